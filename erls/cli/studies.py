"""The commands that run a scene many times: ``erls study``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import App, Parameter

from erls.cli.reports import (
    Resume,
    Set,
    StateFile,
    Workers,
    bad,
    check_output,
    dumped,
    exit_code,
    kept_in,
    read_by,
    tell_written,
    write,
)
from erls.cli.terminal import Force, Json, Output, Progress, print_json, tell

study = App(name="study", help="Run a scene many times and report what changes.", help_format="plaintext")


@study.command
def modes(
    scene: Path,
    /,
    *,
    output: Output = None,
    counts: str = "",
    frequencies: str = "",
    ranked: Annotated[bool, Parameter(negative="")] = False,
    link: str = "",
    tolerance: float = 1e-4,
    load_tolerance: float = 0.02,
    frequency_tolerance: float = 0.01,
    beside: Path | None = None,
    state: StateFile = None,
    resume: Resume = False,
    set_: Set = None,
    workers: Workers = None,
    force: Force = False,
    json: Json = False,
) -> int:
    """How many elastic modes are enough: raise their number until points, angles, loads and spectra stop changing.

    Ends with exit code 4 when there are no three successive changes below the tolerances, unless all modes that there
    are have been taken.

    Parameters
    ----------
    scene
        Scene (TOML).
    output
        Report to write: .html a self-contained page with plots, .json the JSON object.
    counts
        Numbers of elastic modes, separated by commas; from 0 to all there are, in growing steps, unless given. Modes of
        equal frequency are taken together.
    frequencies
        Instead: limits up to which the modes of each link are taken [Hz], separated by commas.
    ranked
        Count fixed-interface modes in the order in which the reduction of each link ranks them (selection = "ranking").
    link
        Vary the modes of this link only; of all links alike unless given.
    tolerance
        Distance of named points that does not matter [m]; angles are held to it over the size of the largest link.
    load_tolerance
        Change of joint forces, moments and efforts that does not matter, relative to their peak.
    frequency_tolerance
        Relative change of spectrum peaks that does not matter.
    beside
        Published table (CSV) to show beside the figures of this study.
    state
        File that keeps runs as they are finished, RUNS.study.
    resume
        Go on with it: what it holds is not computed again.
    set_
        Change a field of the scene, KEY=VALUE; may be repeated.
    workers
        Runs at a time; as many as cores unless given.
    force
        Replace an existing file that is no such report.
    json
        Print one JSON object.
    """
    from erls.errors import Cause, SceneError
    from erls.report.mode_page import beside_summary, mode_study_page, mode_study_text, read_printed
    from erls.studies.mode_count import study_modes
    from erls.studies.mode_result import Tolerances, study_summary

    check_output(output, [scene], set_ or [], (".html", ".json"), force, [] if beside is None else [beside])
    if ranked and beside is not None:
        message, remedy = "published tables are of elastic modes, not of ranked ones", "leave one of the two out"
        raise SceneError(Cause.BAD_FIELD, message, where="--beside", value=str(beside), remedy=remedy)
    printed = None if beside is None else read_printed(beside)
    with Progress("mode study") as advance:
        result = study_modes(
            scene,
            _counts(counts),
            frequencies=_limits(frequencies),
            ranked=ranked,
            link=link,
            overrides=set_ or (),
            tolerances=Tolerances(tolerance, load_tolerance, frequency_tolerance),
            progress=advance,
            workers=workers,
            state=kept_in(state, resume, force),
        )
    summary = study_summary(result)
    if printed is not None:
        summary["beside"] = beside_summary(result, printed)
    if output is not None:
        write(output, mode_study_page(result, printed) if output.suffix == ".html" else dumped(summary))
    if json:
        print_json({**summary, "output": None if output is None else str(output)})
    else:
        print(mode_study_text(result, printed))
        tell_written(output)
    failed = [point.error.exit_code for point in result.points if point.error is not None]
    return exit_code(result.complete, failed) or (
        0 if result.converged is not None or result.exhausted else 4
    )


@study.command
def cost(
    scene: Path,
    /,
    *,
    output: Output = None,
    tolerance: float = 1e-4,
    formulations: str = "",
    modes: str = "",
    integrators: str = "",
    effects: Annotated[list[str] | None, Parameter(name="--effects", negative="")] = None,
    points: str = "",
    norm: str = "max",
    reference: str = "",
    budget: float = 240.0,
    apply: Path | None = None,
    state: StateFile = None,
    resume: Resume = False,
    set_: Set = None,
    workers: Workers = None,
    force: Force = False,
    json: Json = False,
) -> int:
    """What accuracy costs in time: error against time over many settings, and the cheapest that is good enough.

    Ends with exit code 4 when no setting meets the tolerance.

    Parameters
    ----------
    scene
        Scene (TOML).
    output
        Report to write: .html a self-contained page with a plot, .csv one row per run, .json the JSON object.
    tolerance
        Distance of named points that does not matter [m].
    formulations
        Separated by commas; erls,ffr unless given.
    modes
        Numbers of elastic modes of every link; all, half and a quarter of them unless given.
    integrators
        Ours and dop853 unless given.
    effects
        Sets of effects, separated by commas, or the option repeated; names of a set joined by +, what it leaves out by
        -: all,linear,all-coriolis. That of the scene is always tried; all,auto unless given, and, where links have
        second-order displacements, linear.
    points
        Named points that the error is taken over; all unless given.
    norm
        max or rms over time; the worst point counts.
    reference
        nodal, or tight: all modes and effects at a tight tolerance, with second-order displacements where links have
        them. Nodal where links are beams and nothing closes the chain unless given.
    budget
        Time after which no further run starts [s], without compiling on first use; the reference may take 0.4 of it, or
        0.7 where it would be too coarse, a single run a tenth.
    apply
        Write a copy of the scene with the recommended setting, beside the scene; what --set changes is for the study
        alone.
    state
        File that keeps the reference and settings with all their runs as they are finished, RUNS.study.
    resume
        Go on with it: what it holds is not computed again.
    set_
        Change a field of the scene, KEY=VALUE; may be repeated.
    workers
        Runs at a time; as many as cores unless given.
    force
        Replace an existing file that is no such report.
    json
        Print one JSON object.
    """
    from erls.files.results import MARK, claim
    from erls.report.cost_page import cost_csv, cost_page, cost_text
    from erls.studies.apply import check_copy, write_copy
    from erls.studies.cost import study_cost
    from erls.studies.cost_result import cost_summary
    from erls.studies.grid import Grid

    check_output(output, [scene], set_ or [], (".html", ".csv", ".json"), force)
    if apply is not None:
        check_copy(apply, scene)
        claim(apply, ".toml", read_by([scene], set_ or []), force)
    grid = Grid(_names(formulations), _names(integrators), tuple(effects or ()), tuple(_counts(modes, "--modes") or ()))
    with Progress("cost study") as advance:
        result = study_cost(
            scene,
            tolerance,
            grid=grid,
            points=_names(points),
            norm=norm,  # type: ignore[arg-type]
            reference=reference,
            overrides=set_ or (),
            budget=budget,
            progress=advance,
            workers=workers,
            state=kept_in(state, resume, force),
        )
    summary = cost_summary(result)
    if output is not None:
        makers = {".html": cost_page, ".csv": cost_csv}
        write(output, makers[output.suffix](result) if output.suffix in makers else dumped(summary))
    if apply is not None and result.chosen is not None:
        write_copy(apply, scene, result.chosen_overrides, "\n".join([summary["recommendation"], *_kept(set_), MARK]))
    if json:
        print_json({**summary, "output": None if output is None else str(output)})
    else:
        print(cost_text(result))
        tell_written(output)
        tell_written(apply if result.chosen is not None else None)
        for line in _kept(set_) if apply is not None and result.chosen is not None else ():
            tell(line)
    return exit_code(result.complete, []) or (0 if result.chosen is not None else 4)


def _kept(changes: list[str] | None) -> list[str]:
    """What a copy of the scene does not take over from a study."""
    return [f"the study ran with {', '.join(changes)}, which this copy does not take over"] if changes else []


def _names(text: str) -> tuple[str, ...]:
    return tuple(name.strip() for name in text.split(",") if name.strip())


def _limits(text: str) -> list[float] | None:
    try:
        return [float(part) for part in text.split(",") if part.strip()] or None
    except ValueError:
        raise bad("not numbers", "--frequencies", text, "separate them by commas, e.g. 100,500") from None


def _counts(text: str, option: str = "--counts") -> list[int] | None:
    try:
        return [int(part) for part in text.split(",") if part.strip()] or None
    except ValueError:
        raise bad("not whole numbers", option, text, "separate them by commas, e.g. 1,2,6,12") from None


@study.command
def sweep(
    scene: Path,
    /,
    *,
    vary: Annotated[list[str] | None, Parameter(name="--vary", negative="")] = None,
    get: Annotated[list[str] | None, Parameter(name="--get", negative="")] = None,
    sample: str = "",
    seed: int = 0,
    points: Path | None = None,
    output: Output = None,
    table: Path | None = None,
    resume: Resume = False,
    retry_failed: Annotated[bool, Parameter(name="--retry-failed", negative="")] = False,
    verdict: Annotated[bool, Parameter(name="--verdict", negative="")] = False,
    scheduler: str = "",
    set_: Set = None,
    workers: Workers = None,
    force: Force = False,
    json: Json = False,
) -> int:
    """Many variants of a scene: numbers of each run over a grid, a sample or a table of parameters.

    With -o every finished point is kept as it comes, and --resume computes nothing twice.

    Parameters
    ----------
    scene
        Scene (TOML).
    vary
        What varies, KEY=A:B:N for N even values or KEY=V,W for a list, keys as of --set; may be repeated: all
        combinations are run. With --sample KEY=A:B, a range.
    get
        A number of each run; may be repeated: tip.z@0.5, elbow.angle@end, max(tip.distance), rms(elbow.effort),
        energy.total@end: columns of the table of erls view -o RUN.csv at a time, or max, min, mean, rms, range over
        time. tip.distance is how far a point is from its start, error the stated one (--verdict).
    sample
        Draw points instead: latin-hypercube:N, sobol:N or random:N.
    seed
        Of the sample.
    points
        CSV table of points instead; its head holds keys.
    output
        Store to write, RUNS.sweep.
    table
        CSV table to write: a line for each point.
    resume
        Go on with the store.
    retry_failed
        With --resume: run again what failed.
    verdict
        Have every run state its error.
    scheduler
        Address of a Dask scheduler whose workers run the points; they must see the files of the scene.
    set_
        Change a field of the scene for all points, KEY=VALUE; may be repeated.
    workers
        Runs at a time; as many as cores unless given.
    force
        Replace a store that holds finished points, or an existing file that is no such store or table.
    json
        Print one JSON object.
    """
    from erls.files.results import claim
    from erls.report.sweep_table import sweep_summary, sweep_text, write_sweep_table
    from erls.studies.sweep.executors import dask_client
    from erls.studies.sweep.points import points_of
    from erls.studies.sweep.store import SUFFIX
    from erls.studies.sweep.sweep import sweep

    if resume and output is None:
        raise bad("there is nothing to go on with", "--resume", "no store", "give -o RUNS.sweep")
    if not get:
        raise bad("nothing is kept of the runs", "--get", "nothing", "e.g. --get 'max(tip.distance)'")
    asked = points_of(vary or [], sample, seed, points)
    check_output(output, [scene], set_ or [], (SUFFIX,), force, [] if points is None else [points])
    if table is not None:
        claim(table, ".csv", read_by([scene], set_ or []), force)
    executor = dask_client(scheduler) if scheduler else None
    with Progress("sweep") as advance:
        found = sweep(
            scene,
            asked,
            get,
            overrides=set_ or (),
            store=output,
            resume=resume,
            force=force,
            retry=retry_failed,
            executor=executor,
            workers=workers,
            verdict=verdict,
            progress=advance,
        )
    if table is not None:
        write_sweep_table(table, found)
    if json:
        print_json({**sweep_summary(found), "output": None if output is None else str(output)})
    else:
        print(sweep_text(found))
        tell_written(output)
        tell_written(table)
    return exit_code(not found.interrupted, [3 for _ in found.failed])
