"""Nodes, elements and joints as constrained equations of motion, on SE(3) or on R³×SO(3)."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache, cached_property
from typing import TYPE_CHECKING

import numpy as np

from erls.equations.nodal.contract import Model, Work
from erls.equations.nodal.elements import Elements
from erls.equations.nodal.elimination import Elimination, elimination
from erls.equations.nodal.joints import Joint, JointRows
from erls.equations.nodal.layout import Flat, Functions, lay_out, used_kinds
from erls.equations.nodal.model import Kinds, build_model
from erls.equations.nodal.nodes import Nodes, numbers_of, poses_of, rows_of
from erls.equations.nodal.scatter import Scatter, dofs
from erls.equations.system import metre_scales
from erls.maths.beside import compiling_beside
from erls.maths.groups import SE3, Group
from erls.maths.saddle import Matrix
from erls.maths.so3 import Array

if TYPE_CHECKING:  # it imports the compiler
    from erls.equations.stepped import Stepped

_STEPPED = (
    "compose",
    "tangent",
    "residual",
    "mass_matrix",
    "stiffness_and_damping",
    "constraint",
    "constraint_matrix",
    "length_scales",
)  # methods of a system that compiled steps stand for


_DERIVATIVES = {"beam_forces": "beam_derivatives", "shell_forces": "shell_derivatives"}


@cache
def functions(*kinds: str) -> Functions:
    """Loaded with the first system, together with modules of these kinds of elements: not every run is one of nodes."""
    own, more = "erls.equations.nodal", tuple(d for f, d in _DERIVATIVES.items() if f in kinds)
    with compiling_beside(*(f"{own}.{name}" for name in (*kinds, *more, "outputs", "blocks", "matrix", "step"))):
        from erls.equations.nodal.sums import forces, move, remember
    from erls.equations.nodal.blocks import blocks, conditions, weighted
    from erls.equations.nodal.outputs import energies, knot

    return Functions(forces, remember, move, energies, knot, conditions, blocks, weighted)


class NodalSystem:
    """A mechanism of nodal elements; a `erls.integrate.constrained.ConstrainedSystem`.

    All values come from the functions of `erls.equations.nodal.sums` and `erls.equations.nodal.blocks`, on the arrays
    of `erls.equations.nodal.contract`.

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
        self.arms: tuple[tuple[int, Array], ...] = ()  # nodes, and places in their axes of points that go with them
        self.rows = JointRows(joints)
        self.kinds = Kinds(elements)
        pairs = self.kinds.pairs
        n, m = self.size, self.constraints
        places, joint_places = dofs(pairs), dofs(self.rows.nodes)
        every = np.concatenate([places, joint_places])
        self._mass = Scatter([places], [places], (n, n))
        self._stiffness = Scatter([every], [every], (n, n))
        numbers = np.arange(m)[:, None]
        self._constraint = Scatter([numbers], [joint_places[self.rows.joint_of_row]], (m, n))
        nodes = 6 * np.arange(self.count)[:, None] + np.arange(6)
        self._nodes = Scatter([nodes], [nodes], (n, n))
        coordinates = np.concatenate([np.zeros(0), *(a.start for a in self.kinds.actuators)])
        windings = sum(len(s.nodes) for s in self.kinds.windings)
        built = Nodes(poses, self.kinds.beams.built, coordinates, np.zeros((windings, 3)))
        self.start = built  # `length_scales` asks for it
        heavy = len(self.kinds.heavy) == self.count
        self.elimination: Elimination = elimination(self.count, pairs, self.rows, heavy)
        model = build_model(self.kinds, self.rows, self.local, metre_scales(self), self.elimination)
        self._functions = functions(*used_kinds(model))
        self.flat: Flat = lay_out(model, built, self.samples(np.zeros(1)).shape[1], self.elimination, self._functions)
        self._memory = self.flat.reals, self.flat.integers, self.flat.scratch
        self.model: Model = self.flat.model()
        self._work: Work = self.flat.work()
        self._sampled = np.nan
        self._tied: tuple[float, Nodes | None, tuple[Array, ...]] = (np.nan, None, ())
        self.start = self.at(poses, built)
        # the same to the last bit: no strain as built, unless it expands
        beams = self.kinds.beams
        self.model.beam_built[:] = beams.built[:] = beams.without_force(self.start.bent)

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
        for first, second in self.kinds.pairs:
            if first >= 0 and second >= 0:
                far = float(np.linalg.norm(self.start.poses[first, :3, 3] - self.start.poses[second, :3, 3]))
                reach[[first, second]] = np.maximum(reach[[first, second]], far)
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
        self._work.poses[:] = rows_of(poses)
        self._functions.remember(*self._memory, numbers_of(near or self.start))
        return Nodes(poses, self._work.bent.copy(), self._work.turned.copy(), self._work.wound.copy())

    def compose(self, q: Nodes, increment: Array) -> Nodes:
        """Poses ∘ exp(increment), their rotations orthogonal to rounding however many steps were made."""
        work = self._work
        work.increment[:] = increment
        self._functions.move(*self._memory, numbers_of(q))
        return Nodes(poses_of(work.poses), work.bent.copy(), work.turned.copy(), work.wound.copy())

    def tangent(self, increment: Array) -> Matrix:
        """(n, n) a block for each node."""
        return self._nodes.matrix([self.group.tangent(increment.reshape(-1, 6))])

    def residual(self, t: float, q: Nodes, v: Array, a: Array) -> Array:
        """(n,) inertia and internal forces less loads."""
        return self._evaluated(t, q, v, a, None).force.copy()

    def mass_matrix(self, t: float, q: Nodes) -> Matrix:
        """(n, n)"""
        rest = np.zeros(self.size)
        work = self._evaluated(t, q, rest, rest, None)
        self._functions.blocks(*self._memory, 0)
        return self._mass.matrix([self._weighted(work, 0, (1.0, 0.0, 0.0))[: len(self.kinds.pairs)]])

    def stiffness_and_damping(
        self, t: float, q: Nodes, v: Array, a: Array, multipliers: Array, material: bool = False
    ) -> tuple[Matrix, Matrix]:
        """(n, n) twice; ``material`` as in `erls.equations.nodal.blocks.blocks`."""
        work = self._evaluated(t, q, v, a, multipliers)
        self._functions.blocks(*self._memory, int(material))
        stiffness = self._stiffness.matrix([self._weighted(work, 2, (0.0, 0.0, 1.0))])
        if not self.local:
            turning = np.zeros((self.count, 6, 6))
            turning[:, :3, 3:] = work.turning
            stiffness = stiffness + self._nodes.matrix([turning])
        damping = self._mass.matrix([self._weighted(work, 1, (0.0, 1.0, 0.0))[: len(self.kinds.pairs)]])
        return stiffness, damping

    def exact_stiffness_and_damping(
        self, t: float, q: Nodes, v: Array, a: Array, multipliers: Array
    ) -> tuple[Matrix, Matrix]:
        """(n, n) twice, with all that iterations leave out (`erls.equations.nodal.tangents`); on SE(3)."""
        from erls.equations.nodal.tangents import addresses, exact_blocks, room  # here: it is compiled

        model = self.model
        self._evaluated(t, q, v, a, multipliers)
        known = addresses(len(model.beam_nodes), len(model.actuator_nodes))
        exact_blocks(known, *self._memory, *room(self.count))
        blocks = self._work.blocks
        return self._stiffness.matrix([blocks[:, 2]]), self._mass.matrix([blocks[: len(self.kinds.pairs), 1]])

    def constraint(self, t: float, q: Nodes) -> Array:
        """(m,) Φ."""
        return self._conditions(t, q)[0].copy()

    def constraint_matrix(self, t: float, q: Nodes) -> Matrix:
        """(m, n) B."""
        rows = self._constraint.matrix([self._conditions(t, q)[1][:, None, :]])
        return rows if self.local else rows @ self._turning(q)

    def constraint_rate(self, t: float, q: Nodes) -> Array:
        """(m,) Φ_t."""
        return self._conditions(t, q)[2].copy()

    def constraint_bias(self, t: float, q: Nodes, v: Array) -> Array:
        """(m,) Φ̈ − B a."""
        work = self._state(q, v, np.zeros(self.size))
        self._sample(t)
        self._functions.conditions(*self._memory)
        return work.bias.copy()

    def stored(self, t: float, q: Nodes, v: Array, a: Array) -> tuple[Array, Array, Array]:
        """(12 k + a,) position and rotation matrix of each node, then joint coordinates of actuators, with first and
        second derivatives.
        """
        out = np.zeros((3, 12 * self.count + len(self.model.actuators)))
        self._state(q, v, a)
        self._functions.knot(*self._memory, out)
        return out[0], out[1], out[2]

    def places(self, stored: Array) -> Array:
        """(k, nodes + arms, 3) of the nodes, and of what they carry on `arms`."""
        found = stored[:, : 12 * self.count].reshape(len(stored), self.count, 12)
        if not self.arms:
            return found[..., :3]
        nodes, offsets = [node for node, _ in self.arms], np.array([offset for _, offset in self.arms])
        turned = np.einsum("kpij,pj->kpi", found[:, nodes, 3:].reshape(len(stored), -1, 3, 3), offsets)
        return np.concatenate([found[..., :3], found[:, nodes, :3] + turned], axis=1)

    def energies(self, q: Nodes, v: Array) -> Array:
        """(5,) kinetic, elastic of beams, gravity, springs, what is elastic in joints and contacts [J]."""
        out = np.zeros(5)
        self._state(q, v, np.zeros(self.size))
        self._functions.energies(*self._memory, out)
        return out

    def energy(self, t: float, q: Nodes, v: Array) -> tuple[float, float]:
        """Kinetic and potential energy [J]."""
        kinetic, *potential = self.energies(q, v).tolist()
        return kinetic, sum(potential)

    def in_joints(self, t: float, q: Nodes, v: Array, a: Array) -> Array:
        """(a, 10) coordinate, rate, acceleration, effort of each actuator, and its wrench on the outer node there."""
        out = np.zeros((len(self.model.actuators), 10))
        if len(out):
            from erls.equations.nodal.actuator_forces import in_joints  # here: it is compiled

            self._state(q, v, a)
            self._sample(t)
            in_joints(*self._memory, out)
        return out

    def in_contacts(self, q: Nodes, v: Array) -> Array:
        """(c, 15) as of `erls.equations.nodal.contact_forces.in_contacts`."""
        out = np.zeros((len(self.model.contacts), 15))
        if len(out):
            from erls.equations.nodal.contact_forces import in_contacts  # here: it is compiled

            self._state(q, v, np.zeros(self.size))
            in_contacts(*self._memory, out)
        return out

    def samples(self, times: Array) -> Array:
        """(times, ...) what depends on time alone; see `erls.equations.nodal.contract`."""
        joints, loads = self.rows.joints, self.kinds.loads.loads
        actuators = sum(len(group.joints) for group in self.kinds.actuators)
        result = np.zeros((len(times), 3 * len(joints) + len(loads) + 3 * actuators))
        for k, tie in enumerate(joints):
            if tie.motion is not None:
                result[:, 3 * k : 3 * k + 3] = [tie.motion(t) for t in times.tolist()]
        for k, load in enumerate(loads, 3 * len(joints)):
            result[:, k] = [load.factor(t) for t in times.tolist()]
        first = 3 * len(joints) + len(loads)
        for group in self.kinds.actuators:
            after = first + 3 * len(group.joints)
            result[:, first:after] = group.wanted(times).reshape(len(times), -1)
            first = after
        return result

    @property
    def compiled(self) -> Stepped | None:
        """In compiled form, for one run; None where a method was changed that it stands for."""
        if any(getattr(type(self), name) is not getattr(NodalSystem, name) for name in _STEPPED):
            return None
        from erls.equations.nodal.compiled import stepped  # here: it imports the compiler

        return stepped(self)

    def _sample(self, t: float) -> None:
        """Into working memory."""
        if self._sampled != t:
            sample = self.samples(np.array([t], dtype=float))[0]
            self._sampled, self.flat.scratch[: len(sample)] = t, sample

    def _state(self, q: Nodes, v: Array, a: Array) -> Work:
        """The configuration and the motion in memory."""
        work = self._work
        work.poses[:], work.bent[:], work.turned[:], work.wound[:] = rows_of(q.poses), q.bent, q.turned, q.wound
        work.v[:], work.a[:], work.increment[:] = v, a, 0.0
        return work

    def _evaluated(self, t: float, q: Nodes, v: Array, a: Array, multipliers: Array | None) -> Work:
        """With all forces."""
        work = self._state(q, v, a)
        work.multipliers[:] = 0.0 if multipliers is None else multipliers
        self._sample(t)
        self._functions.forces(*self._memory, numbers_of(q))
        return work

    def _weighted(self, work: Work, kind: int, weights: tuple[float, float, float]) -> Array:
        """(E, 12, 12) mass, damping or stiffness in the coordinates of the system."""
        if self.local:
            return work.blocks[:, kind]
        self._functions.weighted(*self._memory, *weights)
        return work.whole

    def _conditions(self, t: float, q: Nodes) -> tuple[Array, ...]:
        """Φ, gradients (m, 12) and Φ_t."""
        known_t, known_q, known = self._tied
        if known_t == t and known_q is q:
            return known
        work = self._state(q, np.zeros(self.size), np.zeros(self.size))
        self._sample(t)
        self._functions.conditions(*self._memory)
        found = work.violation.copy(), work.gradient.copy(), work.drift.copy()
        self._tied = t, q, found
        return found

    def _turning(self, q: Nodes) -> Matrix:
        """(n, n) E."""
        turns = np.zeros((self.count, 6, 6))
        turns[:, :3, :3] = np.swapaxes(q.poses[:, :3, :3], 1, 2)
        turns[:, 3:, 3:] = np.eye(3)
        return self._nodes.matrix([turns])
