"""Guyan reduction, static condensation: constraint modes only (Guyan, AIAA J. 3, 1965).

Statically exact for loads at the interfaces, but inner masses move as statics has them: of the free frequencies only
the first are of use (the L-shaped solid: one, to 0.3 %; the next five are 36 % to 95 % too high).
"""

from __future__ import annotations

from fe_import.description.reduction import Reduction
from fe_import.model import FEModel
from fe_import.reduction.base import Basis, expanded, no_fixed_interface_modes, refuse_fields
from fe_import.reduction.fixed_interface import constraint_modes, partition

_NO_MODES = "static condensation keeps no vibration modes; remove the field, or use method = 'craig-bampton'"
_REFUSED = {
    "fixed_interface_modes": _NO_MODES,
    "free_modes": "static condensation keeps no vibration modes; remove the field, or use method = 'craig-chang'",
    "static_correction": "static condensation is statically exact for interface loads, and holds no inertia of inner "
    "nodes; remove the field, or use method = 'craig-bampton'",
}


def guyan(model: FEModel, options: Reduction, where: str) -> Basis:
    """Basis of constraint modes.

    Raises
    ------
    FEImportError
        The inner stiffness is singular, or options that mean nothing here.
    """
    refuse_fields(options, where, _REFUSED, dict.fromkeys(("frequency", "effective-mass", "ranking"), _NO_MODES))
    parts = partition(model)
    vectors = constraint_modes(parts)
    rigid = model.rigid_body_modes()[model.interface_dofs]
    held = parts.held(vectors) if len(parts.inner) else None
    return Basis(expanded(model, vectors), vectors.shape[1], rigid, no_fixed_interface_modes(), held=held)
