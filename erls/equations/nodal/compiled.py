"""A nodal system as steps of generalized-α take it."""

from __future__ import annotations

from typing import Protocol

from erls.equations.compiled_system import Array, Factoring
from erls.equations.nodal.layout import Flat
from erls.equations.nodal.matrix import factor, solve
from erls.equations.nodal.nodes import Nodes, numbers_of, of_numbers
from erls.equations.nodal.step import compose, residual, settle
from erls.equations.stepped import Stepped


class _System(Protocol):
    """What is asked of a system; see `erls.equations.nodal.assembly.NodalSystem`."""

    flat: Flat
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
    """A system in compiled form, for one run: with working memory of its own."""
    start, flat = system.start, system.flat
    return Stepped(
        system.size,
        system.constraints,
        12 * len(start.poses) + len(start.turned),
        True,
        flat.reals,
        flat.integers,
        flat.scratch.copy(),
        compose,
        residual,
        settle,
        None,
        None,
        Factoring(flat.factors, factor, solve, factor, solve),
        numbers_of,
        lambda numbers: of_numbers(numbers, start),
        samples=system.samples,
    )
