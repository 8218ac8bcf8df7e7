"""Exports of a run: deformed links for ParaView (.pvd with .vtu files) and a table (CSV)."""

from __future__ import annotations

import contextlib
import csv
import re
import shutil
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from erls.equations.formulation import Reaction, State
from erls.errors import Cause, SceneError
from erls.files.output import check_writable, not_writable, replacing, temporary_name
from erls.integrate.base import hermite
from erls.maths.so3 import Array
from erls.run.record import Run, node_positions

Progress = Callable[[int, int], None]  # (done, total)

_PARAVIEW_TIMES, _TABLE_TIMES = 101, 1001
_OURS = re.compile(r"t\d{5,}_link\d+\.vtu")


def export_paraview(
    run: Run,
    path: Path | str,
    times: Sequence[float] | None = None,
    magnification: float = 1.0,
    progress: Progress | None = None,
) -> None:
    """Write the deformed links: NAME.pvd and a folder NAME_files with a .vtu for each time and link.

    Points are deformed positions [m], in the order of the link's nodes. Point data: ``displacement`` against the
    Equivalent Rigid Link System, world axes [m], always true; ``link`` counts links from 1.

    Parameters
    ----------
    run : Run
    path : path
        NAME.pvd. It and its folder are replaced together, or stay as they were.
    times : sequence of float, optional
        [s]; 101 even ones unless given.
    magnification : float
        Of the displacement in the points; 1 is true.
    progress : callable, optional
        Told the times done and their total.

    Raises
    ------
    SceneError
        NOT_WRITABLE, TIME_OUT_OF_RANGE, BAD_FIELD.
    """
    if not np.isfinite(magnification):
        raise SceneError(
            Cause.BAD_FIELD, "must be finite", where="magnification", value=magnification, remedy="1 is true"
        )
    target = check_writable(path)
    folder = target.with_name(f"{target.stem}_files")
    _check_replaceable(folder)
    states = run.states(_times(run, times, _PARAVIEW_TIMES))
    root = ET.Element("VTKFile", type="Collection", version="1.0", byte_order="LittleEndian")
    collection = ET.SubElement(root, "Collection")
    with replacing(target) as index, _replacing_folder(folder, path) as temporary:
        for number, state in enumerate(states):
            for k, name in enumerate(run.link_names):
                file = f"t{number:05d}_link{k + 1}.vtu"
                _write_link(run, state, k, temporary / file, magnification)
                place = {"timestep": repr(state.time), "part": str(k), "name": name, "file": f"{folder.name}/{file}"}
                ET.SubElement(collection, "DataSet", place)
            if progress is not None:
                progress(number + 1, len(states))
        ET.indent(root)
        ET.ElementTree(root).write(index, encoding="utf-8", xml_declaration=True)


def _write_link(run: Run, state: State, link: int, path: Path, magnification: float) -> None:
    import meshio

    model = run.formulation.mechanism.links[link].model
    points = node_positions(run, state, link, magnification=magnification)
    turn = state.poses[link][:3, :3]
    displacement = (model.translation_shapes @ state.modal[link]) @ turn.T
    cells = [(kind, c) for kind, c in (("line", model.lines), ("triangle", model.triangles)) if len(c)]
    if not cells:
        cells = [("vertex", np.arange(len(points))[:, None])]
    data = {"displacement": displacement, "link": np.full(len(points), link + 1)}
    meshio.Mesh(points, cells, point_data=data).write(path)


def _check_replaceable(folder: Path) -> None:
    """Refuse to replace a folder that holds anything but an earlier export."""
    if not folder.exists():
        return
    foreign = folder.name
    if folder.is_dir() and not folder.is_symlink():
        foreign = next((f.name for f in sorted(folder.iterdir()) if not _OURS.fullmatch(f.name)), "")
    if foreign:
        raise not_writable(folder, f"{foreign!r} is no earlier export", "move it away, or choose another name")


@contextlib.contextmanager
def _replacing_folder(folder: Path, path: Path | str) -> Iterator[Path]:
    """A temporary folder that takes the place of ``folder`` when the block ends well."""
    temporary, old = temporary_name(folder), temporary_name(folder)
    try:
        temporary.mkdir()
        yield temporary
        if folder.exists():
            folder.rename(old)
        temporary.rename(folder)
    except OSError as problem:
        raise not_writable(path, problem, "free disk space, or choose another path") from problem
    finally:
        if old.exists() and not folder.exists():
            old.rename(folder)
        for rest in (temporary, old):
            shutil.rmtree(rest, ignore_errors=True)


def export_csv(run: Run, path: Path | str, times: Sequence[float] | None = None) -> None:
    """Write a table: one line of names with units, then one line for each time, 17 significant digits.

    Columns: t; of each point x, y, z; of each joint coordinate, physical angle, its rate, effort, reaction force and
    moment on the outer link (world axes); energies.

    Parameters
    ----------
    run : Run
    path : path
    times : sequence of float, optional
        [s]; 1001 even ones unless given.

    Raises
    ------
    SceneError
        NOT_WRITABLE, TIME_OUT_OF_RANGE.
    """
    check_writable(path)
    columns = table(run, _times(run, times, _TABLE_TIMES))
    rows = np.column_stack(list(columns.values()))
    with replacing(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows([format(value, ".17g") for value in row] for row in rows.tolist())


def table(run: Run, times: ArrayLike) -> dict[str, Array]:
    """The columns of `export_csv`: (n,) values by name with unit."""
    t = np.asarray(times, dtype=float)
    states = run.states(t)
    columns = {"t [s]": t}
    for k, name in enumerate(run.point_names):
        _vector(columns, _plain(name), "m", [run.point_position(s, k) for s in states])
    reactions = _reactions(run, t)
    for k, joint in enumerate(run.formulation.mechanism.joints):
        name, unit, effort = _plain(joint.name), *(("rad", "N m") if joint.type.revolute else ("m", "N"))
        columns[f"{name}.coordinate [{unit}]"] = np.array([s.coordinates[k] for s in states])
        columns[f"{name}.angle [{unit}]"] = np.array([s.angles[k] for s in states])
        columns[f"{name}.rate [{unit}/s]"] = np.array([s.rates[k] for s in states])
        columns[f"{name}.effort [{effort}]"] = np.array([r[k].effort for r in reactions])
        _vector(columns, f"{name}.force", "N", [r[k].force for r in reactions])
        _vector(columns, f"{name}.moment", "N m", [r[k].moment for r in reactions])
    energy = run.energy(t)
    for kind in ("kinetic", "elastic", "gravity", "springs", "total"):
        columns[f"energy.{kind} [J]"] = np.asarray(getattr(energy, kind))
    return columns


def _reactions(run: Run, t: Array) -> list[list[Reaction]]:
    """Reactions of all joints at each time: every time is solved once."""
    s = run.solution
    y, v = hermite(s.t, s.y, s.v, s.a, np.clip(t, s.t[0], run.end))
    return [run.formulation.reactions(*at) for at in zip(t.tolist(), y, v, strict=True)]


def _vector(columns: dict[str, Array], name: str, unit: str, values: list[Array]) -> None:
    for axis, part in zip("xyz", np.array(values).reshape(-1, 3).T, strict=True):
        columns[f"{name}.{axis} [{unit}]"] = part


def _plain(name: str) -> str:
    return " ".join(name.split())


def _times(run: Run, times: Sequence[float] | None, count: int) -> Array:
    """The times asked for, or even ones."""
    if times is not None and len(times):
        return np.asarray(times, dtype=float)
    start = float(run.solution.t[0])
    return np.linspace(start, run.end, count if run.end > start else 1)
