"""Programs of sums of products (`erls.maths.linearized`) on eight states side by side.

Compiled once for all equations: what equations say is in the program.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import types
from numpy.typing import NDArray

from erls.maths.jit import kernel, part
from erls.maths.lanes import WIDTH, as_lanes, eightfold
from erls.maths.linearized import MINUS, ONE, Plan, Program
from erls.maths.so3 import Array
from fe_import.model import IntArray

_MATRIX, _STACK = types.float64[:, ::1], types.float64[:, :, ::1]
_PLAN, _PLACES, _FLAGS = types.uint32[:, ::1], types.int64[::1], types.int64[:, ::1]


@part
def _function(which: int, x: float) -> float:
    """One of `erls.maths.tracing.FUNCTIONS`, in their order."""
    if which == 0:
        return 1.0 / x
    if which == 1:
        return math.sqrt(x)
    if which == 2:
        return math.sin(x)
    if which == 3:
        return math.cos(x)
    if which == 4:
        return math.tan(x)
    if which == 5:
        return math.exp(x)
    if which == 6:
        return math.log(x)
    if which == 7:
        return math.tanh(x)
    if which == 8:
        return math.sinh(x)
    if which == 9:
        return math.cosh(x)
    if which == 10:
        return math.atan(x)
    if which == 11:
        return 1.0 if x > 0.0 else -1.0 if x < 0.0 else 0.0
    if which == 12:
        return abs(x)
    return math.floor(x)


@part
def _holds(which: int, x: float, y: float) -> bool:
    """One of `erls.maths.tracing.COMPARISONS`, in their order."""
    if which == 0:
        return x < y
    if which == 1:
        return x <= y
    if which == 2:
        return x > y
    if which == 3:
        return x >= y
    if which == 4:
        return x == y
    return x != y


@part
def _advance(
    memory: Array, numbers: Any, sums: Plan, functions: Plan, first: int, last: int, begun: int, ended: int
) -> None:
    """Some of the sums, and of the functions between them."""
    k = first
    for f in range(begun, ended + 1):
        due = last if f == ended else min(last, functions[f, 0])
        while k < due:
            numbers[sums[k, 0]] = numbers[sums[k, 1]] + numbers[sums[k, 2]] * numbers[sums[k, 3]]
            k += 1
        if f < ended:
            for lane in range(memory.shape[1]):
                memory[functions[f, 2], lane] = _function(functions[f, 1], memory[functions[f, 3], lane])


@kernel(types.void(_MATRIX, _PLAN, _PLAN, _PLAN, _PLACES, _PLACES, _PLACES, _STACK, _STACK, _FLAGS), counted=False)
def _run(
    memory: Array, sums: Plan, functions: Plan, guards: Plan, guarded: IntArray, inputs: IntArray,
    outputs: IntArray, given: Array, out: Array, apart: IntArray,
) -> None:  # fmt: skip
    """Results ``out`` (j, o, 8) of inputs ``given`` (j, i, 8); ``apart`` (j, 8) says where guards do not hold."""
    numbers, values, results = as_lanes(memory), as_lanes(given), as_lanes(out)
    for group in range(len(values)):
        for i in range(len(inputs)):
            numbers[inputs[i]] = values[group, i]
        _advance(memory, numbers, sums, functions, 0, guarded[0], 0, guarded[1])
        for k in range(len(guards)):
            for lane in range(memory.shape[1]):
                held = _holds(guards[k, 0], memory[guards[k, 1], lane], memory[guards[k, 2], lane])
                if held != (guards[k, 3] != 0):
                    apart[group, lane] = 1
        if apart[group].sum() == memory.shape[1]:
            continue
        _advance(memory, numbers, sums, functions, guarded[0], len(sums), guarded[1], len(functions))
        for o in range(len(outputs)):
            results[group, o] = numbers[outputs[o]]


def run(program: Program, constants: Array, places: IntArray, given: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Results of a program at many states.

    Parameters
    ----------
    program : Program
    constants : (l,) array
        Values of its leaves, of those that are no inputs.
    places : (i,) array
        Which of its leaves are inputs.
    given : (k, i) array
        Values of inputs at k states.

    Returns
    -------
    array
        (k, o) results.
    array
        (k,) of bool: where guards hold; results elsewhere are none.
    """
    number = len(given)
    count = -(-number // WIDTH)
    rows = np.minimum(np.arange(count * WIDTH), number - 1)
    values: Array = eightfold(count, given.shape[1])
    values[...] = given[rows].reshape(count, WIDTH, -1).swapaxes(1, 2)
    memory: Array = eightfold(program.size)
    memory[ONE], memory[MINUS] = 1.0, -1.0
    memory[3 : 3 + len(constants)] = constants[:, None]
    out: Array = eightfold(count, len(program.outputs))
    apart = np.zeros((count, WIDTH), dtype=np.int64)
    _run(
        memory, program.sums, program.functions, program.guards, program.guarded, 3 + places, program.outputs, values,
        out, apart,
    )  # fmt: skip
    held = apart.ravel()[:number] == 0
    return out.swapaxes(1, 2).reshape(count * WIDTH, -1)[:number], held
