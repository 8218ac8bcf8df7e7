"""Faces and lines of the elements of input decks, for pictures."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fe_import.elements.solid_elements import SOLID_ELEMENTS
from fe_import.elements.solid_mesh import FACE_TRIANGLES
from fe_import.model import IntArray

_SOLIDS = {4: "tet4", 10: "tet10", 8: "hex8", 20: "hex20"}
_WEDGE = {
    6: ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    15: (
        *((0, 2, 1, 8, 7, 6), (3, 4, 5, 9, 10, 11)),
        *((0, 1, 4, 3, 6, 13, 9, 12), (1, 2, 5, 4, 7, 14, 10, 13), (2, 0, 3, 5, 8, 12, 11, 14)),
    ),
}


def picture(elements: Mapping[str, IntArray]) -> tuple[IntArray, IntArray]:
    """Lines (m, 2) of beams and trusses, triangles (t, 3) of shells and of the surface of solids.

    Parameters
    ----------
    elements : dict of (m, k) int arrays
        Type -> indices of the nodes of its elements.
    """
    lines, faces = [np.zeros((0, 2), dtype=np.int64)], []
    shells = []
    for kind, nodes in elements.items():
        if kind.startswith("C3D"):
            faces += [nodes[:, local] for local in _faces(nodes.shape[1])]
        elif kind.startswith(("B3", "T3D")):
            lines += [nodes[:, k : k + 2] for k in range(nodes.shape[1] - 1)]
        elif kind.startswith(("S", "M3D", "R3D")) and nodes.shape[1] in FACE_TRIANGLES:
            shells.append(nodes)
    triangles = [_split(f) for f in (*_boundary(faces), *shells)]
    return np.concatenate(lines), np.concatenate([np.zeros((0, 3), dtype=np.int64), *triangles])


def _faces(count: int) -> list[IntArray]:
    if count in _SOLIDS:
        return list(SOLID_ELEMENTS[_SOLIDS[count]].faces)
    return [np.array(face) for face in _WEDGE.get(count, ())]


def _boundary(faces: list[IntArray]) -> list[IntArray]:
    """Faces that no two elements share, whatever the types of these."""
    if not faces:
        return []
    corners = np.full((sum(map(len, faces)), 4), -1, dtype=np.int64)
    start = 0
    for block in faces:
        width = 3 if block.shape[1] in (3, 6) else 4
        corners[start : start + len(block), :width] = block[:, :width]
        start += len(block)
    _, label, count = np.unique(np.sort(corners, axis=1), axis=0, return_inverse=True, return_counts=True)
    alone = np.split(count[label.ravel()] == 1, np.cumsum([len(block) for block in faces])[:-1])
    return [block[keep] for block, keep in zip(faces, alone, strict=True)]


def _split(faces: IntArray) -> IntArray:
    return faces[:, np.array(FACE_TRIANGLES[faces.shape[1]])].reshape(-1, 3)
