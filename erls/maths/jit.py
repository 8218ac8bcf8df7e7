"""Compilation by Numba, kept on disk; with ``ERLS_JIT=0`` the same functions run as plain Python.

The code lies in the folder ``ERLS_KERNELS``, or ``ERLS_CACHE`` like reductions, or the user's cache folder.
"""

from __future__ import annotations

import dis
import gc
import hashlib
import operator
import os
import re
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache, partial
from importlib import import_module
from pathlib import Path
from types import FunctionType
from typing import Any, TypeVar, cast

import numpy as np

F = TypeVar("F", bound=Callable[..., Any])

_PART = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True, "_nrt": False}
_EQUATIONS = "the equations of motion"
_SUBJECTS = {"auto": "the certificate of what auto leaves out", "integrate": "the integrators"}
_ROOT = Path(__file__).parents[1]
_IMPORT = re.compile(r"^\s*from (erls[\w.]*) import (\([^)]*\)|[^\n]*)", re.M)
_listeners: list[Callable[[str], None]] = []
_told: set[str] = set()  # subjects, and kinds of faults of what is kept
_fixed: set[Any] = set()  # kernels, whose signatures are fixed
_guiding: set[Any] = set()  # helpers that call functions of a system
ENABLED = os.environ.get("ERLS_JIT", "1") != "0"


@cache
def folder(module: str) -> Path:
    """Folder for the compiled code of this very source: Numba does not notice changes in what a function calls."""
    import numba

    from fe_import.compiled.jit import kernels_folder
    from fe_import.compiled.kernel_cache import FORMAT

    digest = hashlib.sha256(f"{numba.__version__} {np.__version__} {FORMAT}".encode())
    for name in _reads(module):
        digest.update(_source(name)[0])
    return kernels_folder(_subject(module), digest.hexdigest()[:16])


def _file(module: str) -> Path:
    if not module.startswith("erls."):  # kernels of somebody else
        return Path(str(sys.modules[module].__file__))
    return _ROOT.joinpath(*module.split(".")[1:]).with_suffix(".py")


@cache
def _source(module: str) -> tuple[bytes, frozenset[str]]:
    """Text of a module, and the modules that it imports."""
    text = _file(module).read_bytes()
    found: set[str] = set()
    for base, names in _IMPORT.findall(text.decode("utf-8")):
        ends = {base, *(f"{base}.{each}" for each in re.findall(r"\w+", names))}
        found |= {end for end in ends if _is_module(end)}
    return text, frozenset(found)


@cache
def _is_module(name: str) -> bool:
    return _file(name).is_file()


def _reads(module: str) -> list[str]:
    """A module of kernels and all that it imports, directly or not."""
    found, waiting = set[str](), {module}
    while waiting:
        name = waiting.pop()
        found.add(name)
        waiting |= _source(name)[1] - found
    return sorted(found)


def _subject(module: str) -> str:
    """What a module of kernels belongs to: a formulation, or the integrators."""
    return "-".join(module.split(".")[1:]).replace("_", "-")


@contextmanager
def announcing(tell: Callable[[str], None]) -> Iterator[None]:
    """Have ``tell`` called when something is compiled for the first time, which takes some seconds."""
    _listeners.append(tell)
    try:
        yield
    finally:
        _listeners.remove(tell)


def compiled_before(module: str) -> bool:
    """Whether code for this source lies on disk; otherwise the first use compiles for some seconds."""
    return not ENABLED or os.path.isdir(folder(module))


def tell_of(module: str) -> None:
    """Say that kernels of a module are about to be compiled, once for each subject."""
    subject = next((words for part, words in _SUBJECTS.items() if f".{part}." in f"{module}."), _EQUATIONS)
    _tell_once(subject, f"compiling {subject} (once on this machine)")


def _tell_once(subject: str, text: str) -> None:
    if subject in _told or not _listeners:
        return
    _told.add(subject)
    for tell in _listeners:
        tell(text)


def _on_disk(function: Any) -> bool:
    name = f"{function.__module__.rpartition('.')[2]}.{function.__qualname__}-{function.__code__.co_firstlineno}"
    return compiled_before(function.__module__) and any(folder(function.__module__).glob(f"*/{name}.*"))


def helper(function: F) -> F:
    """A function that kernels call; compiled within them."""
    return _njit(function) if ENABLED else function


def guide(function: F) -> F:
    """A helper that calls functions of a system, by address: where these are Python, so is it (`plain`)."""
    made = helper(function)
    if ENABLED:
        _guiding.add(made)
    return made


def part(function: F) -> F:
    """A helper of kernels that are not ``counted``: no way in from Python, and optimized within its callers alone."""
    return _njit(function, **_PART) if ENABLED else function


def reordered(function: F) -> F:
    """A `part` whose sums may be taken in any order, so that processors take several terms at once."""
    return _njit(function, **_PART, fastmath={"reassoc", "contract"}) if ENABLED else function


def plain(function: Callable[..., Any], within: bool = True, called: Mapping[Any, Any] | None = None) -> Any:
    """The same source as plain Python, with all that it calls by name; unless ``within``, with `guide` functions alone.

    Arrays may stand for its numbers where it does not choose by them, nor keeps what it makes in tables.

    Parameters
    ----------
    function : callable
    within : bool, optional
    called : mapping, optional
        What it calls by address, by what calls it, as for `any_scalar`. An address of which neither this nor the caller
        tells may be a function of Python (`erls.maths.calls.handed`).
    """
    return _in_python(function, within, tuple((called or {}).items()))


@cache
def _in_python(function: Any, within: bool, called: tuple[tuple[Any, Any], ...]) -> Any:
    source: Any = getattr(function, "py_func", function)
    own: dict[str, Any] = {}
    for name in _named(source):
        found = source.__globals__.get(name)
        target = next((target for caller, target in called if caller is found), stood_for(found))
        if target is not None:
            own[name] = partial(_without_address, _in_python(target, within, called))
        elif hasattr(found, "in_python"):
            own[name] = found.in_python
        elif hasattr(found, "py_func") and (within or found in _guiding):
            own[name] = _in_python(found, within, called)
    names = {**source.__globals__, **own}
    return FunctionType(source.__code__, names, source.__name__, source.__defaults__, source.__closure__)


def _without_address(function: Any, address: Any, *arguments: Any) -> Any:
    return function(*arguments)


def stood_for(caller: Any) -> Any:
    """The kernel that is always called by this (`erls.maths.calls.caller`), or None."""
    module, _, name = str(getattr(caller, "stands_for", "")).partition(":")
    return getattr(import_module(module), name) if module else None


def any_scalar(function: F, called: Mapping[Any, Any] | None = None) -> F:
    """A kernel for other numbers than those of its signature: compiled on demand for what it is given, complex ones.

    Parameters
    ----------
    function : callable
    called : mapping, optional
        What it calls by address, by what calls it (`erls.maths.calls.caller`): an address leads to real numbers only.
    """
    return cast(F, _any_scalar(function, tuple((called or {}).items()), within=False) if ENABLED else function)


def _any_scalar(function: Any, called: tuple[tuple[Any, Any], ...], within: bool) -> Any:
    reached = _callers(function, called)  # one twin for all systems whose difference it does not reach
    return _twin(function, tuple((caller, target) for caller, target in called if caller in reached), within)


@cache
def _callers(function: Any, called: tuple[tuple[Any, Any], ...]) -> frozenset[Any]:
    """What calls by address within a function, and within what that calls."""
    source: Any = getattr(function, "py_func", function)
    found: set[Any] = set()
    for used in map(source.__globals__.get, _named(source)):
        if hasattr(used, "stands_for"):
            found.add(used)
            for target in (target for caller, target in called if caller is used):
                found |= _callers(target, called)
        elif hasattr(used, "py_func"):
            found |= _callers(used, called)
    return frozenset(found)


@cache
def _twin(function: Any, called: tuple[tuple[Any, Any], ...], within: bool) -> Any:
    source: Any = getattr(function, "py_func", function)
    own: dict[str, Any] = {}
    for name in _named(source):
        found = source.__globals__.get(name)
        if hasattr(found, "py_func") and _needs_real_numbers(found):
            own[name] = _any_scalar(found, called, within=True)
        elif (known := stood_for(found)) is not None:
            own[name] = _past_address(_any_scalar(known, called, within=True))
        for caller, target in called:
            if found is caller:
                own[name] = _past_address(_any_scalar(target, called, within=True))
    twin = FunctionType(source.__code__, {**source.__globals__, **own}, source.__name__, source.__defaults__)
    if within:  # a name of its own on disk: Python cannot call it
        twin.__qualname__ += "_within"
    return _njit(twin, **(_PART if within else {"_nrt": False}), cache=not called)  # no name tells what was called


@cache
def _needs_real_numbers(function: Any) -> bool:
    """Whether it is a kernel, or a part that calls kernels, by name or by address, itself or within others."""
    if function in _fixed:
        return True
    every = (function.py_func.__globals__.get(name) for name in _named(function.py_func))
    return any(
        hasattr(found, "stands_for") or (hasattr(found, "py_func") and _needs_real_numbers(found)) for found in every
    )


def _past_address(function: Any) -> Any:
    """The function with an address before its arguments, which says nothing."""

    def call(address, *arguments):  # type: ignore[no-untyped-def]
        return function(*arguments)

    return _njit(call, **_PART, cache=False)


@cache
def _named(source: Any) -> tuple[str, ...]:
    """Names of the module that a function uses; those of attributes are others."""
    return tuple(dict.fromkeys(i.argval for i in dis.get_instructions(source) if i.opname == "LOAD_GLOBAL"))


def kernel(signature: Any, counted: bool = True) -> Callable[[F], F]:
    """A function with a fixed signature (of `erls.equations.compiled_system`), compiled when its module is imported.

    Unless ``counted``, it keeps no count of who refers to its arrays: atomic operations, which many arrays make dear.
    """

    def compiled(function: F) -> F:
        if not ENABLED:
            return function
        made: F = _njit(function, signature, _nrt=counted, no_cfunc_wrapper=True)
        _fixed.add(made)
        return made

    return compiled


def _njit(function: Any, *signature: Any, cache: bool = True, **options: Any) -> Any:
    import numba
    from numba.core.typeinfer import register_dispatcher

    from erls.maths.compilers import CompilerOfKernels, CompilerOfParts
    from fe_import.compiled.kernel_cache import KernelCache

    _prepare_numba()
    if signature and not _on_disk(function):
        tell_of(function.__module__)
    settings = {"error_model": "numpy", "nogil": True, **options}
    compiler = CompilerOfParts if "no_cpython_wrapper" in options else CompilerOfKernels
    with _no_collection():
        made = numba.njit(**settings, pipeline_class=compiler)(function)
        if cache:
            made._cache = KernelCache(function, folder(function.__module__), _tell_once)
        for fixed in signature:  # as Numba does, which has no place for a cache of another kind
            with register_dispatcher(made):
                made.compile(fixed)
            made.disable_compile()
    return made


@contextmanager
def _no_collection() -> Iterator[None]:
    """No search for garbage among the many objects that a compiler makes and keeps: a twelfth of its time."""
    on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if on:
            gc.enable()


@cache
def _prepare_numba() -> None:
    """Have Numba type ``a[i]`` as that of an array before the twenty other things that it knows to be indexed.

    It tries what is registered for its target before what is registered for any; a quarter of compilation went there.
    """
    from numba.core.typing.arraydecl import GetItemBuffer, SetItemBuffer
    from numba.core.typing.templates import infer_global

    from erls.maths import array_code

    for operation, rule in ((operator.getitem, GetItemBuffer), (operator.setitem, SetItemBuffer)):
        infer_global(operation)(type(rule.__name__, (rule,), {"metadata": {"target": "cpu"}}))
    array_code.register()
