"""The command ``erls invert``."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from erls.cli.reports import Set, bad, check_output, dumped, tell_written, write
from erls.cli.terminal import Force, Json, Output, Progress, print_json, tell

if TYPE_CHECKING:
    from collections.abc import Callable

    from erls.inverse.inversion import Inversion
    from erls.tracking.confirm import Confirmation
    from erls.tracking.correct import Corrected

_NONE = "none"
_FALL = 12.0  # decades by which changes of an iteration fall


def invert(
    scene: Path,
    /,
    *,
    output: Output = None,
    method: str = "auto",
    confirm: str = "",
    correct: Annotated[bool, Parameter(negative="")] = False,
    set_: Set = None,
    force: Force = False,
    json: Json = False,
) -> int:
    """Find the drives that make a mechanism move as its scene demands.

    What is demanded stands in the tables [[servo]] of the scene. Links may bend: where their motion inside would grow
    without bounds, the one that stays bounded is found, with drives that begin before the point moves. Forward runs
    with these drives and with those of rigid links say what each misses.

    Parameters
    ----------
    scene
        Scene (TOML); simulation.step is the distance of the knots.
    output
        File to write: .csv the drives, joint angles and deflection over time, a table that scenes can use as it is;
        .json what is printed; .html a self-contained page with plots.
    method
        collocation over all steps at once; shooting, the same by multiple shooting; forward, plain integration, which
        is refused where it would diverge; or auto, the one that fits.
    confirm
        Formulation of the forward runs, erls, ffr or nodal: that of the scene unless given; none leaves them out.
    correct
        Take off from what is demanded what the forward run misses, and invert again, until it misses no more than
        simulation.tolerance: an inversion on the model of the forward run. Exit code 4 where that is not reached.
    set_
        Change a field of the scene, KEY=VALUE; may be repeated.
    force
        Replace an existing file that is no such result; with --method forward, integrate on to see it diverge.
    json
        Print one JSON object.
    """
    from erls.equations.registry import FORMULATIONS
    from erls.errors import SceneError
    from erls.files.csv_table import write_columns
    from erls.inverse.invert import invert as inverted
    from erls.report.inverse_page import inversion_page, inversion_text
    from erls.scene.read import load_chain
    from erls.tracking.files import columns, summary
    from fe_import.files.toml import choose

    check_output(output, [scene], set_ or [], (".csv", ".json", ".html"), force)
    if correct and confirm == _NONE:
        raise bad("corrections need a forward run", "--confirm", confirm, "leave it out, or name a formulation")
    if confirm:
        choose(confirm, (*FORMULATIONS, _NONE), "--confirm", SceneError)
    loaded = load_chain(scene, set_ or [])
    if correct and loaded.record.simulation.formulation == "nodal":
        raise bad("an inversion on nodal elements is on the model of the forward run", "--correct", "", "leave it out")
    with Progress("inverting") as advance:
        found = inverted(
            loaded,
            method=method,
            force=force,
            tell=tell,
            progress=_Decades(advance),
        )
    for text in found.warnings:
        tell(f"warning: {text}")
    elastic, rigid = (None, None) if confirm == _NONE or not _whole(found) else _confirmed(found, confirm)
    corrections, missing = 0, False
    if correct and elastic is not None:
        found, elastic, corrections = _corrected(found, elastic)
        missing = max(elastic.error, *elastic.largest) > found.problem.scene.record.simulation.tolerance
        if missing:
            tell("warning: corrections do not bring the forward run to simulation.tolerance")
    told = {**summary(found, elastic, rigid), "corrections": corrections, "output": output and str(output)}
    if output is not None:
        if output.suffix == ".csv":
            write_columns(output, {name: x.tolist() for name, x in columns(found).items()})
        else:
            write(output, dumped(told) if output.suffix == ".json" else inversion_page(found, elastic, rigid))
    if json:
        print_json(told)
    else:
        print(inversion_text(found, elastic, rigid, output))
        tell_written(output)
    return 4 if missing else 0


def _corrected(found: Inversion, elastic: Confirmation) -> Corrected:
    """Told as it goes."""
    from erls.tracking.correct import corrected

    goal = found.problem.scene.record.simulation.tolerance
    tell(f"forward run: misses {max(elastic.error, *elastic.largest):.3g}")
    return corrected(
        found, elastic, goal, told=lambda number, missed: tell(f"correction {number}: forward run misses {missed:.3g}")
    )


class _Decades:
    """How far iterations have come, by the decades of their changes; the next ones begin anew, a bar does not."""

    def __init__(self, advance: Callable[[float, float], None]) -> None:
        self._advance, self._reached = advance, 0.0

    def __call__(self, number: int, change: float) -> None:
        share = -math.log10(max(change, 1e-300)) / _FALL
        self._reached = max(self._reached, min(1.0, share))
        self._advance(self._reached, 1.0)


def _whole(found: Inversion) -> bool:
    """Whether it came to the end of the run."""
    return len(found.t) == len(found.problem.t)


def _confirmed(found: Inversion, formulation: str) -> tuple[Confirmation, Confirmation]:
    """Forward runs with the drives, and with those of rigid links."""
    from erls.tracking.confirm import confirmed

    runs = []
    for efforts, start, what in (
        (found.efforts, found.start, "confirming"),
        (found.rigid_efforts, found.rigid_start, "rigid feed-forward"),
    ):
        with Progress(what) as advance:
            runs.append(confirmed(found, efforts, start, formulation, tell, advance))
    return runs[0], runs[1]
