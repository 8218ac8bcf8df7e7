"""The nodal formulation: geometrically exact beams and rigid bodies on SE(3), tied by joints with multipliers.

V. Sonneville, A. Cardona, O. Brüls, Comput. Methods Appl. Mech. Eng. 268 (2014) 451–474. It holds for any deflection
and knows nothing of modes. y holds position and rotation matrix of every node and the joint coordinates, then what the
integrator found with them: the rates of the nodes' twists and the multipliers.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from erls.equations.consistency import consistent_acceleration
from erls.equations.formulation import Energy, Reaction, State
from erls.equations.nodal.chain import Chain, build_chain
from erls.equations.nodal.joints import GROUND
from erls.equations.nodal.link_state import LinkView
from erls.equations.nodal.nodes import Nodes
from erls.equations.nodal.parts import link_parts
from erls.equations.nodal.statics import solve_statics
from erls.errors import Cause, SceneError, SimulationError
from erls.maths import motion_maps as motions
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism


class Nodal:
    """Equations of motion of a serial chain; a `Formulation`.

    Parameters
    ----------
    mechanism : Mechanism
    elements_per_member : int, optional
        Instead of the numbers in the descriptions of the links.

    Raises
    ------
    SceneError
        A loop, or a link that is neither rigid nor made of beams; it is named.
    """

    def __init__(self, mechanism: Mechanism, elements_per_member: int | None = None) -> None:
        if mechanism.loops:
            loop = mechanism.loops[0]
            carried = next(end.link for end in (loop.outer, loop.inner) if end.link is not None)
            raise SceneError(
                Cause.BAD_FIELD,
                "the nodal formulation closes no loops",
                where=f"loop {loop.name!r} on link {mechanism.links[carried].name!r}",
                value="nodal",
                remedy="use formulation erls or ffr, or a scene of beams and connections, as "
                "data/slider_crank/fast_beams.toml",
            )
        self.mechanism = mechanism
        parts = [link_parts(link, elements_per_member) for link in mechanism.links]
        self.chain: Chain = build_chain(mechanism, parts)
        self.system = self.chain.system
        self.views = [
            LinkView(link, part, nodes, first)
            for link, part, nodes, first in zip(
                mechanism.links, parts, self.chain.nodes, self.chain.elements, strict=True
            )
        ]
        self._frames = 12 * self.system.count  # entries of y that hold them
        self._kept = self._frames + len(mechanism.joints)

    @property
    def size(self) -> int:
        """18 numbers for each node, one for each joint and each of its conditions."""
        return self._kept + self.system.size + self.system.constraints

    def configuration(self, y: Array, v: Array) -> tuple[Nodes, Array]:
        """Configuration and twists of the nodes (n,)."""
        return self.system.from_stored(y[: self._kept], v[: self._kept])

    def _found(self, y: Array) -> tuple[Array, Array]:
        """Rates of twists and multipliers."""
        return y[self._kept : self._kept + self.system.size], y[self._kept + self.system.size :]

    def initial_state(self) -> tuple[Array, Array]:
        """Frames and joint coordinates at time 0; links turn with the joints as they are.

        Raises
        ------
        SimulationError
            NO_EQUILIBRIUM, when the start is to be static.
        """
        q = self._equilibrium() if self.mechanism.static_start else self.system.start
        v = np.zeros((self.system.count, 6))
        moving = np.zeros(6)  # of the link in the world's axes, about its origin
        for joint, seat, nodes in zip(self.mechanism.joints, self.chain.seats, self.chain.nodes, strict=True):
            carrier = np.eye(4) if seat.inner == GROUND else q.poses[seat.inner]
            moving = moving + motions.adjoint(carrier @ seat.inner_frame) @ joint.freedom.screw * joint.rate
            v[nodes] = motions.adjoint_inverse(q.poses[nodes]) @ moving
        a, multipliers = consistent_acceleration(self.system, 0.0, q, v.ravel())
        y, rates, _ = self.system.stored(0.0, q, v.ravel(), a)
        return np.concatenate([y, a, multipliers]), np.concatenate([rates, 0 * a, 0 * multipliers])

    def _equilibrium(self) -> Nodes:
        """At rest under gravity with the joints held."""
        held = self.chain.held(np.array([j.position for j in self.mechanism.joints]))
        failure: SimulationError | None = None
        for tangent in ("full", "material"):  # the second converges from farther away
            found = solve_statics(held, held.start, tangent=tangent)
            if found.failure is None:
                return self.system.at(found.path[-1].q.poses)
            failure = found.failure
        assert failure is not None
        raise failure

    def state(self, t: float, y: Array, v: Array) -> State:
        """Positions of all nodes; link frames at the inboard nodes, modal coordinates as near as modes come."""
        q, velocity = self.configuration(y, v)
        found = [view.at(q.poses, self.chain.beams, q.bent) for view in self.views]
        _, rates, _ = self.system.joint_motion(q, velocity, np.zeros(self.system.size))
        angles = y[self._frames : self._kept]
        return State(
            t, [x.frame for x in found], [x.modal for x in found], angles, angles, rates, [x.nodes for x in found]
        )

    def energy(self, t: float, y: Array, v: Array) -> Energy:
        """Energies of a state."""
        q, velocity = self.configuration(y, v)
        kinetic, elastic, gravity, _, springs = self.system.energies(q, velocity).tolist()
        return Energy(kinetic, elastic, gravity, springs)

    def acceleration(self, t: float, y: Array, v: Array) -> Array:
        """(n,) ÿ of frames and joint coordinates; 0 for the rest."""
        q, velocity = self.configuration(y, v)
        result = np.zeros(self.size)
        result[: self._kept] = self.system.stored(t, q, velocity, self._found(y)[0])[2]
        return result

    def reactions(self, t: float, y: Array, v: Array) -> list[Reaction]:
        """Joint reactions from the multipliers and what acts along the joints."""
        q, velocity = self.configuration(y, v)
        a, multipliers = self._found(y)
        along = self.system.in_joints(t, q, velocity, a)
        rows = self.system.constraint_matrix(t, q)
        result = []
        for k, (joint, seat) in enumerate(zip(self.mechanism.joints, self.chain.seats, strict=True)):
            place = slice(6 * seat.outer, 6 * seat.outer + 6)
            own = np.flatnonzero(self.system.rows.joint_of_row == k)
            wrench = -np.asarray(rows[own][:, place].T @ multipliers[own]).ravel()
            effort, push = float(along[k, 3]), along[k, 4:]
            if joint.drive.prescribed:
                axis = motions.adjoint(seat.outer_frame) @ joint.freedom.screw
                effort = float(axis @ wrench)
            wrench = wrench + push
            turn = q.poses[seat.outer, :3, :3]
            result.append(Reaction(turn @ wrench[:3], turn @ wrench[3:], effort))
        return result

    def describe(self) -> dict[str, Any]:
        """Names and sizes for reports."""
        beams = self.chain.beams
        return {
            "formulation": "nodal",
            "joints": len(self.mechanism.joints),
            "elements": 0 if beams is None else len(beams.nodes),
            "nodes": self.system.count,
            "velocities": self.system.size,
            "conditions": self.system.constraints,
        }
