"""Mode displacement: modes of the free link and nothing else. Offered for comparison; do not use it for mechanisms.

A joint loads the link where free modes are unloaded, so the deformation under joint forces converges slowly and from
below: the static flexibility lacks what each mode left out would add, and a clamped interface is far too stiff. The
health report shows by how much.
"""

from __future__ import annotations

from fe_import.description.reduction import Reduction
from fe_import.model import FEModel
from fe_import.reduction.base import Basis, expanded, no_fixed_interface_modes, refuse_fields
from fe_import.reduction.free_body import free_body
from fe_import.reduction.free_interface import REFUSED, REFUSED_SELECTIONS, choose_free_modes, with_rigid_modes

_REFUSED = {
    **REFUSED,
    "static_correction": "modes of the free link alone do not hold the static response; use method = 'craig-chang'",
}


def mode_displacement(model: FEModel, options: Reduction, where: str) -> Basis:
    """Basis of rigid-body modes and the lowest free elastic modes, without static completion.

    Raises
    ------
    FEImportError
        As `fe_import.reduction.craig_chang.craig_chang`, and static correction is asked for.
    """
    refuse_fields(options, where, _REFUSED, REFUSED_SELECTIONS)
    body = free_body(model, where)
    static = body.static(body.interface_loads())
    _, modes, selection = choose_free_modes(body, options, where)
    fields, rigid = with_rigid_modes(body, modes)
    flexibility = static[body.interfaces]
    return Basis(expanded(model, fields), 0, rigid, no_fixed_interface_modes(), selection, flexibility, held=body.held)
