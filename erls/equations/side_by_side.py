"""Forces at many states by eightfold numbers (`erls.maths.lanes`): eight states for about what two take.

Compiling that takes some ten seconds, once on a machine; for few states `erls.equations.series` is the way.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

import numpy as np

from erls.equations.compiled_system import CompiledSystem
from erls.equations.series import residual_series
from erls.maths.jit import ENABLED
from erls.maths.so3 import Array

WORTH = 20_000
"""Evaluations for which eightfold numbers are worth their compilation."""

_KERNELS = {
    "erls.equations.erls.residual": "erls.equations.erls.lanes",
    "erls.equations.erls.stiffened_residual": "erls.equations.erls.stiffened_lanes",
    "erls.equations.ffr.residual": "erls.equations.ffr.lanes",
}
"""Modules of kernels by those of the forces they are made of; other systems call forces by address, which leads to
single numbers."""


def eightfold_kernels(system: CompiledSystem, evaluations: int) -> Any:
    """What `eightfold_forces` takes: the module of kernels of a system.

    None where it has none, or where they are not worth it for so many evaluations of its forces.
    """
    name = _KERNELS.get(str(getattr(system.residual, "__module__", "")))
    return import_module(name) if ENABLED and name and evaluations >= WORTH else None


def eightfold_forces(kernels: Any, system: CompiledSystem, t: Array, y: Array, v: Array, a: Array) -> Array:
    """(k, n) forces out of balance at states, as `erls.equations.series.residual_series`."""
    return _in_eights(kernels.forces, residual_series, system, (system.size,), t, y, v, a)


def _in_eights(
    together: Any, one_by_one: Callable[..., Array], system: CompiledSystem, shape: tuple[int, ...], *states: Array
) -> Array:
    """(k, ...) what a kernel gives of k states; ``one_by_one`` of those that go different ways."""
    from erls.maths.lanes import WIDTH, Apart, eightfold

    number = len(states[0])
    count = -(-number // WIDTH)
    rows = np.minimum(np.arange(count * WIDTH), number - 1)  # the last one fills the last eight

    def beside(x: Array) -> Array:
        found: Array = eightfold(count, *x.shape[1:])
        found[...] = np.moveaxis(x[rows].reshape(count, WIDTH, *x.shape[1:]), 1, -1)
        return found

    out, done = eightfold(count, *shape), np.zeros(1, dtype=np.int64)
    given = [beside(x) for x in states]
    apart: list[int] = []
    while done[0] < count:
        try:
            together(system.reals, system.integers, _scratch(system, WIDTH), *given, out, done)
        except Apart:
            apart.append(int(done[0]))
            done += 1
    result = np.moveaxis(out, -1, 1).reshape(count * WIDTH, *shape)[:number]
    if apart:
        some = np.flatnonzero(np.isin(np.arange(number) // WIDTH, apart))
        result[some] = one_by_one(system, *(x[some] for x in states))
    return np.asarray(result)


def _scratch(system: CompiledSystem, states: int) -> Array:
    """Working memory as the system has it, of eight states or of one with its derivatives."""
    from erls.maths.lanes import eightfold

    found: Array = eightfold(len(system.scratch))
    found[:, :states] = system.scratch[:, None]
    return found
