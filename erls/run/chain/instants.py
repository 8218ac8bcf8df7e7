"""A chain at some times: what is asked of its motion, found once for all who ask, from (t, y, v, a) alone."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import cast

import numpy as np

from erls.equations.formulation import Formulation, LoopForce, LoopFormulation
from erls.equations.serial.motion_series import MotionSeries, motion_series
from erls.equations.serial.state_series import ReactionSeries, accelerations, reaction_series
from erls.equations.substructures import solved
from erls.maths.so3 import Array
from erls.mechanism.joints import Joint
from erls.mechanism.loops import LoopFreedom
from erls.mechanism.sensors.base import JointForce, JointMotion, Moved, Node, NodeMotion, Site
from erls.run.chain.loads import pull
from erls.run.chain.node_motion import node_motion


@dataclass(frozen=True)
class Instants:
    """A mechanism at k times; a `erls.mechanism.sensors.base.Seen`.

    Attributes
    ----------
    formulation : Formulation
    t : (k,) array
        [s]
    y, v : (k, n) arrays
        Coordinates and rates.
    given : (k, n) array, optional
        Accelerations; those of the equations of motion unless given.
    """

    formulation: Formulation
    t: Array
    y: Array
    v: Array
    given: Array | None = None

    @cached_property
    def a(self) -> Array:
        """(k, n) accelerations."""
        if self.given is not None:
            return self.given
        return accelerations(self.formulation, self.t, self.y, self.v)

    @cached_property
    def motion(self) -> MotionSeries:
        """Motion of links and joints."""
        return motion_series(self.formulation, self.t, self.y, self.v, self.a)

    @cached_property
    def reactions(self) -> ReactionSeries:
        """In all joints."""
        return reaction_series(self.formulation, self.t, self.y, self.v, self.a)

    @cached_property
    def loop_forces(self) -> list[list[LoopForce]]:
        """In all closing joints, at each time."""
        chain = cast(LoopFormulation, solved(self.formulation))
        return [chain.loop_forces(*at) for at in self._each()]

    @cached_property
    def inside(self) -> Instants:
        """The same of what is solved: of the pieces of links that are split."""
        return Instants(solved(self.formulation), self.t, self.y, self.v, self.given)

    @cached_property
    def _nodes(self) -> dict[Node, NodeMotion]:
        return {}

    @cached_property
    def _recovered(self) -> dict[int, Array]:
        return {}

    def node(self, at: Node) -> NodeMotion:
        """Motion of a node."""
        if at not in self._nodes:
            self._nodes[at] = node_motion(self.formulation.mechanism, self.motion, *at)
        return self._nodes[at]

    def link_axes(self, link: int) -> Array:
        """(k, 3, 3) mesh axes of a link, which turn with its inboard interface."""
        return self.node(Node(link, self.formulation.mechanism.links[link].inboard.node)).turn

    def pull(self, link: int) -> Array:
        """(k, 3) gravity and forces per mass on a link [m/s²], world axes."""
        return pull(self.formulation.mechanism, link, self.motion.states)

    def joint(self, at: Moved) -> JointMotion:
        """Motion of a joint; the acceleration of a closing one is not known."""
        states, joints = self.motion.states, len(self.formulation.mechanism.joints)
        if at.number < joints:
            accelerated = self.motion.angle_accelerations[:, at.number]
            return JointMotion(states.angles[:, at.number], states.rates[:, at.number], accelerated)
        chain = cast(LoopFormulation, solved(self.formulation))
        found = np.array([chain.loop_motion(*state, at.number - joints) for state in self._each()]).reshape(-1, 2)
        return JointMotion(found[:, 0], found[:, 1], np.full(len(self.t), np.nan))

    def joint_force(self, at: Moved) -> JointForce:
        """Forces along it."""
        mechanism, moved = self.formulation.mechanism, self.joint(at)
        joints = len(mechanism.joints)
        own: Joint | LoopFreedom
        if at.number < joints:
            own, effort = mechanism.joints[at.number], self.reactions.effort[:, at.number]
        else:
            free = mechanism.loops[at.number - joints].freedom
            assert free is not None
            chain = cast(LoopFormulation, solved(self.formulation))
            own, effort = free, np.array([chain.loop_effort(*state, at.number - joints) for state in self._each()])
        passive = np.array([own.forces.force(*x) for x in zip(moved.angle.tolist(), moved.rate.tolist(), strict=True)])
        return JointForce(effort if own.drive.prescribed else effort - passive, passive)

    def recovered(self, at: Site) -> Array:
        """(k, 6) stress or section forces at a place of a link."""
        from erls.run.chain.recovered import recovered  # here: few ask for it

        if at.link not in self._recovered:
            self._recovered[at.link] = recovered(self, at.link)
        return self._recovered[at.link][:, at.site]

    def _each(self) -> list[tuple[float, Array, Array]]:
        return list(zip(self.t.tolist(), self.y, self.v, strict=True))
