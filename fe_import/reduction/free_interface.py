"""What the methods with modes of the free link share: their options, and choosing the modes."""

from __future__ import annotations

from typing import Any

import numpy as np

from fe_import.description.reduction import Reduction
from fe_import.model import Array
from fe_import.reduction.free_body import FreeBody
from fe_import.reduction.selection import below_frequency, lowest_by_count

REFUSED = {
    "fixed_interface_modes": "the modes of this method are those of the free link; use free_modes",
    "form": "only bases of interface displacements have a physical form; use method = 'craig-bampton' or 'guyan'",
}
REFUSED_SELECTIONS = {
    "effective-mass": "modes of the free link carry no effective mass: they are orthogonal to rigid-body motion; use "
    "selection = 'lowest' or 'frequency', or method = 'craig-bampton'",
    "ranking": "the ranking is of fixed-interface modes; use method = 'craig-bampton'",
}


def choose_free_modes(body: FreeBody, options: Reduction, where: str) -> tuple[Array, Array, dict[str, Any]]:
    """Circular frequencies, shapes (f, m) and how they were chosen."""
    available = body.mass.shape[0] - 6
    if options.selection == "frequency":
        return below_frequency(body.modes, options, available, where)
    return lowest_by_count(body.modes, options.free_modes, available, f"{where}: reduction.free_modes")


def with_rigid_modes(body: FreeBody, fields: Array) -> tuple[Array, Array]:
    """Rigid-body modes and fields (f, k) side by side, and the coordinates (k + 6, 6) of the unit motions in them."""
    rigid = np.zeros((6 + fields.shape[1], 6))
    rigid[:6] = body.motions
    return np.hstack([body.rigid, fields]), rigid
