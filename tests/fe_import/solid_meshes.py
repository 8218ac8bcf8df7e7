"""Structured solid meshes for tests: boxes of every element type, distorted at will, and a quarter ring."""

from __future__ import annotations

import importlib
from itertools import permutations

import numpy as np

from fe_import.elements.reference_cells import HEXAHEDRON
from fe_import.elements.solid_elements import SOLID_ELEMENTS
from fe_import.elements.solid_mesh import ElementBlock, SolidMesh, boundary_faces

importlib.import_module("fe_import.mesh.meshio_files")  # teaches meshio two types of elements

HEX = np.array(HEXAHEDRON.corners)


def _tetrahedra() -> np.ndarray:
    """Six around the diagonal, one per order in which the axes are walked."""
    walks = []
    for order in permutations(range(3)):
        walk = np.cumsum([np.zeros(3, int), *(np.eye(3, dtype=int)[axis] for axis in order)], axis=0)
        mirrored = np.linalg.det(walk[1:] - walk[0]) < 0
        walks.append(walk[[0, 2, 1, 3]] if mirrored else walk)
    return 12 * np.array(walks)


# shape -> (elements of a cell of a box, corners, 3), in twelfths of the cell
CUTS = {
    "hexahedron": 12 * HEX[None],
    "wedge": 12 * HEX[[[0, 1, 2, 4, 5, 6], [0, 2, 3, 4, 6, 7]]],
    "pyramid": np.array([[*(12 * HEX[list(face[::-1])]), [6, 6, 6]] for face in HEXAHEDRON.faces]),
    "tetrahedron": _tetrahedra(),
}


def box(
    element_type: str,
    divisions: tuple[int, int, int] = (2, 2, 2),
    size: tuple[float, float, float] = (1.0, 1.0, 1.0),
    distortion: float = 0.0,
    curvature: float = 0.0,
    seed: int = 0,
) -> SolidMesh:
    """A box from the origin with node sets x0, x1, ... z1 of its faces.

    Inner corners move by up to ``distortion`` times the spacing, mid-side nodes follow; inner mid-side nodes
    then move by up to ``curvature`` times the spacing.
    """
    element = SOLID_ELEMENTS[element_type]
    n = np.array(divisions)
    cells = np.stack(np.meshgrid(*(np.arange(k) for k in n), indexing="ij"), axis=-1).reshape(-1, 3)
    # on a lattice of 12 per cell all midpoints and centres are integers
    corners = (12 * cells[:, None, None, :] + CUTS[element.cell.name]).reshape(-1, element.corners, 3)
    lattice = [corners[:, i] for i in range(element.corners)]
    lattice += [corners[:, list(between)].sum(axis=1) // len(between) for between in element.midpoints]
    keys, index = np.unique(np.stack(lattice, axis=1).reshape(-1, 3), axis=0, return_inverse=True)
    elements = index.reshape(len(corners), -1)

    spacing = np.array(size) / n
    nodes = keys / 12 * spacing
    inner = ((keys > 0) & (keys < 12 * n)).all(axis=1)
    is_corner = np.zeros(len(nodes), dtype=bool)
    is_corner[elements[:, : element.corners]] = True
    random = np.random.default_rng(seed)
    shift = random.uniform(-1, 1, nodes.shape) * spacing
    move = inner & is_corner
    nodes[move] += distortion * shift[move]
    for i, between in enumerate(element.midpoints):
        nodes[elements[:, element.corners + i]] = nodes[elements[:, list(between)]].mean(axis=1)
    move = inner & ~is_corner
    nodes[move] += curvature * shift[move]
    sets = {f"{axis}0": np.flatnonzero(keys[:, k] == 0) for k, axis in enumerate("xyz")}
    sets |= {f"{axis}1": np.flatnonzero(keys[:, k] == 12 * n[k]) for k, axis in enumerate("xyz")}
    return SolidMesh.uniform(nodes, elements, element_type, node_sets=sets, source=f"box of {element_type}")


def quarter_ring(element_type: str, around: int, inner: float, outer: float, height: float) -> SolidMesh:
    """A quarter of a thick-walled cylinder about z, its nodes on true circles."""
    straight = box(element_type, (1, around, 1), (1.0, 1.0, 1.0))
    r = inner + (outer - inner) * straight.nodes[:, 0]
    angle = straight.nodes[:, 1] * np.pi / 2
    nodes = np.column_stack([r * np.cos(angle), r * np.sin(angle), height * straight.nodes[:, 2]])
    return SolidMesh.uniform(
        nodes, straight.only.elements, element_type, node_sets=straight.node_sets, source="quarter ring"
    )


def side(mesh: SolidMesh, name: str) -> np.ndarray:
    """(f, k) element faces of a side of a box; they are all of one kind."""
    found = [faces[np.isin(faces, mesh.node_sets[name]).all(axis=1)] for faces in boundary_faces(mesh)]
    (faces,) = (f for f in found if len(f))
    return faces


def mixed_box(quadratic: bool = False) -> SolidMesh:
    """A box of 3 x 1 x 1 with all shapes: a hexahedron, two wedges, and five pyramids with two tetrahedra."""
    x = np.array([12, 0, 0])
    end = CUTS["pyramid"][1]  # on the side x1
    parts = {
        "hexahedron": CUTS["hexahedron"],
        "wedge": CUTS["wedge"] + x,
        "pyramid": np.delete(CUTS["pyramid"], 1, axis=0) + 2 * x,
        "tetrahedron": end[[[0, 1, 2, 4], [0, 2, 3, 4]]] + 2 * x,
    }
    names = {"hexahedron": "hex20", "wedge": "wedge15", "pyramid": "pyramid13", "tetrahedron": "tet10"}
    if not quadratic:
        names = {"hexahedron": "hex8", "wedge": "wedge6", "pyramid": "pyramid5", "tetrahedron": "tet4"}
    lattices = []
    for shape, corners in parts.items():
        middle = [corners[:, list(b)].sum(axis=1) // 2 for b in SOLID_ELEMENTS[names[shape]].midpoints]
        lattices.append(np.concatenate([corners, *(m[:, None] for m in middle)], axis=1))
    keys, index = np.unique(np.concatenate([a.reshape(-1, 3) for a in lattices]), axis=0, return_inverse=True)
    ends = np.split(index.ravel(), np.cumsum([a.shape[0] * a.shape[1] for a in lattices])[:-1])
    blocks = [ElementBlock(names[s], e.reshape(a.shape[:2])) for s, e, a in zip(parts, ends, lattices, strict=True)]
    sets = {f"x{k}": np.flatnonzero(keys[:, 0] == 36 * k) for k in (0, 1)}
    return SolidMesh(keys / 12, tuple(blocks), node_sets=sets, source="mixed box")


_CARDS = {"tet4": "CTETRA", "pyramid5": "CPYRAM", "wedge6": "CPENTA", "hex8": "CHEXA"}
BAR = box("hex8", (3, 1, 1))


def bulk(mesh: SolidMesh, *more: str, before: str = "", large: bool = False) -> str:
    """Grid point k has number 10 k + 7, element k number k + 1 and property 2; free fields, or large ones."""
    lines = [before + "BEGIN BULK"]
    for k, (x, y, z) in enumerate(mesh.nodes.tolist()):
        if large:
            lines += [f"{'GRID   *':8s}{10 * k + 7:16d}{'':16s}{x:16.9E}{y:16.9E}", f"{'*':8s}{z:16.9E}"]
        else:
            lines.append(f"GRID,{10 * k + 7},,{x!r},{y!r},{z!r}")
    label = 0
    for block in mesh.blocks:
        for nodes in block.elements:
            label += 1
            fields = [str(label), "2", *(str(10 * n + 7) for n in nodes)]
            parts = [",".join(fields[i : i + 8]) for i in range(0, len(fields), 8)]
            lines += [f"{name},{part}" for name, part in zip([_CARDS[block.type], "", ""], parts, strict=False)]
    return "\n".join([*lines, "PSOLID,2,1", "MAT1,1,7.+10,,.33,2700.", *more, "ENDDATA", ""])
