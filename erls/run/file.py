"""Run files (HDF5): a run that can be read again without the files it came from.

Inside: the scene as JSON with its tables inlined, what the kind of run adds (knots of a motion, modal models of links,
equilibria), and for readers that only want curves (MATLAB, Julia, a plot) the group ``output`` with points, joints and
energies at even times.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeVar

import h5py
import msgspec

from erls.errors import Cause, SceneError, SimulationError
from erls.mechanism.tables import read_csv
from erls.run.accuracy_file import read_statement, write_statement
from erls.run.chain.file import read_chain, write_chain
from erls.run.chain.run import ChainRun
from erls.run.knots import End
from erls.run.record import Run
from erls.scene.bodies.schema import BodyScene, ShellSurface
from erls.scene.read import checked
from erls.scene.records import SceneFile
from fe_import.files.hdf5.files import open_for_reading, write_array, write_atomically, write_attribute, write_strings
from fe_import.files.hdf5.values import Reader

SCHEMA = "erls run"
SCHEMA_VERSION = 1
EARLIER = "erls result of bodies"  # what scenes of bodies had before they gave runs
_OUTPUT_TIMES = 1001
_SENT = "sent.run.h5"

S = TypeVar("S", bound=SceneFile)


def save_run(
    path: Path | str, run: Run, status: str = "", beside: Callable[[h5py.Group], None] | None = None
) -> None:
    """Write a run, completely or not at all.

    Parameters
    ----------
    path : Path or str
    run : Run
    status : str
        ``complete`` or the cause of the failure, unless given.
    beside : callable, optional
        Writes what else the file is to hold, instead of the curves for other programs.

    Raises
    ------
    SceneError
        NOT_WRITABLE.
    """
    if not status:
        status = "complete" if run.failure is None else str(run.failure.cause)

    def fill(group: h5py.Group) -> None:
        _fill(group, run, status)
        if beside is None:
            _fill_output(group, run)
        else:
            beside(group)

    write_atomically(path, fill, SceneError, Cause.NOT_WRITABLE)


def run_content(run: Run) -> bytes:
    """The bytes of its file, without curves for other programs."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / _SENT
        save_run(path, run, beside=lambda group: None)
        return path.read_bytes()


def run_of(content: bytes) -> Run:
    """A run from the bytes of its file."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / _SENT
        path.write_bytes(content)
        return load_run(path)


def _fill(group: h5py.Group, run: Run, status: str) -> None:
    write_attribute(group, "schema", SCHEMA)
    write_attribute(group, "schema_version", SCHEMA_VERSION)
    write_attribute(group, "units", "SI")
    write_attribute(group, "status", status)
    write_attribute(group, "message", "" if run.failure is None else str(run.failure))
    write_attribute(group, "scene_file", run.scene.path.name)
    write_attribute(group, "wall_s", run.wall_s)
    scene = msgspec.json.encode(self_contained(run.scene).record).decode()
    write_strings(group, "scene", scene, "the scene as JSON")
    write_strings(group, "warnings", run.warnings, "what the user was told")
    write_statement(group, run.accuracy, run.trust)
    if isinstance(run, ChainRun):
        write_chain(group, run)
    else:
        from erls.run.bodies.file import write_bodies  # here: they import nodal elements, which chains do not need
        from erls.run.bodies.motion import BodyMotion
        from erls.run.bodies.rest import BodyRest

        assert isinstance(run, (BodyMotion, BodyRest))
        write_bodies(group, run)


def _fill_output(group: h5py.Group, run: Run) -> None:
    """Curves at even times, or at those of stored states."""
    times, axis = run.looks(_OUTPUT_TIMES), run.axis
    if len(times):
        write_array(group, f"output/{axis.name.replace(' ', '_')}", times, axis.unit or "1", "even, or those stored")
        for name, curve in run.curves(times).items():
            write_array(group, f"output/{name}", curve.values, curve.unit, curve.text)


def _mesh(shell: ShellSurface, folder: Path, place: str) -> dict[str, Any]:
    """What the mesh of a shell holds, as fields of its record."""
    from erls.equations.nodal.scenes.shell_mesh import mesh_of  # here: most scenes have none

    places, cells, sets = mesh_of(shell, folder, place)
    return {
        "places": places.tolist(),
        "cells": cells.tolist(),
        "sets": {name: own.tolist() for name, own in sets.items()},
    }


def self_contained(scene: S) -> S:
    """The scene with the tables of its CSV files, and the meshes of its shells, written into it."""

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

    if not isinstance(scene, BodyScene) and b'"table"' not in msgspec.json.encode(scene.record):
        return scene  # most have none, and variants of a scene come by the thousand
    data = inline(msgspec.to_builtins(scene.record))
    if isinstance(scene, BodyScene):
        for k, shell in enumerate(scene.record.shells):
            if shell.mesh:
                data["shells"][k] |= {"mesh": "", **_mesh(shell, scene.folder, f"{scene.path}: shells[{k}]")}
    found = checked(data, scene.path, str(scene.path))
    assert isinstance(found, type(scene))
    return found


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
        schema, version = file.attribute("schema", str), file.attribute("schema_version", int)
        if schema == EARLIER:
            message, remedy = "made by a version whose scenes of bodies gave no runs", "run erls simulate again"
            raise SceneError(Cause.RUN_FILE, message, where=f"{path}: /@schema", value=schema, remedy=remedy)
        if schema != SCHEMA or version != SCHEMA_VERSION:
            raise file.fail("@schema", "not a run file of this version", schema, SCHEMA)
        text = file.text("scene")
        try:
            data = msgspec.json.decode(text, type=dict[str, Any])
        except (msgspec.DecodeError, RecursionError) as problem:
            raise file.fail("scene", f"not JSON: {problem}") from None
        scene = checked(data, Path(file.attribute("scene_file", str) or path.name), f"{path}: /scene")
        end = End(_failure(file), file.attribute("wall_s", float), file.names("warnings"))
        statement = read_statement(file)
        if not isinstance(scene, BodyScene):
            return replace(read_chain(file, scene, end), **statement)
        from erls.run.bodies.file import read_bodies

        return replace(read_bodies(file, scene, end), **statement)


def _failure(file: Reader) -> SimulationError | None:
    status = file.attribute("status", str)
    if status == "complete":
        return None
    cause = next((c for c in Cause if str(c) == status), Cause.INTERRUPTED)
    return SimulationError(cause, file.attribute("message", str) or f"the run is {status}")
