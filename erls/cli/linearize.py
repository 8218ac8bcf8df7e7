"""The command ``erls linearize``."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from erls.cli.reports import Set, bad, check_output, dumped, tell_written, write
from erls.cli.terminal import Force, Json, Output, print_json, tell

if TYPE_CHECKING:
    from erls.linear.diagrams import Diagram
    from erls.run.record import Run
    from erls.scene.read import AnyScene

_MOST = 1000  # values of a diagram


def linearize(
    scene: Path,
    /,
    *,
    output: Output = None,
    at: float | None = None,
    equilibrium: Annotated[bool, Parameter(negative="")] = False,
    inputs: str | None = None,
    outputs: str | None = None,
    campbell: str = "",
    locus: str = "",
    mode: int | None = None,
    set_: Set = None,
    force: Force = False,
    json: Json = False,
) -> None:
    """Small motions of a mechanism about a state: matrices, poles, modes, zeros, responses.

    About its start, unless another state is asked for.

    Parameters
    ----------
    scene
        Scene (TOML), or with --at a run file of it.
    output
        File to write: .json, .npz or .mat the model, .html a self-contained page with Bode and Nichols plots and step
        responses; of a diagram .json or .html.
    at
        Time of the motion in seconds, which is computed up to it.
    equilibrium
        About the equilibrium with all joints free next to the start, stable or not.
    inputs
        Separated by commas: joint.NAME.effort, joint.NAME.acceleration of a prescribed or wanted motion,
        point.NAME.force.x, point.NAME.moment.x, load.NUMBER.factor. Efforts of drives and prescribed motions unless
        given.
    outputs
        Separated by commas: joint.NAME.angle, .rate, .acceleration, .effort, point.NAME.x, .velocity.x,
        .acceleration.x, sensor.NAME. Angles, places and sensors unless given.
    campbell
        JOINT=FROM:TO:COUNT: poles over the speed of a joint [rad/s], which turns evenly; for example hub=0:100:21.
    locus
        KEY=FROM:TO:COUNT: poles over a field of the scene, as --set names it; for example
        joints.elbow.drive.proportional_gain=0:200:21.
    mode
        Write this mode, counted from 1, as a run file for erls view: one period in a second.
    set_
        Change a field of the scene, KEY=VALUE; may be repeated.
    force
        Replace an existing file that is no such model or page.
    json
        Print one JSON object.
    """
    from erls.linear.files import FORMATS, summary, write_model
    from erls.linear.linearize import EQUILIBRIUM
    from erls.linear.linearize import linearize as linear_model
    from erls.report.linear_page import model_page, model_text

    if at is not None and equilibrium:
        raise bad("two states at once", "--at", at, "give --at or --equilibrium")
    if mode is not None:
        return _mode(scene, mode, output, EQUILIBRIUM if equilibrium else at or 0.0, set_ or [], force, json)
    if campbell or locus:
        return _diagram(scene, output, at, equilibrium, campbell, locus, set_ or [], force, json)
    check_output(output, [scene], set_ or [], (*FORMATS, ".html"), force)
    state = EQUILIBRIUM if equilibrium else at or 0.0
    chosen = {"inputs": _names(inputs), "outputs": _names(outputs)}
    model = linear_model(_loaded(scene, set_ or []), at=state, **chosen, tell=tell)
    for text in model.warnings:
        tell(f"warning: {text}")
    if output is not None:
        if output.suffix == ".html":
            write(output, model_page(model))
        else:
            write_model(output, model)
    if json:
        return print_json({**summary(model), "output": None if output is None else str(output)})
    print(model_text(model))
    tell_written(output)


def _mode(
    scene: Path, number: int, output: Path | None, at: float | str, changes: list[str], force: bool, json: bool
) -> None:
    """A mode as a run."""
    from erls.cli.reports import read_by
    from erls.files.results import RUN, claim
    from erls.linear.mode_run import mode_run
    from erls.run.chain.run import ChainRun
    from erls.run.file import save_run
    from erls.scene.chain import Scene

    if output is None:
        raise bad("a mode is written as a run file", "--output", "nothing", "give -o MODE.run.h5")
    claim(output, RUN, read_by([scene], changes), force)
    loaded = _loaded(scene, changes)
    if not isinstance(loaded, (Scene, ChainRun)):
        raise bad("a scene of bodies and beams", "--mode", number, "simulate it with type = 'frequencies'")
    found = mode_run(loaded, number, at, tell)
    save_run(output, found)
    if json:
        return print_json({"scene": found.scene.name, "output": str(output)})
    print(f"{found.scene.name}\nwritten to {output}")


def _loaded(path: Path, changes: list[str]) -> AnyScene | Run:
    """A scene, or a run."""
    from erls.files.results import RUN, schema_of
    from erls.run.file import load_run
    from erls.scene.read import load_scene

    if schema_of(path) != RUN:
        return load_scene(path, changes)
    if changes:
        raise bad("a run is as it was made", "--set", changes[0], "give the scene instead of the run")
    return load_run(path)


def _diagram(
    scene: Path,
    output: Path | None,
    at: float | None,
    equilibrium: bool,
    campbell: str,
    locus: str,
    changes: list[str],
    force: bool,
    json: bool,
) -> None:
    """Poles over a speed or a field."""
    from erls.linear import diagrams
    from erls.linear.linearize import EQUILIBRIUM
    from erls.report.linear_page import diagram_page, diagram_summary, diagram_text
    from erls.scene.read import load_chain

    if campbell and locus:
        raise bad("two diagrams at once", "--locus", locus, "give --campbell or --locus")
    if campbell and at is not None:
        raise bad("steady rotation is an equilibrium", "--at", at, "leave it out")
    check_output(output, [scene], changes, (".json", ".html"), force)
    found: Diagram
    if campbell:
        joint, speeds = _range(campbell, "--campbell")
        found = diagrams.campbell(load_chain(scene, changes), joint, speeds, tell)
    else:
        key, values = _range(locus, "--locus")
        state = EQUILIBRIUM if equilibrium else at or 0.0
        found = diagrams.root_locus(scene, key, values, state, changes, tell)
    for text in found.warnings:
        tell(f"warning: {text}")
    if output is not None:
        write(output, diagram_page(found) if output.suffix == ".html" else dumped(diagram_summary(found)))
    if json:
        return print_json({**diagram_summary(found), "output": None if output is None else str(output)})
    print(diagram_text(found))
    tell_written(output)


def _names(text: str | None) -> list[str] | None:
    return None if text is None else [name.strip() for name in text.split(",") if name.strip()]


def _range(text: str, option: str) -> tuple[str, list[float]]:
    """Of NAME=FROM:TO:COUNT."""
    name, _, values = text.rpartition("=")
    parts = values.split(":")
    try:
        first, last, count = float(parts[0]), float(parts[1]), int(parts[2])
        fine = len(parts) == 3 and bool(name.strip()) and 2 <= count <= _MOST
    except (ValueError, IndexError, OverflowError):
        fine = False
    if not fine or not (math.isfinite(first) and math.isfinite(last)):
        remedy = f"NAME=FROM:TO:COUNT with 2 to {_MOST} values, for example hub=0:100:21"
        raise bad("not a range of values", option, text, remedy)
    return name.strip(), [first + (last - first) * k / (count - 1) for k in range(count)]
