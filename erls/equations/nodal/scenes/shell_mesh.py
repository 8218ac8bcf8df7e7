"""The shells of a scene as elements: patches between four nodes, meshes, normals at their nodes, sets."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from erls.equations.nodal.shell import Shell
from erls.equations.nodal.surfaces import corner_frames
from erls.errors import Cause, SceneError
from erls.maths.se3 import pose
from erls.maths.so3 import Array
from erls.scene.bodies.check import EDGES
from erls.scene.bodies.schema import BodySceneRecord, ShellSurface
from fe_import.elements.laminates import Lamina, Laminate, plane_stress
from fe_import.elements.link_shells import four_cornered
from fe_import.model import IntArray

_SAME = 1e-6  # of the size of a mesh: a named node that lies on one of it


@dataclass(frozen=True)
class Surface:
    """Nodes and elements of one shell.

    Attributes
    ----------
    elements : list of Shell
    nodes : (n,) int array
        Those of the surface.
    cells : (e, 4) int array
        Its elements, as places in ``nodes``.
    sets : dict
        Numbers of nodes, and their shares of the set's length.
    heights : (2,) array
        Of bottom and top above the nodes [m].
    """

    elements: list[Shell]
    nodes: IntArray
    cells: IntArray
    sets: dict[str, tuple[IntArray, Array]]
    heights: Array


def surface(
    record: BodySceneRecord, shell: ShellSurface, numbers: dict[str, int], poses: list[Array], folder: Path, place: str
) -> Surface:
    """Of one shell; its own nodes are added to ``numbers`` and ``poses``.

    Raises
    ------
    SceneError, FEImportError
        A mesh that cannot be read; a corner that turns back.
    """
    if shell.corners is None:
        places, cells, sets = mesh_of(shell, folder, place)
        names = [f"{shell.name}/{k}" for k in range(len(places))]
        own = _numbered(places, names, numbers, poses, merge=set(record.nodes))
    else:
        places, cells, sets, names = _patch(shell, numbers, poses)
        own = _numbered(places, names, numbers, poses, merge=set())
    edges = _shares(places, cells, sets)
    frames = corner_frames(places, cells, shell.fold_deg, place)
    make = _laminate(record, shell)
    stiffness, moments, surfaces = make.stiffness(), make.moments(), make.surfaces()
    elements = [
        Shell(tuple(own[cell].tolist()), frame, stiffness, moments, shell.drilling, surfaces)
        for cell, frame in zip(cells, frames, strict=True)
    ]
    found = {f"{shell.name}:{name}": (own[nodes], share) for name, (nodes, share) in edges.items()}
    return Surface(elements, own, cells, found, make.heights[[0, -1]])


def _patch(
    shell: ShellSurface, numbers: dict[str, int], poses: list[Array]
) -> tuple[Array, IntArray, dict[str, IntArray], list[str]]:
    assert shell.corners is not None
    a, b, c, d = (poses[numbers[name]][:3, 3] for name in shell.corners)
    along, across = shell.elements
    r, s = np.meshgrid(np.linspace(0, 1, along + 1), np.linspace(0, 1, across + 1), indexing="ij")
    r, s = r[..., None], s[..., None]
    places = (1 - r) * ((1 - s) * a + s * d) + r * ((1 - s) * b + s * c)
    at = np.arange((along + 1) * (across + 1)).reshape(along + 1, across + 1)
    cells = np.stack([at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]], axis=-1).reshape(-1, 4)
    sets = dict(zip(EDGES, (at[0], at[-1], at[:, 0], at[:, -1]), strict=True))
    names = [f"{shell.name}/{i}/{j}" for i in range(along + 1) for j in range(across + 1)]
    for corner, k in zip(shell.corners, (at[0, 0], at[-1, 0], at[-1, -1], at[0, -1]), strict=True):
        names[int(k)] = corner
    return places.reshape(-1, 3), cells, sets, names


def mesh_of(shell: ShellSurface, folder: Path, place: str) -> tuple[Array, IntArray, dict[str, IntArray]]:
    """Positions, elements and sets of a shell that comes from a mesh; the last corner of a triangle stands twice.

    Raises
    ------
    SceneError, FEImportError
        As of `surface`.
    """
    if shell.places:
        sets = {name: np.array(own, dtype=np.int64) for name, own in shell.sets.items()}
        return np.array(shell.places, dtype=float), np.array(shell.cells, dtype=np.int64), sets
    from fe_import.mesh.read import Wanted, read_mesh  # heavy: most scenes have no mesh

    path = folder / shell.mesh
    if "\0" in shell.mesh or not path.is_file():
        remedy = "give a path that starts at the folder of the scene"
        raise SceneError(
            Cause.FILE_NOT_FOUND, "no such mesh file", where=f"{place}.mesh", value=shell.mesh, remedy=remedy
        )
    mesh = read_mesh(path, (), Wanted(solids=False, shells=True))
    return mesh.nodes, np.concatenate([four_cornered(cells.elements) for cells in mesh.shells]), mesh.node_sets


def _numbered(
    places: Array, names: list[str], numbers: dict[str, int], poses: list[Array], merge: set[str]
) -> IntArray:
    """Numbers of the nodes of a surface: those that are there, and new ones."""
    size = float(np.linalg.norm(np.ptp(places, axis=0)))
    known = {name: poses[numbers[name]][:3, 3] for name in merge}
    found = []
    for place, name in zip(places, names, strict=True):
        same = next((other for other, at in known.items() if np.linalg.norm(at - place) <= _SAME * size), name)
        if same not in numbers:
            numbers[same] = len(poses)
            poses.append(pose(position=place))
        found.append(numbers[same])
    return np.array(found, dtype=np.int64)


def _shares(places: Array, cells: IntArray, sets: dict[str, IntArray]) -> dict[str, tuple[IntArray, Array]]:
    """Nodes of each set with their shares of the length of the edges between them; equal ones where there are none."""
    edges = np.unique(np.sort(np.concatenate([cells[:, [k, (k + 1) % 4]] for k in range(4)]), axis=1), axis=0)
    edges = edges[edges[:, 0] != edges[:, 1]]  # a corner of a triangle stands twice
    lengths = np.linalg.norm(places[edges[:, 0]] - places[edges[:, 1]], axis=1)
    result = {}
    for name, nodes in sets.items():
        share = np.zeros(len(places))
        inside = np.isin(edges, nodes).all(axis=1)
        np.add.at(share, edges[inside], lengths[inside, None] / 2)
        own = share[nodes] if inside.any() else np.ones(len(nodes))
        result[name] = nodes, own / own.sum()
    return result


def _laminate(record: BodySceneRecord, shell: ShellSurface) -> Laminate:
    m = record.materials[shell.material]
    shear = m.youngs_modulus / (2 * (1 + m.poissons_ratio))
    plane = plane_stress(m.youngs_modulus, m.youngs_modulus, m.poissons_ratio, shear)
    return Laminate((Lamina(plane, np.full(2, shear), m.density, shell.thickness),), shell.offset)
