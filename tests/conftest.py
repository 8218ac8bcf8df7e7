"""Fixtures that every test shares."""

from __future__ import annotations

import os
import tempfile

# reductions made by tests go to a cache of their own, shared by the workers of one session
os.environ.setdefault("ERLS_CACHE", os.path.join(tempfile.gettempdir(), f"erls-test-cache-{os.getuid()}"))
