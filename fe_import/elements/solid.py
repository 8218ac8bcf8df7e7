"""Mass and stiffness of a solid link: 3-D linear elasticity."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from fe_import.elements.elasticity import isotropic_moduli
from fe_import.elements.solid_assembly import NodePattern, chunks, element_masses, element_stiffnesses
from fe_import.elements.solid_mesh import SolidMesh
from fe_import.errors import Cause, FEImportError
from fe_import.model import Array, IntArray


@dataclass(frozen=True)
class SolidMaterial:
    """Linear elastic material, isotropic unless it has moduli of its own.

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
    own_moduli : (6, 6) or (m, 6, 6) array or None
        In mesh axes, the same for all of these elements or one for each; see `fe_import.elements.elasticity`. Young's
        modulus and Poisson's ratio are then of no meaning.
    """

    youngs_modulus: float
    poissons_ratio: float
    density: float
    elements: IntArray | None = None
    own_moduli: Array | None = None

    @property
    def moduli(self) -> Array:
        """(6, 6) or (m, 6, 6)."""
        return isotropic_moduli(*self.lame) if self.own_moduli is None else self.own_moduli

    @property
    def lame(self) -> tuple[float, float]:
        """Lamé's parameters λ and μ [Pa]."""
        e, nu = self.youngs_modulus, self.poissons_ratio
        return e * nu / ((1 + nu) * (1 - 2 * nu)), e / (2 * (1 + nu))


def assemble_solid(
    mesh: SolidMesh, materials: Sequence[SolidMaterial], fillings: Sequence[tuple[IntArray, float]] = ()
) -> tuple[sp.csc_array, sp.csc_array]:
    """Consistent mass and stiffness of a free solid.

    Parameters
    ----------
    mesh : SolidMesh
        Checked (``read_mesh``, ``check_mesh``), in m.
    materials : sequence of SolidMaterial
        Every element must have exactly one.
    fillings : sequence of pairs
        Elements, rising, and a density that adds to theirs.

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
    pattern = NodePattern(mesh)
    masses, stiffnesses = np.zeros(pattern.size), np.zeros(9 * pattern.size)
    for material, elements in zip(materials, assigned, strict=True):
        moduli = material.moduli
        for element, nodes, numbers in chunks(mesh, elements):
            corners = mesh.nodes[nodes]
            pattern.add_masses(masses, nodes, element_masses(element, corners, material.density))
            own = moduli if moduli.ndim == 2 else moduli[np.searchsorted(elements, numbers)]
            pattern.add_stiffnesses(stiffnesses, nodes, element_stiffnesses(element, corners, own))
    for elements, density in fillings:
        for element, nodes, _ in chunks(mesh, elements):
            pattern.add_masses(masses, nodes, element_masses(element, mesh.nodes[nodes], density))
    return pattern.mass(masses), pattern.stiffness(stiffnesses)


def volume(mesh: SolidMesh, elements: IntArray) -> float:
    """Of elements, rising."""
    return sum(
        float(element_masses(element, mesh.nodes[nodes], 1.0).sum()) for element, nodes, _ in chunks(mesh, elements)
    )


def element_moduli(mesh: SolidMesh, materials: Sequence[SolidMaterial]) -> tuple[Array, IntArray]:
    """All moduli (k, 6, 6), and which of them each element has."""
    which = np.zeros(mesh.count, dtype=np.int64)
    table: list[Array] = []
    for material in materials:
        elements = np.arange(mesh.count) if material.elements is None else np.unique(material.elements)
        moduli = material.moduli.reshape(-1, 6, 6)
        which[elements] = sum(map(len, table)) + (0 if len(moduli) == 1 else np.arange(len(moduli)))
        table.append(moduli)
    return np.concatenate(table), which


def _assigned_elements(mesh: SolidMesh, materials: Sequence[SolidMaterial]) -> list[IntArray]:
    count = mesh.count
    uses = np.zeros(count, dtype=np.int64)
    assigned = []
    for k, material in enumerate(materials):
        where = f"{mesh.source}: materials[{k}]"
        if material.own_moduli is None:
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
