"""A chain and the conditions of its loops, with nothing said yet of where it starts."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from erls.equations.formulation import Modular, TreeFormulation
from erls.equations.loops.rows import Closure, LoopRows
from erls.equations.system import metre_scales
from erls.maths.beside import compiling_beside
from erls.maths.contact_places import COEFFICIENT
from erls.maths.so3 import Array
from erls.mechanism.loop_turns import turning_signs
from fe_import.model import IntArray

if TYPE_CHECKING:
    from erls.equations.loops.compiled import CompiledLoops

KERNELS = tuple(f"erls.equations.loops.{name}" for name in ("closure", "system", "nearest", "actuated", "steps"))
OPEN = 1e-4  # of the size of the mechanism: a loop that has come apart


class Tied:
    """Conditions of the loops of a chain at its states.

    Parameters
    ----------
    bare : TreeFormulation
        Of the chain; its mechanism holds the loops.

    Attributes
    ----------
    rows : LoopRows
    metres, row_metres : (n,), (m,) arrays
        Per unit of each coordinate and of each condition.
    reach : float
        Size of the mechanism [m].
    """

    def __init__(self, bare: TreeFormulation) -> None:
        self.bare, self.mechanism = bare, bare.mechanism
        self.rows = LoopRows(bare.mechanism.loops)
        seen = bare.kernels[2:] if isinstance(bare, Modular) else ()
        with compiling_beside(*KERNELS, *seen):  # meanwhile, what the equations of the chain take
            self.metres = metre_scales(bare)
            _ = bare.compiled and bare.compiled.frames
        self.reach = self.mechanism.reach
        self.row_metres = np.where(self.rows.turns, self.reach, 1.0)
        self._known: tuple[float, Array, Array, Closure] | None = None

    @property
    def size(self) -> int:
        """Number of coordinates of the chain."""
        return self.bare.size

    def packed(self, kept: IntArray, decay: float) -> CompiledLoops:
        """The compiled form with these rows in use, violations of which decay at a rate [1/s]."""
        from erls.equations.loops.compiled import Given, Turns, compile_loops  # here: they import the compiler

        joints, free = self.mechanism.joints, self.bare.free_joints.tolist()
        signs = np.array([turning_signs(self.mechanism, loop)[0] for loop in self.rows.loops])
        turns = Turns(
            signs,
            signs @ np.array([joint.position for joint in joints]),
            np.array([free.index(k) if k in free else -1 for k in range(len(joints))]),
            [None if k in free else joint.drive.motion for k, joint in enumerate(joints)],
        )
        numbers = self.reach, decay, OPEN * self.reach
        names = tuple(joint.name for joint in joints)
        given = Given(self.bare, self.rows, kept, self.metres, self.row_metres, *numbers, turns, names)
        held = [(at, joints[k]) for at, k in enumerate(free) if self.mechanism.gripped and joints[k].forces.sticks]
        grips = tuple((at, joint.forces.grip(joint.freedom, self.reach)) for at, joint in held)
        return compile_loops(replace(given, grips=grips))

    @cached_property
    def whole(self) -> CompiledLoops:
        """With all rows, to look at; who solves needs those that are independent. Without friction that sticks, which
        is not known of a state by itself.
        """
        result = self.packed(np.arange(len(self.rows.names)), 0.0)
        for law in result.gripped_laws(result.reals):
            law[COEFFICIENT] = 0.0
        return result

    def closure(self, t: float, y: Array, v: Array) -> Closure:
        """Conditions of the loops at a state; the last one is remembered, since integrators ask in several ways."""
        known = self._known
        if known is None or known[0] != t or not (np.array_equal(known[1], y) and np.array_equal(known[2], v)):
            known = self._known = (t, y.copy(), v.copy(), self.whole.closure(t, y, v))
        return known[3]

    def scaled_rows(self, found: Closure, rows: IntArray) -> Array:
        """(r, n) some rows over the independent coordinates, in metres per metre."""
        return np.asarray(self.row_metres[rows, None] * found.rows[rows][:, self.bare.free] / self.metres)

    def openings(self, found: Closure) -> Array:
        """(m,) how far each condition is from holding [m]."""
        return np.asarray(self.row_metres * found.violation)
