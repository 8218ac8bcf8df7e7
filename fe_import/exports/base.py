"""The contract of a reader of exported matrices.

Rules for adding a format:

1. One file with an `ExportFormat` and one line in the registry of ``fe_import/exports/__init__.py``.
2. A reader knows its syntax only: which rows belong to which node, in which frame, in the file's own units. What is
   common to all (sizes, symmetry, definiteness, units, interfaces, masses) is checked and done after it, in
   `fe_import.models.matrices` and `fe_import.health.report`.
3. Files are data from strangers: a declared size is held against the size of the file before memory is taken;
   truncated files, duplicate entries, numbers that are not finite are errors that name file and line or entry.
4. A file whose name ends in ``.gz`` is read as it is.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import scipy.sparse as sp

from fe_import.model import Array, IntArray


@dataclass(frozen=True)
class Export:
    """What a reader found, in the units and frames of its files.

    Attributes
    ----------
    mass, stiffness : (d, d) sparse CSC
        Both triangles. A format that stores one triangle is completed by its reader; one that stores both is
        passed on as it is, so that the health report sees an asymmetry.
    nodes : (n, 3) array
        Positions.
    labels : (n,) int array
        Numbers of the nodes in the program that wrote the files.
    dof_map : (n, 6) int array
        Row of each nodal component (ux, uy, uz, rx, ry, rz), -1 where the node lacks it.
    modal_rows : (k,) int array
        Rows that are no nodal component but a modal coordinate of a superelement, of any scale.
    orientations : (n, 3, 3) array or None
        Axes (columns) of the frame in which a node's displacements and rotations are counted; None when all are the
        mesh frame.
    node_sets : dict of int arrays
        Named sets; indices of nodes, not labels.
    lines, triangles : (m, 2), (t, 3) int arrays
        For pictures; indices of nodes.
    notes : dict of str
        What the provenance should say: program, version, what was left out.
    """

    mass: sp.csc_array
    stiffness: sp.csc_array
    nodes: Array
    labels: IntArray
    dof_map: IntArray
    modal_rows: IntArray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    orientations: Array | None = None
    node_sets: dict[str, IntArray] = field(default_factory=dict)
    lines: IntArray = field(default_factory=lambda: np.zeros((0, 2), dtype=np.int64))
    triangles: IntArray = field(default_factory=lambda: np.zeros((0, 3), dtype=np.int64))
    notes: dict[str, str] = field(default_factory=dict)


class NoOptions(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """Options of a format whose files say everything."""


@dataclass(frozen=True)
class ExportFormat:
    """One format.

    Attributes
    ----------
    required, optional : tuple of str
        Roles of the files that a link description names in ``[matrices.files]`` (``stiffness``, ``mass``, ``dofs``,
        ``mesh`` ...).
    options : type
        msgspec record of ``[matrices.options]``.
    read : callable
        ``read(files, options, where) -> Export``; ``files`` maps roles to paths that exist, ``where`` names the link
        description. Raises `FEImportError` only.
    """

    required: tuple[str, ...]
    optional: tuple[str, ...]
    options: type[Any]
    read: Callable[[Mapping[str, Path], Any, str], Export]
