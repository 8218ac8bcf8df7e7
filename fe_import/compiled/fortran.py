"""Routines of BLAS and LAPACK in compiled functions: those that SciPy brings, found by their address.

They release Python's lock, which SciPy's own wrappers keep. Code that was kept on disk finds them by name, so that a
routine must be known (`routine`) before code that calls it is loaded.
"""

from __future__ import annotations

from typing import Any

from fe_import.compiled.jit import ENABLED


def letter(text: str) -> Any:
    """A character as an argument."""
    import numpy as np

    return np.uint8(ord(text))


def routine(module: str, name: str) -> Any:
    """``call(*arguments)`` of a subroutine ``name`` in ``scipy.linalg.<module>``, within compiled functions.

    As in Fortran all is passed by reference: `letter`, integers (as 32-bit copies), floats, and arrays from their first
    entry on; an array of one 32-bit integer takes what the routine says in the end.
    """
    if not ENABLED:
        return None
    import llvmlite.binding as llvm
    from llvmlite import ir
    from numba.core import cgutils, types
    from numba.core.extending import intrinsic
    from numba.extending import get_cython_function_address

    symbol = f"fe_import_{module}_{name}"
    llvm.add_symbol(symbol, get_cython_function_address(f"scipy.linalg.{module}", name))
    every: Any = types

    def generate(context: Any, builder: Any, typed: Any, given: Any) -> Any:
        byte = ir.IntType(8).as_pointer()
        passed = []
        for kind, value in zip(typed.args[0].types, cgutils.unpack_tuple(builder, given[0]), strict=True):
            if isinstance(kind, every.Array):
                place = context.make_array(kind)(context, builder, value).data
            else:
                if isinstance(kind, every.Integer) and kind.bitwidth > 32:
                    value = builder.trunc(value, ir.IntType(32))
                place = cgutils.alloca_once_value(builder, value)
            passed.append(builder.bitcast(place, byte))
        form = ir.FunctionType(ir.VoidType(), [byte] * len(passed))
        builder.call(cgutils.get_or_insert_function(builder.module, form, symbol), passed)
        return context.get_dummy_value()

    def call(typing_context: Any, *arguments: Any) -> Any:
        return every.none(every.StarArgTuple(arguments)), generate

    return intrinsic(call)
