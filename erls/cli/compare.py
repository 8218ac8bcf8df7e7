"""The command ``erls compare``."""

from __future__ import annotations

from pathlib import Path

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
    tell_written,
    write,
)
from erls.cli.terminal import Force, Json, Output, Progress, print_json


def compare(
    scene: Path,
    /,
    *more: Path,
    formulations: str = "",
    output: Output = None,
    state: StateFile = None,
    resume: Resume = False,
    set_: Set = None,
    workers: Workers = None,
    force: Force = False,
    json: Json = False,
) -> int:
    """Simulate a scene in several formulations and report distances, cost and whether they are as expected.

    Of several scenes: how far formulations depart from the nodal one (the first unless it is asked for) against how far
    links bend. Scenes that it cannot compute are named.

    Parameters
    ----------
    scene
        Scene (TOML).
    more
        Further scenes.
    formulations
        Separated by commas; erls,ffr unless given. Besides them: nodal (beam elements, for any deflection),
        erls-minimum-norm (five rows per joint), erls-fem (links not reduced).
    output
        Report to write: .html a self-contained page with plots, .csv the histories (of several scenes the
        departures), .json the JSON object.
    state
        File that keeps runs of one scene as they are finished, RUNS.study.
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
    from erls.report.compare_page import comparison_csv, comparison_page, comparison_text
    from erls.studies.compare import compare as run_comparison
    from erls.studies.compare_result import comparison_summary

    check_output(output, [scene, *more], set_ or [], (".html", ".csv", ".json"), force)
    names = [name.strip() for name in formulations.split(",") if name.strip()]
    if more:
        if state is not None:
            raise bad("several scenes keep no runs", "--state", str(state), "compare them one by one")
        return _compare_scenes([scene, *more], names or ["erls", "ffr"], output, set_ or [], workers, json)
    with Progress("comparing") as advance:
        kept = kept_in(state, resume, force)
        result = run_comparison(scene, names, overrides=set_ or (), progress=advance, workers=workers, state=kept)
    summary = comparison_summary(result)
    if output is not None:
        makers = {".html": comparison_page, ".csv": comparison_csv}
        write(output, makers[output.suffix](result) if output.suffix in makers else dumped(summary))
    if json:
        print_json({**summary, "output": None if output is None else str(output)})
    else:
        print(comparison_text(result))
        tell_written(output)
    return exit_code(result.complete, [error.exit_code for error in result.errors.values()])


def _compare_scenes(
    scenes: list[Path], names: list[str], output: Path | None, changes: list[str], workers: int | None, json: bool
) -> int:
    """The part of `compare` for several scenes; 2 when none could be compared."""
    from erls.report.scenes_page import scenes_csv, scenes_page, scenes_text
    from erls.studies.compare_scenes import compare_scenes, scenes_summary

    with Progress("comparing") as advance:
        result = compare_scenes(scenes, names, overrides=changes, progress=advance, workers=workers)
    summary = scenes_summary(result)
    if output is not None:
        makers = {".html": scenes_page, ".csv": scenes_csv}
        write(output, makers[output.suffix](result) if output.suffix in makers else dumped(summary))
    if json:
        print_json({**summary, "output": None if output is None else str(output)})
    else:
        print(scenes_text(result))
        tell_written(output)
    errors = [error for c in result.comparisons.values() for error in c.errors.values()]
    failed = [e.exit_code for e in errors if e.exit_code != 2]  # what a formulation refuses is stated
    return exit_code(result.complete, failed if result.departures else [*failed, 2])
