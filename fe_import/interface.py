"""Interface nodes of a solid link: a joint's node whose displacement and rotation rigidly move a face (RBE2).

A coupled node at x follows the interface node at x_c: u = u_c + φ_c × (x - x_c).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from fe_import.errors import Cause, FEImportError
from fe_import.model import Array, IntArray, InterfaceNode
from fe_import.solid_mesh import SolidMesh, surface_triangles

COLLINEAR = 1e-6  # width of a face over its length
FAR = 10.0  # distance of an interface node from its face, in sizes of the face


@dataclass(frozen=True)
class InterfaceFace:
    """A face that an interface node moves.

    Attributes
    ----------
    name : str
        Of the interface.
    nodes : (k,) int array
        Nodes of the face.
    position : (3,) array
        Of the interface node [m].
    """

    name: str
    nodes: IntArray
    position: Array


@dataclass(frozen=True)
class RigidCoupling:
    """A solid's nodes and dofs extended by its interface nodes.

    Attributes
    ----------
    nodes : (n + i, 3) array
        The solid's nodes, then one node per interface [m].
    dof_map : (n + i, 6) int array
        Row of each nodal component, -1 for rotations of solid nodes.
    coupling : (d, f) sparse CSC
        All d = 3 n + 6 i nodal components = ``coupling`` @ independent dofs.
    independent : (f,) int array
        Rows that are the independent dofs: those of uncoupled solid nodes, then six of every interface.
    interface_nodes : tuple of InterfaceNode
    """

    nodes: Array
    dof_map: IntArray
    coupling: sp.csc_array
    independent: IntArray
    interface_nodes: tuple[InterfaceNode, ...]

    def extended(self, matrix: sp.csc_array) -> sp.csc_array:
        """A (3 n, 3 n) matrix of the solid over all d nodal components; interface nodes add nothing."""
        d = self.coupling.shape[0]
        coo = sp.coo_array(matrix)
        return sp.csc_array((coo.data, coo.coords), shape=(d, d))


def interface_face(mesh: SolidMesh, name: str, node_set: str, position: Array | None = None) -> InterfaceFace:
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

    Raises
    ------
    FEImportError
        ``INTERFACE``: no such node set, or an empty one.
    """
    if node_set not in mesh.node_sets:
        known = ", ".join(sorted(mesh.node_sets)) or "none"
        kind = "a set of solid elements" if node_set in mesh.element_sets else "not in the mesh"
        raise FEImportError(
            Cause.INTERFACE,
            f"interface {name!r} needs node set {node_set!r}, which is {kind}",
            where=mesh.source,
            remedy=f"node sets of this mesh: {known}",
        )
    nodes = mesh.node_sets[node_set]
    _check_count(name, nodes, mesh.source)
    place = _centroid(mesh, nodes) if position is None else np.asarray(position, dtype=float)
    return InterfaceFace(name, nodes, place)


def _centroid(mesh: SolidMesh, nodes: IntArray) -> Array:
    triangles = surface_triangles(mesh)
    corners = mesh.nodes[triangles[np.isin(triangles, nodes).all(axis=1)]]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    if areas.sum() == 0:
        return np.asarray(mesh.nodes[nodes].mean(axis=0))
    return np.asarray(areas @ corners.mean(axis=1) / areas.sum())


def rigid_coupling(nodes: Array, faces: Sequence[InterfaceFace], source: str = "") -> RigidCoupling:
    """Add an interface node to each face and couple the face rigidly to it.

    Parameters
    ----------
    nodes : (n, 3) array
        Of a solid, with three dofs each, row 3 * node + component.
    faces : sequence of InterfaceFace
    source : str
        File to name in messages.

    Raises
    ------
    FEImportError
        ``INTERFACE``: nodes that do not exist, fewer than three or collinear ones, a position far from the
        face, faces that share a node, or two interfaces of one name.
    """
    faces = [InterfaceFace(f.name, np.unique(f.nodes), f.position) for f in faces]
    for face in faces:
        _check_face(face, nodes, source)
    _check_pairs(faces, source)

    n, i = len(nodes), len(faces)
    dof_map = np.full((n + i, 6), -1, dtype=np.int64)
    dof_map[:n, :3] = np.arange(3 * n).reshape(n, 3)
    dof_map[n:] = 3 * n + np.arange(6 * i).reshape(i, 6)
    coupled = np.concatenate([np.zeros(0, dtype=np.int64), *(face.nodes for face in faces)])
    free = np.setdiff1d(np.arange(3 * n + 6 * i), dof_map[coupled, :3].ravel())
    column = np.full(3 * n + 6 * i, -1, dtype=np.int64)
    column[free] = np.arange(len(free))

    rows, columns, values = [free], [column[free]], [np.ones(len(free))]
    for k, face in enumerate(faces):
        x, y, z = (nodes[face.nodes] - face.position).T
        ux, uy, uz = dof_map[face.nodes, :3].T
        one, (cx, cy, cz, px, py, pz) = np.ones(len(x)), column[dof_map[n + k]]
        for row, col, value in (
            *((ux, cx, one), (ux, py, z), (ux, pz, -y)),
            *((uy, cy, one), (uy, pz, x), (uy, px, -z)),
            *((uz, cz, one), (uz, px, y), (uz, py, -x)),
        ):
            rows.append(row)
            columns.append(np.full(len(row), col))
            values.append(value)
    coupling = sp.csc_array(
        (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))),
        shape=(3 * n + 6 * i, len(free)),
    )
    interface_nodes = tuple(
        InterfaceNode(f.name, n + k, f.position, f.nodes, np.full(len(f.nodes), 1 / len(f.nodes)), "rigid")
        for k, f in enumerate(faces)
    )
    return RigidCoupling(
        np.vstack([nodes, *(face.position for face in faces)]), dof_map, coupling, free, interface_nodes
    )


def _check_count(name: str, nodes: IntArray, source: str) -> None:
    if len(nodes) < 3:
        raise FEImportError(
            Cause.INTERFACE,
            f"interface {name!r} has too few nodes to carry rotations",
            where=source,
            value=len(nodes),
            limit="at least 3, not on one line",
        )


def _check_face(face: InterfaceFace, nodes: Array, source: str) -> None:
    _check_count(face.name, face.nodes, source)
    if face.nodes[0] < 0 or face.nodes[-1] >= len(nodes):
        raise FEImportError(
            Cause.INTERFACE,
            f"interface {face.name!r} names nodes that do not exist",
            where=source,
            value=int(face.nodes[0] if face.nodes[0] < 0 else face.nodes[-1]),
            limit=f"0 ... {len(nodes) - 1}",
        )
    points = nodes[face.nodes]
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    if spread[1] <= COLLINEAR * spread[0]:
        raise FEImportError(
            Cause.INTERFACE,
            f"the {len(points)} nodes of interface {face.name!r} lie on one line and cannot carry rotations",
            where=source,
            remedy="couple a face, not an edge",
        )
    if np.shape(face.position) != (3,) or not np.isfinite(face.position).all():
        raise FEImportError(
            Cause.INTERFACE,
            f"position of interface {face.name!r} is not three numbers",
            where=source,
            value=np.asarray(face.position).tolist(),
        )
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    distance = float(cKDTree(points).query(face.position)[0])
    if distance > FAR * size:
        raise FEImportError(
            Cause.INTERFACE,
            f"interface {face.name!r} is far from its face of size {size:.4g}",
            where=source,
            value=f"distance {distance:.4g}",
            limit=f"{FAR * size:.4g}",
            remedy="check the position's unit and frame",
        )


def _check_pairs(faces: Sequence[InterfaceFace], source: str) -> None:
    for k, face in enumerate(faces):
        for other in faces[:k]:
            if face.name == other.name:
                raise FEImportError(Cause.INTERFACE, f"two interfaces are named {face.name!r}", where=source)
            shared = np.intersect1d(face.nodes, other.nodes)
            if shared.size:
                raise FEImportError(
                    Cause.INTERFACE,
                    f"interfaces {other.name!r} and {face.name!r} share {shared.size} nodes, "
                    f"the first is node {shared[0]}",
                    where=source,
                    remedy="a node can follow one rigid face only; leave a gap between them, or join them",
                )
