"""Orders of the nodes of quadratic elements in formats that do not share meshio's, by type of element.

The k-th node in meshio's order is the ``ORDER[k]``-th of the file.
"""

from __future__ import annotations

from fe_import.elements.solid_elements import MESH_ELEMENTS

HEIGHT_FIRST = {  # Nastran, Exodus: edges along the height come before those of the top
    "wedge15": [*range(9), 12, 13, 14, 9, 10, 11],
    "hex20": [*range(12), 16, 17, 18, 19, 12, 13, 14, 15],
}


def _around(corners: int) -> list[int]:
    """Corners and middles of a ring by turns, from corners first."""
    return [*range(0, 2 * corners, 2), *range(1, 2 * corners, 2)]


def _interlaced(kind: str) -> list[int]:
    """Universal files go around the bottom, corners and middles by turns, up its edges, and around the top."""
    element = MESH_ELEMENTS[kind]
    ring = 4 if kind == "hex20" else 3
    bottom, top = range(2 * ring), range(3 * ring, 5 * ring)
    if kind == "tet10":
        return [0, 2, 4, 9, 1, 3, 5, 6, 7, 8]
    corners = [*bottom[::2], *top[::2]]
    return [*corners, *bottom[1::2], *top[1::2], *range(2 * ring, 3 * ring)][: element.size]


INTERLACED = {
    **{kind: _interlaced(kind) for kind in ("tet10", "wedge15", "hex20")},
    "triangle6": _around(3),
    "quad8": _around(4),
    "line3": [0, 2, 1],
}
