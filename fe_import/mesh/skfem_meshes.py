"""Meshes of scikit-fem: their elements, boundaries and subdomains as those of a solid link."""

from __future__ import annotations

from typing import Any

import numpy as np

from fe_import.elements.solid_elements import MESH_ELEMENTS
from fe_import.elements.solid_mesh import SolidMesh
from fe_import.errors import Cause, FEImportError
from fe_import.mesh.checks import check_mesh, scaled_jacobians


def solid_mesh(mesh: Any, where: str) -> SolidMesh:
    """The same mesh, checked.

    Parameters
    ----------
    mesh : skfem.Mesh
        Of tetrahedra (``MeshTet``, ``MeshTet2``), hexahedra (``MeshHex``, ``MeshHex2``) or wedges (``MeshWedge1``);
        named boundaries become node sets, named subdomains element sets.
    where : str
        For messages.

    Raises
    ------
    FEImportError
        ``UNSUPPORTED_ELEMENT``; what `fe_import.mesh.checks` refuses.
    """
    kinds = {element.shape: name for name, element in MESH_ELEMENTS.items() if isinstance(element.shape, str)}
    shape = getattr(mesh.elem, "__name__", "")
    if shape not in kinds:
        raise FEImportError(
            Cause.UNSUPPORTED_ELEMENT,
            f"a mesh of {type(mesh).__name__} with {shape} is not one of solid elements",
            where=where,
            limit=", ".join(sorted(kinds)),
            remedy="give a mesh of solids, or a Basis with its matrices",
        )
    kind = kinds[shape]
    elements = np.empty((mesh.t.shape[1], MESH_ELEMENTS[kind].size), dtype=np.int64)
    elements[:, MESH_ELEMENTS[kind].skfem_order] = mesh.dofs.element_dofs.T
    faces = {name: np.asarray(facets, dtype=np.int64) for name, facets in (mesh.boundaries or {}).items()}
    found = SolidMesh.uniform(
        np.array(mesh.doflocs.T, dtype=np.float64),
        elements,
        kind,
        element_sets={name: np.unique(own).astype(np.int64) for name, own in (mesh.subdomains or {}).items()},
        node_sets={name: facet_nodes(mesh, own) for name, own in faces.items()},
        source=where,
    )
    turned = scaled_jacobians(found) < 0  # scikit-fem sorts nodes as it likes
    elements[turned] = elements[turned][:, MESH_ELEMENTS[kind].mirrored_order]
    check_mesh(found)
    return found


def facet_nodes(mesh: Any, facets: Any) -> Any:
    """(k,) nodes of facets, rising."""
    return np.unique(mesh.dofs.get_facet_dofs(np.asarray(facets)).flatten()).astype(np.int64)
