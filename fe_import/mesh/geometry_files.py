"""Geometry of CAD programs (STEP, IGES, BREP), meshed by gmsh: tetrahedra of 10 nodes, sets of faces and volumes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from fe_import.errors import Cause, FEImportError
from fe_import.mesh.raw import Block, RawMesh
from fe_import.model import IntArray

GEOMETRIES = (".step", ".stp", ".iges", ".igs", ".brep")
_WITHOUT_UNIT = (".brep",)
_ROUND = 8  # elements around a circle, at least
_SMALLEST = 0.25  # element, of the size asked for, where surfaces are curved
_EQUAL = 1e-6  # distance of surfaces that are equally near, of the size of the geometry
_TETRAHEDRA, _TRIANGLES = 11, 9  # gmsh's numbers of those of second order
_OUR_ORDER = [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]  # gmsh has the last two edges in another order
_MOST = 3_000_000  # elements; more do not fit


@dataclass(frozen=True)
class Meshing:
    """How a geometry is meshed.

    Attributes
    ----------
    size : float
        Length of the edges of elements.
    unit : float
        In which all lengths are [m]. Files of STEP and IGES know their own, BREP has this one.
    faces : dict of (3,) floats
        Name -> a place; the set is the surface next to it, or those that are equally near.
    """

    size: float
    unit: float = 1.0
    faces: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)


def is_geometry(path: Path) -> bool:
    """Whether a file holds a geometry instead of a mesh, by its suffix."""
    name = path.name.lower().removesuffix(".gz")
    return name.endswith(GEOMETRIES)


def read_geometry(path: Path, where: str, meshing: Meshing | None) -> RawMesh:
    """Mesh the solids of a file; sets ``surface:N``, ``volume:N`` by gmsh's numbers, and those asked for.

    Raises
    ------
    FEImportError
        ``BAD_FIELD``: no size, or gmsh is not installed; ``NOT_READABLE``; ``MESH``: no solids, solids that overlap,
        elements by the million, or gmsh gives up.
    """
    if meshing is None:
        message, remedy = "a geometry has no elements", "give it as [solid], with the size of elements: size = LENGTH"
        raise FEImportError(Cause.BAD_FIELD, message, where=where, remedy=remedy)
    scale = 1.0 if path.name.lower().endswith(_WITHOUT_UNIT) else meshing.unit / 1e-3  # of what is read in mm
    with _gmsh(where) as gmsh:
        try:
            shapes = gmsh.model.occ.importShapes(str(path))
        except Exception as problem:  # gmsh has no others
            raise FEImportError(
                Cause.NOT_READABLE, f"cannot be read as a geometry: {_first_line(problem)}", where=where,
                remedy="write it again as STEP (AP 214 or 242)",
            ) from None  # fmt: skip
        volumes = [shape for shape in shapes if shape[0] == 3]
        if not volumes:
            raise FEImportError(
                Cause.MESH, f"no solids, {len(shapes)} surfaces or lines", where=where,
                remedy="export closed solids, or mesh the surface and give it as [shell]",
            )  # fmt: skip
        if len(volumes) > 1:  # common faces are to have common nodes
            parts, _ = gmsh.model.occ.fragment(volumes[:1], volumes[1:])
            if sum(dimension == 3 for dimension, _ in parts) != len(volumes):
                remedy = "cut them in the CAD program, where they overlap"
                raise FEImportError(Cause.MESH, "solids overlap", where=where, value=len(volumes), remedy=remedy)
        gmsh.model.occ.synchronize()
        _refuse_too_many(gmsh, meshing.size, scale, where)
        named = {name: _nearest(gmsh, [scale * x for x in place]) for name, place in meshing.faces.items()}
        try:
            gmsh.model.mesh.generate(3)
        except Exception as problem:
            raise FEImportError(
                Cause.MESH, f"gmsh cannot mesh it: {_first_line(problem)}", where=where, value=meshing.size,
                remedy="try another size, or mesh it in another program",
            ) from None  # fmt: skip
        return _mesh(gmsh, named, scale)


@contextmanager
def _gmsh(where: str) -> Iterator[Any]:
    """The package, with a model of its own that is gone afterwards."""
    try:
        import gmsh
    except (ImportError, OSError) as problem:  # its library may lack others
        raise FEImportError(
            Cause.BAD_FIELD, f"geometries need the package gmsh, which cannot be imported: {_first_line(problem)}",
            where=where, remedy="pip install 'erls[geometry]', or give a mesh",
        ) from None  # fmt: skip
    begun = not gmsh.isInitialized()
    if begun:
        gmsh.initialize(interruptible=False, readConfigFiles=False)
    asked = {"General.Terminal": 0, "General.NumThreads": 1}
    gmsh.option.setString("Geometry.OCCTargetUnit", "MM")  # as gmsh does unless told otherwise
    before = {name: gmsh.option.getNumber(name) for name in asked}
    name = f"erls {len(gmsh.model.list())}"
    try:
        for option, value in asked.items():
            gmsh.option.setNumber(option, value)
        gmsh.model.add(name)
        yield gmsh
    finally:
        for option, value in before.items():
            gmsh.option.setNumber(option, value)
        if begun:
            gmsh.finalize()
        else:
            gmsh.model.setCurrent(name)
            gmsh.model.remove()


def _refuse_too_many(gmsh: Any, size: float, scale: float, where: str) -> None:
    """Set the size of elements; how many of them fill the volume is known before they are made."""
    volume = sum(gmsh.model.occ.getMass(3, tag) for _, tag in gmsh.model.getEntities(3))
    expected = volume / ((size * scale) ** 3 / (6 * math.sqrt(2)))
    if expected > _MOST:
        raise FEImportError(
            Cause.MESH, "too many elements of this size", where=f"{where}: solid.size", value=size,
            limit=f"{_MOST} elements, about {expected:.2g} of them", remedy="sizes are in the stated unit of length",
        )  # fmt: skip
    for name, value in (
        ("MeshSizeMax", size * scale), ("MeshSizeMin", _SMALLEST * size * scale), ("MeshSizeFromCurvature", _ROUND),
        ("ElementOrder", 2), ("HighOrderOptimize", 1),
    ):  # fmt: skip
        gmsh.option.setNumber(f"Mesh.{name}", value)


def _nearest(gmsh: Any, place: Sequence[float]) -> list[int]:
    """Surfaces next to a place; both halves of a bore about its centre."""
    occ, surfaces = gmsh.model.occ, [tag for _, tag in gmsh.model.getEntities(2)]
    point = occ.addPoint(*place)
    distances = np.array([occ.getDistance(0, point, 2, tag)[0] for tag in surfaces])
    occ.remove([(0, point)])
    box = np.array(gmsh.model.getBoundingBox(-1, -1))
    equal = distances <= distances.min() + _EQUAL * float(np.linalg.norm(box[3:] - box[:3]))
    return [tag for tag, near in zip(surfaces, equal, strict=True) if near]


def _mesh(gmsh: Any, named: Mapping[str, list[int]], scale: float) -> RawMesh:
    tags, places, _ = gmsh.model.mesh.getNodes()
    number = np.full(int(tags.max()) + 1, -1, dtype=np.int64)
    number[tags] = np.arange(len(tags))
    volumes, surfaces = (
        {tag: _cells(gmsh, number, dimension, tag) for _, tag in gmsh.model.getEntities(dimension)}
        for dimension in (3, 2)
    )
    blocks = [Block("tetra10", 3, cells[:, _OUR_ORDER]) for cells in volumes.values()]
    blocks += [Block("triangle6", 2, cells) for cells in surfaces.values()]
    sets: dict[str, list[Any]] = {}
    for at, name in enumerate([*(f"volume:{v}" for v in volumes), *(f"surface:{s}" for s in surfaces)]):
        sets[name] = [np.arange(len(block.cells)) if k == at else None for k, block in enumerate(blocks)]
    order = list(surfaces)
    for name, own in named.items():
        chosen = {len(volumes) + order.index(tag) for tag in own}
        sets[name] = [np.arange(len(block.cells)) if k in chosen else None for k, block in enumerate(blocks)]
    return RawMesh(np.reshape(places, (-1, 3)) / scale, blocks, sets)


def _cells(gmsh: Any, number: IntArray, dimension: int, tag: int) -> IntArray:
    """(m, 10) or (m, 6) points of the elements of a volume or a surface."""
    kind, size = (_TETRAHEDRA, 10) if dimension == 3 else (_TRIANGLES, 6)
    return np.asarray(number[gmsh.model.mesh.getElementsByType(kind, tag)[1]].reshape(-1, size))


def _first_line(problem: BaseException) -> str:
    return str(problem).strip().split("\n")[0]

