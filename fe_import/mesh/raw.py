"""What a mesh file holds, before it is checked: points, blocks of cells, sets. Every reader of meshes gives this."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from fe_import.elements.attachments import Attachment
from fe_import.elements.solid_mesh import MeshMaterials
from fe_import.model import Array, IntArray


@dataclass(frozen=True)
class Block:
    """Cells of one type: meshio's name, dimension and (m, k) points."""

    type: str
    dimension: int
    cells: IntArray


@dataclass(frozen=True)
class LeftOut:
    """What a file holds besides its mesh.

    Attributes
    ----------
    name : str
        Keyword, card or type of elements.
    count : int
    where : str
        Place of the first.
    loss : str
        What the link would lack; empty where it cannot matter to a link.
    used : bool
        Read after all, as attachments; they may be left out when asked for.
    """

    name: str
    count: int
    where: str
    loss: str = ""
    used: bool = False


@dataclass
class RawMesh:
    """A mesh as it stands in a file; nothing is checked.

    Attributes
    ----------
    points : (n, 3) array
    blocks : list of Block
    cell_sets : dict
        Name -> cells of each block (an array, or None).
    point_sets : dict
        Name -> points.
    lost : dict
        Name -> why a set of the file is not among these.
    left_out : list of LeftOut
    attachments : list of Attachment
        With numbers of points.
    materials : MeshMaterials
    mirrored : frozenset of str
        Types of solid elements that the format may number inside out; where all of one are, they are turned.
    """

    points: Array
    blocks: list[Block]
    cell_sets: dict[str, list[Any]] = field(default_factory=dict)
    point_sets: dict[str, Any] = field(default_factory=dict)
    lost: dict[str, str] = field(default_factory=dict)
    left_out: list[LeftOut] = field(default_factory=list)
    attachments: list[Attachment] = field(default_factory=list)
    materials: MeshMaterials = field(default_factory=MeshMaterials)
    mirrored: frozenset[str] = frozenset()
