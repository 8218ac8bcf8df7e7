"""States beside one of a chain with loops (`erls.equations.neighbours`): those of its tree, and the conditions."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from erls.equations.formulation import Formulation
from erls.equations.loops.tied import Tied
from erls.equations.neighbours import States
from erls.equations.serial.neighbours import TreeNeighbours, fastest
from erls.maths.so3 import Array
from erls.mechanism.contacts import constant_friction
from fe_import.model import IntArray

if TYPE_CHECKING:
    from erls.equations.loops.compiled import CompiledLoops  # they import the compiler
    from erls.equations.loops.gripped import Rubbed


@dataclass(frozen=True)
class LoopNeighbours:
    """Of a closed state of a chain, with the forces (r,) of the conditions ``kept``.

    Attributes
    ----------
    tree : TreeNeighbours
        Of its tree.
    rubbed : Rubbed, optional
        Joints that may stick, where closing joints do; friction stays as it is.
    held : tuple of int
        Of these, by their numbers, what rests by itself.
    """

    chain: Tied
    tree: TreeNeighbours
    reactions: Array
    kept: IntArray
    rubbed: Rubbed | None = None
    held: tuple[int, ...] = ()

    @cached_property
    def loops(self) -> CompiledLoops:
        """Of the conditions that count, whose violations do not decay."""
        result = self.chain.packed(self.kept, 0.0)
        if self.rubbed is not None:
            for law, force in zip(result.gripped_laws(result.reals), self.rubbed.forces.tolist(), strict=True):
                law[:] = constant_friction(force)
        return result

    @cached_property
    def _fixed(self) -> tuple[list[int], list[tuple[int, int, float]]]:
        """Coordinates that are held; closing joints, components of their twists and where they are held."""
        if self.rubbed is None:
            return [], []
        places, closing = [at for at, _ in self.loops.given.grips], self.loops.sticking
        number = len(places)
        along = [(k, loop.freedom.freedom.row) for k in closing if (loop := self.chain.mechanism.loops[k]).freedom]
        ends = [(*along[k - number], float(self.rubbed.coordinates[k])) for k in self.held if k >= number]
        return [places[k] for k in self.held if k < number], ends

    @property
    def time(self) -> float:
        """See `Neighbours`."""
        return self.tree.time

    @property
    def names(self) -> tuple[str, ...]:
        """Those of the tree."""
        return self.tree.names

    @property
    def metres(self) -> Array:
        """See `Neighbours`."""
        return self.chain.metres

    @property
    def stiffness(self) -> Array:
        """See `Neighbours`."""
        return self.tree.stiffness

    @property
    def size(self) -> float:
        """See `Neighbours`."""
        return self.chain.reach

    @property
    def reach(self) -> float:
        """See `Neighbours`."""
        return self.chain.reach

    @property
    def speed(self) -> Array:
        """See `Neighbours`."""
        return self.tree.v

    @property
    def acceleration(self) -> Array:
        """See `Neighbours`."""
        return self.tree.a

    @property
    def driven(self) -> tuple[float, float]:
        """See `Neighbours`."""
        found = (loop.freedom for loop in self.chain.mechanism.loops if loop.prescribed)
        own = fastest([(free.drive, free.freedom) for free in found if free is not None], self.time, self.reach)
        fast, faster = map(max, own, self.tree.driven)
        return fast, faster

    @property
    def multipliers(self) -> Array:
        """Those of the conditions, and none of joints that stick."""
        return np.concatenate([self.reactions, self.tree.multipliers, np.zeros(len(self.held))])

    def forces(self, x: Array, w: Array, b: Array) -> Array:
        """See `Neighbours`."""
        return self.loops.held(*self.states(x, w, b), np.tile(self.reactions, (len(x), 1)))

    def mass(self) -> Array:
        """See `Neighbours`."""
        return self.loops.masses(self.tree.time, self.tree.y)

    def rows(self) -> Array:
        """See `Neighbours`."""
        found = self.chain.closure(self.tree.time, self.tree.y, self.tree.v)
        free, (places, ends) = self.chain.bare.free, self._fixed
        closing = np.array([found.moves[k][along, free] for k, along, _ in ends]).reshape(-1, len(free))
        tree = np.concatenate([self.tree.rows(), np.eye(len(free))[places]])
        return np.concatenate([found.rows[self.kept][:, free], tree, closing])

    def violation(self) -> Array:
        """See `Neighbours`."""
        found, (places, ends) = self.chain.closure(self.tree.time, self.tree.y, self.tree.v), self._fixed
        opened = [found.efforts[k].coordinate - held for k, _, held in ends]
        tree = np.concatenate([self.tree.violation(), np.zeros(len(places))])
        return np.concatenate([found.violation[self.kept], tree, opened])

    def states(self, x: Array, w: Array, b: Array) -> States:
        """See `Neighbours`."""
        return self.tree.states(x, w, b)

    def later(self, tau: float) -> LoopNeighbours:
        """See `Neighbours`."""
        return replace(self, tree=self.tree.later(tau))

    def at_rest(self, x: Array, multipliers: Array) -> LoopNeighbours:
        """See `Neighbours`."""
        return replace(self, tree=self.tree.at_rest(x, multipliers), reactions=multipliers[: len(self.kept)])

    def of(self, formulation: Formulation) -> LoopNeighbours:
        """See `Neighbours`."""
        chain: Tied = formulation  # type: ignore[assignment]  # closed like this one
        return replace(self, chain=chain, tree=self.tree.of(chain.bare))
