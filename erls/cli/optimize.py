"""The command ``erls optimize``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from erls.cli.reports import Set, bad, check_output, dumped, read_by, tell_written, write
from erls.cli.terminal import Force, Json, Output, print_json, tell

if TYPE_CHECKING:
    from erls.optimization.result import Analysis


def optimize(
    problem: Path,
    /,
    *,
    output: Output = None,
    scene: Annotated[Path | None, Parameter(name="--scene")] = None,
    state: Annotated[Path | None, Parameter(name="--state")] = None,
    resume: Annotated[bool, Parameter(name="--resume", negative="")] = False,
    set_: Set = None,
    force: Force = False,
    json: Json = False,
) -> int:
    """Find the best design of a mechanism: links as light as its motion allows.

    Ends with exit code 4 where a method does not converge: the report says why, and holds the best design that it
    found.

    Parameters
    ----------
    problem
        Problem (TOML): a scene, what may change, what is wanted, what must hold.
    output
        Report to write: .html a self-contained page with plots, .json the JSON object.
    scene
        Copy of the scene with the best design, beside the scene, to write.
    state
        File that keeps all analyses (.npz), from which --resume goes on.
    resume
        Go on from the file of --state.
    set_
        Change a field of the problem, KEY=VALUE; may be repeated.
    force
        Replace an existing file that is no such report.
    json
        Print one JSON object.
    """
    from erls.files.results import claim
    from erls.optimization.optimize import optimize as optimum
    from erls.optimization.problem import load_problem
    from erls.optimization.result import INTERRUPTED, summary
    from erls.report.optimum_page import optimum_page, optimum_text
    from erls.studies.apply import check_copy, write_copy

    if resume and state is None:
        raise bad("nothing to go on from", "--resume", "no --state", "name the file with --state")
    loaded = load_problem(problem, set_ or [])
    given = loaded.path.parent / loaded.record.scene
    inputs = [problem, *read_by([given], loaded.record.set)]
    check_output(output, [given], loaded.record.set, (".html", ".json"), force, [problem])
    if scene is not None:
        check_copy(scene, given, "--scene")
        claim(scene, ".toml", inputs, force)
    if state is not None:
        if state.suffix != ".npz":
            raise bad("the file of all analyses is one of NumPy", "--state", state.name, "end in .npz")
        claim(state, ".npz", inputs, force or resume)

    def progress(method: str, count: int, analysis: Analysis) -> None:
        passed = f"violation {100 * analysis.violation:.3f} %"
        tell(f"{method}: analysis {count}, objective {analysis.objective:.6g}, {passed}")

    found = optimum(loaded, tell=tell, progress=progress, state=state, resume=resume)
    told = {**summary(found), "output": None if output is None else str(output)}
    if output is not None:
        write(output, optimum_page(found) if output.suffix == ".html" else dumped(summary(found)))
    if scene is not None and found.outcomes:
        best = found.best
        note = f"{loaded.name}, {best.method}: {best.status}, objective {best.objective:.6g}\nwritten by erls"
        write_copy(scene, given, [*found.problem.record.set, *found.problem.overrides(best.x)], note)
    if json:
        print_json(told)
    else:
        print(optimum_text(found))
        tell_written(output)
        tell_written(scene)
    statuses = {outcome.status for outcome in found.outcomes}
    if INTERRUPTED in statuses:
        return 130
    return 0 if statuses == {"converged"} else 4
