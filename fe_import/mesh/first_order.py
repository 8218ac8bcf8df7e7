"""Surfaces of second order as elements of first order on the same nodes.

A triangle of six nodes becomes four triangles, a quadrangle of eight or nine four quadrangles, so that nodes, their
sets and what hangs on them stay. The middle of eight nodes is where their shape functions have it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from fe_import.mesh.raw import Block, RawMesh
from fe_import.model import Array, IntArray

_QUADS = [[0, 4, 8, 7], [4, 1, 5, 8], [8, 5, 2, 6], [7, 8, 6, 3]]
_CUTS = {
    "triangle6": ("triangle", [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]]),
    "quad8": ("quad", _QUADS),
    "quad9": ("quad", _QUADS),
}
_MIDDLE = np.array([-0.25] * 4 + [0.5] * 4)
PARTS = 4  # of every element


def of_first_order(raw: RawMesh) -> RawMesh:
    """A mesh whose surfaces of second order are cut, sets of them included; others stay as they are."""
    points: Array = np.asarray(raw.points, dtype=np.float64)
    cut = {b for b, block in enumerate(raw.blocks) if block.type in _CUTS}
    if not cut or points.ndim != 2:
        return raw
    blocks = []
    for b, block in enumerate(raw.blocks):
        if b not in cut:
            blocks.append(block)
            continue
        name, parts = _CUTS[block.type]
        cells: IntArray = np.where((block.cells >= 0) & (block.cells < len(raw.points)), block.cells, -1)
        if block.type == "quad8":
            middles = np.einsum("k,ekx->ex", _MIDDLE, points[cells])
            cells = np.column_stack([cells, len(points) + np.arange(len(cells))])
            points = np.vstack([points, middles])
        blocks.append(Block(name, 2, cells[:, parts].reshape(-1, len(parts[0]))))
    sets = {name: [_members(own) if b in cut else own for b, own in enumerate(per_block)]
            for name, per_block in raw.cell_sets.items()}  # fmt: skip
    return replace(raw, points=points, blocks=blocks, cell_sets=sets)


def _members(own: Any) -> Any:
    """Parts of the elements of a set; what is no list of elements stays for whoever refuses it."""
    if own is None or np.ndim(own) != 1 or np.asarray(own).dtype.kind not in "iu":
        return own
    return (PARTS * np.asarray(own, dtype=np.int64)[:, None] + np.arange(PARTS)).ravel()
