"""The command ``erls invert``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from erls.cli.reports import Set, check_output, dumped, tell_written, write
from erls.cli.terminal import Force, Json, Output, Progress, print_json, tell

if TYPE_CHECKING:
    from erls.inverse.confirm import Confirmation
    from erls.inverse.invert import Inversion

_NONE = "none"
_FALL = 12.0  # decades by which changes of an iteration fall


def invert(
    scene: Path,
    /,
    *,
    output: Output = None,
    method: str = "auto",
    confirm: str = "",
    set_: Set = None,
    force: Force = False,
    json: Json = False,
) -> None:
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
    set_
        Change a field of the scene, KEY=VALUE; may be repeated.
    force
        Replace an existing file that is no such result; with --method forward, integrate on to see it diverge.
    json
        Print one JSON object.
    """
    from erls.equations.registry import FORMULATIONS
    from erls.errors import SceneError
    from erls.inverse.files import summary, write_columns
    from erls.inverse.invert import invert as inverted
    from erls.report.inverse_page import inversion_page, inversion_text
    from erls.scene.read import load_chain
    from fe_import.files.toml import choose

    check_output(output, [scene], set_ or [], (".csv", ".json", ".html"), force)
    if confirm:
        choose(confirm, (*FORMULATIONS, _NONE), "--confirm", SceneError)
    with Progress("inverting") as advance:
        found = inverted(
            load_chain(scene, set_ or []),
            method=method,
            force=force,
            tell=tell,
            progress=lambda number, change: advance(_share(change), 1.0),
        )
    for text in found.warnings:
        tell(f"warning: {text}")
    elastic, rigid = (None, None) if confirm == _NONE or not _whole(found) else _confirmed(found, confirm)
    told = {**summary(found, elastic, rigid), "output": None if output is None else str(output)}
    if output is not None:
        if output.suffix == ".csv":
            write_columns(output, found)
        else:
            write(output, dumped(told) if output.suffix == ".json" else inversion_page(found, elastic, rigid))
    if json:
        return print_json(told)
    print(inversion_text(found, elastic, rigid, output))
    tell_written(output)


def _share(change: float) -> float:
    """How far an iteration has come, by decades of its change."""
    import math

    return min(1.0, max(0.0, -math.log10(max(change, 1e-300)) / _FALL))


def _whole(found: Inversion) -> bool:
    """Whether it came to the end of the run."""
    return len(found.t) == len(found.problem.t)


def _confirmed(found: Inversion, formulation: str) -> tuple[Confirmation, Confirmation]:
    """Forward runs with the drives, and with those of rigid links."""
    from erls.inverse.confirm import confirmed

    runs = []
    for efforts, start, what in (
        (found.efforts, found.start, "confirming"),
        (found.rigid_efforts, found.rigid_start, "rigid feed-forward"),
    ):
        with Progress(what) as advance:
            runs.append(confirmed(found, efforts, start, formulation, tell, advance))
    return runs[0], runs[1]
