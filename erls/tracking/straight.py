"""The straight way in joint space that a planned motion goes, q(s) = q₀ + s Δq of the planned joints, loops closed.

Everything else of rigid links follows from the planned joints where loops hold it, so that their efforts are those of
one coordinate,

    u = m(s) s̈ + c(s) ṡ² + d(s) ṡ + g(s)

(J. E. Bobrow, S. Dubowsky, J. S. Gibson, Int. J. Robot. Res. 4:3 (1985) 3-17), tabulated along the way. Small motions
of flexible links beside its end, planned joints held and loops closed, have the coordinates that both leave.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy.linalg as la

from erls.errors import Cause, SimulationError
from erls.inverse.conditions import Condition, Conditions, Demand, Together
from erls.inverse.internal import without_internal
from erls.inverse.problem import of_rigid_links, servoed_of, with_drives
from erls.inverse.servoed import Servoed, States
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.curves import piecewise
from erls.mechanism.drives import Drive
from erls.mechanism.without_effects import with_rigid
from erls.scene.chain import Scene
from fe_import.model import IntArray

_KNOTS = 201  # of the table
_INSTANT = 1e-9  # s for the whole way: what is prescribed besides stays where it starts


@dataclass(frozen=True)
class Straight:
    """The way of a plan.

    Attributes
    ----------
    scene : Scene
    free : Mechanism
        The planned joints at rest without drives.
    conditions : Conditions
        Their coordinates.
    joints : (j,) int array
        Their numbers.
    first, change : (j,) arrays
        Where they start, and by how much they go.
    """

    scene: Scene
    free: Mechanism
    conditions: Conditions
    joints: IntArray
    first: Array
    change: Array

    def demand(self, place: Array, rate: float = 0.0, acceleration: float = 0.0) -> Demand:
        """At shares s (k,) of the way, the same ṡ and s̈ at all."""
        still = np.zeros((len(place), len(self.change)))
        value = self.first + np.outer(place, self.change)
        return Demand(_INSTANT * place, value, still + rate * self.change, still + acceleration * self.change)

    def gone(self, servoed: Servoed, place: Array) -> Array:
        """(k, n) places at rising shares (k,), each next to the one before, what planned joints do not move as it is.

        Raises
        ------
        SimulationError
            NO_PLAN: loops do not close on the way; OUT_OF_REACH, SINGULAR_SERVO where it starts.
        """
        y = servoed.settled(self.demand(np.zeros(1)), servoed.beginning[None])
        found = np.empty((len(place), y.shape[1]))
        for k, share in enumerate(place.tolist()):
            try:
                y = servoed.settled(self.demand(np.array([share])), y)
            except SimulationError as problem:
                raise SimulationError(
                    Cause.NO_PLAN,
                    "loops cannot be held on the straight way between both poses",
                    where=f"{self.scene.path}: plan.joints",
                    value=f"{100 * share:.3g} % of the way",
                    remedy="plan by way of another pose, or leave out what loops move",
                ) from problem
            found[k] = y[0]
        return found


def straight(scene: Scene, mechanism: Mechanism, joints: IntArray, first: Array, change: Array) -> Straight:
    """Of planned joints by their numbers (j,), from (j,) by (j,)."""
    free = with_drives(mechanism, {k: Drive() for k in joints.tolist()})
    units = np.eye(len(mechanism.joints))
    every = tuple(
        Condition(mechanism.joints[k].name, "", Together(units[k]), piecewise([], [at]))
        for k, at in zip(joints.tolist(), first.tolist(), strict=True)
    )
    return Straight(scene, free, Conditions(every, mechanism.points), joints, first, change)


class Beside(NamedTuple):
    """Small motions at a place (n,), of n coordinates.

    Attributes
    ----------
    mass, damping, stiffness : (n, n) arrays
    ways : (n, m) array
        Motions that planned joints and loops leave.
    moves : (n, j) array
        Of rigid links by each planned joint.
    points : (p, 3, n) array
        Motion of points.
    """

    mass: Array
    damping: Array
    stiffness: Array
    ways: Array
    moves: Array
    points: Array


def beside_end(way: Straight) -> Beside:
    """Small motions of the flexible links beside the end of a way.

    Raises
    ------
    SimulationError
        As `Straight.gone`.
    """
    servoed, j = servoed_of(way.scene, way.free, way.conditions, way.joints), len(way.joints)
    y = way.gone(servoed, np.linspace(0.0, 1.0, _KNOTS if servoed.closing is not None else 2))[-1:]
    there, still = way.demand(np.ones(1)), np.zeros_like(y)
    held = servoed.held(there, y, still)
    metres = servoed.metres
    ways = la.null_space(held.rows[0] / metres) / metres[:, None]
    moves = np.zeros((servoed.tree.size, j))
    follows = servoed.dependent
    moves[follows] = np.linalg.solve(held.rows[0][:, follows], np.eye(len(follows), j))
    states = States(y, still, still, np.zeros((1, len(follows))))
    own = servoed.plain_tangents(there.t, states)
    return Beside(own.mass[0], own.damping[0], own.stiffness[0], ways, moves, servoed.points(there.t, y, still).rows[0])


class Table:
    """Efforts of rigid links along a way, loops closed.

    Parameters
    ----------
    way : Straight

    Raises
    ------
    SimulationError
        As `Straight.gone`.
    """

    def __init__(self, way: Straight) -> None:
        from scipy.interpolate import CubicSpline  # here: slow to import

        bare = with_rigid(way.free, {link.name for link in way.free.links})
        servoed, place = of_rigid_links(way.scene, bare, way.conditions, way.joints), np.linspace(0.0, 1.0, _KNOTS)
        y = way.gone(servoed, place)

        def efforts(rate: float, acceleration: float) -> Array:
            return without_internal(servoed, way.demand(place, rate, acceleration), y).efforts[:, : len(way.joints)]

        rest, fore, back = efforts(0.0, 0.0), efforts(1.0, 0.0), efforts(-1.0, 0.0)
        parts = efforts(0.0, 1.0) - rest, (fore + back) / 2 - rest, (fore - back) / 2, rest
        self._parts = CubicSpline(place, np.stack(parts, axis=1))

    def efforts(self, place: Array, rate: Array, acceleration: Array) -> Array:
        """(k, j) by s and its derivatives (k,)."""
        factors = np.stack([acceleration, rate**2, rate, np.ones_like(rate)], axis=1)
        return np.asarray(np.einsum("kp,kpj->kj", factors, self._parts(place)))
