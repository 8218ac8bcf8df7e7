"""Meshes as they are computed: of a higher order, or with incompatible modes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fe_import.elements.attachments import AverageNode, RigidBody, TiedNodes
from fe_import.elements.solid_elements import SOLID_ELEMENTS
from fe_import.elements.solid_mesh import ElementBlock, SolidMesh, boundary_faces
from fe_import.model import IntArray


def with_incompatible_modes(mesh: SolidMesh) -> SolidMesh:
    """The same mesh, its hexahedra of 8 nodes with incompatible modes."""
    return replace(mesh, blocks=tuple(replace(b, type="hex8i") if b.type == "hex8" else b for b in mesh.blocks))


def is_linear(mesh: SolidMesh) -> bool:
    """Whether elements have corners only (all or none do: they fit together)."""
    return not mesh.blocks[0].element.midpoints


def raised(mesh: SolidMesh) -> SolidMesh:
    """The mesh with a node in the middle of each edge, if it has none; a checked mesh stays sound.

    New nodes come last. They belong to the node sets, rigid bodies, ties and averages by area that hold the corners of
    a whole face of the surface around them.
    """
    if not is_linear(mesh):
        return mesh
    edges = [block.elements[:, block.element.cell.edges] for block in mesh.blocks]  # (m, edges, 2)
    ends, index = np.unique(
        np.sort(np.concatenate([e.reshape(-1, 2) for e in edges]), axis=1), axis=0, return_inverse=True
    )
    new = np.split(len(mesh.nodes) + index.ravel(), np.cumsum([e.shape[0] * e.shape[1] for e in edges])[:-1])
    blocks = []
    for block, own in zip(mesh.blocks, new, strict=True):
        name = block.element.raised
        middle = own.reshape(len(block), -1)
        places = [block.element.cell.edges.index(between) for between in SOLID_ELEMENTS[name].midpoints]
        blocks.append(ElementBlock(name, np.hstack([block.elements, middle[:, places]])))
    nodes = np.vstack([mesh.nodes, mesh.nodes[ends].mean(axis=1)])
    whole = replace(mesh, nodes=nodes, blocks=tuple(blocks))
    faces = boundary_faces(whole)
    sets = {name: _with_middles(members, faces, len(mesh.nodes)) for name, members in mesh.node_sets.items()}
    attachments = tuple(
        replace(item, nodes=_with_middles(item.nodes, faces, len(mesh.nodes)))
        if isinstance(item, (RigidBody, TiedNodes)) or (isinstance(item, AverageNode) and item.weights is None)
        else item
        for item in mesh.attachments
    )
    return replace(whole, node_sets=sets, attachments=attachments)


def _with_middles(members: IntArray, faces: list[IntArray], first_new: int) -> IntArray:
    added = [f[(np.isin(f, members) | (f >= first_new)).all(axis=1)].ravel() for f in faces]
    return np.unique(np.concatenate([members, *added]))
