"""Fixtures that every test shares."""

from __future__ import annotations

import os
import tempfile

# links are small matrices: threads of the linear algebra cost more than they bring, most of all on a busy machine
for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")

# reductions made by tests go to a cache of their own, shared by the workers of one session
os.environ.setdefault("ERLS_CACHE", os.path.join(tempfile.gettempdir(), f"erls-test-cache-{os.getuid()}"))
