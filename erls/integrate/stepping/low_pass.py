"""The low-pass filter of forces, M Re (1 - i cot φ)(M + τ² exp(iφ) K)⁻¹ (`erls.integrate.global_error`)."""

from __future__ import annotations

import math
from typing import Any

from erls.equations.compiled_system import Array, IntArray
from erls.integrate.stepping.stages import MASS, PART_IM, PART_RE, STIFFNESS, solve
from erls.maths import dense
from erls.maths.jit import helper

# cos φ and sin φ of the filter: at 90° it is sharpest, but M alone may be nearly singular
TURN_RE, TURN_IM = math.cos(math.radians(75.0)), math.sin(math.radians(75.0))


@helper
def factor_filter(matrices: Array, square: Any, out: Any, pivots: IntArray) -> int:
    """Dense factors of M + ``square`` K; 0, or 1 + the coordinate at which elimination broke down."""
    mass, stiffness = matrices[MASS], matrices[STIFFNESS]
    for i in range(len(out)):
        m, k, row = mass[i], stiffness[i], out[i]
        for j in range(len(row)):
            row[j] = m[j] + square * k[j]
    return int(dense.factor(out, pivots))


@helper
def smooth(force: Array, matrices: Array, vectors: Array, way: Any, filtered: int) -> None:
    """Replace a force by M Re (1 - i cot φ) (M + τ² exp(iφ) K)⁻¹ of it."""
    re, im = vectors[PART_RE], vectors[PART_IM]
    for q in range(len(force)):
        re[q], im[q] = force[q], 0.0
        force[q] = 0.0
    solve(filtered, False, re, im, way)
    for q in range(len(force)):
        re[q] += TURN_RE / TURN_IM * im[q]
    dense.add_product(matrices[MASS], re, force)
