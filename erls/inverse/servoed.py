"""A tree of links whose unknown drives hold servo conditions: its internal dynamics, and the efforts that it takes.

With the conditions h(q) = y_d held, as many joint coordinates s as there are unknown drives follow from the others z,
which are the elastic coordinates and the joints that nothing drives:

    h(s, z) = y_d,    C q̇ = ẏ_d,    C q̈ + bias = ÿ_d,    R(t, q, q̇, q̈) = A u

with R the forces out of balance and u the efforts. All three levels of the conditions hold at every state, so that no
spurious alternating motion can arise as it does where they are held by their position alone. Places and rates follow
from z and ż at once; accelerations and efforts are left to whoever solves, with `missing` and its derivatives, those of
R by `erls.equations.tangents`, those of the kinematics by differences.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import NamedTuple

import numpy as np

from erls.equations.serial.equilibrium import elastic_on_diagonal, size_of
from erls.equations.serial.formulation import SerialFormulation
from erls.equations.series import residual_series
from erls.equations.system import metre_scales
from erls.equations.tangents import Evaluation, Knots, Tangents, steps_of
from erls.errors import Cause, SimulationError
from erls.inverse.closing import Closing, following
from erls.inverse.conditions import Conditions, Demand, Held, Joints
from erls.inverse.frames import PointMotion, point_motions
from erls.maths.so3 import Array
from fe_import.model import IntArray

_ITERATIONS = 40
_LARGEST = 0.3  # rad, and of the size of a link: a change of joint coordinates in one iteration
_SETTLED = 1e-8  # of the same: a change after which the next one is below rounding
_SINGULAR = 1e-7  # of the largest singular value of ∂h/∂s: no joint coordinate follows
_REACHED = 1e-6  # of the size of a link: gap that a search for the nearest place may leave
_STEEP = 0.1  # of the largest metres per unit of a coordinate, the smallest that count
_SEARCH = 200  # iterations of that search


class States(NamedTuple):
    """The mechanism at k times, conditions held.

    Attributes
    ----------
    y, v, a : (k, n) arrays
        Independent coordinates and their derivatives.
    efforts : (k, r) array
        Of the unknown drives [N m or N], then multipliers of loops.
    """

    y: Array
    v: Array
    a: Array
    efforts: Array


class Derivatives(NamedTuple):
    """Of n forces and p accelerations at k states, conditions held up to rates.

    Attributes
    ----------
    places, rates : (k, n + p, m) arrays
        By internal coordinates and their rates.
    accelerations : (k, n + p, n) array
        By all accelerations.
    efforts : (k, n + p, r) array
    """

    places: Array
    rates: Array
    accelerations: Array
    efforts: Array


class Servoed:
    """A tree with conditions.

    Parameters
    ----------
    tree : SerialFormulation
        Of a mechanism with the points of the conditions (`erls.inverse.frames.with_ends`), its unknown drives at rest.
    conditions : Conditions
    drives : (r,) int array
        Joints that they drive; as many as there are conditions.
    closing : Closing or None
        Loops, whose conditions and forces stand behind those of the demand and of the drives.
    """

    def __init__(
        self, tree: SerialFormulation, conditions: Conditions, drives: IntArray, closing: Closing | None = None
    ) -> None:
        self.tree, self.conditions = tree, conditions
        self.system = tree.compiled
        self.closing, self.driven = closing, np.searchsorted(tree.free_joints, drives)
        self.size = size_of(tree.mechanism) or 1.0
        joints = len(tree.free_joints)
        turns = np.array([tree.mechanism.joints[k].freedom.turns for k in tree.free_joints.tolist()], dtype=bool)
        least = _STEEP * float(self.metres.max(initial=0.0))
        elastic = self.size / np.maximum(self.metres[joints:], least)
        units = np.concatenate([np.where(turns, 1.0, self.size), elastic])
        self.dependent = self.driven if closing is None else self._following(joints, units)
        self.internal = np.setdiff1d(np.arange(tree.size), self.dependent)
        self._units = units[self.dependent]

    def _following(self, joints: int, units: Array) -> IntArray:
        """Driven joints, then others, then elastic coordinates where joints do not close the loops.

        Raises
        ------
        SimulationError
            SINGULAR_SERVO: conditions depend on each other at the start.
        """
        y = self.beginning[None]
        rows = self.held(self.conditions.demand(np.zeros(1)), y, np.zeros_like(y)).rows[0] * units
        rest = np.setdiff1d(np.arange(joints), self.driven)
        found = following(rows, (self.driven, rest, np.arange(joints, self.tree.size)))
        if len(found) < len(rows):
            raise SimulationError(
                Cause.SINGULAR_SERVO,
                f"{self._names} cannot all be held: loops leave some of them no motion of their own",
                where="the start",
                remedy="demand as many independent motions as the loops leave, or start from another position",
            )
        return found

    @cached_property
    def beginning(self) -> Array:
        """(n,) undeformed links where the scene starts, loops closed."""
        return self.tree.undeformed_start()[0] if self.closing is None else self.closing.chain.start.y

    @property
    def _names(self) -> str:
        return ", ".join(each.name for each in self.conditions.every)

    @property
    def count(self) -> int:
        """Internal coordinates m."""
        return len(self.internal)

    @cached_property
    def metres(self) -> Array:
        """(n,) per unit of each coordinate."""
        return metre_scales(self.tree)

    @cached_property
    def steps(self) -> Array:
        return steps_of(self.metres, self.size, elastic_on_diagonal(self.tree)[0])

    def joints(self, t: Array, y: Array, v: Array) -> Joints:
        """Joint coordinates at k states."""
        tree = self.tree
        free, other = tree.free_joints, tree.prescribed_joints
        angles, rates, accelerations = np.zeros((3, len(t), tree.joints))
        angles[:, free], rates[:, free] = y[:, : len(free)], v[:, : len(free)]
        for k in other.tolist():
            motion = tree.mechanism.joints[k].drive.motion
            assert motion is not None
            found = np.array([motion.derivatives(at) for at in t.tolist()])
            angles[:, k], rates[:, k], accelerations[:, k] = found.T
        return Joints(angles, rates, accelerations, np.eye(tree.joints, tree.size)[np.argsort(np.r_[free, other])])

    def points(self, t: Array, y: Array, v: Array) -> PointMotion:
        """Those of the conditions at k states."""
        prescribed = len(self.tree.prescribed_joints)
        return point_motions(self.system, len(self.conditions.points), prescribed, t, y, v)

    def held(self, demand: Demand, y: Array, v: Array) -> Held:
        """Conditions at k states."""
        found = self.conditions.held(demand, self.points(demand.t, y, v), self.joints(demand.t, y, v))
        if self.closing is None:
            return found
        loops = self.closing.held(demand.t, y, v)
        gap, rate, bias, rows = (np.concatenate(pair, axis=1) for pair in zip(found[:4], loops, strict=True))
        return Held(gap, rate, bias, rows, found.metres)

    def settled(self, demand: Demand, y: Array) -> Array:
        """(k, n) places near ``y`` at which the conditions hold, its internal coordinates as they are.

        Raises
        ------
        SimulationError
            OUT_OF_REACH, SINGULAR_SERVO: says when.
        """
        y, still = y.copy(), np.zeros_like(y)
        for _ in range(_ITERATIONS):
            held = self.held(demand, y, still)
            rows = held.rows[:, :, self.dependent]
            self._refuse_singular(demand, y, rows)
            change = np.linalg.solve(rows, held.gap[..., None])[..., 0]
            far = np.abs(change / self._units).max(axis=1)
            y[:, self.dependent] -= change * np.minimum(1.0, _LARGEST / np.maximum(far, _LARGEST))[:, None]
            if not far.max(initial=0.0) > _SETTLED:
                return y
        self._fail(demand, y, int(np.nanargmax(far)))
        raise AssertionError

    def _refuse_singular(self, demand: Demand, y: Array, rows: Array) -> None:
        values = np.linalg.svd(np.nan_to_num(rows * self._units), compute_uv=False)
        flat = values[:, -1] <= _SINGULAR * np.maximum(values[:, 0], np.finfo(float).tiny)
        if flat.any():
            self._fail(demand, y, int(np.flatnonzero(flat)[0]))

    def _fail(self, demand: Demand, y: Array, k: int) -> None:
        """Say why the conditions cannot be held at a time: nothing gets there, or joint coordinates do not follow."""
        one, place = demand.part(slice(k, k + 1)), np.nan_to_num(y[k : k + 1])
        nearest = self._nearest(one, place)
        names = self._names if self.closing is None else f"{self._names} (loops {self.closing.names})"
        where = f"t = {float(demand.t[k]):.6g} s"
        if nearest > _REACHED * self.size:
            raise SimulationError(
                Cause.OUT_OF_REACH,
                f"what is demanded of {names} is out of reach",
                where=where,
                value=f"{nearest:.3g} away at the nearest",
                remedy="move the demanded place, or start from joint coordinates on the other side (joints.initial)",
            )
        raise SimulationError(
            Cause.SINGULAR_SERVO,
            f"{names} cannot be moved by the unknown drives in some direction: a singular position",
            where=where,
            remedy="keep away from stretched and folded positions, or name other drives (inverse.drives)",
        )

    def _nearest(self, demand: Demand, y: Array) -> float:
        """How far the conditions are from being held, at the least, near a place (1, n): Levenberg and Marquardt."""
        y, still, mu = y.copy(), np.zeros_like(y), 1e-3

        def look(at: Array) -> tuple[Array, Array]:
            held = self.held(demand, at, still)
            return held.gap[0], held.rows[0][:, self.dependent] * self._units

        gap, rows = look(y)
        for _ in range(_SEARCH):
            step = np.linalg.solve(rows.T @ rows + mu * np.eye(rows.shape[1]), rows.T @ gap)
            other = y.copy()
            other[0, self.dependent] -= step * self._units
            found = look(other)
            if np.linalg.norm(found[0]) < np.linalg.norm(gap):
                y, (gap, rows), mu = other, found, mu / 4
            else:
                mu *= 4
            if mu > 1e12 or np.abs(step).max() < 1e-12:
                break
        return float(np.linalg.norm(gap))

    def at(self, demand: Demand, y: Array, w: Array, accelerations: Array, efforts: Array) -> States:
        """States at which conditions hold, up to their accelerations.

        Parameters
        ----------
        demand : Demand
        y : (k, n) array
            Places, joint coordinates next to those that are looked for.
        w : (k, m) array
            Rates of internal coordinates.
        accelerations, efforts : (k, n), (k, r) arrays

        Raises
        ------
        SimulationError
            As `settled`.
        """
        y = self.settled(demand, y)
        held = self.held(demand, y, np.zeros_like(y))
        rows, v = held.rows, np.zeros_like(y)
        v[:, self.internal] = w
        missing = held.rate + np.einsum("kpm,km->kp", rows[:, :, self.internal], w)
        v[:, self.dependent] = -np.linalg.solve(rows[:, :, self.dependent], missing[..., None])[..., 0]
        return States(y, v, accelerations, efforts)

    def missing(self, demand: Demand, states: States) -> Array:
        """(k, n + p) forces out of balance, and what accelerations lack of those that are demanded."""
        y, v, a, efforts = states
        p = len(self.driven)
        if self.closing is None:
            forces = residual_series(self.system, demand.t, y, v, a)
        else:
            forces = self.closing.forces(demand.t, y, v, a, efforts[:, p:])
        forces[:, self.driven] -= efforts[:, :p]
        held = self.held(demand, y, v)
        return np.hstack([forces, held.bias + np.einsum("kpn,kn->kp", held.rows, a)])

    def tangents(self, demand: Demand, states: States) -> Derivatives:
        """Of `missing`, conditions held up to rates."""
        own = self.plain_tangents(demand.t, states)
        rows = self.held(demand, states.y, states.v).rows
        by_place, last_by_place, last_by_rate = self._kinematics(demand, states)
        s, z, m, p = self.dependent, self.internal, self.count, len(self.dependent)
        places, rates, later = np.zeros((3, len(rows), self.tree.size, m))
        places[:, z] = rates[:, z] = np.eye(m)
        across = rows[:, :, s]
        places[:, s] = rates[:, s] = -np.linalg.solve(across, rows[:, :, z])
        later[:, s] = -np.linalg.solve(across, by_place @ places)
        forces = own.stiffness @ places + own.damping @ later, own.damping @ rates, own.mass
        last = last_by_place @ places + last_by_rate @ later, last_by_rate @ rates, rows
        pushed = np.zeros((len(rows), self.tree.size + p, p))
        driven = len(self.driven)
        pushed[:, self.driven, np.arange(driven)] = -1.0
        pushed[:, : self.tree.size, driven:] = rows[:, driven:].transpose(0, 2, 1)
        by = [np.concatenate(pair, axis=1) for pair in zip(forces, last, strict=True)]
        return Derivatives(by[0], by[1], by[2], pushed)

    def plain_tangents(self, t: Array, states: States) -> Tangents:
        """Of the forces at times (k,), efforts and multipliers as they are."""
        y, v, a, efforts = states
        if self.closing is None:
            return Evaluation(self.steps).tangents(self.system, Knots(t, y, v, a))
        return self.closing.tangents(Knots(t, y, v, a), efforts[:, len(self.driven) :], self.steps)

    def _kinematics(self, demand: Demand, states: States) -> tuple[Array, Array, Array]:
        """(k, p, n) derivatives of ḣ by q, and of ḧ by q and by q̇."""
        y, v, a, _ = states

        def look(y: Array, v: Array) -> Array:
            held = self.held(demand, y, v)
            return np.stack([held.rate, held.bias + np.einsum("kpn,kn->kp", held.rows, a)])

        def slope(moved: Callable[[Array], Array]) -> Array:
            found = np.empty((2, len(y), len(self.dependent), y.shape[1]))
            for j, step in enumerate(self.steps.tolist()):
                one = np.zeros(y.shape[1])
                one[j] = step
                found[..., j] = (moved(one) - moved(-one)) / (2 * step)
            return found

        by_place, by_rate = slope(lambda x: look(y + x, v)), slope(lambda x: look(y, v + x))
        return by_place[0], by_place[1], by_rate[1]


def followed(servoed: Servoed, conditions: Conditions, t: Array) -> Array:
    """(k, n) places at which the conditions hold at times (k,), each next to the one before; the first one next to the
    start of the scene.

    Raises
    ------
    SimulationError
        OUT_OF_REACH, SINGULAR_SERVO: says when.
    """
    demand = conditions.demand(t)
    y = servoed.beginning[None]
    result = np.empty((len(t), y.shape[1]))
    for k in range(len(t)):
        one = demand.part(slice(k, k + 1))
        y = servoed.settled(one, y)
        result[k] = y[0]
        if k + 1 < len(t):
            rates = servoed.at(one, y, np.zeros((1, servoed.count)), np.zeros_like(y), np.zeros((1, 0))).v
            y = y + (t[k + 1] - t[k]) * rates
    return result
