"""Exact tangents of nodal equations: all blocks of `erls.equations.nodal.blocks`, and what iterations leave out.

Compiled for whoever asks for derivatives; runs do without. Contacts and springs between bodies have the blocks of
iterations, which leave out how their rows turn, and what a change of place does to dampers.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from erls.equations.compiled_system import Array, IntArray
from erls.equations.nodal.contract import (
    BEAMS_APART,
    TANGENTS,
    call_actuator_tangents,
    call_beam_tangents,
    call_blocks,
    read_layout,
)
from erls.maths.calls import address_for
from erls.maths.jit import ENABLED, kernel


class Exact(NamedTuple):
    """Addresses of what adds to the blocks of iterations, -1 for what a system does not have."""

    beams: int
    actuators: int


EXACT: Any = None
EXACT_BLOCKS: Any = None
if ENABLED:
    from numba import types as _t

    EXACT = _t.NamedUniTuple(_t.int64, 2, Exact)
    EXACT_BLOCKS = _t.void(EXACT, *TANGENTS.args)


@kernel(EXACT_BLOCKS, counted=False)
def exact_blocks(
    exact: Exact, reals: Array, integers: IntArray, scratch: Array, poses: Array, motion: Array
) -> None:
    """As `erls.equations.nodal.blocks.blocks`; ``poses`` (k, 12) and ``motion`` (3, n) are complex memory."""
    known = read_layout(reals, integers, integers[len(integers) - 1])
    call_blocks(known.blocks, reals, integers, scratch, BEAMS_APART)
    if exact.beams >= 0:
        call_beam_tangents(exact.beams, reals, integers, scratch, poses, motion)
    if exact.actuators >= 0:
        call_actuator_tangents(exact.actuators, reals, integers, scratch, poses, motion)


def addresses(beams: int, actuators: int) -> Exact:
    """Of a system with so many beams and actuators; compiled now."""
    return Exact(address_for(call_beam_tangents, beams > 0), address_for(call_actuator_tangents, actuators > 0))


def room(nodes: int) -> tuple[Array, Array]:
    """Memory of complex numbers."""
    return np.zeros((nodes, 12), dtype=complex), np.zeros((3, 6 * nodes), dtype=complex)
