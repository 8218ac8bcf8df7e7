"""Links from scikit-fem in Python: from a mesh and a material, or from a basis and matrices assembled over it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from fe_import.description.records import LinkDescription
from fe_import.errors import Cause, FEImportError
from fe_import.files.toml import choose
from fe_import.made import described, joined, reduced
from fe_import.modal.model import ModalModel
from fe_import.model import FEModel

_WHERE = "link_from_skfem"


def link_from_skfem(
    source: Any,
    interfaces: Mapping[str, Any],
    *,
    material: Mapping[str, float] | None = None,
    stiffness: Any = None,
    mass: Any = None,
    name: str = "link",
    options: Mapping[str, Any] | None = None,
) -> ModalModel:
    """Reduce a link that scikit-fem meshed, or assembled.

    Parameters
    ----------
    source : skfem.Mesh or skfem.Basis
        A mesh of tetrahedra, hexahedra or wedges gets the elements of solid links, with stress and second-order data. A
        basis of displacements (``ElementVector`` of a nodal element) keeps its own.
    interfaces : mapping
        Name -> name of a boundary of the mesh, or indices of facets, or a table with ``face`` (one of these) and the
        fields of ``[[interfaces]]`` (``coupling``, ``weights``, ``position``).
    material : mapping, optional
        ``youngs_modulus`` [Pa], ``poissons_ratio``, ``density`` [kg/m³]; needed for a mesh, and for a basis without
        matrices, which scikit-fem's forms of linear elasticity then give.
    stiffness, mass : (N, N) sparse matrices, optional
        Over all dofs of a basis, free of supports [N/m, kg].
    name : str
        Of the link.
    options : mapping, optional
        Other tables of a link description: ``reduction``, ``damping``, ``recovery``, ``masses``, ``units``; ``solid``
        for a mesh.

    Returns
    -------
    ModalModel
        As `fe_import.reduce_link` gives it.

    Raises
    ------
    FEImportError
        A mesh, basis, set, material or option that is faulty.

    Examples
    --------
    >>> import numpy as np, skfem
    >>> from fe_import import link_from_skfem
    >>> mesh = skfem.MeshHex.init_tensor(np.linspace(0, 0.3, 7), np.linspace(0, 0.02, 2), np.linspace(0, 0.03, 2))
    >>> mesh = mesh.with_boundaries({"root": lambda x: x[0] == 0.0, "tip": lambda x: x[0] == 0.3})
    >>> steel = {"youngs_modulus": 2.1e11, "poissons_ratio": 0.3, "density": 7850.0}
    >>> modal = link_from_skfem(mesh, {"root": "root", "tip": "tip"}, material=steel)
    >>> round(modal.mass_properties.mass, 6)
    1.413
    """
    is_basis = hasattr(source, "dofs") and hasattr(source, "elem") and hasattr(source, "mesh")
    mesh = source.mesh if is_basis else source
    if not hasattr(mesh, "facets") or not hasattr(mesh, "doflocs") or len(mesh.p) != 3:
        raise _fault("a mesh or a basis of scikit-fem in three dimensions is needed", type(source).__name__)
    if (stiffness is None) != (mass is None) or (stiffness is not None and not is_basis):
        raise _fault("matrices come in pairs, with the basis that they were assembled over", None)
    if material is None and stiffness is None:
        raise _fault("a material is needed", None)
    facets, tables = _faces(mesh, interfaces)
    given: dict[str, Any] = {"name": name, "interfaces": tables}
    if material is not None:
        given["materials"] = {"m": dict(material)}
    data = joined(options, given, _WHERE)
    model: FEModel
    if is_basis:
        if stiffness is None:
            stiffness, mass = _assembled(source, described({**data, "solid": {"mesh": ""}}, _WHERE))
        data.pop("materials", None)
        description = described(joined(data, {"matrices": {"format": "scikit-fem", "files": {}}}, _WHERE), _WHERE)
        from fe_import.exports.skfem_basis import skfem_export
        from fe_import.models.matrices import export_model

        model = export_model(skfem_export(source, stiffness, mass, facets, _WHERE), description, _WHERE)
    else:
        solid = data.get("solid", {})
        data["solid"] = {"mesh": "", "material": "m", **(solid if isinstance(solid, Mapping) else {})}
        description = described(data, _WHERE)
        from fe_import.mesh.skfem_meshes import solid_mesh
        from fe_import.models.meshed import mesh_model

        named = mesh.with_boundaries(facets) if facets else mesh
        model = mesh_model(solid_mesh(named, _WHERE), description, _WHERE)
    return reduced(model, description, _WHERE)


def _fault(message: str, value: Any) -> FEImportError:
    remedy = "give a mesh and a material, or a Basis with stiffness and mass"
    return FEImportError(Cause.BAD_FIELD, message, where=_WHERE, value=value, remedy=remedy)


def _faces(mesh: Any, interfaces: Mapping[str, Any]) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Facets of all sets, those of the mesh and those that interfaces give, and tables of the interfaces."""
    boundaries = dict(mesh.boundaries or {})
    facets = {name: np.asarray(own, dtype=np.int64) for name, own in boundaries.items()}
    tables = []
    for name, given in interfaces.items():
        table = dict(given) if isinstance(given, Mapping) else {"face": given}
        face = table.get("face")
        if isinstance(face, str):
            choose(face, boundaries, f"{_WHERE}: interfaces.{name}")
        else:
            count = mesh.facets.shape[1]
            found = np.unique(face) if isinstance(face, (np.ndarray, list, tuple)) else np.zeros(0)
            if found.dtype.kind not in "iu" or not len(found) or not 0 <= found[0] <= found[-1] < count:
                message = "an interface needs the name of a boundary, or indices of facets"
                raise FEImportError(
                    Cause.INTERFACE, message, where=f"{_WHERE}: interfaces.{name}", limit=f"0 ... {count - 1}",
                    remedy="name it with mesh.with_boundaries, or take mesh.facets_satisfying",
                )  # fmt: skip
            face = f"facets of {name}"
            facets[face] = found.astype(np.int64)
        tables.append({**table, "name": name, "face": face})
    return facets, tables


def _assembled(basis: Any, description: LinkDescription) -> tuple[Any, Any]:
    """Stiffness and mass by scikit-fem's forms."""
    import skfem
    from skfem.helpers import dot
    from skfem.models.elasticity import lame_parameters, linear_elasticity

    m = description.materials["m"]
    mass = skfem.BilinearForm(lambda u, v, w: m.density * dot(u, v)).assemble(basis)
    return linear_elasticity(*lame_parameters(m.youngs_modulus, m.poissons_ratio)).assemble(basis), mass
