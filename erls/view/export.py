"""Exports of a run: deformed links for ParaView (.pvd with .vtu files) and a table (CSV)."""

from __future__ import annotations

import contextlib
import re
import shutil
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from erls.errors import Cause, SceneError
from erls.files.csv_table import write_table
from erls.files.output import check_writable, not_writable, replacing, temporary_name
from erls.files.results import MARK
from erls.maths.so3 import Array
from erls.run.record import Run
from erls.view.figure import PartMesh
from erls.view.figures import figure_of

Progress = Callable[[int, int], None]  # (done, total)

_PARAVIEW_TIMES, _TABLE_TIMES = 101, 1001
_OURS = re.compile(r"t\d{5,}_(link|part)\d+\.vtu")


def export_paraview(
    run: Run,
    path: Path | str,
    times: Sequence[float] | None = None,
    magnification: float = 1.0,
    progress: Progress | None = None,
    color: str = "deflection",
) -> None:
    """Write the deformed links, or beams and bodies: NAME.pvd and a folder NAME_files with a .vtu for each time and
    link.

    Points are deformed positions [m], in the order of the link's nodes, then of the corners of its surface where it has
    one. Point data: ``displacement`` against the Equivalent Rigid Link System, of beams and bodies against where they
    are built, world axes [m], always true; ``link`` counts links from 1, ``part`` beams and bodies.

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
    color : str
        A key of `erls.view.figure.SHADES` that is point data, too.

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
    figure = figure_of(run, magnification, color)
    poses = figure.poses(_times(run, times, _PARAVIEW_TIMES))
    root = ET.Element("VTKFile", type="Collection", version="1.0", byte_order="LittleEndian")
    root.append(ET.Comment(f" {MARK} "))
    collection = ET.SubElement(root, "Collection")
    with replacing(target) as index, _replacing_folder(folder, path) as temporary:
        for number, pose in enumerate(poses):
            for k, mesh in enumerate(pose.meshes(magnification)):
                file = f"t{number:05d}_{figure.part}{k + 1}.vtu"
                _write_mesh(mesh, {figure.part: np.full(len(mesh.points), k + 1)}, temporary / file)
                place = {"timestep": repr(pose.time), "part": str(k), "name": mesh.name}
                ET.SubElement(collection, "DataSet", {**place, "file": f"{folder.name}/{file}"})
            if progress is not None:
                progress(number + 1, len(poses))
        ET.indent(root)
        ET.ElementTree(root).write(index, encoding="utf-8", xml_declaration=True)


def _write_mesh(mesh: PartMesh, data: dict[str, Any], path: Path) -> None:
    import meshio

    data = {"displacement": mesh.displacement, **mesh.more, **data}
    meshio.Mesh(mesh.points, mesh.cells, point_data=data).write(path)


def _check_replaceable(folder: Path) -> None:
    """Refuse to replace a folder that holds anything but an earlier export."""
    try:
        if not folder.exists():
            return
    except OSError as problem:  # too long a name
        raise not_writable(folder, problem.strerror, "choose a shorter name") from None
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

    The columns are those of `Run.columns`.

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
    columns = run.columns(_times(run, times, _TABLE_TIMES))
    rows = np.column_stack(list(columns.values()))
    with replacing(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        write_table(file, columns, ([format(value, ".17g") for value in row] for row in rows.tolist()))


def _times(run: Run, times: Sequence[float] | None, count: int) -> Array:
    """The times asked for, or even ones."""
    if times is not None and len(times):
        return np.asarray(times, dtype=float)
    return run.spread(count)
