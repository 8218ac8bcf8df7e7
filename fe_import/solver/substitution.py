"""Compiled forward and backward substitution through fronts, see `fe_import.solver.fronts`.

Right-hand sides x (n, k) lie in the order of elimination; rows that a piece touches beyond itself lie behind them, each
piece's own (`fe_import.solver.layout.Layout.spread`), so that pieces do not meet.
"""

from __future__ import annotations

from fe_import.compiled.jit import helper, kernel
from fe_import.model import Array, IntArray
from fe_import.solver.blocks import multiply, multiply_transposed
from fe_import.solver.fronts import BLOCK
from fe_import.solver.layout import FIRST, PANEL, ROWS

_TYPES = "void(int64, int64, int64[:, ::1], int64[::1], float64[::1], float64[:, ::1], float64[:, ::1])"


@helper
def copy(x: Array, low: int, high: int, memory: Array) -> None:
    """Rows ``low`` to ``high``."""
    for i in range(low, high):
        for j in range(x.shape[1]):
            memory[i - low, j] = x[i, j]


@kernel(_TYPES)
def forward(front: int, stop: int, table: IntArray, rows: IntArray, panels: Array, x: Array, memory: Array) -> None:
    """L⁻¹ x through fronts of a piece; ``memory`` holds as many rows as a front has at most."""
    for k in range(front, stop):
        first, begin = table[k, FIRST], table[k, ROWS]
        own, across = table[k + 1, FIRST] - first, table[k + 1, ROWS] - begin
        columns = panels[table[k, PANEL] : table[k, PANEL] + own * (own + across)].reshape(own, own + across)
        mine = x[first : first + own]
        for low in range(0, own, BLOCK):
            high = min(low + BLOCK, own)
            copy(mine, low, high, memory)
            multiply(1.0, memory[: high - low, :], columns[low:high, low:high], 0.0, mine[low:high, :])
            if high < own:
                multiply(-1.0, mine[low:high, :], columns[low:high, high:own], 1.0, mine[high:, :])
        if across:
            multiply(1.0, mine[:, :], columns[:, own:], 0.0, memory[:across, :])
            for i in range(across):
                taking = x[rows[begin + i]]
                for j in range(x.shape[1]):
                    taking[j] -= memory[i, j]


@kernel(_TYPES)
def backward(front: int, stop: int, table: IntArray, rows: IntArray, panels: Array, x: Array, memory: Array) -> None:
    """L⁻ᵀ x through fronts of a piece, the last one first."""
    for k in range(stop - 1, front - 1, -1):
        first, begin = table[k, FIRST], table[k, ROWS]
        own, across = table[k + 1, FIRST] - first, table[k + 1, ROWS] - begin
        columns = panels[table[k, PANEL] : table[k, PANEL] + own * (own + across)].reshape(own, own + across)
        mine = x[first : first + own]
        if across:
            for i in range(across):
                given = x[rows[begin + i]]
                for j in range(x.shape[1]):
                    memory[i, j] = given[j]
            multiply_transposed(-1.0, memory[:across, :], columns[:, own:], 1.0, mine[:, :])
        for low in range((own - 1) // BLOCK * BLOCK, -1, -BLOCK):
            high = min(low + BLOCK, own)
            if high < own:
                multiply_transposed(-1.0, mine[high:, :], columns[low:high, high:own], 1.0, mine[low:high, :])
            copy(mine, low, high, memory)
            multiply_transposed(1.0, memory[: high - low, :], columns[low:high, low:high], 0.0, mine[low:high, :])
