"""A chain with loops some of whose joints stick, or whose motors come to their limits (`erls.equations.switches.base`).

Joints that stick are coordinates that do not move in the equations of the chain; of those that rest because others do,
the conditions of the loops see to that. Where closing joints may stick, too, joints are held as points of contacts are
(`erls.equations.loops.gripped`), and no coordinate is.
"""

from __future__ import annotations

import numpy as np

from erls.equations.loops import actuated
from erls.equations.loops.closed_chain import ClosedChain
from erls.equations.loops.gripped import loop_grips
from erls.equations.switches.base import NO_FRICTION, Switches
from erls.equations.switches.gripped import lent
from erls.equations.switches.law import Freely, Settled, settled
from erls.equations.switches.motors import Acting, Asked, acting_in, motors_among, put_friction
from erls.maths.so3 import Array


class SwitchedChain(ClosedChain, Switches):
    """A `ClosedChain` with modes.

    Parameters
    ----------
    chain : ClosedChain
    """

    def __init__(self, chain: ClosedChain) -> None:
        ClosedChain.__init__(self, chain.bare)
        self._chain = chain
        # what the start tells, where nothing is held
        self.start, self.kept, self.stiffest_at_start = chain.start, chain.kept, chain.stiffest_at_start
        tree, loops = acting_in(self.exact), self.exact.acting
        acting = Acting(*(np.concatenate(pair) for pair in zip(tree, loops, strict=True)))
        closing = [loop for loop in self.mechanism.loops if loop.freedom is not None and loop.freedom.active]
        joints = self.mechanism.joints
        drives = [joint.drive for joint in joints] + [loop.freedom.drive for loop in closing if loop.freedom]
        names = [*(joint.name for joint in joints), *(loop.name for loop in closing)]
        motors = motors_among(drives, names, acting)
        Switches.__init__(self, self.dry or NO_FRICTION, motors, self.size)
        self.grips = loop_grips(self, self.loops)
        self._joints = tree.joints[self.bare.free_joints[self.rubbing.places]]
        self._asked = Asked(motors, self.exact, actuated.forces)

    @property
    def unheld(self) -> ClosedChain:
        """See `ClosedChain`."""
        return self._chain

    def put(self, y: Array) -> None:
        """Into constants and memory of the equations."""
        system, rubs = self.loops, len(self.rubbing.places)
        self.motors.put(self.modes[rubs:], system.reals, system.integers)
        put_friction(-self.modes[:rubs] * self.rubbing.sliding, self._joints, system.reals, system.integers)
        held = system.room.held
        held[:] = 0.0
        held[self.fixed] = 1.0

    def knot(self, t: float, y: Array, v: Array) -> tuple[Array, Array]:
        """See `Switches`: accelerations and multipliers of the conditions in use."""
        a = self.acceleration(t, y, v)
        return np.array([y, v, a]), np.concatenate([a, self.loops.room.multipliers])

    def settled(self, t: float, y: Array, v: Array, released: Array) -> Settled:
        """See `Switches`."""
        with lent(self.grips, self.mechanism, self.exact):
            return settled(self, t, y, v, released)

    def freely(self, t: float, y: Array, v: Array) -> Freely:
        """See `Switches`."""
        with lent(self.grips, self.mechanism, self.exact):
            return ClosedChain.freely(self, t, y, v)

    def asked(self, t: Array, y: Array, v: Array) -> Array:
        """See `Switches`."""
        return self._asked(t, y, v)

    def holding(self, t: Array, y: Array, v: Array, a: Array) -> Array:
        """See `Switches`."""
        result, rest = np.zeros((len(t), len(self.rubbing.places))), self.modes[: len(self.rubbing.places)] == 0.0
        for k, at in enumerate(t.tolist()):
            result[k, rest] = self.holding_at(at, y[k], v[k], a[k]).forces
        return result
