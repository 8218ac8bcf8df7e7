"""What runs, and looks at them, cost: by counting, so that no decision depends on a clock.

Times are those of one machine of 2024 for the operations of `erls.equations.erls`, and of NumPy where a formulation has
no compiled form; only their ratios matter.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from erls.auto.forced import KNOTS
from erls.auto.outputs import driven_joints, reacting
from erls.auto.probe import fixed_steps
from erls.equations.erls.chain import Erls
from erls.equations.formulation import Formulation
from erls.equations.registry import formulate
from erls.equations.substructures import solved
from erls.integrate.base import Options
from erls.integrate.choice import integrator
from erls.mechanism.chain import Mechanism, poses
from erls.mechanism.effects import FIRST, SECOND
from erls.scene.chain import Scene

ITERATIONS, CALM = 2.3, 1.1  # of generalized-alpha, per step; without vibrations and free joints
_COARSE = 6.0  # the same in large steps
_PILOT = 1 / 40  # of a run with adaptive steps: what is run to count them
_LINK, _MASS, _X, _Z = 1.5e-7, 4e-10, 6e-10, 8e-10  # s: per link; per entry of each matrix in use
_SOLVE, _FACTOR, _REFRESH = 1.2e-9, 4e-10, 0.05  # s per entry, s per entry and column; share of steps with new factors
_LINKED_FACTOR, _LINKED_SOLVE = 0.6, 0.15  # of an evaluation
_LINKED = 2.5e-9  # s per square of the modes of a link
_STIFFENED = 2.2
_PYTHON, _PYTHON_LINK, _PYTHON_X, _PYTHON_Z = 4e-5, 5e-5, 3e-5, 1e-5
_PYTHON_CURVED, _PYTHON_CURVED_FRAME = 6e-4, 8e-5  # s per link with geometric stiffening: ERLS, floating frames
PREPARE, STATE = 5e-4, 1e-4  # s per link: of equations, of the points of a state
FIXED = 0.05  # s: of files, and of what a run looks at afterwards
FOLLOWING = 0.03  # s per link: of states of links that follow statically, in what a run looks at afterwards
_CALL, _SPECTRUM = 8e-6, 1.5e-7  # s: of an evaluation from Python; of modes, per cube of their number
_LOOK = 2e-3  # s per link: of equations with and without prescribed motions
_EFFORTS, _REACTING = 7e-4, 2e-5  # s per link: of drive forces in a state, in Python and compiled


@dataclass(frozen=True)
class Cost:
    """What a step of equations of motion consists of [s].

    Attributes
    ----------
    links, size : int
        The latter of coordinates.
    evaluation, solution, factors : float
        Of the equations; with the iteration matrix; of that matrix.
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


def cost_of(formulation: Formulation) -> Cost:
    """Cost of a formulation's equations."""
    return _cost(formulation, _is_stiffened(solved(formulation).mechanism))


def stiffened_cost(formulation: Formulation) -> Cost:
    """The same with geometric stiffening, without having to formulate that."""
    return _cost(formulation, True)


def _is_stiffened(mechanism: Mechanism) -> bool:
    return "geometric_stiffening" in mechanism.effects and any(k.second_order is not None for k in mechanism.links)


def _cost(formulation: Formulation, stiffened: bool) -> Cost:
    system = solved(formulation)
    mechanism = system.mechanism
    first = not FIRST.isdisjoint(mechanism.effects)
    second = not SECOND.isdisjoint(mechanism.effects)
    axes = _axes(mechanism)
    size = system.size
    if not size:  # nothing to integrate
        return Cost(len(axes), 0, 0.0, 0.0, 0.0)
    compiled = getattr(system, "compiled", None)
    if compiled is None or (stiffened and mechanism.loops):
        per_link = _PYTHON_LINK + first * _PYTHON_X + second * _PYTHON_Z
        if stiffened:
            per_link += _PYTHON_CURVED if isinstance(getattr(system, "bare", system), Erls) else _PYTHON_CURVED_FRAME
        evaluation = _PYTHON + len(axes) * per_link
        return Cost(len(axes), size, evaluation, _PYTHON / 2, 2 * evaluation)
    evaluation = 0.0
    for link, count in zip(mechanism.links, axes, strict=True):
        entries = (6 + link.elastic_modes) ** 2
        pairs = count * (count + 1) // 2
        evaluation += _LINK + entries * (_MASS + first * count * _X + second * pairs * _Z)
    if stiffened:
        evaluation *= _STIFFENED
    if getattr(compiled, "factoring", None) is not None:  # link by link
        solving = _LINKED_SOLVE * evaluation + _LINKED * sum(link.elastic_modes**2 for link in mechanism.links)
        return Cost(len(axes), size, evaluation, solving, _LINKED_FACTOR * evaluation)
    solving = _SOLVE * size**2
    return Cost(len(axes), size, evaluation, solving, evaluation + _FACTOR * size**3 + solving)


def forced_cost(cost: Cost) -> float:
    """Of the vibrations that prescribed motions set off [s]."""
    return KNOTS * (cost.evaluation + _CALL) + _SPECTRUM * cost.size**3 + _LOOK * cost.links


def effort_cost(formulation: Formulation) -> float:
    """Of the drive forces in a state, per link [s]."""
    if not driven_joints(formulation.mechanism):
        return 0.0
    return _EFFORTS if reacting(formulation) is None else _REACTING


def count_steps(scene: Scene, mechanism: Mechanism) -> float:
    """Steps of a run, as steps of generalized-alpha: from the scene, or from a short run with an adaptive method.

    Raises
    ------
    SimulationError
        That run failed.
    """
    settings = scene.record.simulation
    steps = fixed_steps(settings)
    if steps is not None:
        return steps
    formulation = formulate(mechanism, settings)
    y, v = formulation.initial_state()
    options = Options(None, settings.rtol, settings.atol, settings.spectral_radius, tolerance=settings.tolerance)
    end = _PILOT * settings.duration
    solution = integrator(mechanism, settings)(formulation, (0.0, end), y, v, options, None)
    if solution.failure is not None:
        raise solution.failure
    late = np.count_nonzero(solution.t > end / 2) / max(len(solution.t), 1)  # without its first, small steps
    return 2 * late * solution.work.rhs_calls / ITERATIONS / _PILOT


def _axes(mechanism: Mechanism) -> list[int]:
    """Axes about which each link can turn: 0, 1, or 3 as soon as two joints before it are not parallel."""
    frames = poses(mechanism, np.array([joint.position for joint in mechanism.joints]))
    result: list[int] = []
    seen: list[np.ndarray] = []
    for k, joint in enumerate(mechanism.joints):
        if joint.type.revolute:
            before = frames[k - 1] if k else np.eye(4)
            seen.append((before @ joint.before)[:3, 2])
        parallel = all(math.isclose(abs(float(axis @ seen[0])), 1.0, abs_tol=1e-9) for axis in seen)
        result.append((1 if parallel else 3) if seen else 0)
    return result
