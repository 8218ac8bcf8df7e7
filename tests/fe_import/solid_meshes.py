"""Structured solid meshes for tests: boxes of every element type, distorted at will, and a quarter ring."""

from __future__ import annotations

from itertools import permutations

import numpy as np

from fe_import.elements.solid_elements import SOLID_ELEMENTS
from fe_import.elements.solid_mesh import SolidMesh


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
    corner_offsets = np.array(SOLID_ELEMENTS["hex8"].corner_coordinates)
    cells = np.stack(np.meshgrid(*(np.arange(k) for k in n), indexing="ij"), axis=-1).reshape(-1, 3)
    if element.corners == 8:
        corners = cells[:, None, :] + corner_offsets
    else:  # six tetrahedra around the diagonal, one per order in which the axes are walked
        walks = []
        for order in permutations(range(3)):
            walk = np.cumsum([np.zeros(3, int), *(np.eye(3, dtype=int)[axis] for axis in order)], axis=0)
            mirrored = np.linalg.det(walk[1:] - walk[0]) < 0
            walks.append(walk[[0, 2, 1, 3]] if mirrored else walk)
        corners = (cells[:, None, None, :] + np.array(walks)).reshape(-1, 4, 3)
    # on a lattice of 12 per cell all midpoints and centres are integers
    lattice = [12 * corners[:, i] for i in range(element.corners)]
    lattice += [12 * corners[:, list(between)].sum(axis=1) // len(between) for between in element.midpoints]
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
    return SolidMesh(nodes, elements, element_type, node_sets=sets, source=f"box of {element_type}")


def quarter_ring(element_type: str, around: int, inner: float, outer: float, height: float) -> SolidMesh:
    """A quarter of a thick-walled cylinder about z, its nodes on true circles."""
    straight = box(element_type, (1, around, 1), (1.0, 1.0, 1.0))
    r = inner + (outer - inner) * straight.nodes[:, 0]
    angle = straight.nodes[:, 1] * np.pi / 2
    nodes = np.column_stack([r * np.cos(angle), r * np.sin(angle), height * straight.nodes[:, 2]])
    return SolidMesh(
        nodes, straight.elements, element_type, node_sets=straight.node_sets, source="quarter ring"
    )
