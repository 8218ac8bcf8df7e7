"""Materials in bulk data: PSOLID with MAT1, MAT9, MAT11 and the system of the material; PSHELL with MAT1."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fe_import.elements.elasticity import checked_moduli, largest_youngs_modulus, orthotropic_moduli
from fe_import.elements.solid_mesh import MeshMaterial, MeshMaterials, MeshSection, ShellSection
from fe_import.mesh.nastran_bulk import Bulk, Unused
from fe_import.model import Array
from fe_import.nastran.cards import Card
from fe_import.nastran.grid import Frame

USED = ("PSOLID", "MAT1", "MAT9", "MAT11")
_SAME = 1e-3  # share by which E, G and Poisson's ratio of one MAT1 may disagree


def mesh_materials(bulk: Bulk, owners: set[int], shells: set[int]) -> MeshMaterials:
    """Materials of the properties of solid elements, and of shells."""
    constants: dict[str, MeshMaterial] = {}
    sections: list[MeshSection] = []
    orientations: dict[str, Callable[[Array], Array]] = {}
    lack = ""
    try:
        for number in sorted(owners):
            card = bulk.property(number, ("PSOLID",))
            own = bulk.materials.get(card.integer(2))
            if own is None or own.name not in _READERS:
                raise Unused(f"material {card.integer(2)} of PSOLID {number} is no MAT1, MAT9 or MAT11 of this file")
            name, axes = f"{own.name}:{own.integer(1)}", ""
            constants[name] = _READERS[own.name](own)
            if constants[name].moduli is not None:
                if card.field(3) in ("", "-1"):
                    raise Unused(f"PSOLID {number} lacks the coordinate system of its material (CORDM)")
                axes = f"CORDM:{card.integer(3)}"
                orientations[axes] = _axes(bulk.points.frames.get(card.integer(3), card))
            sections.append(MeshSection(f"PID:{number}", name, axes))
    except (Unused, ValueError) as reason:
        lack = str(reason)
    shell_sections, shell_lack = _shell_sections(bulk, shells, constants)
    return MeshMaterials(
        constants, tuple(sections), orientations, lack, USED, shells=shell_sections, shell_lack=shell_lack
    )


def _shell_sections(
    bulk: Bulk, owners: set[int], constants: dict[str, MeshMaterial]
) -> tuple[tuple[ShellSection, ...], str]:
    """PSHELL of one material, which bends and shears as a solid plate; or why they are not used."""
    found = []
    try:
        for number in sorted(owners):
            card = bulk.property(number, ("PSHELL",))
            material, thickness = card.integer(2), card.real(3, 0.0)
            plain = card.integer(4, 0) == material and card.integer(6, material) == material
            plain &= abs(card.real(5, 1.0) - 1) < _SAME and abs(card.real(7, 5 / 6) - 5 / 6) < _SAME
            if not (plain and thickness > 0 and card.real(8, 0.0) == 0):
                raise Unused(f"PSHELL {number} is no plate of one material without nonstructural mass")
            own = bulk.materials.get(material)
            if own is None or own.name != "MAT1":
                raise Unused(f"material {material} of PSHELL {number} is no MAT1 of this file")
            name = f"MAT1:{material}"
            constants[name] = _isotropic(own)
            found.append(ShellSection(f"PID:{number}", name, thickness))
    except (Unused, ValueError) as reason:
        return (), str(reason)
    return tuple(found), "" if found else "its shells have no PSHELL"


def _axes(frame: Frame) -> Callable[[Array], Array]:
    return lambda points: np.stack([frame.axes_at(point) for point in points])


def elastic_constants(card: Card) -> tuple[float, float, float]:
    """E, G and Poisson's ratio of a MAT1, which gives two of them or all.

    Raises
    ------
    Unused
    """
    young, shear, ratio = (card.real(k) if card.field(k) else None for k in (2, 3, 4))
    if young is None and shear is not None and ratio is not None:
        young = 2 * shear * (1 + ratio)
    elif shear is None and young is not None and ratio is not None and ratio > -1:
        shear = young / (2 * (1 + ratio))
    elif ratio is None and young and shear:
        ratio = young / (2 * shear) - 1
    if young is None or shear is None or ratio is None:
        raise Unused(f"MAT1 {card.integer(1)} lacks two of E, G and Poisson's ratio")
    return young, shear, ratio


def _isotropic(card: Card) -> MeshMaterial:
    young, shear, ratio = elastic_constants(card)
    if abs(2 * shear * (1 + ratio) - young) > _SAME * abs(young):
        raise Unused(f"E, G and Poisson's ratio of MAT1 {card.integer(1)} are not those of an isotropic solid")
    return MeshMaterial(young, ratio, card.real(5, 0.0))


def _anisotropic(card: Card) -> MeshMaterial:
    own, k = np.zeros((6, 6)), 2
    for i in range(6):
        for j in range(i, 6):
            own[i, j] = own[j, i] = card.real(k, 0.0)
            k += 1
    moduli = checked_moduli(own)
    return MeshMaterial(largest_youngs_modulus(moduli), 0.0, card.real(k, 0.0), moduli)


def _orthotropic(card: Card) -> MeshMaterial:
    given = [card.real(k, 0.0) for k in range(2, 12)]
    moduli = orthotropic_moduli(given[:3], given[3:6], given[6:9])
    return MeshMaterial(largest_youngs_modulus(moduli), 0.0, given[9], moduli)


_READERS: dict[str, Callable[[Card], MeshMaterial]] = {
    "MAT1": _isotropic,
    "MAT9": _anisotropic,
    "MAT11": _orthotropic,
}
