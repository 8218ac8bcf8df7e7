"""Faults of a mesh that would give wrong matrices or a wrong mechanism without a word.

Elements are counted through the solids, then through the shells.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from fe_import.elements.attachments import AttachedMass, TiedNodes, nodes_of
from fe_import.elements.reference_cells import Tuples
from fe_import.elements.solid_elements import SolidElement
from fe_import.elements.solid_mesh import SolidMesh, element_faces
from fe_import.errors import Cause, FEImportError
from fe_import.model import Array, IntArray

COINCIDENT = 1e-9  # of the mesh's size
FARTHEST = 1e12  # coordinate in any unit of length; squares of larger ones overflow
FLAT = 1e-9  # Jacobian determinant over the product of the edge vectors' lengths
_CHUNK = 20_000  # elements whose Jacobians are held at a time


def check_mesh(mesh: SolidMesh) -> None:
    """Check coordinates, connectivity and shape of every element.

    Raises
    ------
    FEImportError
        ``MESH``: coordinates not finite, elements that use a node twice, coincident nodes, inverted or flat
        elements, neighbours that do not fit together, overlapping elements. ``DISCONNECTED``: parts that no
        element face joins.
    """
    _check_coordinates(mesh)
    _check_repeated_nodes(mesh)
    _check_coincident_nodes(mesh)
    if mesh.blocks:
        _check_shapes(mesh)
        _check_mid_nodes(mesh)
    if mesh.shells:
        _check_shell_shapes(mesh)
    _check_connections(mesh)


def _faulty(mesh: SolidMesh, message: str, remedy: str, cause: Cause = Cause.MESH, **details: Any) -> FEImportError:
    return FEImportError(cause, message, where=mesh.source, remedy=remedy, **details)


def _place(point: Array) -> str:
    return "({:.6g}, {:.6g}, {:.6g})".format(*point)


def _element(mesh: SolidMesh, index: int) -> str:
    return f"element {index} (centre {_place(mesh.nodes[mesh.element_nodes(index)].mean(axis=0))})"


def _check_coordinates(mesh: SolidMesh) -> None:
    bad = np.flatnonzero(~(np.abs(mesh.nodes) <= FARTHEST).all(axis=1))
    if bad.size:
        raise _faulty(
            mesh,
            f"{bad.size} nodes have coordinates that are not finite or absurd, the first is node {bad[0]}",
            "write the mesh again; node numbers count from 0 in the file's order",
            value=_place(mesh.nodes[bad[0]]),
        )


def _check_repeated_nodes(mesh: SolidMesh) -> None:
    twice = [(np.diff(np.sort(elements, axis=1), axis=1) == 0).any(axis=1) for elements in mesh.all_elements]
    bad = np.flatnonzero(np.concatenate(twice))
    if bad.size:
        raise _faulty(
            mesh,
            f"{bad.size} elements use a node twice, the first is {_element(mesh, int(bad[0]))}",
            "replace collapsed elements by wedges, pyramids, tetrahedra or triangles",
        )


def _check_coincident_nodes(mesh: SolidMesh) -> None:
    limit = COINCIDENT * float(np.linalg.norm(np.ptp(mesh.nodes, axis=0)))
    pairs = cKDTree(mesh.nodes).query_pairs(limit, output_type="ndarray")
    if len(pairs):  # a tie, an equation, a beam may join such nodes
        tied, held = (np.zeros(len(mesh.nodes) + len(mesh.further_nodes), dtype=bool) for _ in range(2))
        for item in mesh.attachments:
            if isinstance(item, TiedNodes):
                tied[item.nodes] = True
            elif not isinstance(item, AttachedMass):
                held[nodes_of(item)] = True
        pairs = pairs[~(tied[pairs].any(axis=1) | held[pairs].all(axis=1))]
    if len(pairs):
        a, b = sorted(pairs[np.lexsort(pairs.T[::-1])[0]].tolist())
        raise _faulty(
            mesh,
            f"{len(pairs)} pairs of nodes coincide, the first {a} and {b} at {_place(mesh.nodes[a])}",
            "merge coincident nodes in the mesher",
            limit=f"distance {limit:.3g}",
        )


def scaled_jacobians(mesh: SolidMesh) -> Array:
    """(m,) smallest Jacobian determinant of each element over the product of its columns' lengths.

    Taken at the element's nodes and at the stiffness's quadrature points; 1 for a brick, 0 for a flat
    element, negative for an inverted one.
    """
    result = np.empty(mesh.count)
    for block, _, numbers in mesh.parts():
        element = block.element
        points = np.hstack([element.reference_nodes.T, element.quadrature(element.stiffness_order)[0]])
        gradients = element.shape_gradients(points)
        for start in range(0, len(block), _CHUNK):
            chunk = block.elements[start : start + _CHUNK]
            columns = np.einsum("mkc,kdq->mqdc", mesh.nodes[chunk], gradients)
            scale = np.linalg.norm(columns, axis=3).prod(axis=2)
            ratio = np.linalg.det(columns) / np.where(scale > 0, scale, 1.0)
            result[numbers[start : start + _CHUNK]] = ratio.min(axis=1)
    return result


def _check_shapes(mesh: SolidMesh) -> None:
    jacobians = scaled_jacobians(mesh)
    bad = np.flatnonzero(jacobians <= FLAT)
    if bad.size:
        first = int(bad[0])
        kind = "inverted" if jacobians[first] < -FLAT else "flat"
        everywhere = bad.size == len(jacobians)
        raise _faulty(
            mesh,
            f"{bad.size} of {len(jacobians)} elements are inverted or flat, "
            f"the first is {_element(mesh, first)}: {kind}",
            "the node order is mirrored or not VTK's"
            if everywhere
            else "refine or repair the mesh there, or mend the order of nodes",
            value=float(f"{jacobians[first]:.3g}"),
            limit=f"scaled Jacobian above {FLAT:g}",
        )


def _check_shell_shapes(mesh: SolidMesh) -> None:
    """Quadrangles must be convex and triangles have an area; seen from all corners on the same side."""
    worst = []
    for cells in mesh.shells:
        corners = mesh.nodes[cells.elements]
        ahead = np.roll(corners, -1, axis=1) - corners
        back = np.roll(corners, 1, axis=1) - corners
        normals = np.cross(ahead, back)
        scale = np.linalg.norm(ahead, axis=2) * np.linalg.norm(back, axis=2)
        whole = normals.sum(axis=1)
        length = np.linalg.norm(whole, axis=1, keepdims=True)
        along = np.einsum("ekc,ec->ek", normals, whole / np.where(length > 0, length, 1.0))
        worst.append((along / np.where(scale > 0, scale, 1.0)).min(axis=1))
    found = np.concatenate(worst)
    bad = np.flatnonzero(found <= FLAT)
    if bad.size:
        raise _faulty(
            mesh,
            f"{bad.size} of {len(found)} shells have no area or a corner that turns back, "
            f"the first is {_element(mesh, mesh.count + int(bad[0]))}",
            "refine or repair the mesh there",
            value=float(f"{found[bad[0]]:.3g}"),
            limit=f"sine of the angle at each corner above {FLAT:g}",
        )


def _check_mid_nodes(mesh: SolidMesh) -> None:
    """Neighbours must share the mid-side nodes of a shared edge or face, and nobody else may use them."""
    corners = np.unique(np.concatenate([b.elements[:, : b.element.corners].ravel() for b in mesh.blocks]))
    for count in (2, 4, 8):
        keys, values, owners = [], [], []
        for block, _, numbers in mesh.parts():
            element = block.element
            at = {frozenset(between): element.corners + i for i, between in enumerate(element.midpoints)}
            for between in _entities(element, count):
                node = at.get(frozenset(between), -1)
                keys.append(np.sort(block.elements[:, between], axis=1))
                values.append(block.elements[:, node] if node >= 0 else np.full(len(block), -1))
                owners.append(numbers)
        value = np.concatenate([np.zeros(0, dtype=np.int64), *values])
        if not (value >= 0).any():
            continue
        label = np.unique(np.concatenate(keys), axis=0, return_inverse=True)[1].ravel()
        pairs = np.unique(np.column_stack([label, value]), axis=0)
        bad = np.isin(label, _repeated(pairs[:, 0])) | np.isin(value, _repeated(pairs[pairs[:, 1] >= 0, 1]))
        bad |= np.isin(value, corners)
        if bad.any():
            first = int(np.flatnonzero(bad)[0])
            at_node = f"{value[first]} at {_place(mesh.nodes[value[first]])}" if value[first] >= 0 else "that it lacks"
            raise _faulty(
                mesh,
                f"{_element(mesh, int(np.concatenate(owners)[first]))} does not fit its neighbours at mid-side node "
                + at_node,
                "neighbours must share the corners and the mid-side nodes of a common face",
            )


def _entities(element: SolidElement, count: int) -> Tuples:
    """Corners of the edges (2), quadrilateral faces (4) or the inside (8) of an element."""
    if count == 2:
        return element.cell.edges
    if count == 4:
        return tuple(face for face in element.cell.faces if len(face) == 4)
    return (tuple(range(8)),) if element.corners == 8 else ()


def _repeated(values: IntArray) -> IntArray:
    found, counts = np.unique(values, return_counts=True)
    return found[counts > 1]


def _check_connections(mesh: SolidMesh) -> None:
    solids = _solid_parts(mesh) if mesh.blocks else np.zeros(0, dtype=np.int64)
    _check_parts(mesh, np.concatenate([solids, solids.max(initial=-1) + 1 + _shell_parts(mesh)]))


def _solid_parts(mesh: SolidMesh) -> IntArray:
    """(elements,) which of them faces join; faces of three, and two of the same corners, are refused."""
    faces = element_faces(mesh)
    label, owner = faces.label, faces.owner
    crowded = np.flatnonzero(np.bincount(label)[label] > 2)
    if crowded.size:
        raise _faulty(
            mesh,
            f"more than two elements share a face of {_element(mesh, int(owner[crowded[0]]))}",
            "remove doubled or overlapping elements",
        )
    incidence = sp.csr_array((np.ones(len(label)), (owner, label)))
    shared = (incidence @ incidence.T).tocoo()
    twins = (shared.row != shared.col) & (shared.data == np.bincount(owner)[shared.row])
    if twins.any():
        raise _faulty(
            mesh,
            f"two elements have the same corners, one is {_element(mesh, int(shared.row[twins.argmax()]))}",
            "remove doubled elements",
        )
    return np.asarray(connected_components(shared, directed=False)[1], dtype=np.int64)


def _shell_parts(mesh: SolidMesh) -> IntArray:
    """(shells,) which of them edges join; two of the same corners are refused."""
    edges, owners, corners, start = [], [], [], 0
    for cells in mesh.shells:
        numbers = start + np.arange(len(cells))
        for k in range(cells.element.corners):
            edges.append(cells.elements[:, [k, (k + 1) % cells.element.corners]])
            owners.append(numbers)
        rows = np.full((len(cells), 4), -1, dtype=np.int64)
        rows[:, : cells.element.corners] = cells.elements
        corners.append(np.sort(rows, axis=1))
        start += len(cells)
    if not start:
        return np.zeros(0, dtype=np.int64)
    _, first, times = np.unique(np.concatenate(corners), axis=0, return_index=True, return_counts=True)
    if (times > 1).any():
        one = _element(mesh, mesh.count + int(first[times > 1][0]))
        raise _faulty(mesh, f"two shells have the same corners, one is {one}", "remove doubled elements")
    label = np.unique(np.sort(np.concatenate(edges), axis=1), axis=0, return_inverse=True)[1].ravel()
    owner = np.concatenate(owners)
    incidence = sp.csr_array((np.ones(len(label)), (owner, label)), shape=(start, int(label.max()) + 1))
    return np.asarray(connected_components(incidence @ incidence.T, directed=False)[1], dtype=np.int64)


def _check_parts(mesh: SolidMesh, part: IntArray) -> None:
    """Parts of the mesh (elements,) that no face or edge joins need attachments, and so do further nodes.

    A shell is joined to the solid whose nodes it shares.
    """
    count, further = int(part.max()) + 1, len(mesh.further_nodes)
    vertex = np.full(len(mesh.nodes) + further, -1, dtype=np.int64)  # of the graph of parts, then further nodes
    for block, _, numbers in mesh.parts():
        vertex[block.elements] = part[numbers][:, None]
    joined, start = [np.zeros((0, 2), dtype=np.int64)], mesh.count
    of_solids = vertex.copy()
    for cells in mesh.shells:
        own = np.repeat(part[start : start + len(cells), None], cells.elements.shape[1], axis=1)
        there = of_solids[cells.elements]
        joined.append(np.column_stack([own[there >= 0], there[there >= 0]]))
        vertex[cells.elements[there < 0]] = own[there < 0]
        start += len(cells)
    vertex[len(mesh.nodes) :] = count + np.arange(further)
    rows = [vertex[np.array(nodes_of(item), dtype=np.int64)] for item in mesh.attachments]
    pairs = np.array([(own[0], other) for own in rows for other in own[1:]], dtype=np.int64).reshape(-1, 2)
    pairs = np.concatenate([pairs, *joined])
    graph = sp.coo_array((np.ones(len(pairs)), pairs.T), shape=(count + further,) * 2)
    together = connected_components(graph, directed=False)[1]
    apart = np.setdiff1d(together[count:], together[:count])
    if apart.size:
        first = int((together[count:] == apart[0]).argmax())
        names = {item.keyword for item in mesh.attachments if first - further in nodes_of(item)}
        listed = ", ".join(f'"{name}"' for name in sorted(names))
        raise _faulty(
            mesh,
            f"{', '.join(sorted(names))} on a node that nothing joins to the mesh, "
            f"at {mesh.further_nodes[first].tolist()}",
            f"join it (*RIGID BODY, RBE2 ...), or ignore = [{listed}]",
            cause=Cause.DISCONNECTED,
        )
    part = together[:count][part]
    parts = len(np.unique(part))
    if parts > 1:
        sizes = np.bincount(part)
        rarest = int(np.where(sizes > 0, sizes, sizes.max() + 1).argmin())
        smallest = _element(mesh, int((part == rarest).argmax()))
        one, others = (_nodes_of(mesh, own) for own in (part == part[0], part != part[0]))
        touching = np.intersect1d(one, others).size > 0
        raise _faulty(
            mesh,
            f"the mesh has {parts} parts that no element {'edge' if mesh.shells else 'face'} joins"
            + (" (they touch at nodes or edges only)" if touching else "")
            + f", the smallest of {sizes[rarest]} elements, with {smallest}",
            "fuse the parts before meshing, or mesh each link alone",
            cause=Cause.DISCONNECTED,
            value=parts,
            limit=1,
        )


def _nodes_of(mesh: SolidMesh, chosen: NDArray[np.bool_]) -> IntArray:
    """Nodes of the chosen elements (elements,)."""
    elements = [row for rows in mesh.all_elements for row in rows]
    return np.unique(np.concatenate([elements[k] for k in np.flatnonzero(chosen)]))
