"""Final designs simulated again in full: at every step, and by the other formulations with fine elements beside."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import msgspec
import numpy as np

from erls.errors import SimulationError
from erls.maths.so3 import Array
from erls.optimization.design import scene_at
from erls.optimization.dynamics import Dynamics
from erls.optimization.equivalent_loads import flexible
from erls.optimization.memory import Memory
from erls.optimization.pictures import drawn
from erls.optimization.problem import Problem
from erls.optimization.result import Confirmed
from erls.simulation.simulate import simulate
from fe_import.errors import ReportedError

_MOST_STEPS = 20_000  # that are looked at; of more some, and the name says so
_FINE = 4  # elements in each member


def confirmed(dynamics: Dynamics, x: Array, tell: Callable[[str], None]) -> tuple[Confirmed, ...]:
    """The design as the scene says, and by ERLS, FFR and nodal elements, fine ones, where links are made of beams."""
    problem = dynamics.problem
    result = [simulated(problem, x, tell)]
    if not flexible(problem.scene):
        return tuple(result)
    for formulation in ("erls", "ffr", "nodal"):
        changes = [f'simulation.formulation="{formulation}"', 'simulation.inertia_interpolation="helicoidal"']
        fine, name = formulation == "nodal", formulation
        if fine:
            changes.append(f"simulation.elements_per_member={_FINE}")
            name = f"nodal, {_FINE} elements per member"
        changes.append(f"simulation.residual_bending_flexibility={str(fine).lower()}")
        result.append(_one(problem, x, changes, name, tell))
    return tuple(result)


def simulated(problem: Problem, x: Array, tell: Callable[[str], None]) -> Confirmed:
    """A design as the scene says."""
    return _one(problem, x, (), problem.scene.record.simulation.formulation, tell)


def _one(
    problem: Problem, x: Array, changes: Sequence[str], name: str, tell: Callable[[str], None]
) -> Confirmed:
    """Constraints over all steps; a formulation that refuses the scene says why."""
    try:
        return _looked(problem, x, changes, name, tell)
    except SimulationError as problem_found:
        if not changes or problem_found.exit_code == 130:
            raise
        return Confirmed(name, failure=problem_found.message)
    except ReportedError as refusal:
        if not changes:
            raise
        return Confirmed(name, failure=refusal.message)


def _looked(
    problem: Problem, x: Array, changes: Sequence[str], name: str, tell: Callable[[str], None]
) -> Confirmed:
    scene = scene_at(problem, x, changes)
    run = simulate(scene, verdict=False)
    every_step = -(-len(run.times) // _MOST_STEPS)
    times = run.times[::every_step]
    if every_step > 1:
        name += f", one step in {every_step}"
    every = [msgspec.structs.replace(c, samples=2) for c in problem.record.constraints]
    record = msgspec.structs.replace(problem.record, constraints=every)
    own = Problem(problem.path, record, scene, x, problem.parameters, problem.factors, problem.powers)
    looking = Dynamics(own, Memory(own), tell, times)
    motion = looking.motion_of(run)
    values, at, curves, violation = {}, {}, {}, -1.0
    for limit in looking.limits(looking.start):
        found = limit.measure.value(limit.exact(motion))
        rows = np.broadcast_to(found.reshape(len(limit.at), -1).max(axis=1), times.shape)
        worst = int(rows.argmax())
        curves[limit.name] = limit.told(rows)
        values[limit.name], at[limit.name] = float(curves[limit.name][worst]), float(times[worst])
        if limit.limit is not None:
            violation = max(violation, float(rows[worst]) / limit.limit - 1)
    settings = scene.record.simulation
    shapes = () if changes else drawn(motion, settings, looking.numbers, x)
    return Confirmed(name, values, at, violation, instants=times, curves=curves, shapes=shapes)


