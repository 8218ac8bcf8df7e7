"""A nodal system as steps of generalized-α take it: its constants and working memory in flat arrays."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from erls.equations.compiled_system import Array, Factoring
from erls.equations.nodal import contract as own
from erls.equations.nodal.blocks import blocks, weighted
from erls.equations.nodal.contract import Before, Model, Stepping
from erls.equations.nodal.matrix import factor, solve
from erls.equations.nodal.model import factor_room, room
from erls.equations.nodal.nodes import Nodes, numbers_of, of_numbers, rows_of
from erls.equations.nodal.outputs import knot
from erls.equations.nodal.step import compose, residual, settle
from erls.equations.nodal.sums import forces, remember
from erls.equations.stepped import Stepped
from erls.equations.system import MovingSystem, metre_scales
from erls.maths.calls import address_of
from erls.maths.records import Memory


class _System(MovingSystem, Protocol):
    """What is asked of a system; see `erls.equations.nodal.assembly.NodalSystem`."""

    width: int
    model: Model
    start: Nodes

    @property
    def size(self) -> int:
        """Number of velocities."""

    @property
    def constraints(self) -> int:
        """Number of conditions."""

    def samples(self, times: Array) -> Array:
        """What depends on time alone."""


def stepped(system: _System) -> Stepped:
    """A system in compiled form, for one run."""
    model, start = system.model, system.start
    integers: list[int] = []
    samples = system.samples(np.zeros(1)).shape[1]
    constants, scratch = Memory(integers), Memory(integers, np.zeros(samples))
    factors = Memory(integers)
    state = own.State(rows_of(start.poses), start.bent, start.turned, start.wound)
    whole = Stepping(
        model=constants.put(model),
        work=scratch.put(room(model)),
        before=scratch.put(Before(numbers_of(start), np.zeros(1))),
        state=Memory(integers).put(state),
        factors=factors.put(factor_room(model, system.width)),
        forces=address_of(forces, own.FORCES),
        remember=address_of(remember, own.REMEMBER),
        knot=address_of(knot, own.KNOT),
        blocks=address_of(blocks, own.BLOCKS),
        weighted=address_of(weighted, own.SUMMED),
        samples=samples,
        reach=float(metre_scales(system).max(initial=1.0)),
    )
    integers.append(constants.put(whole))
    return Stepped(
        system.size,
        system.constraints,
        12 * len(start.poses) + len(start.turned),
        True,
        constants.numbers,
        np.array(integers, dtype=np.int64),
        scratch.numbers,
        compose,
        residual,
        settle,
        None,
        None,
        Factoring(len(factors.numbers), factor, solve, factor, solve),
        numbers_of,
        lambda numbers: of_numbers(numbers, start),
        samples=system.samples,
    )
