"""The command that fits scenes to measured records: ``erls identify``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from erls.cli.reports import Set, bad, check_output, dumped, tell_written, write
from erls.cli.terminal import Force, Json, Output, Progress, print_json


def identify(
    scene: Path,
    /,
    *,
    measured: Path | None = None,
    fit: Annotated[list[str] | None, Parameter(name="--fit", negative="")] = None,
    bounds: Annotated[list[str] | None, Parameter(name="--bounds", negative="")] = None,
    output: Output = None,
    set_: Set = None,
    force: Force = False,
    json: Json = False,
) -> None:
    """Fit numbers of a scene to a measured record: values, intervals, what the record does not tell.

    Parameters
    ----------
    scene
        Scene (TOML); its values are where the fit begins.
    measured
        Record (CSV): time in its first column, then columns with heads of the table that erls view -o RUN.csv gives.
    fit
        Keys as of --set, separated by commas; * stands for any part: joints.*.damping. May be repeated.
    bounds
        KEY=LOW:HIGH; may be repeated. Parameters that are not bounded keep their sign.
    output
        Report to write: .html a self-contained page with plots, .json the JSON object.
    set_
        Change a field of the scene, KEY=VALUE; may be repeated.
    force
        Replace an existing file that is no such report.
    json
        Print one JSON object.
    """
    from erls.identify.identify import identify as fitted
    from erls.identify.identify import summary
    from erls.report.identify_page import identify_page, identify_text

    if measured is None or not fit:
        missing = "--measured" if measured is None else "--fit"
        raise bad("a fit needs a record and numbers to fit", missing, "nothing", f"give {missing}")
    check_output(output, [scene], set_ or [], (".html", ".json"), force, [measured])
    with Progress("fitting") as advance:
        found = fitted(scene, measured, fit, overrides=set_ or (), bounds=_bounds(bounds or []), progress=advance)
    if output is not None:
        write(output, identify_page(found) if output.suffix == ".html" else dumped(summary(found)))
    if json:
        return print_json({**summary(found), "output": None if output is None else str(output)})
    print(identify_text(found))
    tell_written(output)


def _bounds(texts: list[str]) -> dict[str, tuple[float, float]]:
    """KEY=LOW:HIGH."""
    found = {}
    for text in texts:
        key, _, ends = text.partition("=")
        try:
            low, high = (float(end) for end in ends.split(":"))
        except ValueError:
            raise bad("not of the form KEY=LOW:HIGH", "--bounds", text, "e.g. joints.hip.damping=0.01:1") from None
        if not low < high:
            raise bad("the lower bound must be below the upper one", "--bounds", text, "swap or change them")
        found[key.strip()] = (low, high)
    return found
