"""Result files of scenes of bodies (HDF5): places of all nodes over time or load, and the summary as JSON.

For readers that only want curves (MATLAB, Julia, a plot): ``parameter`` (k,), time or load parameter, and a dataset
``points/NAME`` (k, 3) for every reported node. ``nodes`` (k, n, 12) holds position and rotation matrix of all.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import msgspec
import numpy as np

from erls.errors import Cause, SceneError
from erls.run.bodies.result import Motion, Rest
from fe_import.files.hdf5.files import open_for_reading, write_array, write_atomically, write_attribute, write_strings

SCHEMA = "erls result of bodies"
SCHEMA_VERSION = 1


def write_result(path: Path | str, result: Motion | Rest) -> None:
    """Write a result, completely or not at all.

    Raises
    ------
    SceneError
        NOT_WRITABLE.
    """
    write_atomically(path, lambda group: _fill(group, result), SceneError, Cause.NOT_WRITABLE)


def _fill(group: h5py.Group, result: Motion | Rest) -> None:
    write_attribute(group, "schema", SCHEMA)
    write_attribute(group, "schema_version", SCHEMA_VERSION)
    write_attribute(group, "units", "SI")
    write_attribute(group, "status", "complete" if result.failure is None else str(result.failure.cause))
    write_attribute(group, "scene_file", result.scene.path.name)
    write_strings(group, "scene", msgspec.json.encode(result.scene.record).decode(), "the scene as JSON")
    parameter, frames = _course(result)
    summary = result.summary([result.end]) if isinstance(result, Motion) else result.summary()
    write_strings(group, "summary", msgspec.json.encode(summary).decode(), "what erls simulate printed, as JSON")
    unit = "s" if isinstance(result, Motion) else "1"
    write_array(group, "parameter", parameter, unit, "time, or load parameter")
    write_strings(group, "node_names", tuple(result.assembly.numbers), "in the order of nodes")
    write_array(group, "nodes", frames, "m, 1", "parameter, node, position and rows of the rotation matrix")
    for name in result.assembly.reported:
        places = frames[:, result.assembly.numbers[name], :3]
        write_array(group, f"points/{name.replace('/', ':')}", np.ascontiguousarray(places), "m", "parameter, axis")


def _course(result: Motion | Rest) -> tuple[np.ndarray, np.ndarray]:
    """Parameter (k,) and frames (k, nodes, 12)."""
    count = result.assembly.system.count
    if isinstance(result, Motion):
        s = result.solution
        return s.t, s.y.reshape(len(s.t), count, 12)
    path = result.statics.path
    poses = np.array([e.q.poses for e in path]).reshape(len(path), count, 4, 4)
    turns = poses[:, :, :3, :3].reshape(len(path), count, 9)
    return np.array([e.t for e in path]), np.concatenate([poses[:, :, :3, 3], turns], axis=2)


def refuse_result(path: Path | str, why: str) -> None:
    """Refuse a file that `write_result` wrote, with what to do instead; any other file passes.

    Raises
    ------
    SceneError
        BAD_FIELD.
    """
    try:
        with h5py.File(path, "r", locking="best-effort") as file:
            schema = file.attrs.get("schema")
    except (OSError, ValueError):
        return  # whoever reads it says what is wrong
    if schema in (SCHEMA, SCHEMA.encode()):
        remedy = "read its datasets points/NAME over parameter, or use erls info"
        raise SceneError(Cause.BAD_FIELD, why, where=str(path), value="a result of bodies", remedy=remedy)


def read_summary(path: Path | str) -> dict[str, Any]:
    """What `write_result` noted: the JSON of ``erls simulate``, with ``status``.

    Raises
    ------
    SceneError
        FILE_NOT_FOUND, NOT_READABLE or RUN_FILE.
    """
    with open_for_reading(path, SceneError, Cause.RUN_FILE) as file:
        if file.attribute("schema", str) != SCHEMA or file.attribute("schema_version", int) != SCHEMA_VERSION:
            raise file.fail("@schema", "not a result of this version", file.attribute("schema", str), SCHEMA)
        try:
            found = msgspec.json.decode(file.text("summary"), type=dict[str, Any])
        except (msgspec.DecodeError, RecursionError) as problem:
            raise file.fail("summary", f"not JSON: {problem}") from None
        return {**found, "status": file.attribute("status", str)}
