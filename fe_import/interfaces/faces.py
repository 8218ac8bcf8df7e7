"""The face of an interface: the nodes that a joint's interface node moves, rigidly (RBE2) or on average (RBE3).

A node that turns (of a beam, of a rigid body) is an interface by itself: coupling ``node``, one node, in its place.
For solids `interface_face` finds it in the mesh; for other models write
``InterfaceFace(name, nodes, position, coupling, weights)``. Either goes to
`fe_import.interfaces.coupling.couple_interfaces`, which checks it and adds the interface node.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from fe_import.elements.solid_mesh import SolidMesh, surface_triangles
from fe_import.errors import Cause, FEImportError
from fe_import.files.toml import as_spelt
from fe_import.interfaces.weights import area_weights
from fe_import.model import Array, IntArray

NARROW = 1e-4  # width of a face over its length; files of 6 digits leave 1e-6 on a line
SMALL = 1e-6  # size of a face over that of the model
FAR = 10.0  # distance of an interface node from its face, in sizes of the face


@dataclass(frozen=True)
class InterfaceFace:
    """Nodes that an interface node moves.

    Attributes
    ----------
    name : str
        Of the interface.
    nodes : (k,) int array
    position : (3,) array
        Of the interface node [m].
    coupling : str
        ``rigid``, ``averaged`` or ``node``.
    weights : (k,) array or None
        Positive weights of the nodes, for the average; equal ones when None.
    turns : bool
        Whether its nodes turn, as those of shells do, and go with the interface node in this, too: an edge will do.
    """

    name: str
    nodes: IntArray
    position: Array
    coupling: str = "rigid"
    weights: Array | None = None
    turns: bool = False

    @property
    def shares(self) -> Array:
        """(k,) weights whose sum is 1."""
        weights = np.ones(len(self.nodes)) if self.weights is None else self.weights
        return np.asarray(weights / weights.sum())


def interface_face(
    mesh: SolidMesh,
    name: str,
    node_set: str,
    position: Array | None = None,
    coupling: str = "rigid",
    weights: str = "uniform",
) -> InterfaceFace:
    """The face of an interface, from a node set of the mesh.

    Parameters
    ----------
    mesh : SolidMesh
    name : str
        Of the interface.
    node_set : str
    position : (3,) array or None
        Of the interface node; when None the centroid of the area of the element faces whose nodes are all
        in the set, or the mean of the nodes when there is no such face.
    coupling : str
        ``rigid`` or ``averaged``.
    weights : str
        ``uniform`` or ``area``.

    Raises
    ------
    FEImportError
        ``INTERFACE``: no such node set, an empty one, or area weights of nodes without area.
    """
    node_set = as_spelt(node_set, mesh.node_sets)
    if node_set not in mesh.node_sets:
        known = ", ".join(sorted(mesh.node_sets)) or "none"
        kind = "a set of solid elements" if node_set in mesh.element_sets else "not in the mesh"
        if node_set in mesh.lost_sets:
            kind = f"not usable: {mesh.lost_sets[node_set]}"
        raise _faulty(
            f"interface {name!r} needs node set {node_set!r}, which is {kind}",
            mesh.source,
            remedy=f"node sets of this mesh: {known}",
        )
    nodes = mesh.node_sets[node_set]
    turns = coupling == "rigid" and bool(np.isin(nodes, mesh.shell_nodes).all())
    _check_count(name, nodes, turns, mesh.source)
    place = _centroid(mesh, nodes) if position is None else np.asarray(position, dtype=float)
    shares = area_weights(mesh, nodes, name) if weights == "area" else None
    return InterfaceFace(name, nodes, place, coupling, shares, turns)


def _centroid(mesh: SolidMesh, nodes: IntArray) -> Array:
    triangles = surface_triangles(mesh)
    corners = mesh.nodes[triangles[np.isin(triangles, nodes).all(axis=1)]]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    if areas.sum() == 0:
        return np.asarray(mesh.nodes[nodes].mean(axis=0))
    return np.asarray(areas @ corners.mean(axis=1) / areas.sum())


def checked_faces(nodes: Array, faces: Sequence[InterfaceFace], source: str) -> list[InterfaceFace]:
    """Faces with rising nodes, each once.

    Raises
    ------
    FEImportError
        ``INTERFACE``, see `fe_import.interfaces.coupling.couple_interfaces`.
    """
    result = []
    for face in faces:
        unique, first = np.unique(face.nodes, return_index=True)
        weights = face.weights
        if weights is not None:
            _check_weights(face, np.asarray(weights, dtype=float), source)
            weights = np.asarray(weights, dtype=float)[first]
        result.append(replace(face, nodes=unique, weights=weights))
        _check_face(result[-1], nodes, source)
    _check_pairs(result, source)
    return result


def _faulty(message: str, source: str, **details: Any) -> FEImportError:
    return FEImportError(Cause.INTERFACE, message, where=source, **details)


def _check_weights(face: InterfaceFace, weights: Array, source: str) -> None:
    if weights.shape != np.shape(face.nodes) or not (np.isfinite(weights) & (weights > 0)).all():
        raise _faulty(
            f"weights of interface {face.name!r} must be positive, one per node",
            source,
            value=f"{weights.size} weights for {np.size(face.nodes)} nodes, the least {weights.min(initial=np.inf):g}",
            remedy='use weights = "uniform"',
        )


def _check_count(name: str, nodes: IntArray, turns: bool, source: str) -> None:
    if len(nodes) < (1 if turns else 3):
        raise _faulty(
            f"interface {name!r} has too few nodes to carry rotations",
            source,
            value=len(nodes),
            limit="at least 1" if turns else "at least 3, not on one line",
        )


def _check_face(face: InterfaceFace, nodes: Array, source: str) -> None:
    if face.coupling == "node":
        return
    _check_count(face.name, face.nodes, face.turns, source)
    if face.nodes[0] < 0 or face.nodes[-1] >= len(nodes):
        raise _faulty(
            f"interface {face.name!r} names nodes that do not exist",
            source,
            value=int(face.nodes[0] if face.nodes[0] < 0 else face.nodes[-1]),
            limit=f"0 ... {len(nodes) - 1}",
        )
    points = nodes[face.nodes]
    if face.turns:
        _check_place(face, points, float(np.linalg.norm(np.ptp(nodes, axis=0))), source)
        return
    size, whole = (float(np.linalg.norm(np.ptp(p, axis=0))) for p in (points, nodes))
    if size <= SMALL * whole:
        raise _faulty(
            f"the {len(points)} nodes of interface {face.name!r} lie in one point and cannot carry rotations",
            source,
            value=f"size {size:.3g}",
            limit=f"above {SMALL * whole:.3g}, {SMALL:g} of the link",
            remedy="couple a face",
        )
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    if spread[1] <= NARROW * spread[0]:
        raise _faulty(
            f"the {len(points)} nodes of interface {face.name!r} lie on one line and cannot carry rotations about it",
            source,
            value=f"width {spread[1] / spread[0]:.2g} of the length",
            limit=f"above {NARROW:g}",
            remedy="couple a face, not an edge",
        )
    _check_place(face, points, size, source)


def _check_place(face: InterfaceFace, points: Array, size: float, source: str) -> None:
    if np.shape(face.position) != (3,) or not np.isfinite(face.position).all():
        raise _faulty(
            f"position of interface {face.name!r} is not three numbers",
            source,
            value=np.asarray(face.position).tolist(),
        )
    distance = float(cKDTree(points).query(face.position)[0])
    if distance > FAR * size:
        raise _faulty(
            f"interface {face.name!r} is far from its face of size {size:.4g}",
            source,
            value=f"distance {distance:.4g}",
            limit=f"{FAR * size:.4g}",
            remedy="check the position's unit and frame",
        )


def _check_pairs(faces: Sequence[InterfaceFace], source: str) -> None:
    for k, face in enumerate(faces):
        for other in faces[:k]:
            if face.name == other.name:
                raise _faulty(f"two interfaces are named {face.name!r}", source)
            shared = np.intersect1d(face.nodes, other.nodes)
            if shared.size and "node" in (face.coupling, other.coupling):
                raise _faulty(
                    f"interfaces {other.name!r} and {face.name!r} share node {shared[0]}",
                    source,
                    remedy="let each interface have nodes of its own",
                )
            if shared.size and face.coupling == other.coupling == "rigid":
                raise _faulty(
                    f"interfaces {other.name!r} and {face.name!r} share {shared.size} nodes, "
                    f"the first is node {shared[0]}",
                    source,
                    remedy='a node can follow one rigid face only; leave a gap, join them, or use "averaged"',
                )
