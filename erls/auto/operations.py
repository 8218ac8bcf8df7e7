"""What runs, and deciding about them, cost: floating-point operations, counted from sizes.

No clock and no machine enters, nor how an equation is implemented: the same scene costs as much in every formulation
that solves it, compiled or not, and decisions compare counts with counts. For a link with e elastic modes, m = 6 + e
modes in all, that can turn about r axes (0, 1 or 3) with p = r (r + 1) / 2 pairs of them, an evaluation of the
equations of motion counts

- the products of its matrices with a vector, 2 m² operations each: M a; for effects of first order in the deformation
  X_a q, X_a q̇ and X_aᵀ v for each axis; for those of second order Z_ab q for each pair;
- with geometric stiffening and foreshortening, products of second-order tensors, 2 e² each: six of momentum, three of
  spin for each axis, and six of the interface that carries the next link; with modal inertia three for each mode;
- the motion of the interface that carries the next link with its two derivatives, and its force on the modes, 12 e
  each;
- twist, acceleration and wrench carried from link to link;

all of it twice where modes above a bandwidth follow statically, for their own equations are solved first.

The equations are solved link by link: what hangs on a link acts on the 6 + r numbers of its motion, its modes are
diagonal in coordinates of their own. Loops with c conditions over n coordinates add their rows, and a factorization of
the c conditions, for which the links are solved c times.

Around the equations Python makes calls, for states that are looked at and for equations that are put together. They are
counted too; each weighs `CALL` operations, the one number here that is not counted but agreed on. Decisions bear a
factor of three on it (``tests/erls/test_effects_worth.py``).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from erls.auto.forced import CONFIGURATIONS, KNOTS
from erls.mechanism.chain import Mechanism, poses
from erls.mechanism.effects import FIRST, SECOND
from erls.mechanism.links import Link
from erls.mechanism.substructures import is_split, split

ITERATIONS, CALM = 2.3, 1.1  # of generalized-alpha, per step; without vibrations and free joints
_COARSE = 6.0  # the same in large steps, each with factors of its own
_REFRESH = 0.05  # share of steps with new factors
_CARRIED = 300  # twist, acceleration and wrench, from one link to the next
_EIGEN = 14  # of a symmetric generalized eigenproblem with all vectors, times the cube of its size
CALL = 30_000
STATE, PREPARE = 12, 60  # calls per link: to look at a state; to put equations together
FOLLOWING = 3600  # calls per link: to look at a run of links that follow statically, with every state to be solved for
EFFORT, REACTION = 3, 90  # calls per link: for drive forces, of freed joints; of joints within the mechanism
FIXED = 6000  # calls: for files, and for what a run looks at afterwards


@dataclass(frozen=True)
class Operations:
    """What a step of equations of motion consists of.

    Attributes
    ----------
    links, size : int
        The latter of coordinates.
    evaluation, solution, factors : float
        Operations of the equations, of a solution with the iteration matrix, of its factorization.
    """

    links: int
    size: int
    evaluation: float
    solution: float
    factors: float

    @property
    def iteration(self) -> float:
        """Of Newton's method."""
        return self.evaluation + self.solution

    def step(self, iterations: float) -> float:
        """Of generalized-alpha."""
        return iterations * self.iteration + (_REFRESH if iterations > CALM else 0.0) * self.factors

    @property
    def coarse_step(self) -> float:
        """The same with large steps."""
        return _COARSE * self.iteration + self.factors

    def calls(self, count: float) -> float:
        """Of so many calls for each link."""
        return CALL * count * self.links

    @property
    def forced(self) -> float:
        """Of the vibrations that prescribed motions set off: loads at knots, modes, equations with freed joints."""
        knots = KNOTS * (self.evaluation + CALL)
        return knots + CONFIGURATIONS * _EIGEN * self.size**3 + self.calls(4 * PREPARE)


def operations(mechanism: Mechanism) -> Operations:
    """Of the equations of motion of a mechanism."""
    if is_split(mechanism):
        mechanism = split(mechanism).pieces
    links, axes = mechanism.links, axes_of(mechanism)
    free = sum(not joint.drive.prescribed for joint in mechanism.joints)
    size = free + sum(link.elastic_modes for link in links)
    if not size:  # nothing to integrate
        return Operations(len(links), 0, 0.0, 0.0, 0.0)
    evaluation = sum(_evaluation(mechanism, k, axes[k]) for k in range(len(links)))
    if mechanism.bandwidth is not None and "static_correction" in mechanism.effects:
        evaluation *= 2
    solution = sum(_CARRIED + 4 * e**2 + 4 * (6 + r) * e for e, r in _sizes(links, axes))
    factors: float = sum(2 * (6 + r) ** 3 + (6 + r) ** 2 * e + 2 * r * e**2 for e, r in _sizes(links, axes))
    conditions = 6 * len(mechanism.loops)
    if conditions:
        evaluation += 2 * conditions * size
        factors += conditions * solution + 2 * conditions**3 / 3
        solution += 4 * conditions * size + 2 * conditions**2
    return Operations(len(links), size, evaluation, solution, factors)


def _sizes(links: tuple[Link, ...], axes: list[int]) -> list[tuple[int, int]]:
    return [(link.elastic_modes, r) for link, r in zip(links, axes, strict=True)]


def _evaluation(mechanism: Mechanism, number: int, r: int) -> float:
    """Of the equations of one link that turns about r axes."""
    link, effects = mechanism.links[number], mechanism.effects
    e = link.elastic_modes
    products = 1 + 3 * r * (not FIRST.isdisjoint(effects)) + r * (r + 1) // 2 * (not SECOND.isdisjoint(effects))
    tensors, carries = 0, len(mechanism.standing_on(number))
    if link.second_order is not None and not {"geometric_stiffening", "foreshortening"}.isdisjoint(effects):
        tensors = 6 + 3 * r + 6 * carries + 3 * e * ("modal_inertia" in effects)
    return _CARRIED + 48 * e * carries + 2 * products * (6 + e) ** 2 + 2 * tensors * e**2


def axes_of(mechanism: Mechanism) -> list[int]:
    """Axes about which each link can turn: 0, 1, or 3 as soon as two joints before it are not parallel."""
    frames = poses(mechanism, np.array([joint.position for joint in mechanism.joints]))
    found: list[list[np.ndarray]] = []
    for joint in mechanism.joints:
        below, frame = ([], np.eye(4)) if joint.parent < 0 else (found[joint.parent], frames[joint.parent])
        found.append([*below, (frame @ joint.before)[:3, joint.freedom.axis]] if joint.freedom.turns else below)
    return [_spread(axes) for axes in found]


def _spread(axes: list[np.ndarray]) -> int:
    parallel = all(math.isclose(abs(float(axis @ axes[0])), 1.0, abs_tol=1e-9) for axis in axes)
    return (1 if parallel else 3) if axes else 0
