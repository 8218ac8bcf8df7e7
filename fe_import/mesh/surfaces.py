"""Surfaces that are only drawn: STL through meshio and OBJ, within limits; thinned; written as binary STL."""

from __future__ import annotations

import stat
from functools import lru_cache
from pathlib import Path

import numpy as np

from fe_import.errors import Cause, FEImportError
from fe_import.mesh.meshio_files import read_with_meshio
from fe_import.mesh.raw import Block
from fe_import.model import MOST_TRIANGLES, Array, IntArray, Surface

SUFFIXES = (".stl", ".obj")
_MOST_BYTES = 50_000_000
_LARGEST = 1e6  # [m]
_STL = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def read_surface(path: Path, most: int | None = MOST_TRIANGLES) -> Surface:
    """Read the faces of a file, polygons cut into triangles; triangles without area are left out.

    What this process has read lately, for the variants of a study, is shared while the file keeps its size and time.

    Parameters
    ----------
    path : Path
        Ends in one of `SUFFIXES`.
    most : int or None
        Triangles that it may have; None: as many as a file of 50 MB holds.

    Returns
    -------
    Surface
        In the file's unit of length.

    Raises
    ------
    FEImportError
        FILE_NOT_FOUND; NOT_READABLE: no regular file, another format, too large, damaged; MESH: no triangles, too many,
        corners that are not in the file or not finite.
    """
    where, remedy = str(path), "give an STL or OBJ file of moderate size"
    try:
        status = path.stat()
    except (OSError, ValueError):
        raise FEImportError(Cause.FILE_NOT_FOUND, "no such file", where=where, remedy="check the path") from None
    if not stat.S_ISREG(status.st_mode) or path.suffix.lower() not in SUFFIXES:
        message = f"not a file that ends in {' or '.join(SUFFIXES)}"
        raise FEImportError(Cause.NOT_READABLE, message, where=where, value=path.suffix, remedy="convert it")
    if status.st_size > _MOST_BYTES:
        message, limit = "too large for a surface that is only drawn", f"{_MOST_BYTES} bytes"
        raise FEImportError(Cause.NOT_READABLE, message, where=where, value=status.st_size, limit=limit, remedy=remedy)
    if most is None:
        return _read(path, most)
    return _lately(path.absolute(), most, status.st_size, status.st_mtime_ns)


@lru_cache(maxsize=64)
def _lately(path: Path, most: int, size: int, time: int) -> Surface:
    """Keyed by what tells that a file was replaced."""
    surface = _read(path, most)
    surface.points.setflags(write=False)
    surface.triangles.setflags(write=False)
    return surface


def _read(path: Path, most: int | None) -> Surface:
    points, triangles = _obj(path) if path.suffix.lower() == ".obj" else _stl(path)
    return sound(points, triangles, str(path), most)


def sound(points: Array, triangles: IntArray, where: str, most: int | None = MOST_TRIANGLES) -> Surface:
    """A surface that can be drawn: what lies in no triangle, and triangles without three corners, are left out.

    Parameters
    ----------
    points : (n, 3) array
    triangles : (t, 3) int array
    where : str
        For messages.
    most : int or None

    Raises
    ------
    FEImportError
        MESH: as `read_surface`.
    """
    remedy = "give an STL or OBJ file of moderate size"
    if len(triangles) and not 0 <= triangles.min() <= triangles.max() < len(points):
        message = "triangles refer to corners that are not in the file"
        raise FEImportError(Cause.MESH, message, where=where, remedy="write the file again")
    points, triangles = _used(points, triangles)
    if not len(triangles):
        raise FEImportError(Cause.MESH, "no triangles", where=where, remedy=remedy)
    if not (np.abs(points) < _LARGEST).all():
        message = "corners that are not finite numbers of plausible size"
        raise FEImportError(Cause.MESH, message, where=where, limit=_LARGEST, remedy="write the file again")
    if most is not None and len(triangles) > most:
        message, remedy = "more triangles than a link may be drawn with", "thin it in the program that made it"
        raise FEImportError(Cause.MESH, message, where=where, value=len(triangles), limit=most, remedy=remedy)
    return Surface(points, triangles)


def thinned(surface: Surface, most: int) -> Surface:
    """A surface of at most so many triangles: corners in one cell of a grid become their mean (Rossignac and Borrel,
    1993), in the first of growing grids that does.
    """
    points, triangles = surface.points, surface.triangles
    if len(triangles) <= most:
        return surface
    a, b, c = (points[triangles[:, k]] for k in range(3))
    area = float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)
    width = max(0.25 * (area / most) ** 0.5, 1e-6 * float(np.ptp(points, axis=0).max()))
    while True:
        cells = np.floor((points - points.min(axis=0)) / width).astype(np.int64)
        _, own, count = np.unique(_numbers(cells), return_inverse=True, return_counts=True)
        means = np.stack([np.bincount(own, points[:, k]) / count for k in range(3)], axis=1)
        found = own[triangles]
        _, first = np.unique(_numbers(np.sort(found, axis=1)), return_index=True)
        places, left = _used(means, found[np.sort(first)])
        if len(left) <= most:
            return Surface(places, left)
        width *= max(1.05, 0.95 * (len(left) / most) ** 0.5)  # a surface has cells by the square of their width


def _numbers(rows: IntArray) -> IntArray:
    """One number for each row of three, equal for equal rows; of at most 1e6 on each side, or corners."""
    x, y, z = rows.T
    return np.asarray((x * (y.max() + 1) + y) * (z.max() + 1) + z)


def as_stored(surface: Surface, where: str) -> Surface:
    """As its STL file will be read; FEImportError, MESH, where nothing is left in single precision."""
    with np.errstate(over="ignore"):
        rounded = surface.points.astype(np.float32)
    points, own = np.unique(rounded, axis=0, return_inverse=True)
    return sound(points.astype(np.float64), own.reshape(-1)[surface.triangles], where)


def stl_bytes(surface: Surface, remark: str) -> bytes:
    """A binary STL file, single precision, with a remark of at most 80 characters that does not start with "solid"."""
    corners = surface.points[surface.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    table = np.zeros(len(corners), dtype=_STL)
    table["normal"] = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    table["corners"] = corners
    return remark.encode("ascii")[:80].ljust(80) + len(table).to_bytes(4, "little") + table.tobytes()


def _used(points: Array, triangles: IntArray) -> tuple[Array, IntArray]:
    """Corners that triangles use, and those triangles that have three of them."""
    ordered = np.sort(triangles, axis=1)
    triangles = triangles[(ordered[:, 1:] != ordered[:, :-1]).all(axis=1)]
    used, numbers = np.unique(triangles, return_inverse=True)
    return points[used], numbers.reshape(-1, 3).astype(np.int64)


def _stl(path: Path) -> tuple[Array, IntArray]:
    with path.open("rb") as file:
        head, size = file.read(84), path.stat().st_size
    declared = 84 + 50 * int.from_bytes(head[80:], "little")
    if head[:5].lower() != b"solid" and size != declared:  # meshio would look for text in it
        message, remedy = "cut off, or no STL file", "write the file again"
        raise FEImportError(Cause.NOT_READABLE, message, where=str(path), value=size, limit=f"{declared} bytes",
                            remedy=remedy)  # fmt: skip
    raw = read_with_meshio(path, str(path))
    points = np.asarray(raw.points, dtype=np.float64).reshape(-1, 3)
    return points, _joined([_fan(block) for block in raw.blocks if block.dimension == 2])


def _fan(block: Block) -> IntArray:
    cells = np.asarray(block.cells, dtype=np.int64)
    return _joined([cells[:, [0, k, k + 1]] for k in range(1, cells.shape[1] - 1)])


def _joined(parts: list[IntArray]) -> IntArray:
    return np.concatenate([np.zeros((0, 3), dtype=np.int64), *parts])


def _obj(path: Path) -> tuple[Array, IntArray]:
    """Without meshio, which refuses files with more or fewer texture coordinates than corners: most with pictures."""
    points, faces = list[list[float]](), list[tuple[int, int, int]]()
    for number, line in enumerate(path.read_text(encoding="utf-8", errors="replace").splitlines(), 1):
        word, *rest = line.split() or [""]
        try:
            if word == "v":
                x, y, z = (float(text) for text in rest[:3])
                points.append([x, y, z])
            elif word == "f":
                at = [int(text.partition("/")[0]) for text in rest]
                own = [n - 1 if n > 0 else len(points) + n if n < 0 else -1 for n in at]  # negative: from the end
                faces += [(own[0], own[k], own[k + 1]) for k in range(1, len(own) - 1)]
        except ValueError:
            message, remedy = f"line {number} is no corner and no face", "write the file again"
            raise FEImportError(Cause.NOT_READABLE, message, where=str(path), value=line[:60], remedy=remedy) from None
    try:
        triangles = np.array(faces, dtype=np.int64).reshape(-1, 3)
    except OverflowError:
        triangles = np.full((1, 3), -1)  # refused as others that are not in the file
    return np.array(points, dtype=np.float64).reshape(-1, 3), triangles
