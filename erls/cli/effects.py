"""The command ``erls effects``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from erls.cli.terminal import Json, print_json, tell


def effects(
    scene: Path,
    /,
    *,
    set_: Annotated[list[str] | None, Parameter(name="--set", negative="")] = None,
    json: Json = False,
) -> None:
    """Show which physical effects a scene calls for, how large they are, and what they cost.

    Coarse runs with everything, and without one effect at a time, give the error of leaving it out; what
    effects = "auto" would leave out is marked.

    Parameters
    ----------
    scene
        Scene (TOML).
    set_
        Change a field of the scene, KEY=VALUE; may be repeated. For example simulation.effects_tolerance=1e-3.
    json
        Print one JSON object.
    """
    from erls.auto.survey import survey
    from erls.report.effects_table import effects_summary, effects_text

    found = survey(scene, set_ or (), tell)
    if json:
        return print_json(effects_summary(found))
    print(effects_text(found))
