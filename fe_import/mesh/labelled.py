"""A mesh whose nodes and elements have numbers, as formats of programs state it: gathered, then without numbers."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from fe_import.mesh.raw import Block, RawMesh
from fe_import.model import IntArray

_LARGEST_LABEL = 10**12


@dataclass
class LabelledMesh:
    """Nodes and elements by number, sets of numbers by name.

    Attributes
    ----------
    points : dict of (3,) tuples
    shapes : dict
        meshio's name of a shape -> its dimension.
    cells : dict
        Shape -> number of an element -> numbers of its nodes, in meshio's order.
    kinds : dict
        Number of an element -> its shape.
    node_sets, element_sets : dict
        Name -> numbers.
    """

    points: dict[int, tuple[float, ...]] = field(default_factory=dict)
    shapes: dict[str, int] = field(default_factory=dict)
    cells: dict[str, dict[int, list[int]]] = field(default_factory=dict)
    kinds: dict[int, str] = field(default_factory=dict)
    node_sets: dict[str, list[int]] = field(default_factory=dict)
    element_sets: dict[str, list[int]] = field(default_factory=dict)

    def add_point(self, label: int, position: tuple[float, ...]) -> None:
        """Add a node.

        Raises
        ------
        ValueError
            Its number stands twice or is no number of a node.
        """
        if not 0 <= label < _LARGEST_LABEL:
            raise ValueError(f"{label} is no number of a node")
        if self.points.setdefault(label, position) is not position:
            raise ValueError(f"node {label} stands twice")

    def add_cell(self, shape: str, dimension: int, label: int, nodes: list[int]) -> None:
        """Add an element; its nodes may follow later.

        Raises
        ------
        ValueError
            Its number stands twice.
        """
        if self.kinds.setdefault(label, shape) != shape or label in self.cells.get(shape, {}):
            raise ValueError(f"element {label} stands twice")
        self.shapes[shape] = dimension
        self.cells.setdefault(shape, {})[label] = nodes

    def raw(self) -> RawMesh:
        """Without numbers; sets with members that are not there are lost.

        Raises
        ------
        ValueError
            An element needs a node that is not there.
        """
        place = {label: k for k, label in enumerate(self.points)}
        mesh = RawMesh(np.array(list(self.points.values()), dtype=float).reshape(-1, 3), [])
        for shape, cells in self.cells.items():
            for label, nodes in cells.items():
                missing = next((n for n in nodes if n not in place), None)
                if missing is not None:
                    raise ValueError(f"element {label} needs node {missing}, which is not there")
            rows = np.array([[place[n] for n in nodes] for nodes in cells.values()], dtype=np.int64)
            mesh.blocks.append(Block(shape, self.shapes[shape], rows))
        numbers = [{label: k for k, label in enumerate(cells)} for cells in self.cells.values()]
        for name, labels in self.node_sets.items():
            if self._known(mesh, name, labels, place, "node"):
                mesh.point_sets[name] = _sorted(place[label] for label in labels)
        for name, labels in self.element_sets.items():
            if self._known(mesh, name, labels, self.kinds, "element"):
                mesh.cell_sets[name] = [_sorted(own[i] for i in labels if i in own) for own in numbers]
        return mesh

    @staticmethod
    def _known(mesh: RawMesh, name: str, labels: list[int], known: Iterable[int], what: str) -> bool:
        missing = next((label for label in labels if label not in known), None)
        if missing is not None:
            mesh.lost[name] = f"it names {what} {missing}, which is not there or not read"
        return missing is None


def _sorted(values: Iterable[int]) -> IntArray:
    return np.unique(np.fromiter(values, dtype=np.int64))
