"""States beside a steady motion of nodes that go along with a joint on the ground (`erls.equations.neighbours`)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from erls.equations.nodal.chain import Chain
from erls.equations.nodal.joints import GROUND
from erls.equations.nodal.neighbours import NodalNeighbours, Stored
from erls.equations.nodal.nodes import Nodes
from erls.errors import Cause, SceneError
from erls.maths import motion_maps as motions
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.joint_types import Z


@dataclass(frozen=True)
class SpinningNeighbours(NodalNeighbours):
    """Of nodes in steady motion along a screw ξ, seen from axes that go with them.

    Of q(t) = exp(t ξ) q the twists in the axes of the nodes, Ad(q⁻¹) ξ, are constant, and so are the conditions of
    their joints: displacements x of the nodes have equations with constant coefficients.

    Attributes
    ----------
    screw : (6,) array
        In the world.
    going : (k,) bool array
        Nodes that go along; the others rest.
    """

    screw: Array
    going: Array

    @property
    def speed(self) -> Array:
        """See `Neighbours`."""
        return np.zeros_like(self.v)

    @property
    def acceleration(self) -> Array:
        """See `Neighbours`."""
        return np.zeros_like(self.v)

    @property
    def driven(self) -> tuple[float, float]:
        """See `Neighbours`: what goes along moves as prescribed."""
        return float(np.linalg.norm(self.v.reshape(-1, 6)[:, :3], axis=1).max()), 0.0

    def later(self, tau: float) -> SpinningNeighbours:
        """See `Neighbours`: the same, seen from those axes."""
        return self

    def at_rest(self, x: Array, multipliers: Array) -> SpinningNeighbours:
        """See `Neighbours`: at rest as seen from those axes."""
        q = self.system.compose(self.q, x)
        return replace(self, q=q, v=twists_along(q, self.screw, self.going), multipliers=multipliers)


def twists_along(q: Nodes, screw: Array, going: Array) -> Array:
    """(n,) twists of nodes that go along a screw of the world, in their own axes; the others rest."""
    return np.asarray((motions.adjoint_inverse(q.poses) @ screw * going[:, None]).ravel())


def spinning_neighbours(
    mechanism: Mechanism, chain: Chain, joint: str, speed: float, stored: Stored, names: tuple[str, ...]
) -> SpinningNeighbours:
    """Of a chain, undeformed, of which a joint and all that it bears go along steadily [rad/s or m/s].

    Raises
    ------
    SceneError
        BAD_FIELD: the joint does not stand on the ground.
    """
    number = [each.name for each in mechanism.joints].index(joint)
    seat, freedom, system = chain.seats[number], mechanism.joints[number].freedom, chain.system
    if seat.inner != GROUND:
        message = "nodes go along steadily with a joint on the ground alone: the loads of what bears it would turn"
        remedy = "use formulation = 'erls' or 'ffr', or a joint on the ground"
        raise SceneError(Cause.BAD_FIELD, message, where=f"joint {joint!r}", value="nodal", remedy=remedy)
    q, going = system.start, np.zeros(system.count, dtype=bool)
    for link in mechanism.carried(number):
        going[chain.nodes[link]] = True
    screw = motions.adjoint(seat.frames(q)[0]) @ replace(freedom, axis=Z).screw * speed
    rest = np.zeros(system.size), np.zeros(system.constraints)
    return SpinningNeighbours(system, 0.0, q, twists_along(q, screw, going), *rest, stored, names, screw, going)
