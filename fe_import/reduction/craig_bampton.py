"""Craig-Bampton reduction: constraint modes and fixed-interface modes (Craig & Bampton, AIAA J. 6, 1968).

Keeps interface displacements as they are and is statically exact for loads at the interfaces, whatever the number of
modes. With static correction the response to the inertia of rigid-body accelerations is added.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from fe_import.description.reduction import Reduction
from fe_import.model import Array, FEModel
from fe_import.reduction.base import Basis, expanded, refuse_fields
from fe_import.reduction.effective_mass import carried_shares, fixed_interface_table
from fe_import.reduction.fixed_interface import Partition, constraint_modes, partition
from fe_import.reduction.ranking import best_ranked
from fe_import.reduction.residual import residual_vectors
from fe_import.reduction.selection import below_frequency, carrying_mass, lowest_by_count
from fe_import.solver.sparse import lowest_modes

_REFUSED = {"free_modes": "the modes of this method have clamped interfaces; use fixed_interface_modes"}


def craig_bampton(model: FEModel, options: Reduction, where: str) -> Basis:
    """Basis of constraint modes (unit displacement of one interface dof, inner dofs free of force) and modes with
    all interfaces clamped.

    Raises
    ------
    FEImportError
        The inner stiffness is singular, or more fixed-interface modes are asked for than there are.
    """
    refuse_fields(options, where, _REFUSED)
    parts = partition(model)
    constraint = constraint_modes(parts)
    omega, modes, selection = _fixed_interface_modes(model, parts, constraint, options, where)
    columns = [constraint, parts.clamped_field(modes)]
    if options.static_correction and len(parts.inner):
        loads = parts.inertia
        columns += [
            parts.clamped_field(residual_vectors(parts.static(loads), loads, omega, modes, parts.inner_stiffness))
        ]
    vectors = np.hstack(columns)
    count = len(parts.boundary)
    rigid = np.zeros((vectors.shape[1], 6))
    rigid[:count] = model.rigid_body_modes()[model.interface_dofs]
    table, held = fixed_interface_table(parts, omega, modes), parts.held(constraint) if len(parts.inner) else None
    return Basis(expanded(model, vectors), count, rigid, table, selection, held=held)


def _fixed_interface_modes(
    model: FEModel, parts: Partition, constraint: Array, options: Reduction, where: str
) -> tuple[Array, Array, dict[str, Any]]:
    """Circular frequencies, inner shapes (i, m) and how they were chosen."""
    available = len(parts.inner)

    def lowest(count: int) -> tuple[Array, Array]:
        if available == 0:
            return np.zeros(0), np.zeros((0, 0))
        what = "link with clamped interfaces"
        return lowest_modes(parts.inner_stiffness, parts.inner_mass, count, what, solve=parts.solve)

    if options.selection == "frequency":
        return below_frequency(lowest, options, available, where)
    if options.selection == "effective-mass":
        return carrying_mass(lowest, carried_shares(parts), options, available, where)
    if options.selection == "ranking" and options.ranking is not None:
        return best_ranked(model, parts, constraint, lowest, options.ranking, where)
    field = f"{where}: reduction.fixed_interface_modes"
    return lowest_by_count(lowest, options.fixed_interface_modes, available, field)
