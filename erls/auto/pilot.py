"""How many steps a run takes: from the scene, or from a short run where steps follow a tolerance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from erls.auto.operations import ITERATIONS
from erls.auto.probe import fixed_steps
from erls.equations.registry import formulate
from erls.integrate.choice import integrator, options_of
from erls.integrate.work_limit import work_limit
from erls.mechanism.chain import Mechanism
from erls.scene.chain import Scene

_PILOT = 1 / 40  # of a run with adaptive steps: what is run to count them
_ENOUGH = 3000  # evaluations, from which the rest can be told


def count_steps(scene: Scene, mechanism: Mechanism) -> float:
    """Steps of a run, as steps of generalized-alpha with as many evaluations.

    Raises
    ------
    SimulationError
        The short run failed.
    """
    settings = scene.record.simulation
    steps = fixed_steps(settings)
    if steps is not None:
        return steps
    formulation = formulate(mechanism, settings)
    y, v = formulation.initial_state()
    options = replace(options_of(settings), step=None, output_step=None)
    end = _PILOT * settings.duration
    solution = integrator(mechanism, settings)(formulation, (0.0, end), y, v, options, work_limit(_ENOUGH))
    if solution.failure is not None:
        raise solution.failure
    reached = float(solution.t[-1])
    late = np.count_nonzero(solution.t > reached / 2) / max(len(solution.t), 1)  # without its first, small steps
    return 2 * late * solution.work.rhs_calls / ITERATIONS * settings.duration / max(reached, 1e-300)
