"""A scene of bodies in, its result out."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from erls.equations.nodal.redundant import refuse_open
from erls.equations.nodal.scenes.build import Assembly, assemble
from erls.equations.nodal.spectrum import buckling_loads, natural_frequencies
from erls.equations.nodal.statics import Statics, solve_statics
from erls.errors import Cause, SceneError
from erls.integrate.constrained import ConstrainedOptions, ConstrainedSolution
from erls.integrate.lie_generalized_alpha import lie_generalized_alpha
from erls.run.bodies.result import Motion, Rest, work
from erls.scene.bodies.analyses import TANGENTS, AtRest, Buckling, Dynamics, Frequencies, StaticSteps
from erls.scene.bodies.schema import BodyScene
from erls.scene.read import AnyScene, load_scene
from erls.scene.records import SceneFile

Progress = Callable[[float, float], None]


def solve(scene: AnyScene | Path | str, progress: Progress = lambda done, total: None) -> Motion | Rest:
    """Find what a scene of bodies asks for.

    Parameters
    ----------
    scene : BodyScene, Path or str
    progress : callable
        Called with (time, duration) after each step of a motion.

    Returns
    -------
    Motion or Rest

    Raises
    ------
    SceneError, FEImportError
        Bad input: names file, field, value and remedy.
    SimulationError
        A failure or an interrupt; what was computed is in its attribute ``run``.

    Examples
    --------
    >>> from erls.run.bodies.solve import solve
    >>> bool(abs(solve("data/statics/roll_up.toml").position("tip")).max() < 1e-10)  # back at the root
    True
    """
    if not isinstance(scene, SceneFile):
        scene = load_scene(scene)
    if not isinstance(scene, BodyScene):
        raise SceneError(Cause.BAD_FIELD, "a chain", where=str(scene.path), remedy="use erls.simulate")
    assembly = assemble(scene)
    analysis = scene.record.simulation
    if isinstance(analysis, Dynamics):
        result: Motion | Rest = _motion(scene, assembly, analysis, progress)
    else:
        result = _rest(scene, assembly, analysis)
    if result.failure is not None:
        result.failure.run = result
        raise result.failure
    return result


def _motion(scene: BodyScene, assembly: Assembly, analysis: Dynamics, progress: Progress) -> Motion:
    options = ConstrainedOptions(
        step=analysis.step,
        spectral_radius=analysis.spectral_radius,
        newton_tolerance=analysis.newton_tolerance,
        iteration_matrix=analysis.iteration_matrix,
        residual_tolerance=analysis.residual_tolerance,
    )

    def observe(t: float, knots: Callable[[], ConstrainedSolution]) -> None:
        progress(t, analysis.duration)

    begun = time.perf_counter()
    times = (0.0, analysis.duration)
    system = assembly.system
    found = lie_generalized_alpha(system, times, system.start, assembly.velocity, options, observe)  # type: ignore[arg-type]
    wall = time.perf_counter() - begun
    result = Motion(scene, assembly, wall, (*_redundancy(assembly), *found.warnings), found)
    if assembly.left_out and found.failure is None:
        for t, poses in zip(*result.some_poses(), strict=True):
            refuse_open(assembly.full, t, replace(system.start, poses=poses), assembly.left_out)
    return result


def _rest(scene: BodyScene, assembly: Assembly, analysis: AtRest) -> Rest:
    system, tangents = assembly.system, {}
    begun = time.perf_counter()
    end = analysis.load if isinstance(analysis, (Buckling, Frequencies)) else 1.0
    found = solve_statics(system, system.start, analysis.load_steps, analysis.tangent, end=end)
    modes = _modes(assembly, analysis, found) if found.failure is None else ()
    wall = time.perf_counter() - begun
    if isinstance(analysis, StaticSteps) and analysis.compare_tangents:
        for name in TANGENTS:
            other = (
                found if name == analysis.tangent else solve_statics(system, system.start, analysis.load_steps, name)
            )
            tangents[name] = work(other)
    for e in found.path if assembly.left_out else ():
        refuse_open(assembly.full, e.t, e.q, assembly.left_out)
    return Rest(scene, assembly, wall, _redundancy(assembly), found, modes, tangents)


def _redundancy(assembly: Assembly) -> tuple[str, ...]:
    """A warning that names what was left out."""
    if not assembly.left_out:
        return ()
    names = "; ".join(assembly.left_out)
    return (
        f"{len(assembly.left_out)} conditions follow from the others and are left out: {names}; forces of connections "
        "are the smallest that do the same",
    )


def _modes(assembly: Assembly, analysis: AtRest, found: Statics) -> tuple[dict[str, Any], ...]:
    """What a buckling or frequency analysis finds about the last equilibrium."""
    system, last = assembly.system, found.path[-1]
    if isinstance(analysis, Buckling):
        name, modes = "load", buckling_loads(system, last, analysis.count)
    elif isinstance(analysis, Frequencies):
        name, modes = "frequency_hz", natural_frequencies(system, last, analysis.count)
    else:
        return ()
    turns = last.q.poses[:, :3, :3]
    result = []
    for value, shape in zip(modes.values.tolist(), modes.shapes.reshape(len(modes.values), -1, 6), strict=True):
        moved = (turns @ shape[:, :3, None])[:, :, 0]
        points = {node: moved[assembly.numbers[node]].tolist() for node in assembly.reported}
        result.append({name: value, "points": points})
    return tuple(result)
