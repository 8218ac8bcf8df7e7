"""Faults of a mesh, each as one typed error that names the mesh and the place; sound meshes pass."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from solid_meshes import box

from fe_import.elements.reference_cells import HEXAHEDRON
from fe_import.elements.solid_elements import SOLID_ELEMENTS
from fe_import.elements.solid_mesh import ElementBlock, SolidMesh
from fe_import.errors import Cause, FEImportError
from fe_import.mesh.checks import check_mesh, scaled_jacobians

TYPES = sorted(SOLID_ELEMENTS)


def moved(mesh: SolidMesh, node: int, position: list[float]) -> SolidMesh:
    nodes = mesh.nodes.copy()
    nodes[node] = position
    return replace(mesh, nodes=nodes)


def joined(first: SolidMesh, second: SolidMesh) -> SolidMesh:
    """Two meshes side by side, nodes that coincide made one."""
    nodes, index = np.unique(np.vstack([first.nodes, second.nodes]).round(12), axis=0, return_inverse=True)
    elements = np.vstack([first.only.elements, second.only.elements + len(first.nodes)])
    return SolidMesh.uniform(nodes, index.ravel()[elements], first.only.type, source="two meshes")


def shifted(mesh: SolidMesh, by: tuple[float, float, float]) -> SolidMesh:
    return replace(mesh, nodes=mesh.nodes + np.array(by))


def with_elements(mesh: SolidMesh, elements: np.ndarray) -> SolidMesh:
    return SolidMesh.uniform(mesh.nodes, elements, mesh.only.type, source=mesh.source)


def on_top() -> SolidMesh:
    """A pyramid of 5 nodes on a hexahedron of 20: the edges that they share have mid-side nodes on one side only."""
    base = CURVED.only.elements[0, HEXAHEDRON.faces[5]]
    nodes = np.vstack([CURVED.nodes, [[0.5, 0.5, 2.0]]])
    pyramid = np.array([[*base, len(CURVED.nodes)]])
    blocks = (ElementBlock("hex20", CURVED.only.elements), ElementBlock("pyramid5", pyramid))
    return SolidMesh(nodes, blocks, source="two orders")


def torn() -> SolidMesh:
    """Two hex20 whose common face has two mid-side nodes on one edge, a little apart."""
    mesh = box("hex20", (2, 1, 1))
    shared = np.intersect1d(mesh.only.elements[0, 8:], mesh.only.elements[1, 8:])[0]
    elements = mesh.only.elements.copy()
    elements[1][elements[1] == shared] = len(mesh.nodes)
    return SolidMesh.uniform(
        np.vstack([mesh.nodes, mesh.nodes[shared] + [0, 0, 0.01]]), elements, "hex20", source=mesh.source
    )


def hanging() -> SolidMesh:
    """A mid-side node of one hex20 that is a corner of a smaller neighbour."""
    coarse = box("hex20", (1, 1, 1))
    fine = shifted(box("hex20", (1, 2, 1)), (1.0, 0.0, 0.0))
    return joined(coarse, fine)


def single(element_type: str, nodes: list[list[float]], *elements: list[int]) -> SolidMesh:
    return SolidMesh.uniform(np.array(nodes, dtype=float), np.array(elements), element_type, source="hand-made mesh")


CUBE = box("hex8", (1, 1, 1))
BRICK = box("hex8", (2, 1, 1))
CURVED = box("hex20", (1, 1, 1))
MID = CURVED.only.elements[0, 8]  # between (0, 0, 0) and (1, 0, 0)
SUPPORT = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
FAULTS = {
    "not a number": (moved(BRICK, 5, [np.nan, 0, 0]), Cause.MESH, "node 5"),
    "infinite": (moved(BRICK, 0, [0, np.inf, 0]), Cause.MESH, "node 0"),
    "absurd": (moved(BRICK, 3, [0, 0, 1e200]), Cause.MESH, "node 3"),
    "mirrored": (
        replace(BRICK, nodes=BRICK.nodes * [1, 1, -1]),
        Cause.MESH,
        "2 of 2 elements are inverted or flat, the first is element 0",
    ),
    "one inverted": (
        with_elements(BRICK, np.stack([BRICK.only.elements[0], np.roll(BRICK.only.elements[1], 4)])),
        Cause.MESH,
        "1 of 2 elements are inverted or flat, the first is element 1 (centre (0.75, 0.5, 0.5)): inverted",
    ),
    "flat": (
        single("tet4", [*SUPPORT, [1, 1, 0]], [0, 1, 2, 3]),
        Cause.MESH,
        "element 0 (centre (0.5, 0.5, 0)): flat",
    ),
    "mid-side node near a corner": (moved(CURVED, MID, [0.2, 0, 0]), Cause.MESH, "element 0"),
    "quarter point": (moved(CURVED, MID, [0.25, 0, 0]), Cause.MESH, ": flat"),
    "node used twice": (single("tet4", SUPPORT, [0, 1, 2, 1]), Cause.MESH, "use a node twice"),
    "coincident nodes": (
        SolidMesh.uniform(
            np.vstack([CUBE.nodes, shifted(CUBE, (1, 0, 0)).nodes]),
            np.vstack([CUBE.only.elements, CUBE.only.elements + 8]),
            "hex8",
            source="two cubes",
        ),
        Cause.MESH,
        "4 pairs of nodes coincide, the first 4 and 8 at (1, 0, 0)",
    ),
    "torn face": (torn(), Cause.MESH, "mid-side node"),
    "hanging node": (hanging(), Cause.MESH, "does not fit its neighbours"),
    "three on a face": (
        single(
            "tet4", [*SUPPORT, [0, 0, 1], [0, 0, -1], [0.3, 0.3, 2]], [0, 1, 2, 3], [0, 2, 1, 4], [0, 1, 2, 5]
        ),
        Cause.MESH,
        "more than two elements share a face",
    ),
    "doubled": (with_elements(CUBE, np.repeat(CUBE.only.elements, 2, axis=0)), Cause.MESH, "have the same corners"),
    "two orders": (on_top(), Cause.MESH, "does not fit its neighbours"),
    "two parts": (joined(BRICK, shifted(CUBE, (5, 0, 0))), Cause.DISCONNECTED, "2 parts"),
    "hinged at an edge": (
        joined(CURVED, shifted(CURVED, (1, 1, 0))),
        Cause.DISCONNECTED,
        "touch at nodes or edges only",
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_faulty_meshes(fault):
    mesh, cause, named = FAULTS[fault]
    with pytest.raises(FEImportError) as caught:
        check_mesh(mesh)
    assert caught.value.cause is cause
    assert named in str(caught.value)
    assert mesh.source in str(caught.value)
    assert caught.value.remedy


@pytest.mark.parametrize("name", TYPES)
def test_sound_meshes_pass(name):
    check_mesh(box(name, (3, 2, 2), (1.0, 1e-3, 10.0), 0.2))


def test_scaled_jacobian_of_bricks():
    """1 for bricks of any aspect ratio, to rounding."""
    np.testing.assert_allclose(scaled_jacobians(box("hex20", (2, 1, 1), (1e3, 1.0, 1e-3))), 1, rtol=1e-12)
