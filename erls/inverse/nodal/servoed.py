"""Nodal elements whose unknown drives hold servo conditions: forces, conditions and their derivatives at many states.

    R(t, q, v, v̇) + Bᵀ λ = Aᵀ u,    Φ(t, q) = 0,    h(q) = y_d

with A the rates of the driven joints over the twists of the nodes. B and the rows C of h need not be those of A: drives
hold a point through links that bend.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from erls.equations.nodal.equations import Nodal
from erls.equations.nodal.joints import GROUND
from erls.equations.nodal.nodes import Nodes
from erls.equations.serial.equilibrium import size_of
from erls.equations.system import metre_scales
from erls.errors import Cause, SimulationError
from erls.inverse.conditions import Conditions, Demand, Joints
from erls.inverse.frames import PointMotion
from erls.maths import motion_maps as motions
from erls.maths.rotation_maps import skews
from erls.maths.saddle import dense
from erls.maths.so3 import Array
from fe_import.model import IntArray

_ITERATIONS = 30
_RESTS = 1e-11  # of the size of the mechanism: the last correction of an equilibrium


class Held(NamedTuple):
    """Conditions at k states.

    Attributes
    ----------
    gap : (k, p) array
        h - y_d.
    rows : (k, p, n) array
        C, over increments of the nodes.
    driven : (k, p, n) array
        A.
    """

    gap: Array
    rows: Array
    driven: Array


class Balance(NamedTuple):
    """What is out of balance at k states.

    Attributes
    ----------
    force : (k, n) array
        R + Bᵀ λ - Aᵀ u.
    open : (k, m + p) array
        Φ, then h - y_d.
    rows : (k, m + p, n) array
        B, then C.
    pushed : (k, n, m + p) array
        Bᵀ, then -Aᵀ.
    """

    force: Array
    open: Array
    rows: Array
    pushed: Array


class Blocks(NamedTuple):
    """Derivatives of R + Bᵀ λ at k states, (k, P, 6, 6) each, of nodes by nodes: `NodalServoed.pairs`."""

    mass: Array
    damping: Array
    stiffness: Array


class Rest(NamedTuple):
    """An equilibrium: configuration, multipliers of joints and efforts (m + p,); balance and derivatives there, these
    as matrices (n, n).
    """

    q: Nodes
    held_by: Array
    balance: Balance
    matrices: tuple[Array, Array, Array]


class NodalServoed:
    """Nodal equations of a mechanism with conditions.

    Parameters
    ----------
    nodal : Nodal
        Of a mechanism whose unknown drives do nothing.
    conditions : Conditions
    drives : (p,) int array
        Joints that they drive.
    """

    def __init__(self, nodal: Nodal, conditions: Conditions, drives: IntArray) -> None:
        self.nodal, self.system, self.conditions, self.drives = nodal, nodal.system, conditions, drives
        self.size, self.joints = self.system.size, len(nodal.mechanism.joints)
        self.holding = self.system.constraints + len(drives)
        self.reach = size_of(nodal.mechanism) or 1.0
        places = [nodal.place_of(point.link, point.node) for point in conditions.points]
        count = self.system.count
        still = np.zeros(3)
        self._places = [(k, still) if k < count else self.system.arms[k - count] for k in places]

    @cached_property
    def metres(self) -> Array:
        """(n,) per unit of each increment."""
        return metre_scales(self.system)

    def held(self, demand: Demand, q: Sequence[Nodes]) -> Held:
        """Conditions at as many states."""
        poses, count, n = np.array([each.poses for each in q]), len(q), self.size
        place, rows = np.zeros((count, len(self._places), 3)), np.zeros((count, len(self._places), 3, n))
        for e, (node, arm) in enumerate(self._places):
            turn = poses[:, node, :3, :3]
            place[:, e] = poses[:, node, :3, 3] + turn @ arm
            rows[:, e, :, 6 * node : 6 * node + 3] = turn
            rows[:, e, :, 6 * node + 3 : 6 * node + 6] = -turn @ skews(arm)
        angles, still = np.array([each.turned[: self.joints] for each in q]), np.zeros_like(place)
        turning = self._rates(poses)
        none = np.zeros_like(angles)
        found = self.conditions.held(
            demand, PointMotion(place, still, still, rows), Joints(angles, none, none, turning)
        )
        return Held(found.gap, found.rows, turning[:, self.drives])

    def _rates(self, poses: Array) -> Array:
        """(k, j, n) rates of joint coordinates over twists of the nodes, at poses (k, N, 4, 4)."""
        found = np.zeros((len(poses), self.joints, self.size))
        pairs = zip(self.nodal.mechanism.joints, self.nodal.chain.seats, strict=True)
        for k, (joint, seat) in enumerate(pairs):
            along, outer = 5 if joint.freedom.turns else 2, 6 * seat.outer
            found[:, k, outer : outer + 6] += motions.adjoint_inverse(seat.outer_frame)[along]
            if seat.inner != GROUND:
                frame = motions.inverse(poses[:, seat.inner]) @ poses[:, seat.outer] @ seat.outer_frame
                found[:, k, 6 * seat.inner : 6 * seat.inner + 6] -= motions.adjoint_inverse(frame)[:, along]
        return found

    @cached_property
    def pairs(self) -> tuple[IntArray, IntArray]:
        """(P,) nodes, and (P,) those that act on them: themselves, and their neighbours by elements and joints."""
        own, every = self.system.model.pairs, np.arange(self.system.count)
        own = own[(own >= 0).all(axis=1)]
        found = np.unique(np.concatenate([own, own[:, ::-1], np.column_stack([every, every])]), axis=0)
        return found[:, 0], found[:, 1]

    def balance(self, demand: Demand, q: Sequence[Nodes], motion: tuple[Array, Array], holding: Array) -> Balance:
        """At as many states with twists and their rates (k, n), multipliers and efforts (k, m + p)."""
        held, system, m = self.held(demand, q), self.system, self.system.constraints
        count, n = len(q), self.size
        force, open_ = np.empty((count, n)), np.hstack([np.empty((count, m)), held.gap])
        rows = np.concatenate([np.empty((count, m, n)), held.rows], axis=1)
        for k, (t, v, a) in enumerate(zip(demand.t.tolist(), *motion, strict=True)):
            force[k] = system.residual(t, q[k], v, a)
            open_[k, :m], rows[k, :m] = system.constraint(t, q[k]), dense(system.constraint_matrix(t, q[k]))
        pushed = np.concatenate([rows[:, :m], -held.driven], axis=1).transpose(0, 2, 1)
        force += (pushed @ holding[..., None])[..., 0]
        return Balance(force, open_, rows, pushed)

    def blocks(self, demand: Demand, q: Sequence[Nodes], motion: tuple[Array, Array], holding: Array) -> Blocks:
        """Derivatives at the states of `balance`."""
        system, (on, by), m = self.system, self.pairs, self.system.constraints
        found = Blocks(*np.empty((3, len(q), len(on), 6, 6)))
        for k, (t, v, a) in enumerate(zip(demand.t.tolist(), *motion, strict=True)):
            stiffness, damping = system.stiffness_and_damping(t, q[k], v, a, holding[k, :m])
            for blocks, matrix in zip(found, (system.mass_matrix(t, q[k]), damping, stiffness), strict=True):
                blocks[k] = dense(matrix).reshape(system.count, 6, system.count, 6)[on, :, by]
        return found

    def whole(self, blocks: Array) -> Array:
        """(n, n) matrix of blocks (P, 6, 6)."""
        on, by = self.pairs
        found = np.zeros((self.system.count, 6, self.system.count, 6))
        found[on, :, by] = blocks
        return found.reshape(self.size, self.size)

    def rest(self, demand: Demand, near: Nodes) -> Rest:
        """The equilibrium at one time (1,), next to a configuration.

        Raises
        ------
        SimulationError
            NO_EQUILIBRIUM: says when.
        """
        q, holding, still = near, np.zeros(self.holding), np.zeros((1, self.size))
        for _ in range(_ITERATIONS):
            at = demand, [q], (still, still), holding[None]
            found, matrices = self.balance(*at), tuple(self.whole(part[0]) for part in self.blocks(*at))
            zero = np.zeros((self.holding, self.holding))
            whole = np.block([[matrices[2], found.pushed[0]], [found.rows[0], zero]])
            step = np.linalg.solve(whole, -np.concatenate([found.force[0], found.open[0]]))
            q, holding = self.system.compose(q, step[: self.size]), holding + step[self.size :]
            far = float(np.abs(step[: self.size] * self.metres).max())
            if far <= _RESTS * self.reach:
                return Rest(q, holding, found, (matrices[0], matrices[1], matrices[2]))
            if not np.isfinite(far):
                break
        raise SimulationError(
            Cause.NO_EQUILIBRIUM,
            "nodal elements find no rest where they are demanded to be",
            where=f"t = {float(demand.t[0]):.6g} s",
            value=f"change {far:.3g} m",
            limit=f"{_ITERATIONS} iterations",
            remedy="invert in modes (simulation.formulation = 'erls'), or demand places at which links bend less",
        )
