"""Mass and stiffness of a solid link: 3-D linear elasticity, assembled by scikit-fem.

With G_ab[i, j] = ∫ ∂_a φ_i ∂_b φ_j the stiffness between component a of node i and b of node j is λ G_ab +
μ G_ba + μ δ_ab tr G (Lamé's λ, μ), so that scalar integrals are enough. The shape functions interpolate the
geometry as well (isoparametric elements), hex20's curved sides with its own twenty.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
import skfem
from skfem.mapping import MappingIsoparametric

from fe_import.errors import Cause, FEImportError
from fe_import.model import IntArray
from fe_import.solid_mesh import SolidMesh

_CHUNK_VALUES = 2_000_000  # shape function values held at a time


@dataclass(frozen=True)
class SolidMaterial:
    """Isotropic linear material.

    Attributes
    ----------
    youngs_modulus : float
        E > 0 [Pa].
    poissons_ratio : float
        -1 < ν < 0.5.
    density : float
        ρ > 0 [kg/m³].
    elements : (m,) int array or None
        Elements that are made of it, all when None.
    """

    youngs_modulus: float
    poissons_ratio: float
    density: float
    elements: IntArray | None = None

    @property
    def lame(self) -> tuple[float, float]:
        """Lamé's parameters λ and μ [Pa]."""
        e, nu = self.youngs_modulus, self.poissons_ratio
        return e * nu / ((1 + nu) * (1 - 2 * nu)), e / (2 * (1 + nu))


def assemble_solid(mesh: SolidMesh, materials: Sequence[SolidMaterial]) -> tuple[sp.csc_array, sp.csc_array]:
    """Consistent mass and stiffness of a free solid.

    Parameters
    ----------
    mesh : SolidMesh
        Checked (``read_mesh``, ``check_mesh``), in m.
    materials : sequence of SolidMaterial
        Every element must have exactly one.

    Returns
    -------
    mass, stiffness : (3 n, 3 n) sparse CSC
        Row 3 * node + component [kg, N/m], symmetric. The mass is exact for the interpolated geometry; the
        stiffness is exact for straight tetrahedra and for parallelepipeds, and for constant strain in any
        element.

    Raises
    ------
    FEImportError
        ``BAD_FIELD``: material out of range, elements without or with two materials.
    """
    assigned = _assigned_elements(mesh, materials)
    element = mesh.element
    local_nodes = np.ascontiguousarray(mesh.elements[:, element.skfem_order].T)
    topology = element.topology(np.ascontiguousarray(mesh.nodes.T), local_nodes, elem=type(element.shape))
    node_of_dof = np.empty(len(mesh.nodes), dtype=np.int64)
    node_of_dof[topology.dofs.element_dofs] = local_nodes

    mass: Any = 0
    stiffness: dict[tuple[int, int], Any] = dict.fromkeys(_GRADIENT_FORMS, 0)
    for material, elements in zip(materials, assigned, strict=True):
        lam, mu = material.lame
        for basis in _bases(mesh, topology, elements, element.mass_order):
            mass = mass + material.density * sp.csr_array(_MASS_FORM.assemble(basis))
        for basis in _bases(mesh, topology, elements, element.stiffness_order):
            g = {ab: sp.csr_array(form.assemble(basis)) for ab, form in _GRADIENT_FORMS.items()}
            trace = g[0, 0] + g[1, 1] + g[2, 2]
            for (a, b), g_ab in g.items():
                block = lam * g_ab + mu * g_ab.T
                stiffness[a, b] = stiffness[a, b] + (block + mu * trace if a == b else block)

    blocks = [[stiffness[a, b] if a <= b else stiffness[b, a].T for b in range(3)] for a in range(3)]
    return (
        _node_major(sp.block_diag([mass] * 3), node_of_dof),
        _node_major(sp.block_array(blocks), node_of_dof),
    )


def _gradient_form(a: int, b: int) -> Any:
    return skfem.BilinearForm(lambda u, v, _: v.grad[a] * u.grad[b])


_GRADIENT_FORMS = {(a, b): _gradient_form(a, b) for a in range(3) for b in range(a, 3)}
_MASS_FORM = skfem.BilinearForm(lambda u, v, _: v * u)


def _bases(mesh: SolidMesh, topology: Any, elements: IntArray, order: int) -> Iterator[Any]:
    """Scalar bases over a few elements at a time, which bounds the memory."""
    element = mesh.element
    quadrature = element.quadrature(order)
    step = max(1, _CHUNK_VALUES // (len(element.reference_nodes) * quadrature[1].size))
    for start in range(0, len(elements), step):
        yield skfem.Basis(
            topology,
            element.shape,
            mapping=MappingIsoparametric(topology, element.shape),  # it caches Jacobians as long as it lives
            elements=elements[start : start + step],
            quadrature=quadrature,
            dofs=topology.dofs,
            disable_doflocs=True,
        )


def _node_major(matrix: Any, node_of_dof: IntArray) -> sp.csc_array:
    """Rows (component, scikit-fem's dof) -> rows 3 * node + component, symmetric to the last bit."""
    n = len(node_of_dof)
    row = (3 * node_of_dof + np.arange(3)[:, None]).ravel()
    coo = sp.coo_array(matrix)
    ordered = sp.csc_array((coo.data, (row[coo.coords[0]], row[coo.coords[1]])), shape=(3 * n, 3 * n))
    return sp.csc_array((ordered + ordered.T) / 2)


def _assigned_elements(mesh: SolidMesh, materials: Sequence[SolidMaterial]) -> list[IntArray]:
    count = len(mesh.elements)
    uses = np.zeros(count, dtype=np.int64)
    assigned = []
    for k, material in enumerate(materials):
        where = f"{mesh.source}: materials[{k}]"
        _check_range(material.youngs_modulus, 0, math.inf, f"{where}.youngs_modulus")
        _check_range(material.poissons_ratio, -1, 0.5, f"{where}.poissons_ratio")
        _check_range(material.density, 0, math.inf, f"{where}.density")
        given = np.arange(count) if material.elements is None else material.elements
        elements = np.unique(given).astype(np.int64)
        if elements.size and (elements[0] < 0 or elements[-1] >= count):
            raise FEImportError(
                Cause.BAD_FIELD,
                "material of elements that do not exist",
                where=f"{where}.elements",
                value=int(elements[0] if elements[0] < 0 else elements[-1]),
                limit=f"0 ... {count - 1}",
            )
        uses[elements] += 1
        assigned.append(elements)
    for wrong, what in ((uses == 0, "no material"), (uses > 1, "more than one material")):
        if wrong.any():
            raise FEImportError(
                Cause.BAD_FIELD,
                f"{wrong.sum()} elements have {what}, the first is element {wrong.argmax()}",
                where=f"{mesh.source}: materials",
                remedy="give every element exactly one material",
            )
    return assigned


def _check_range(value: float, low: float, high: float, where: str) -> None:
    if not low < value < high:
        raise FEImportError(
            Cause.BAD_FIELD,
            "material constant out of range",
            where=where,
            value=value,
            limit=f"above {low:g}" + ("" if math.isinf(high) else f" and below {high:g}"),
        )
