"""A mesh of solid elements, of shells, or of both, of one type or several, and its surface: data only."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fe_import.elements.attachments import Attachment
from fe_import.elements.shell_elements import SHELL_ELEMENTS, ShellElement
from fe_import.elements.solid_elements import SOLID_ELEMENTS, SolidElement
from fe_import.model import Array, IntArray


@dataclass(frozen=True)
class ElementBlock:
    """Elements of one type.

    Attributes
    ----------
    type : str
        Key of ``SOLID_ELEMENTS``.
    elements : (m, k) int array
        Nodes of each element in meshio's (VTK's) order.
    """

    type: str
    elements: IntArray

    @property
    def element(self) -> SolidElement:
        """The element type's entry in the registry."""
        return SOLID_ELEMENTS[self.type]

    def __len__(self) -> int:
        return len(self.elements)


@dataclass(frozen=True)
class ShellCells:
    """Shell elements of one type: key of ``SHELL_ELEMENTS``, and nodes (m, k), anticlockwise seen from the top."""

    type: str
    elements: IntArray

    @property
    def element(self) -> ShellElement:
        """The element type's entry in the registry."""
        return SHELL_ELEMENTS[self.type]

    def __len__(self) -> int:
        return len(self.elements)


@dataclass(frozen=True)
class MeshMaterial:
    """A material that a mesh file brings, in its units.

    Attributes
    ----------
    youngs_modulus, poissons_ratio, density : float
        With moduli of its own, Young's modulus is the largest along their axes and Poisson's ratio 0.
    moduli : (6, 6) array or None
        In the axes of its section's orientation, or of the mesh; see `fe_import.elements.elasticity`.
    """

    youngs_modulus: float
    poissons_ratio: float
    density: float
    moduli: Array | None = None


@dataclass(frozen=True)
class MeshSection:
    """An element set of a mesh file, its material and the name of its orientation, empty without one."""

    elements: str
    material: str
    orientation: str = ""


@dataclass(frozen=True)
class ShellSection:
    """A set of shells of a mesh file, its isotropic material, thickness, and height of its middle above the nodes."""

    elements: str
    material: str
    thickness: float
    offset: float = 0.0


FILLING = "NONSTRUCTURAL MASS"  # keyword of a filling


@dataclass(frozen=True)
class Filling:
    """Nonstructural mass in the elements of a set: ``density`` per volume, or ``total``, shared as their own mass is
    (``by_mass``) or as their volume.
    """

    elements: str
    density: float = 0.0
    total: float = 0.0
    by_mass: bool = True


@dataclass(frozen=True)
class MeshMaterials:
    """Materials that a mesh file brings.

    Attributes
    ----------
    constants : dict of MeshMaterial
    sections : tuple of MeshSection
    orientations : dict of callable
        (e, 3, 3) axes (columns) at the centres (e, 3) of elements.
    lack : str
        Why they cannot be used; empty when they can.
    names : tuple of str
        What of the file they are made of.
    fillings : tuple of Filling
        Nonstructural masses, whatever the materials are.
    shells : tuple of ShellSection
    shell_lack : str
        Why these cannot be used; empty when they can.
    """

    constants: dict[str, MeshMaterial] = field(default_factory=dict)
    sections: tuple[MeshSection, ...] = ()
    orientations: dict[str, Callable[[Array], Array]] = field(default_factory=dict)
    lack: str = "it is none that brings materials"
    names: tuple[str, ...] = ()
    fillings: tuple[Filling, ...] = ()
    shells: tuple[ShellSection, ...] = ()
    shell_lack: str = "it is none that brings sections of shells"


@dataclass(frozen=True)
class SolidMesh:
    """Nodes, elements and named sets of a link of solid elements or shells.

    Attributes
    ----------
    nodes : (n, 3) array
        Positions in the mesh frame, in the file's unit of length; every node belongs to an element.
    blocks : tuple of ElementBlock
        Solid elements, counted through all blocks.
    element_sets : dict
        Name -> solid elements, rising.
    node_sets : dict
        Name -> nodes, rising.
    source : str
        File that the mesh came from.
    lost_sets : dict
        Name -> why a set of the file is not among these.
    left_out : dict of int
        What stands in the file and is not part of the link, and how often.
    further_nodes : (k, 3) array
        Of no element, which attachments need.
    further_names : dict of int
        Name -> the one further node of a set.
    attachments : tuple of Attachment
        Further nodes have negative numbers: those of the mesh and these in one array, counted from its end.
    materials : MeshMaterials
    shells : tuple of ShellCells
        Counted through all of them, from 0.
    shell_sets : dict
        Name -> shells, rising.
    """

    nodes: Array
    blocks: tuple[ElementBlock, ...]
    element_sets: dict[str, IntArray] = field(default_factory=dict)
    node_sets: dict[str, IntArray] = field(default_factory=dict)
    source: str = ""
    lost_sets: dict[str, str] = field(default_factory=dict)
    left_out: dict[str, int] = field(default_factory=dict)
    further_nodes: Array = field(default_factory=lambda: np.zeros((0, 3)))
    further_names: dict[str, int] = field(default_factory=dict)
    attachments: tuple[Attachment, ...] = ()
    materials: MeshMaterials = field(default_factory=MeshMaterials)
    shells: tuple[ShellCells, ...] = ()
    shell_sets: dict[str, IntArray] = field(default_factory=dict)

    @staticmethod
    def uniform(nodes: Array, elements: IntArray, element_type: str, **further: Any) -> SolidMesh:
        """A mesh of one element type."""
        return SolidMesh(nodes, (ElementBlock(element_type, elements),), **further)

    @property
    def only(self) -> ElementBlock:
        """The block of a mesh of one type."""
        (block,) = self.blocks
        return block

    @property
    def count(self) -> int:
        """Number of solid elements."""
        return sum(map(len, self.blocks))

    @property
    def shell_count(self) -> int:
        """Number of shells."""
        return sum(map(len, self.shells))

    @property
    def all_elements(self) -> list[IntArray]:
        """Nodes (m, k) of all elements, type by type, solids first."""
        return [*(block.elements for block in self.blocks), *(cells.elements for cells in self.shells)]

    @property
    def shell_nodes(self) -> IntArray:
        """Nodes of shells, rising; they turn."""
        return np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *(c.elements.ravel() for c in self.shells)]))

    def parts(self, chosen: IntArray | None = None) -> Iterator[tuple[ElementBlock, IntArray, IntArray]]:
        """Each block with its chosen elements: their rows in it, and their numbers through all blocks."""
        start = 0
        for block in self.blocks:
            if chosen is None:
                rows = np.arange(len(block))
            else:
                rows = chosen[(chosen >= start) & (chosen < start + len(block))] - start
            yield block, rows, rows + start
            start += len(block)

    def nodes_of(self, chosen: IntArray) -> IntArray:
        """Nodes of elements, rising."""
        used = [block.elements[rows].ravel() for block, rows, _ in self.parts(chosen)]
        return np.unique(np.concatenate(used))

    def centres(self, chosen: IntArray) -> Array:
        """(e, 3) means of the corners of elements, which rise."""
        corners = [block.elements[rows, : block.element.corners] for block, rows, _ in self.parts(chosen)]
        return np.concatenate([self.nodes[own].mean(axis=1) for own in corners])

    def element_nodes(self, number: int) -> IntArray:
        """(k,) nodes of one element; shells are counted behind the solids."""
        for elements in self.all_elements:
            if number < len(elements):
                return np.asarray(elements[number])
            number -= len(elements)
        raise IndexError(number)


@dataclass(frozen=True)
class ElementFaces:
    """All faces of all elements, anticlockwise seen from outside.

    Attributes
    ----------
    nodes : (f, w) int array
        Corners, mid-edge nodes, centre; filled up with -1.
    sizes : (f,) int array
        How many nodes each has.
    label : (f,) int array
        Equal for faces of equal corners.
    owner : (f,) int array
        Elements.
    """

    nodes: IntArray
    sizes: IntArray
    label: IntArray
    owner: IntArray


def element_faces(mesh: SolidMesh) -> ElementFaces:
    """All faces of all elements, and which of them are one and the same."""
    width = max((len(face) for block in mesh.blocks for face in block.element.faces), default=4)
    none = np.zeros(0, dtype=np.int64)
    nodes, corners, sizes, owner = [none.reshape(0, width)], [none.reshape(0, 4)], [none], [none]
    for block, _, numbers in mesh.parts():
        for face, edges in zip(block.element.faces, block.element.cell.faces, strict=True):
            rows = np.full((len(block), width), -1, dtype=np.int64)
            rows[:, : len(face)] = block.elements[:, face]
            ends = np.full((len(block), 4), -1, dtype=np.int64)
            ends[:, : len(edges)] = block.elements[:, edges]
            nodes.append(rows)
            corners.append(ends)
            sizes.append(np.full(len(block), len(face)))
            owner.append(numbers)
    label = np.unique(np.sort(np.concatenate(corners), axis=1), axis=0, return_inverse=True)[1]
    return ElementFaces(np.concatenate(nodes), np.concatenate(sizes), label.ravel(), np.concatenate(owner))


def boundary_faces(mesh: SolidMesh) -> list[IntArray]:
    """Faces of one solid only, anticlockwise seen from outside, then shells: arrays (f, k) of k nodes each."""
    faces = element_faces(mesh)
    alone = np.bincount(faces.label)[faces.label] == 1
    solids = [faces.nodes[alone & (faces.sizes == k), :k] for k in np.unique(faces.sizes[alone])]
    return [*solids, *(cells.elements for cells in mesh.shells)]


# a face of n nodes -> triangles over its nodes (corners, then mid-edge nodes, then centre), same sense
FACE_TRIANGLES = {
    3: ((0, 1, 2),),
    4: ((0, 1, 2), (0, 2, 3)),
    6: ((0, 3, 5), (1, 4, 3), (2, 5, 4), (3, 4, 5)),
    8: ((0, 4, 7), (1, 5, 4), (2, 6, 5), (3, 7, 6), (4, 5, 6), (4, 6, 7)),
    9: ((0, 4, 7), (1, 5, 4), (2, 6, 5), (3, 7, 6), (4, 5, 8), (5, 6, 8), (6, 7, 8), (7, 4, 8)),
}


def split_faces(faces: list[IntArray]) -> IntArray:
    """(t, 3) triangles over all nodes of faces (f, k), so that curvature shows; the same sense."""
    triangles = [f[:, np.array(FACE_TRIANGLES[f.shape[1]])].reshape(-1, 3) for f in faces]
    return np.concatenate([np.zeros((0, 3), dtype=np.int64), *triangles])


def surface_triangles(mesh: SolidMesh) -> IntArray:
    """(t, 3) triangles of the surface, anticlockwise seen from outside."""
    return split_faces(boundary_faces(mesh))
