"""Functions compiled by Numba and kept on disk; with ``ERLS_JIT=0`` they run as plain Python.

The code lies in the folder ``ERLS_KERNELS``, or ``ERLS_CACHE`` like reductions, or the user's cache folder. Functions
release Python's lock: threads run them side by side.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

from fe_import.files.log import log

F = TypeVar("F", bound=Callable[..., Any])

ENABLED = os.environ.get("ERLS_JIT", "1") != "0"


def kernel(signature: str) -> Callable[[F], F]:
    """A function of fixed types, in Numba's words, compiled when its module is imported."""
    return lambda function: _njit(function, signature) if ENABLED else function


def helper(function: F) -> F:
    """A function that kernels call; compiled for what they give it."""
    return _njit(function) if ENABLED else function


def kernels_folder(name: str, version: str) -> Path:
    """Where compiled code of this name and version of its source is kept."""
    import platformdirs

    given = os.environ.get("ERLS_KERNELS") or os.environ.get("ERLS_CACHE")
    base = Path(given) if given else Path(platformdirs.user_cache_dir("erls", appauthor=False))
    return base / f"kernels-{name}-{version}"


@cache
def folder(package: str) -> Path:
    """For the compiled code of this very source: Numba does not notice changes in what a function calls."""
    import numba
    import numpy as np

    from fe_import.compiled.kernel_cache import FORMAT

    digest = hashlib.sha256(f"{numba.__version__} {np.__version__} {FORMAT}".encode())
    for each in (package, __package__ or ""):
        found = importlib.util.find_spec(each)
        for place in (found.submodule_search_locations or []) if found else []:
            for file in sorted(Path(place).glob("*.py")):
                digest.update(file.read_bytes())
    return kernels_folder(package.replace(".", "-").replace("_", "-"), digest.hexdigest()[:16])


def compiled_before(package: str) -> bool:
    """Whether code for this source lies on disk; otherwise the first use compiles for some seconds."""
    return not ENABLED or os.path.isdir(folder(package))


def _njit(function: Any, *signature: str) -> Any:
    import numba

    from fe_import.compiled.kernel_cache import KernelCache

    made = numba.njit(error_model="numpy", nogil=True)(function)
    made._cache = KernelCache(function, folder(function.__module__.rpartition(".")[0]), _tell)
    for fixed in signature:
        made.compile(fixed)
        made.disable_compile()
    return made


@cache
def _tell(kind: str, text: str) -> None:
    """Say what is wrong with the folder, once for each kind of fault."""
    log(f"warning: {text}")
