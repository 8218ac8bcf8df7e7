"""Craig-Chang reduction: free-interface modes and residual attachment modes (Craig & Chang, AIAA J. 14, 1976; Rubin,
AIAA J. 13, 1975).

Its lowest free frequencies are those of the full model, and residual inertia-relief attachment modes at the interface
dofs make it statically exact for loads there, and for the inertia of rigid-body accelerations, whatever holds the link.
"""

from __future__ import annotations

import numpy as np

from fe_import.description.reduction import Reduction
from fe_import.model import FEModel
from fe_import.reduction.base import Basis, expanded, no_fixed_interface_modes, refuse_fields
from fe_import.reduction.free_body import free_body
from fe_import.reduction.free_interface import REFUSED, REFUSED_SELECTIONS, choose_free_modes, with_rigid_modes
from fe_import.reduction.residual import residual_vectors


def craig_chang(model: FEModel, options: Reduction, where: str) -> Basis:
    """Basis of rigid-body modes, the lowest free elastic modes, and what they lack of the inertia-relieved response
    to unit loads at the interfaces.

    Raises
    ------
    FEImportError
        Some part can move without strain, more free modes are asked for than there are, or options that mean nothing
        here.
    """
    refuse_fields(options, where, REFUSED, REFUSED_SELECTIONS)
    body = free_body(model, where)
    loads = body.interface_loads()
    static = body.static(loads)
    omega, modes, selection = choose_free_modes(body, options, where)
    attachment = body.elastic(residual_vectors(static, loads, omega, modes, body.stiffness))
    fields, rigid = with_rigid_modes(body, np.hstack([modes, attachment]))
    return Basis(expanded(model, fields), 0, rigid, no_fixed_interface_modes(), selection, held=body.held)
