"""Versions of packages, as files name them."""

from __future__ import annotations

import importlib.metadata
from functools import cache


@cache
def package_version(package: str) -> str:
    """Of an installed package, or "unknown"."""
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "unknown"
