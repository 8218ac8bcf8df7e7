"""Run files (HDF5): a run that can be read again without the files it came from.

Inside: the scene as JSON with its tables inlined, the modal models, the knots of the motion, and for readers that
only want curves (MATLAB, Julia, a plot) the group ``output`` with points, joints and energies at even times.
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import h5py
import msgspec
import numpy as np

from erls.equations.formulation import Formulation
from erls.equations.quasi_static.formulation import QuasiStatic
from erls.equations.registry import FORMULATIONS, formulate
from erls.errors import Cause, SceneError, SimulationError
from erls.integrate.base import Solution, Work
from erls.mechanism.effects import Certificate
from erls.mechanism.tables import read_csv
from erls.run.record import Run
from erls.scene.build import build_mechanism
from erls.scene.chain import Scene, SceneRecord
from erls.scene.check import check_scene
from fe_import.description.records import LinkDescription
from fe_import.errors import ReportedError
from fe_import.files.hdf5.files import open_for_reading, write_array, write_atomically, write_attribute, write_strings
from fe_import.files.hdf5.values import Reader
from fe_import.files.toml import choose, convert
from fe_import.modal.file import read_modal_group, write_modal_group
from fe_import.modal.model import ModalModel
from fe_import.models.substructures import MOST_PIECES

SCHEMA = "erls run"
SCHEMA_VERSION = 1
_OUTPUT_TIMES = 1001


def write_run(path: Path | str, run: Run, status: str = "") -> None:
    """Write a run, completely or not at all.

    Parameters
    ----------
    path : Path or str
    run : Run
    status : str
        ``complete`` or the cause of the failure, unless given.

    Raises
    ------
    SceneError
        NOT_WRITABLE.
    """
    if not status:
        status = "complete" if run.failure is None else str(run.failure.cause)
    write_atomically(path, lambda group: _fill(group, run, status), SceneError, Cause.NOT_WRITABLE)


def _fill(group: h5py.Group, run: Run, status: str) -> None:
    solution = run.solution
    write_attribute(group, "schema", SCHEMA)
    write_attribute(group, "schema_version", SCHEMA_VERSION)
    write_attribute(group, "units", "SI")
    write_attribute(group, "status", status)
    write_attribute(group, "message", "" if run.failure is None else str(run.failure))
    write_attribute(group, "scene_file", run.scene.path.name)
    write_attribute(group, "wall_s", run.wall_s)
    for name, value in {} if run.certificate is None else run.certificate.summary().items():
        if value is not None and np.isfinite(value):
            write_attribute(group, name, value)
    scene = msgspec.json.encode(self_contained(run.scene).record).decode()
    write_strings(group, "scene", scene, "the scene as JSON")
    write_strings(group, "warnings", run.warnings, "what the user was told")
    write_array(group, "knots/time", solution.t, "s", "times of the steps; twice where forces jump")
    reduced = _reduced(run.formulation)
    for name, values, unit in (
        ("position", solution.y, "rad, m, m sqrt(kg)"),
        ("velocity", solution.v, "per s"),
        ("acceleration", solution.a, "per s^2"),
    ):
        kept = values if reduced is None else reduced.stored(values)
        write_array(group, f"knots/{name}", kept, unit, "independent coordinates; knot, coordinate")
    for name, count in msgspec.to_builtins(solution.work).items():
        write_attribute(group["knots"], name, int(count))
    stored: list[ModalModel] = []
    numbers: list[int] = []
    models = group.create_group("models")
    every = [link.model for link in run.formulation.mechanism.links]
    every += [piece.model for link in run.formulation.mechanism.links for piece in link.pieces]
    for model in every:
        known = [k for k, other in enumerate(stored) if other is model]
        if not known:
            known = [len(stored)]
            stored.append(model)
            write_modal_group(models.create_group(f"{len(stored):04d}"), model)
        numbers.append(known[0] + 1)
    links = run.formulation.mechanism.links
    own, others = np.split(np.array(numbers, dtype=np.int64), [len(links)])
    write_array(group, "model_of_link", own, "1", "group of models/ of each link")
    counts = np.array([len(link.pieces) for link in links], dtype=np.int64)
    if counts.any():
        write_array(group, "substructures/count", counts, "1", "pieces of each link; 0 for a link in one")
        write_array(group, "substructures/model", others, "1", "group of models/ of each piece, link by link")
    if run.scene.record.simulation.formulation == "nodal":
        texts = [link.description and msgspec.json.encode(link.description).decode() for link in links]
        write_strings(group, "descriptions", tuple(t or "" for t in texts), "links made of beams as JSON, or empty")
    _fill_output(group, run)


def _fill_output(group: h5py.Group, run: Run) -> None:
    """Curves at even times, or at those of stored states."""
    times = run.looks(_OUTPUT_TIMES)
    states = run.states(times)
    write_array(group, "output/time", times, "s", "even times, or those of stored states")
    for k, name in enumerate(run.point_names):
        positions = np.array([run.point_position(s, k) for s in states])
        write_array(group, f"output/points/{name}", positions, "m", "world position; time, axis")
    for k, name in enumerate(run.joint_names):
        for what in ("coordinates", "angles", "rates"):
            values = np.array([getattr(s, what)[k] for s in states])
            write_array(
                group, f"output/joints/{name}/{what}", values, "rad or m, per s", "joint motion"
            )
    energy = run.energy(times)
    for kind in ("kinetic", "elastic", "gravity", "springs", "total"):
        write_array(group, f"output/energy/{kind}", getattr(energy, kind), "J", f"{kind} energy")


def self_contained(scene: Scene) -> Scene:
    """The scene with the tables of its CSV files written into it."""

    def inline(value: Any) -> Any:
        if isinstance(value, (list, tuple)):
            return [inline(v) for v in value]
        if not isinstance(value, dict):
            return value
        if value.get("shape") == "table" and value.get("file"):
            table = read_csv(scene.folder / value["file"], "table")
            value = dict(value)
            values = table[:, value.pop("column", 1)]
            times = table[:, 0].tolist()
            degrees = value.pop("degrees", False)
            value.pop("file")
            return {**value, "times": times, "values_deg" if degrees else "values": values.tolist()}
        return {k: inline(v) for k, v in value.items()}

    data = inline(msgspec.to_builtins(scene.record))
    return Scene(scene.path, convert(data, SceneRecord, str(scene.path), SceneError))


def load_run(path: Path | str) -> Run:
    """Read a run file.

    Raises
    ------
    SceneError
        FILE_NOT_FOUND, NOT_READABLE, or RUN_FILE: anything wrong inside.
    FEImportError
        A faulty modal model inside.
    """
    path = Path(path)
    with open_for_reading(path, SceneError, Cause.RUN_FILE) as file:
        if file.attribute("schema", str) != SCHEMA or file.attribute("schema_version", int) != SCHEMA_VERSION:
            raise file.fail(
                "@schema", "not a run file of this version", file.attribute("schema", str), SCHEMA
            )
        text = file.text("scene")
        try:
            data = msgspec.json.decode(text)
        except (msgspec.DecodeError, RecursionError) as problem:
            raise file.fail("scene", f"not JSON: {problem}") from None
        record = convert(data, SceneRecord, f"{path}: /scene", SceneError)
        check_scene(record, f"{path}: /scene")
        choose(record.simulation.formulation, FORMULATIONS, f"{path}: /scene simulation.formulation", SceneError)
        scene = Scene(Path(file.attribute("scene_file", str) or path.name), record)
        count = len(record.links)
        numbers = file.integers("model_of_link", (count,), 1, count + 1)
        models = file.subgroup("models")
        counts, others = _pieces(file, record)
        read = {
            int(n): read_modal_group(models.subgroup(f"{n:04d}").group, str(path))
            for n in sorted({*numbers.tolist(), *map(int, others)})
        }
        ends = np.cumsum([0, *counts])
        pieces = [[read[int(n)] for n in others[a:b]] for a, b in pairwise(ends.tolist())]
        descriptions: list[LinkDescription | None] = []
        if record.simulation.formulation == "nodal":
            descriptions = [_description(text, f"{path}: /descriptions") for text in file.names("descriptions", count)]
        try:
            whole = [read[int(n)] for n in numbers]
            built = build_mechanism(scene, models=whole, descriptions=descriptions, pieces=pieces)
            formulation = formulate(built.mechanism, record.simulation)
        except ReportedError as problem:
            problem.where = f"{path}: /scene: {problem.where}"
            raise
        knots = file.subgroup("knots")
        t = knots.array("time", (None,))
        reduced = _reduced(formulation)
        shape = (len(t), formulation.size if reduced is None else reduced.inner.size)
        if not len(t) or (np.diff(t) < 0).any():
            raise file.fail("knots/time", "times must rise", None)
        work = Work(**{name: knots.attribute(name, int) for name in msgspec.to_builtins(Work())})
        status = file.attribute("status", str)
        failure = None
        if status != "complete":
            cause = next((c for c in Cause if str(c) == status), Cause.INTERRUPTED)
            failure = SimulationError(cause, file.attribute("message", str) or f"the run is {status}")
        y, v, a = (knots.array(name, shape) for name in ("position", "velocity", "acceleration"))
        if reduced is not None:
            y, v, a = reduced.restored(y), reduced.restored(v), reduced.restored(a)
        solution = Solution(t, y, v, a, work, failure)
        warnings = file.names("warnings")
        return Run(scene, formulation, solution, file.attribute("wall_s", float), warnings, _certificate(file, record))


def _reduced(formulation: Formulation) -> QuasiStatic | None:
    """A formulation whose coordinates depend on how modes are scaled: files hold those of all modes."""
    return formulation if isinstance(formulation, QuasiStatic) else None


def _certificate(file: Reader, record: SceneRecord) -> Certificate | None:
    """Of a run with ``effects = "auto"``; an error that is not there could not be followed."""
    known = file.attribute_names()
    if "effects_wall_s" not in known:
        return None
    error = file.attribute("certified_error", float) if "certified_error" in known else float("inf")
    effort = file.attribute("certified_effort_error", float) if "certified_effort_error" in known else None
    settings = record.simulation
    tolerances = settings.effects_tolerance, settings.effects_effort_tolerance
    return Certificate(error, effort, *tolerances, file.attribute("effects_wall_s", float))


def _pieces(file: Reader, record: SceneRecord) -> tuple[list[int], list[int]]:
    """Number of substructures of each link, 0 for one in one piece, and the groups of their models."""
    if "substructures" not in file.names_inside():
        return [0] * len(record.links), []
    group = file.subgroup("substructures")
    counts = group.integers("count", (len(record.links),), 0, MOST_PIECES + 1).tolist()
    for count, link in zip(counts, record.links, strict=True):
        if count not in (0, link.substructures) or count == 1:
            raise group.fail("count", f"does not fit link {link.name!r}", count, link.substructures)
    return counts, group.integers("model", (sum(counts),), 1).tolist()


def _description(text: str, where: str) -> LinkDescription | None:
    """A link description that was embedded."""
    if not text:
        return None
    try:
        data = msgspec.json.decode(text)
    except (msgspec.DecodeError, RecursionError) as problem:
        raise SceneError(Cause.RUN_FILE, f"not JSON: {problem}", where=where, remedy="make the run again") from None
    return convert(data, LinkDescription, where)
