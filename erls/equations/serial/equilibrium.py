"""Static equilibrium of links that are linear in their own frames, with joints held: along the load, from none to all.

With R(y) the forces out of balance at rest, K₀ the stiffness of the links and y₀ where they lie without force,

    s (R(y) + Φ_yᵀ λ) + (1 - s) K₀ (y - y₀) = 0,    Φ(y) = 0

has the share s of all loads: weight, motion of prescribed joints, what acts in joints that follow, and the stiffness
that these make. Newton's method at s = 1 does where the loads leave the links stiffness at its start and at its end.
Where they do not, s grows step by step, and each step must end with a positive stiffness: that follows the branch on
the side to which the loads bend the links, and finds the share at which they buckle.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple, Protocol

import numpy as np

from erls.equations.formulation import TreeFormulation
from erls.equations.linearization import derivatives, difference_steps, stiffness_left, ways_left
from erls.equations.serial.state_series import state_series
from erls.equations.stability import Bearing, too_soft, unstable
from erls.equations.system import metre_scales
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.thermal import elastic_rest
from fe_import.model import IntArray

_ITERATIONS = 20
_TOLERANCE = 1e-10  # of the deflection; one more step of quadratic convergence would reach rounding
_ROUNDING = 1e-13  # of the size of a link
_FIRST_STEP, _SMALLEST_STEP = 0.125, 1e-3  # of the load; the second of the share that is borne
_STEP_CHANGE = 2.0
_BUCKLED = 0.5  # of the stiffness, left where a path ends: it ends for lack of stiffness, else for large deflections
_UNHELD = 1e-12  # of the stiffness of a mode: given to ways that bend no link


class Forces(Protocol):
    """(k, n) forces out of balance at places (k, n), with those of multipliers (r,)."""

    def __call__(self, many: Array, multipliers: Array) -> Array:
        """R + Φ_yᵀ λ."""


@dataclass(frozen=True)
class Held:
    """A mechanism at rest with its joints held.

    Attributes
    ----------
    mechanism : Mechanism
    forces : Forces
    conditions : callable
        Φ (m,) and its rows (m, n) at a place (n,), none of them following from others: r conditions of loops, then
        those that hold joints, whose rows hardly change.
    loops : int
        r.
    stiffness, rest : (n,) arrays
        K₀, 0 for joints, and y₀.
    metres : (n,) array
        Per unit of each coordinate.
    size : float
        Of a link [m]: deflections must stay below.
    what : str
        For messages.
    """

    mechanism: Mechanism
    forces: Forces
    conditions: Callable[[Array], tuple[Array, Array]]
    loops: int
    stiffness: Array
    rest: Array
    metres: Array
    size: float
    what: str = "no static equilibrium"

    @property
    def elastic(self) -> Array:
        """(n,) which coordinates are elastic."""
        return np.asarray(self.stiffness > 0)


class _Found(NamedTuple):
    """Where Newton's method came to: place (n,), multipliers (r,), tangents (n, n) of the first and of the last step,
    the last deflection [m], and whether forces balance.
    """

    y: Array
    multipliers: Array
    first: Array
    last: Array
    deflection: float
    balanced: bool


def equilibrium(held: Held, y: Array) -> tuple[Array, Bearing]:
    """Elastic coordinates in equilibrium while every joint that is held keeps its angle, and what loads leave of the
    stiffness.

    Parameters
    ----------
    held : Held
    y : (n,) array
        Coordinates with the joints in place and the links undeformed.

    Raises
    ------
    SimulationError
        UNSTABLE_START: links buckle under their loads, and the mechanism does not allow it; names the link.
        NO_EQUILIBRIUM: the links are too soft for small displacements to carry the load.
    """
    whole = _balance(held, 1.0, y, np.zeros(held.loops))
    bearing, before = _bearing(held, whole.y, whole.last), _bearing(held, y, whole.first)
    if whole.balanced and (bearing.sound and before.sound):
        return whole.y, bearing
    path = _along_the_load(held, y)
    if path.share == 1.0:
        return path.y, path.bearing
    if whole.balanced and held.mechanism.allow_unstable:
        return whole.y, bearing
    if path.bearing.left < _BUCKLED:
        raise unstable(path.bearing.link, path.share, whole.balanced)
    raise too_soft(held.what, whole.deflection, held.size)


class _Path(NamedTuple):
    """The end of a path: place (n,), what loads leave there, share of the loads."""

    y: Array
    bearing: Bearing
    share: float


def _along_the_load(held: Held, y: Array) -> _Path:
    """The stable branch from no load to all of it, as far as it goes."""
    step, multipliers = _FIRST_STEP, np.zeros(held.loops)
    path = _Path(y, Bearing(1.0, ""), 0.0)
    while path.share < 1.0 and step > _SMALLEST_STEP * max(path.share, _SMALLEST_STEP):
        target = min(path.share + step, 1.0)
        found = _balance(held, target, path.y, multipliers)
        bearing = _bearing(held, found.y, found.last) if found.balanced else path.bearing
        if found.balanced and bearing.sound:
            path, multipliers, step = _Path(found.y, bearing, target), found.multipliers, _STEP_CHANGE * step
        else:
            step = (target - path.share) / _STEP_CHANGE
    return path


def _balance(held: Held, share: float, y: Array, multipliers: Array) -> _Found:
    """Newton's method under a share of the loads."""
    steps = difference_steps(held.metres, held.size, held.stiffness)
    first: Array | None = None
    deflection = 0.0
    slope = np.zeros((len(y), len(y)))
    for _ in range(_ITERATIONS):
        conditions, rows = held.conditions(y)
        slope = share * derivatives(partial(held.forces, multipliers=multipliers), y, steps)
        slope[np.diag_indices(len(y))] += (1 - share) * held.stiffness
        first = slope if first is None else first
        force = share * held.forces(y[None], np.zeros(held.loops))[0] + (1 - share) * held.stiffness * (y - held.rest)
        block = np.block([[slope, rows.T], [rows, np.zeros((len(rows),) * 2)]])
        try:
            with np.errstate(over="ignore", invalid="ignore"):  # of a step too far, which is found
                solved = np.linalg.solve(block, -np.concatenate([force, conditions]))
        except np.linalg.LinAlgError:
            break
        update = solved[: len(y)]
        y, multipliers = y + update, solved[len(y) : len(y) + held.loops] / share
        deflection = float(np.abs(held.metres * y)[held.elastic].max(initial=0.0))
        if not deflection < held.size:
            break
        moved = float(np.abs(held.metres * update).max(initial=0.0))
        if moved <= max(_TOLERANCE * deflection, _ROUNDING * held.size):
            return _Found(y, multipliers, first, slope, deflection, True)
    return _Found(y, multipliers, slope if first is None else first, slope, deflection, False)


def _bearing(held: Held, y: Array, slope: Array) -> Bearing:
    """What loads leave of the stiffness at a place with this tangent, on the ways that conditions leave."""
    elastic = held.elastic
    if not elastic.any() or not np.isfinite(slope).all():
        return Bearing(1.0 if np.isfinite(slope).all() else -np.inf, "")
    scales = 1 / held.metres
    scales[elastic] = 1 / np.sqrt(held.stiffness[elastic])
    ways = ways_left(held.conditions(y)[1], scales)
    if not ways.shape[1]:
        return Bearing(1.0, "")
    unloaded = ways.T @ (held.stiffness[:, None] * ways)
    unloaded[np.diag_indices(len(unloaded))] += _UNHELD
    left, shape = stiffness_left(ways.T @ slope @ ways, unloaded)
    energy = held.stiffness * (ways @ shape) ** 2
    links = held.mechanism.links
    ends = np.cumsum([link.elastic_modes for link in links])
    by_link = [float(part.sum()) for part in np.split(energy[elastic], ends[:-1])]
    return Bearing(left, links[int(np.argmax(by_link))].name)


def held_tree(equations: TreeFormulation, y: Array, held_joints: IntArray) -> Held:
    """A tree at rest under gravity, and what prescribed motions do at time 0.

    Parameters
    ----------
    equations : TreeFormulation
    y : (n,) array
        Independent coordinates with the joints in place and the links undeformed; joint coordinates first.
    held_joints : int array
        Joints whose coordinates stand in ``y``.
    """
    metres, size = metre_scales(equations), size_of(equations.mechanism)
    angles = Angles(equations, held_joints, y, metres, size)
    still = np.zeros(len(y))

    def forces(many: Array, multipliers: Array) -> Array:
        return np.array([equations.residual(0.0, at, still, still) for at in many]).reshape(many.shape)

    stiffness, rest = elastic_on_diagonal(equations)
    return Held(equations.mechanism, forces, angles.conditions, 0, stiffness, rest, metres, size)


def elastic_on_diagonal(equations: TreeFormulation) -> tuple[Array, Array]:
    """(n,) stiffness of the elastic coordinates, 0 for joints, and where they lie without force."""
    links, joints = equations.mechanism.links, len(equations.free_joints)
    stiffness = np.concatenate([np.zeros(joints), *(link.stiffness for link in links)])
    return stiffness, np.concatenate([np.zeros(joints), *(elastic_rest(link) for link in links)])


def size_of(mechanism: Mechanism) -> float:
    """Size of the largest link [m]."""
    return max(link.size for link in mechanism.links)


class Angles:
    """Physical angles of joints that are held where they are.

    Parameters
    ----------
    equations : TreeFormulation
    joints : int array
        By their numbers.
    y : (n,) array
        Where they are.
    metres : (n,) array
    size : float
    """

    def __init__(self, equations: TreeFormulation, joints: IntArray, y: Array, metres: Array, size: float) -> None:
        self._equations, self._joints = equations, joints
        self._steps = difference_steps(metres, size, np.zeros(len(y)))
        self._held = self._at(y[None])[0]

    def _at(self, many: Array) -> Array:
        if not len(self._joints):
            return np.zeros((len(many), 0))
        found = state_series(self._equations, np.zeros(len(many)), many, np.zeros_like(many))
        return found.angles[:, self._joints]

    def conditions(self, y: Array) -> tuple[Array, Array]:
        """How far they are from there, and their derivatives (m, n): constant where angles are coordinates."""
        return self._at(y[None])[0] - self._held, derivatives(self._at, y, self._steps)
