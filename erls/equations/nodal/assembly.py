"""Nodes, elements and joints as constrained equations of motion, on SE(3) or on R³×SO(3).

Elements speak in twists and wrenches of the node axes, as on SE(3). On R³×SO(3) a node's velocity is [u; ω] with u in
the world's axes; with ν = E [u; ω], E = diag(Rᵀ, 1), forces become Eᵀ f and accelerations E a + Ė v.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from erls.equations.nodal.elements import Elements
from erls.equations.nodal.joints import Joint, JointRows, Relative
from erls.equations.nodal.scatter import IntArray, Scatter, dofs
from erls.maths.groups import SE3, Group
from erls.maths.rotation_maps import skews
from erls.maths.saddle import Matrix
from erls.maths.so3 import Array

_ONE_AND_HALF = 1.5 * np.eye(3)


@dataclass(frozen=True)
class Nodes:
    """A configuration: poses (k, 4, 4) of the nodes, and what each kind of elements remembers."""

    poses: Array
    memory: tuple[Any, ...]


class NodalSystem:
    """A mechanism of nodal elements; a `erls.integrate.constrained.ConstrainedSystem`.

    Parameters
    ----------
    poses : (k, 4, 4) array
        Nodes as built.
    elements : sequence of Elements
    joints : sequence of Joint
    group : Group
        `erls.maths.groups.SE3` or `R3_SO3`, for all nodes.
    """

    def __init__(
        self, poses: Array, elements: Sequence[Elements], joints: Sequence[Joint] = (), group: Group = SE3
    ) -> None:
        self.count, self.elements, self.group = len(poses), tuple(elements), group
        self.local = group is SE3
        self.rows = JointRows(joints)
        self.start = Nodes(poses, tuple(e.remember(poses[e.nodes], None) for e in self.elements))
        n, m = self.size, self.constraints
        places = [dofs(e.nodes) for e in elements]
        joint_places = dofs(self.rows.nodes)
        self._places = places
        self._mass = Scatter(places, places, (n, n))
        stiff = [*places, joint_places]
        self._stiffness = Scatter(stiff, stiff, (n, n))
        numbers = np.arange(m)[:, None]
        self._constraint = Scatter([numbers], [joint_places[self.rows.joint_of_row]], (m, n))
        nodes = 6 * np.arange(self.count)[:, None] + np.arange(6)
        self._nodes = Scatter([nodes], [nodes], (n, n))
        self._last: tuple[float, Nodes, Relative | None] = (
            0.0,
            self.start,
            None,
        )  # configurations never change in place

    @property
    def size(self) -> int:
        """Six velocities for each node."""
        return 6 * self.count

    @property
    def constraints(self) -> int:
        """Number of conditions of all joints."""
        return len(self.rows.names)

    @property
    def constraint_names(self) -> tuple[str, ...]:
        """Joint and condition."""
        return self.rows.names

    @cached_property
    def length_scales(self) -> Array:
        """(n,) per radian, the distance of a node from the farthest joint or neighbour."""
        reach = np.zeros(self.count)
        for joint in self.rows.joints:
            for node, frame in ((joint.inner, joint.inner_frame), (joint.outer, joint.outer_frame)):
                if node >= 0:
                    reach[node] = max(reach[node], float(np.linalg.norm(frame[:3, 3])))
        for element in self.elements:
            for nodes in element.nodes:
                places = self.start.poses[nodes, :3, 3]
                far = np.linalg.norm(places[:, None] - places, axis=2).max(axis=1)
                reach[nodes] = np.maximum(reach[nodes], far)
        least = float(reach.max(initial=0.0)) or 1.0
        scales = np.ones((self.count, 6))
        scales[:, 3:] = np.where(reach > 0, reach, least)[:, None]
        return scales.ravel()

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Of all elements and prescribed motions."""
        found = {t for e in self.elements for t in e.breakpoints}
        return tuple(sorted(found | {t for j in self.rows.joints for t in j.breakpoints}))

    def at(self, poses: Array, near: Nodes | None = None) -> Nodes:
        """Configuration at poses (k, 4, 4), with elements wound up as they are nearby (as built unless given)."""
        before = (near or self.start).memory
        found = (e.remember(poses[e.nodes], m) for e, m in zip(self.elements, before, strict=True))
        return Nodes(poses, tuple(found))

    def compose(self, q: Nodes, increment: Array) -> Nodes:
        """Poses ∘ exp(increment), their rotations orthogonal to rounding however many steps were made."""
        moved: Array = self.group.move(q.poses, increment.reshape(-1, 6))
        turn = moved[:, :3, :3]
        moved[:, :3, :3] = turn @ (_ONE_AND_HALF - 0.5 * np.swapaxes(turn, 1, 2) @ turn)
        return self.at(moved, q)

    def tangent(self, increment: Array) -> Matrix:
        """(n, n) a block for each node."""
        return self._nodes.matrix([self.group.tangent(increment.reshape(-1, 6))])

    def residual(self, t: float, q: Nodes, v: Array, a: Array) -> Array:
        """(n,) inertia and internal forces less loads."""
        twist, twist_rate = self._twists(q, v, a)
        return self._turned(q, self._forces(t, q, twist, twist_rate))

    def mass_matrix(self, t: float, q: Nodes) -> Matrix:
        """(n, n)"""
        mass = self._mass.matrix([e.mass(q.poses[e.nodes], m) for e, m in self._each(q)])
        if self.local:
            return mass
        turn = self._turning(q)
        return turn.T @ mass @ turn

    def stiffness_and_damping(
        self, t: float, q: Nodes, v: Array, a: Array, multipliers: Array, material: bool = False
    ) -> tuple[Matrix, Matrix]:
        """(n, n) twice; ``material`` as in `erls.equations.nodal.elements.Elements`."""
        twist, rate = self._twists(q, v, a)
        found = []
        for element, memory in self._each(q):
            motion = _of_elements(twist, element.nodes), _of_elements(rate, element.nodes)
            found.append(element.derivatives(t, q.poses[element.nodes], memory, *motion, material=material))
        relative = self._relative(t, q)
        stiffness = self._stiffness.matrix([*(k for k, _ in found), self.rows.stiffness(relative, multipliers)])
        damping = self._mass.matrix([c for _, c in found])
        if self.local:
            return stiffness, damping
        force = self._forces(t, q, twist, rate).reshape(-1, 6)
        reaction = relative.gradient * multipliers[:, None]
        for side in (0, 1):
            nodes = self.rows.nodes[self.rows.joint_of_row, side]
            np.add.at(force, nodes[nodes >= 0], reaction[nodes >= 0, 6 * side : 6 * side + 6])
        return self._in_world_axes(q, (twist, rate, force), stiffness, damping)

    def constraint(self, t: float, q: Nodes) -> Array:
        """(m,) Φ."""
        return self.rows.violation(self._relative(t, q))

    def constraint_matrix(self, t: float, q: Nodes) -> Matrix:
        """(m, n) B."""
        rows = self._constraint.matrix([self._relative(t, q).gradient[:, None, :]])
        return rows if self.local else rows @ self._turning(q)

    def constraint_rate(self, t: float, q: Nodes) -> Array:
        """(m,) Φ_t."""
        return self.rows.rate(self._relative(t, q))

    def constraint_bias(self, t: float, q: Nodes, v: Array) -> Array:
        """(m,) Φ̈ − B a."""
        twist, rate = self._twists(q, v, np.zeros_like(v))
        ends = np.concatenate([self._at_joint_ends(twist, side) for side in (0, 1)], axis=1)
        relative = self._relative(t, q)
        bias = self.rows.bias(relative, ends)
        if self.local:
            return bias
        swing = np.concatenate([self._at_joint_ends(rate, side) for side in (0, 1)], axis=1)
        gradient = relative.gradient
        result: Array = bias + (gradient * swing[self.rows.joint_of_row]).sum(axis=1)
        return result

    def stored(self, t: float, q: Nodes, v: Array, a: Array) -> tuple[Array, Array, Array]:
        """(12 k,) position and rotation matrix of each node, with first and second derivatives."""
        twist, rate = self._twists(q, v, a)
        turn, spin = q.poses[:, :3, :3], skews(twist[:, 3:])
        slide = rate[:, :3] + (spin @ twist[:, :3, None])[:, :, 0]
        first = np.concatenate([(turn @ twist[:, :3, None]), turn @ spin], axis=2)
        second = np.concatenate([turn @ slide[:, :, None], turn @ (spin @ spin + skews(rate[:, 3:]))], axis=2)
        knot = np.concatenate([q.poses[:, :3, 3:], turn], axis=2)
        return _flat(knot), _flat(first), _flat(second)

    def energy(self, t: float, q: Nodes, v: Array) -> tuple[float, float]:
        """Kinetic and potential energy [J]."""
        twist, _ = self._twists(q, v, np.zeros_like(v))
        pairs = [e.energy(t, q.poses[e.nodes], m, _of_elements(twist, e.nodes)) for e, m in self._each(q)]
        return sum(k for k, _ in pairs), sum(p for _, p in pairs)

    def compiled(self) -> Any:
        """The system as arrays (`erls.equations.nodal.compiled.CompiledSystem`), None where it has no kernels."""
        from erls.equations.nodal.compiled import CompiledSystem, has_kernels

        return CompiledSystem(self) if has_kernels(self) else None

    def _each(self, q: Nodes) -> Iterator[tuple[Elements, Any]]:
        return zip(self.elements, q.memory, strict=True)

    def _twists(self, q: Nodes, v: Array, a: Array) -> tuple[Array, Array]:
        """(k, 6) twists of all nodes in their own axes, and their rates."""
        v, a = v.reshape(-1, 6), a.reshape(-1, 6)
        if self.local:
            return v, a
        back = np.swapaxes(q.poses[:, :3, :3], 1, 2)
        twist, rate = v.copy(), a.copy()
        twist[:, :3] = (back @ v[:, :3, None])[:, :, 0]
        rate[:, :3] = (back @ a[:, :3, None])[:, :, 0] - _crossed(v[:, 3:], twist[:, :3])
        return twist, rate

    def _forces(self, t: float, q: Nodes, twist: Array, rate: Array) -> Array:
        """(n,) wrenches in node axes."""
        result = np.zeros(self.size)
        for (element, memory), place in zip(self._each(q), self._places, strict=True):
            nodes = element.nodes
            motion = _of_elements(twist, nodes), _of_elements(rate, nodes)
            found = element.forces(t, q.poses[nodes], memory, *motion)
            result += np.bincount(place.ravel(), found.ravel(), self.size)
        return result

    def _turned(self, q: Nodes, force: Array) -> Array:
        """Eᵀ f."""
        if self.local:
            return force
        blocks = force.reshape(-1, 6).copy()
        blocks[:, :3] = (q.poses[:, :3, :3] @ blocks[:, :3, None])[:, :, 0]
        return blocks.ravel()

    def _turning(self, q: Nodes) -> Matrix:
        """(n, n) E."""
        blocks = np.zeros((self.count, 6, 6))
        blocks[:, :3, :3] = np.swapaxes(q.poses[:, :3, :3], 1, 2)
        blocks[:, 3:, 3:] = np.eye(3)
        return self._nodes.matrix([blocks])

    def _in_world_axes(
        self,
        q: Nodes,
        known: tuple[Array, Array, Array],
        stiffness: Matrix,
        damping: Matrix,
    ) -> tuple[Matrix, Matrix]:
        """Derivatives on R³×SO(3) from those on SE(3): chain rule over E(q) v, E(q) a + Ė v and Eᵀ f."""
        twist, rate, force = known
        mass = self._mass.matrix([e.mass(q.poses[e.nodes], m) for e, m in self._each(q)])
        turn = self._turning(q)
        spin, slide = skews(twist[:, 3:]), skews(twist[:, :3])
        swing, by_velocity, by_turn, of_force = np.zeros((4, self.count, 6, 6))
        swing[:, :3, 3:] = slide  # of E v by a turn
        by_velocity[:, :3, :3] = -spin @ np.swapaxes(q.poses[:, :3, :3], 1, 2)  # of Ė v
        by_velocity[:, :3, 3:] = slide
        fixed = rate[:, :3] + _crossed(twist[:, 3:], twist[:, :3])  # E a
        by_turn[:, :3, 3:] = skews(fixed) - spin @ slide  # of E a + Ė v
        of_force[:, :3, 3:] = -q.poses[:, :3, :3] @ skews(force[:, :3])
        swing, by_velocity, by_turn, of_force = (
            self._nodes.matrix([b]) for b in (swing, by_velocity, by_turn, of_force)
        )
        whole = turn.T @ (stiffness @ turn + damping @ swing + mass @ by_turn) + of_force
        return whole, turn.T @ (damping @ turn + mass @ by_velocity)

    def _relative(self, t: float, q: Nodes) -> Relative:
        known_t, known_q, known = self._last
        if known is not None and known_t == t and known_q is q:
            return known
        with_ground = np.concatenate([q.poses, np.eye(4)[None]])  # the ground is the last node, −1
        found = self.rows.relative(t, with_ground[self.rows.nodes[:, 0]], with_ground[self.rows.nodes[:, 1]])
        self._last = t, q, found
        return found

    def _at_joint_ends(self, per_node: Array, side: int) -> Array:
        with_ground = np.concatenate([per_node, np.zeros((1, 6))])
        result: Array = with_ground[self.rows.nodes[:, side]]
        return result


def _of_elements(per_node: Array, nodes: IntArray) -> Array:
    """(e, 6k) twists of the nodes (e, k) of elements."""
    return per_node[nodes].reshape(len(nodes), 6 * nodes.shape[1])


def _crossed(a: Array, b: Array) -> Array:
    """(k, 3) a × b."""
    result: Array = (skews(a) @ b[:, :, None])[:, :, 0]
    return result


def _flat(columns: Array) -> Array:
    """(12 k,) position, then the rotation's rows, of matrices (k, 3, 4) [position | rotation]."""
    return np.concatenate([columns[:, :, 0], columns[:, :, 1:].reshape(-1, 9)], axis=1).ravel()
