"""Matrices that scikit-fem assembled over a basis of displacements, as an export."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from fe_import.errors import Cause, FEImportError
from fe_import.exports.base import Export
from fe_import.model import Array, IntArray

_SAME = 1e-9  # distance of two dofs of one node, of the size of the mesh


def skfem_export(basis: Any, stiffness: Any, mass: Any, facets: Mapping[str, IntArray], where: str) -> Export:
    """Nodes at the places of the dofs, sets of the facets, triangles of the surface.

    Parameters
    ----------
    basis : skfem.Basis
        Of an element whose dofs are displacements along x, y, z at nodes (``ElementVector`` of a nodal element).
    stiffness, mass : sparse matrices
        Over all dofs of the basis.
    facets : dict of int arrays
        Facets of the mesh by the name of their set.
    where : str
        For messages.

    Raises
    ------
    FEImportError
        ``EXPORT``: dofs that are no displacements of nodes.
    """
    component = _components(basis, where)
    places = np.asarray(basis.doflocs.T, dtype=np.float64)
    first = np.flatnonzero(component == 0)
    nodes = places[first]
    size = float(np.linalg.norm(np.ptp(nodes, axis=0)))
    dof_map = np.full((len(nodes), 6), -1, dtype=np.int64)
    dof_map[:, 0] = first
    tree = cKDTree(nodes)
    for c in (1, 2):
        rows = np.flatnonzero(component == c)
        distance, node = tree.query(places[rows])
        if len(rows) != len(nodes) or distance.max() > _SAME * size or len(np.unique(node)) < len(node):
            raise _fault("dofs along x, y and z are not at the same nodes", where)
        dof_map[node, c] = rows
    owner = np.full(basis.N, -1, dtype=np.int64)
    owner[dof_map[:, :3]] = np.arange(len(nodes))[:, None]
    sets = {
        name: np.unique(owner[basis.get_dofs(facets=np.asarray(own)).flatten()]).astype(np.int64)
        for name, own in facets.items()
    }
    corners = owner[basis.dofs.nodal_dofs[0]]
    return Export(
        mass=sp.csc_array(mass),
        stiffness=sp.csc_array(stiffness),
        nodes=nodes,
        labels=np.arange(len(nodes), dtype=np.int64),
        dof_map=dof_map,
        node_sets=sets,
        triangles=_surface(basis.mesh, corners),
        notes={"program": "scikit-fem"},
    )


def _components(basis: Any, where: str) -> IntArray:
    """(N,) component, 0 to 2, of each dof."""
    names, result = list(basis.elem.dofnames), np.full(basis.N, -1, dtype=np.int64)
    at = 0
    for own in ("nodal_dofs", "edge_dofs", "facet_dofs", "interior_dofs"):
        rows: Array = getattr(basis.dofs, own)
        for row in rows if rows.size else ():
            name = names[at] if at < len(names) else ""
            if name not in ("u^1", "u^2", "u^3"):
                raise _fault(f"a dof {name!r} is no displacement", where)
            result[row] = int(name[-1]) - 1
            at += 1
    return result


def _surface(mesh: Any, corners: IntArray) -> IntArray:
    """(t, 3) triangles of the facets of one element, over the nodes at the vertices of the mesh."""
    facets = corners[mesh.facets[:, mesh.boundary_facets()]]
    if len(facets) == 3:
        return np.asarray(facets.T)
    ordered = _around(mesh)
    triangles = np.concatenate([corners[ordered[:, own]] for own in ([0, 1, 2], [0, 2, 3])])
    sides = np.sort(triangles, axis=1)
    return np.asarray(triangles[(np.diff(sides, axis=1) > 0).all(axis=1)])  # wedges name a corner of triangles twice


def _around(mesh: Any) -> IntArray:
    """(f, 4) vertices of quadrilateral facets of the surface, in the order around them."""
    facets = mesh.facets[:, mesh.boundary_facets()].T
    points = mesh.p.T[facets]
    centre = points.mean(axis=1, keepdims=True)
    normal = np.linalg.svd(points - centre)[2][:, 2]
    first = points[:, 0] - centre[:, 0]
    second = np.cross(normal, first)
    angle = np.arctan2(
        np.einsum("fkc,fc->fk", points - centre, second), np.einsum("fkc,fc->fk", points - centre, first)
    )
    return np.take_along_axis(facets, np.argsort(angle, axis=1), axis=1)


def _fault(message: str, where: str) -> FEImportError:
    return FEImportError(
        Cause.EXPORT,
        message,
        where=where,
        remedy="use a Basis of ElementVector of a nodal element in three dimensions, as ElementVector(ElementTetP2())",
    )
