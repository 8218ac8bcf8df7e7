"""The command ``erls plan``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from erls.cli.reports import Set, check_output, dumped, tell_written, write
from erls.cli.terminal import Force, Json, Output, print_json, tell

if TYPE_CHECKING:
    from erls.tracking.plan import Planned


def plan(
    scene: Path,
    /,
    *,
    output: Output = None,
    method: str = "shaped",
    confirm: str = "",
    set_: Set = None,
    force: Force = False,
    json: Json = False,
) -> int:
    """Find a short motion between two poses that keeps bounds on efforts, rates and the vibration after it.

    Poses and bounds stand in the table [plan] of the scene. A law is found by a model, run forward with its links as
    they bend, and found anew until the run keeps all bounds. Exit code 4 where none does.

    Parameters
    ----------
    scene
        Scene (TOML).
    output
        File to write: .csv the motions of the joints over time, with rates and efforts, a table that scenes can use as
        it is; .json what is printed.
    method
        shaped: a polynomial, folded so that slow vibrations are left at rest; optimal: from there on to shorter laws,
        as far as forward runs keep the bounds.
    confirm
        Formulation of the forward runs, erls, ffr or nodal: that of the scene unless given.
    set_
        Change a field of the scene, KEY=VALUE; may be repeated.
    force
        Replace an existing file that is no such result.
    json
        Print one JSON object.
    """
    from erls.equations.registry import FORMULATIONS
    from erls.errors import SceneError
    from erls.files.csv_table import write_columns
    from erls.report.plan_text import plan_text
    from erls.scene.read import load_chain
    from erls.tracking.plan import plan as planned
    from erls.tracking.plan_files import columns, summary
    from fe_import.files.toml import choose

    check_output(output, [scene], set_ or [], (".csv", ".json"), force)
    if confirm:
        choose(confirm, FORMULATIONS, "--confirm", SceneError)
    found = planned(load_chain(scene, set_ or []), method=method, formulation=confirm, tell=tell, told=_tell)
    if not found.kept:
        tell("warning: no law was found whose forward run keeps all bounds; this is the last one")
    told = {**summary(found), "output": output and str(output)}
    if output is not None:
        if output.suffix == ".csv":
            write_columns(output, {name: x.tolist() for name, x in columns(found).items()})
        else:
            write(output, dumped(told))
    if json:
        print_json(told)
    else:
        print(plan_text(found, output))
        tell_written(output)
    return 0 if found.kept else 4


def _tell(found: Planned) -> None:
    """Of every law that was run."""
    word = "keeps the bounds" if found.kept else "passes a bound"
    tell(f"{found.method}: {found.law.duration:.4g} s, swings on by {1e3 * found.swing:.3g} mm, {word}")
