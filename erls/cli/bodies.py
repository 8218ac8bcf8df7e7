"""``erls simulate`` for scenes of bodies, beams and connections."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from erls.cli.terminal import Progress, print_json, refuse_unwritable, report_times, tell


def simulate_bodies(
    scene: Path, output: Path | None, formulation: str | None, changes: Sequence[str], at: str, json: bool
) -> None:
    """Solve a scene of bodies, print and write what it gives."""
    from erls.errors import SimulationError
    from erls.run.bodies.result import Motion
    from erls.run.bodies.result_file import write_result
    from erls.run.bodies.solve import solve
    from erls.scene.bodies.analyses import Dynamics
    from erls.scene.read import load_scene

    _only_nodal(formulation)
    loaded = load_scene(scene, changes)
    analysis = loaded.record.simulation
    times = report_times(at, analysis.duration) if isinstance(analysis, Dynamics) else _no_times(at)
    if output is not None:
        refuse_unwritable(output, scene)
    try:
        with Progress("simulating") as advance:
            result = solve(loaded, advance)
    except SimulationError as problem:
        if output is not None and problem.run is not None:
            write_result(output, problem.run)
            tell(f"what was computed is in {output}")
        raise
    for text in result.warnings:
        tell(f"warning: {text}")
    if output is not None:
        write_result(output, result)
    if isinstance(result, Motion):
        summary = result.summary(times or ([] if json else [result.end]))
    else:
        summary = result.summary()
    if json:
        return print_json({**summary, "output": None if output is None else str(output)})
    from erls.report.body_page import result_report

    print(result_report(summary))
    if output is not None:
        print(f"\nwritten to {output}")


def _only_nodal(formulation: str | None) -> None:
    from erls.errors import Cause, SceneError

    if formulation not in (None, "nodal"):
        message = "bodies and beams of their own have nodal elements only"
        raise SceneError(Cause.BAD_FIELD, message, where="--formulation", value=formulation, remedy="leave it out")


def _no_times(at: str) -> list[float]:
    from erls.errors import Cause, SceneError

    if at.strip():
        message, remedy = "nothing moves: every load step is reported", "leave it out, or change simulation.load_steps"
        raise SceneError(Cause.TIME_OUT_OF_RANGE, message, where="--at", value=at, remedy=remedy)
    return []
