"""Calls of compiled functions by address: of a system by the loops of integrators, of one system by another.

Addresses are arguments of loops, or lie among the integers of a system. A system that is built upon another one, known
only by its functions, keeps their addresses beside its constants: then it is compiled once for all of them, and what it
calls is not compiled within it again. In plain Python an address is the place of a function in a list, or the function.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from erls.maths.jit import ENABLED, stood_for

_known: list[Callable[..., Any]] = []
_found: dict[tuple[int, int], tuple[Any, Any, int]] = {}  # beside each address what it is of, which so stays


def address_of(function: Any, signature: Any) -> int:
    """Where a kernel of this signature (`erls.equations.compiled_system`) is found, as long as it is referred to."""
    if not ENABLED:
        if function not in _known:
            _known.append(function)
        return _known.index(function)
    at = id(function), id(signature)
    if at not in _found:
        made = function.get_compile_result(signature)
        pointer = int(made.library.get_pointer_to_function(made.fndesc.llvm_func_name))
        _found[at] = function, signature, pointer
    return _found[at][2]


def handed(function: Any, signature: Any) -> Any:
    """What a loop gets that calls this function: its address, or itself where it is not compiled; 0 for None."""
    if function is None:
        return 0
    return address_of(function, signature) if hasattr(function, "py_func") else function


def address_for(call: Any, needed: bool = True) -> int:
    """Of the kernel that a `caller` always calls, which is compiled now; -1 unless it is needed."""
    if not needed:
        return -1
    return address_of(stood_for(call), call.signature)


def _plain(address: Any, *arguments: Any) -> Any:
    return (address if callable(address) else _known[address])(*arguments)


def caller(signature: Any, kernel: str = "") -> Callable[..., Any]:
    """``call(address, *arguments)`` in compiled functions and, with ``ERLS_JIT=0``, in plain Python.

    Where the address is always that of one kernel, `erls.maths.jit.any_scalar` is told which, ``module:name``.
    """
    if not ENABLED:
        return _with(partial(_plain), signature, kernel)
    from numba.core import types
    from numba.core.extending import intrinsic

    every: Any = types

    def generate(context: Any, builder: Any, typed: Any, given: Any) -> Any:
        convention, kind, kinds = context.call_conv, signature.return_type, signature.args
        pointer = convention.get_function_type(kind, kinds).as_pointer()
        arguments = [builder.extract_value(given[1], i) for i in range(len(kinds))]
        status, result = convention.call_function(builder, builder.inttoptr(given[0], pointer), kind, kinds, arguments)
        with builder.if_then(status.is_error, likely=False):
            convention.return_status_propagate(builder, status)
        return result

    def call(typing_context: Any, address: Any, *arguments: Any) -> Any:
        return signature.return_type(every.int64, every.StarArgTuple(signature.args)), generate

    found: Any = intrinsic(call)
    found.in_python = _plain
    return _with(found, signature, kernel)


def _with(call: Any, signature: Any, kernel: str) -> Callable[..., Any]:
    """The caller, which knows what it calls."""
    call.signature, call.stands_for = signature, kernel
    return call  # type: ignore[no-any-return]
