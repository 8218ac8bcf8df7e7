"""Shells of a mesh: what they are made of, by the link description, and their matrices over the nodes."""

from __future__ import annotations

import math

import numpy as np

from fe_import.description.meshes import Layer, Shell, ShellRegion
from fe_import.description.records import LinkDescription, Material
from fe_import.elements.laminates import Lamina, Laminate, plane_stress
from fe_import.elements.shell import ShellBlock, element_matrices, lumped
from fe_import.elements.shell_stress import ShellPart
from fe_import.elements.solid_mesh import SolidMesh
from fe_import.errors import Cause, FEImportError
from fe_import.files.toml import as_spelt, choose
from fe_import.model import Array, IntArray
from fe_import.models.attached import AttachedNodes, Entries

_CHUNK = 4000  # elements whose matrices are held at a time
_ACROSS = 1e-3  # sine of the angle between a direction and the normal of a shell


def shell_parts(link: LinkDescription, shell: Shell, mesh: SolidMesh, where: str) -> list[ShellPart]:
    """Shells with one make and of one type each, in the order of the mesh.

    Raises
    ------
    FEImportError
        ``BAD_REFERENCE``: an unknown set; ``BAD_FIELD``: shells of no region or of two, layers without a direction,
        or with one that stands on the surface.
    """
    if shell.regions:
        makes = [laminate(link, made) for made in shell.regions]
        sets = [(region.set, f"shell.regions[{k}].set") for k, region in enumerate(shell.regions)]
    elif shell.material or shell.layers:
        makes, sets = [laminate(link, shell)], []
    else:
        makes, sets = _of_mesh(mesh, where)
    which = _assigned(sets, mesh, where)
    parts, start = [], 0
    for cells in mesh.shells:
        numbers = start + np.arange(len(cells))
        for k, make in enumerate(makes):
            own = numbers[which[numbers] == k]
            if not len(own):
                continue
            nodes = cells.elements[own - start]
            reference = None
            if not make.isotropic:
                reference = _directions(shell, mesh.nodes[nodes], where)
            count = len(own)
            stiffness, moments = np.tile(make.stiffness(), (count, 1, 1)), np.tile(make.moments(), (count, 1))
            block = ShellBlock(cells.element, nodes, stiffness, moments, reference)
            parts.append(ShellPart(block, own, make, shell.drilling))
        start += len(cells)
    _check_normals(parts, mesh.nodes, where)
    return parts


def _check_normals(parts: list[ShellPart], nodes: Array, where: str) -> None:
    """Neighbouring shells look to one side, where their make has two different ones.

    Raises
    ------
    FEImportError
        ``MESH``: their common edge runs the same way in both.
    """
    sides = [block.nodes for block in (part.block for part in parts if part.laminate.sided)]
    if not sides:
        return
    edges = np.concatenate([np.stack([n, np.roll(n, -1, axis=1)], axis=2).reshape(-1, 2) for n in sides])
    common, which, times = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True, return_counts=True)
    forward = np.bincount(which.ravel(), edges[:, 0] < edges[:, 1], minlength=len(common))
    same = np.flatnonzero((times == 2) & (forward != 1))
    if len(same):
        place = "({:.4g}, {:.4g}, {:.4g})".format(*nodes[common[same[0]]].mean(axis=0))
        raise FEImportError(
            Cause.MESH,
            f"normals of neighbouring shells point to opposite sides, at {len(same)} edges, the first at {place}; an "
            "offset, or layers, count along them",
            where=f"{where}: shell",
            remedy="orient the shells in the mesher, or give a thickness that is the same from both sides",
        )


def add_shells(parts: list[ShellPart], where: AttachedNodes, form: str, mass: Entries, stiffness: Entries) -> None:
    """Matrices of shells; ``form`` of the mass as in the description."""
    for part in parts:
        block = part.block
        for begin in range(0, len(block.nodes), _CHUNK):
            some = part.some(slice(begin, begin + _CHUNK)).block
            masses, stiffnesses, _ = element_matrices(some, where.nodes[some.nodes], part.drilling)
            rows = where.dof_map[some.nodes].reshape(len(some.nodes), -1)
            mass.add_all(rows, lumped(masses) if form == "lumped" else masses)
            stiffness.add_all(rows, stiffnesses)


def laminate(link: LinkDescription, made: Shell | ShellRegion) -> Laminate:
    """Of checked fields."""
    layers = made.layers or [Layer(made.material, made.thickness or 0.0)]
    return Laminate(tuple(_lamina(link.materials[layer.material], layer) for layer in layers), made.offset)


def _lamina(m: Material, layer: Layer) -> Lamina:
    shear = m.youngs_modulus / (2 * (1 + m.poissons_ratio)) if m.shear_modulus is None else m.shear_modulus
    second = m.youngs_modulus if m.transverse_modulus is None else m.transverse_modulus
    across = shear if m.transverse_shear_modulus is None else m.transverse_shear_modulus
    plane = plane_stress(m.youngs_modulus, second, m.poissons_ratio, shear)
    return Lamina(plane, np.array([shear, across]), m.density, layer.thickness, math.radians(layer.angle))


def _of_mesh(mesh: SolidMesh, where: str) -> tuple[list[Laminate], list[tuple[str, str]]]:
    """Makes and sets of the sections that the mesh file brings."""
    found = mesh.materials
    if found.shell_lack:
        raise FEImportError(
            Cause.BAD_FIELD,
            f"no 'material' and 'thickness', and the sections of the mesh file cannot be used: {found.shell_lack}",
            where=f"{where}: shell",
            remedy="give material and thickness for the whole mesh, or [[shell.regions]] for its sets",
        )
    makes, sets = [], []
    for section in found.shells:
        m = found.constants[section.material]
        material = Material(m.youngs_modulus, m.poissons_ratio, m.density)
        layer = _lamina(material, Layer(section.material, section.thickness))
        makes.append(Laminate((layer,), section.offset))
        sets.append((section.elements, "shell"))
    return makes, sets


def _assigned(sets: list[tuple[str, str]], mesh: SolidMesh, where: str) -> IntArray:
    """(shells,) number of the make of each, from sets and the fields that name them."""
    if not sets:
        return np.zeros(mesh.shell_count, dtype=np.int64)
    which = np.full(mesh.shell_count, -1, dtype=np.int64)
    for k, (name, field) in enumerate(sets):
        place = f"{where}: {field}"
        spelt = as_spelt(name, mesh.shell_sets)
        choose(spelt, mesh.shell_sets, place)
        own = mesh.shell_sets[spelt]
        if (which[own] >= 0).any():
            other = sets[int(which[own].max())][0]
            raise FEImportError(
                Cause.BAD_FIELD, f"shells of this set are of set {other!r}, too", where=place, value=name,
                remedy="give every shell one region",
            )  # fmt: skip
        which[own] = k
    if (which < 0).any():
        raise FEImportError(
            Cause.BAD_FIELD,
            f"{(which < 0).sum()} of {len(which)} shells are of no region or section",
            where=f"{where}: shell",
            remedy="add a region for their set",
        )
    return which


def _directions(shell: Shell, corners: Array, where: str) -> Array:
    if shell.direction is None:
        raise FEImportError(
            Cause.BAD_FIELD, "layers that are not isotropic need a direction", where=f"{where}: shell.direction",
            remedy="give the direction from which their angles count, as [1, 0, 0]",
        )  # fmt: skip
    direction = np.asarray(shell.direction) / np.linalg.norm(shell.direction)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, -1] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    across = np.linalg.norm(np.cross(direction, normals), axis=1)
    if across.min() < _ACROSS:
        raise FEImportError(
            Cause.BAD_FIELD,
            "the direction of layers stands on the surface of some shells",
            where=f"{where}: shell.direction",
            value=shell.direction,
            limit=f"sine of the angle to the normal above {_ACROSS:g}, at {corners[across.argmin()].mean(axis=0)}",
            remedy="give another direction, or split the link",
        )
    return np.tile(direction, (len(corners), 1))
