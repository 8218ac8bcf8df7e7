"""The run of a scene of bodies and beams: its motion, equilibria, buckling loads or natural frequencies."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

from erls.equations.nodal.redundant import refuse_open
from erls.equations.nodal.scenes.build import Assembly, assemble
from erls.equations.nodal.scenes.equilibria import equilibria
from erls.equations.nodal.spectrum import buckling_loads, natural_frequencies
from erls.equations.nodal.statics import Statics, solve_statics
from erls.errors import Cause, SceneError
from erls.integrate.choice import TIED_STEPS, body_options, compiling_steps
from erls.integrate.constrained import ConstrainedSolution
from erls.integrate.lie_generalized_alpha import lie_generalized_alpha
from erls.maths.jit import announcing
from erls.run.bodies.motion import BodyMotion
from erls.run.bodies.rest import BodyPath, BodyRest, Modes, work
from erls.run.bodies.sensors import body_sensors
from erls.run.file import self_contained
from erls.run.watches.base import BodyPlan, Started
from erls.run.watches.watching import Warnings, Watching
from erls.scene.bodies.analyses import TANGENTS, AtRest, Buckling, Continuation, Dynamics, Frequencies, StaticSteps
from erls.scene.bodies.schema import BodyScene
from erls.simulation.asked import Asked
from erls.simulation.statements import with_statement


def run_bodies(scene: BodyScene, asked: Asked) -> BodyMotion | BodyRest:
    """Find what a scene of bodies asks for.

    Raises
    ------
    SceneError, FEImportError
        Bad input: names file, field, value and remedy.
    SimulationError
        A failure or an interrupt; what was computed is in its attribute ``run``.
    """
    analysis = scene.record.simulation
    if asked.until is not None:
        message, remedy = "a run of bodies and beams cannot be extended", "simulate with a longer simulation.duration"
        raise SceneError(Cause.BAD_FIELD, message, where="--until", value=asked.until, remedy=remedy)
    with announcing(asked.tell), compiling_steps(TIED_STEPS if isinstance(analysis, Dynamics) else None):
        assembly = assemble(scene)
    if isinstance(analysis, Dynamics):
        return _stated(_motion(scene, assembly, analysis, asked), asked)
    run = _rest(scene, assembly, analysis)
    for text in run.warnings:
        asked.tell(f"warning: {text}")
    if run.failure is not None:
        run.failure.run = run
        raise run.failure
    return _stated(run, asked)


def _stated(run: BodyMotion | BodyRest, asked: Asked) -> BodyMotion | BodyRest:
    """The run with what it states of its error, where that is asked for."""
    if not asked.verdict:
        return run
    from erls.accuracy.bodies import stated_bodies  # here: runs without a verdict need none of it

    return with_statement(run, stated_bodies)


def _motion(scene: BodyScene, assembly: Assembly, analysis: Dynamics, asked: Asked) -> BodyMotion:
    if asked.checkpoints is not None:
        asked.checkpoints.identify(self_contained(scene))
    checkpoint = asked.checkpoint(scene)
    body_sensors(scene, assembly)  # refused before anything moves
    begun, warnings = time.perf_counter() - (0.0 if checkpoint is None else checkpoint.spent), Warnings(asked.tell)
    warnings(_redundancy(assembly))
    watching = Watching(BodyPlan(scene), warnings, asked.watches(checkpoint))

    def run_of(found: ConstrainedSolution) -> BodyMotion:
        return BodyMotion(scene, assembly, time.perf_counter() - begun, tuple(warnings.texts), found)

    watching.begins(Started(analysis.duration, run_of))
    times = (0.0, analysis.duration)
    system = assembly.system
    options = replace(body_options(analysis), keeper=checkpoint)
    start = system.start, assembly.velocity
    found = watching.ended(lie_generalized_alpha(system, times, *start, options, watching.observe))
    assert isinstance(found, ConstrainedSolution)
    run = watching.judged(run_of(found))
    if assembly.left_out:
        looks = run.spread(21)
        for t, poses in zip(looks.tolist(), run.poses(looks), strict=True):
            refuse_open(assembly.full, t, replace(system.start, poses=poses), assembly.left_out)
    return run


def _rest(scene: BodyScene, assembly: Assembly, analysis: AtRest) -> BodyRest:
    system = assembly.system
    tangents: dict[str, dict[str, Any]] = {}
    begun = time.perf_counter()
    found = equilibria(system, analysis)
    modes = _modes(assembly, analysis, found) if found.failure is None else None
    wall = time.perf_counter() - begun
    if isinstance(analysis, StaticSteps) and analysis.compare_tangents:
        for name in TANGENTS:
            own = name == analysis.tangent
            tangents[name] = work(found if own else solve_statics(system, system.start, analysis.load_steps, name))
    for e in found.path if assembly.left_out else ():
        refuse_open(assembly.full, e.t, e.q, assembly.left_out)
    warnings = _redundancy(assembly)
    if isinstance(analysis, Continuation):
        return BodyPath(scene, assembly, wall, warnings + _unfinished(analysis, found), found)
    return BodyRest(scene, assembly, wall, warnings, found, modes, tangents)


def _unfinished(analysis: Continuation, found: Statics) -> tuple[str, ...]:
    """A warning where the path did not get as far as it should."""
    known, bifurcations = found.path, sum(turn.kind == "bifurcation" for turn in found.turns)
    told = []
    if found.failure is None and known[-1].t < analysis.load * (1 - 1e-9):
        told.append(
            f"the path ends after {analysis.most_steps} steps at load parameter {known[-1].t:.6g}, before "
            f"{analysis.load:g}: set simulation.most_steps for more"
        )
    if bifurcations < abs(analysis.branch):
        told.append(f"the path has {bifurcations} bifurcations, and leaves for no branch: simulation.branch = "
                    f"{analysis.branch}")  # fmt: skip
    return tuple(told)


def _redundancy(assembly: Assembly) -> tuple[str, ...]:
    """A warning that names what was left out."""
    if not assembly.left_out:
        return ()
    names = "; ".join(assembly.left_out)
    return (
        f"{len(assembly.left_out)} conditions follow from the others and are left out: {names}; forces of connections "
        "are the smallest that do the same",
    )


def _modes(assembly: Assembly, analysis: AtRest, found: Statics) -> Modes | None:
    """What a buckling or frequency analysis finds about the last equilibrium."""
    system, last = assembly.system, found.path[-1]
    if isinstance(analysis, Buckling):
        quantity, modes = "load", buckling_loads(system, last, analysis.count)
    elif isinstance(analysis, Frequencies):
        quantity, modes = "frequency_hz", natural_frequencies(system, last, analysis.count)
    else:
        return None
    shapes = modes.shapes.reshape(len(modes.values), -1, 6)
    moved, turned = ((last.q.poses[:, :3, :3] @ part[..., None])[..., 0] for part in (shapes[..., :3], shapes[..., 3:]))
    return Modes(quantity, modes.values, moved, turned)
