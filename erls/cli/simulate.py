"""The command ``erls simulate``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from erls.cli.terminal import Force, Json, Output, Progress, print_json, remove, report_times, tell

if TYPE_CHECKING:
    from erls.run.record import Run
    from erls.scene.records import Record


def simulate(
    scene: Path,
    /,
    *,
    output: Output = None,
    formulation: str | None = None,
    set_: Annotated[list[str] | None, Parameter(name="--set", negative="")] = None,
    at: str = "",
    strict: Annotated[bool, Parameter(negative="")] = False,
    verdict: bool = True,
    resume: Path | None = None,
    until: float | None = None,
    report: Path | None = None,
    force: Force = False,
    json: Json = False,
) -> None:
    """Simulate a scene; links are reduced on the fly and cached by content.

    Parameters
    ----------
    scene
        Scene (TOML).
    output
        Run file to write (HDF5); none unless given.
    formulation
        Formulation instead of the one in the scene: erls, ffr or nodal.
    set_
        Change a field of the scene, KEY=VALUE; may be repeated. For example simulation.step=1e-4,
        links.arm.elastic_modes=8, joints.0.initial.position_deg=30.
    at
        Times in seconds, separated by commas, at which to report joints and points.
    strict
        Repeat the run where its stated error passes the tolerance, with what keeps it; exit code 4 where nothing does.
    verdict
        State the error of the run, part by part, and whether it can be relied on; --no-verdict does without, at no
        cost.
    resume
        Run file of a run that was stopped, killed or ran out of memory: go on from the last checkpoint beside it
        (RUN.h5.partial), with what --set gave then, and write it; as though nothing had happened, bit for bit.
    until
        Go on beyond simulation.duration up to this time in seconds, with what was settled for it; with --resume RUN.h5
        also from the end of a finished run.
    report
        Page to write (.html): plots, the mechanism in space, error and verdict, settings, how to repeat it.
    force
        Replace an existing file that is no run file, or no page.
    json
        Print one JSON object.
    """
    from erls.cli.reports import bad
    from erls.cli.resuming import checkpoint_of, left_by, refuse_together
    from erls.errors import Cause, SimulationError
    from erls.files.results import RUN, claim
    from erls.report.runs import run_report
    from erls.run.checkpoints import Checkpoints
    from erls.run.file import save_run
    from erls.scene.inputs import files_of
    from erls.scene.read import load_scene
    from erls.simulation.extension import extend, refuse_other
    from erls.simulation.simulate import simulate as run_simulation

    changes = list(set_ or [])
    if formulation is not None:
        changes.append(f'simulation.formulation="{formulation}"')
    output = output or resume
    refuse_together(until, strict)
    saved, before = (None, None) if resume is None else left_by(resume, until)
    if saved is not None and not changes:
        changes = list(saved.changes)
    loaded = load_scene(scene, changes)
    times = _asked(at, loaded.record.simulation, until)
    partial = None if output is None else checkpoint_of(output)
    for path in (output, partial):
        if path is not None:
            claim(path, RUN, files_of(loaded), force)
    if report is not None:
        if report.suffix != ".html":
            raise bad("a report is a page", "--report", report.name, "end it in .html")
        claim(report, ".html", files_of(loaded), force)
    saving = None if partial is None else Checkpoints(partial, tuple(changes), saved)
    try:
        with Progress("simulating") as advance:
            asked: dict[str, Any] = {"progress": advance, "tell": tell, "checkpoint": saving, "verdict": verdict}
            if before is not None and until is not None:
                refuse_other(loaded, before)
                run: Run = extend(before, until, **asked)
            else:
                run = run_simulation(loaded, strict=strict, until=until, **asked)
    except SimulationError as problem:
        if output is None and problem.run is not None:
            hint = "give -o RUN.h5 to keep what was computed"
            problem.remedy = hint if problem.cause == Cause.INTERRUPTED else f"{problem.remedy}; {hint}"
        elif before is not None and output == resume:
            tell(f"{output} stays as it was; the same command goes on from the last checkpoint, if there was one")
        elif output is not None and problem.run is not None and problem.run.worth_a_file:
            save_run(output, problem.run)
            axis = problem.run.axis
            tell(f"what was computed, up to {axis.symbol} = {axis.text(f'{problem.run.end:.6g}')}, is in {output}")
            going_on = problem.cause in (Cause.INTERRUPTED, Cause.OUT_OF_MEMORY)
            if going_on and partial is not None and partial.exists():
                tell(f"erls simulate {scene} --resume {output} goes on from the last checkpoint")
            else:
                remove(partial)
        raise
    if output is not None:
        save_run(output, run)
        remove(partial)
    if report is not None:
        from erls.view import write_view  # here: nobody else needs it

        sets = [word for text in set_ or [] for word in ("--set", text)]
        sets += [] if formulation is None else ["--formulation", formulation]
        write_view(run, report, repeat=["simulate", str(scene), *sets])
    if json:
        return print_json({**run.summary(times), "output": None if output is None else str(output)})
    print(run_report(run, times))
    for path in (output, report):
        if path is not None:
            print(f"\nwritten to {path}")


def _asked(at: str, settings: Record, until: float | None) -> list[float]:
    """Times of ``--at``, which only motions have."""
    from erls.errors import Cause, SceneError
    from erls.scene.records import Stepping

    if isinstance(settings, Stepping):
        return report_times(at, settings.duration if until is None else max(until, settings.duration))
    if at.strip():
        message, remedy = "nothing moves: every load step is reported", "leave it out, or change simulation.load_steps"
        raise SceneError(Cause.TIME_OUT_OF_RANGE, message, where="--at", value=at, remedy=remedy)
    return []
