"""No reduction: all independent dofs are kept, which gives the older ERLS-FEM formulation."""

from __future__ import annotations

import numpy as np

from fe_import.description.reduction import Reduction
from fe_import.errors import Cause, FEImportError
from fe_import.model import FEModel
from fe_import.reduction.base import Basis, expanded, no_fixed_interface_modes, refuse_fields

LARGEST = 2000  # independent dofs; a dense eigenproblem of this size takes seconds, its invariants 0.4 GB

_ALL = "a model that is not reduced has all its modes; remove the field, or use method = 'craig-bampton'"
_REFUSED = {
    "fixed_interface_modes": "a model that is not reduced has no fixed-interface modes; remove the field, or use "
    "method = 'craig-bampton'",
    "free_modes": "a model that is not reduced has all free modes; remove the field, or use method = 'craig-chang'",
}


def no_reduction(model: FEModel, options: Reduction, where: str) -> Basis:
    """Unit displacements of every independent dof.

    Raises
    ------
    FEImportError
        The model has more than `LARGEST` dofs, or fixed-interface modes are asked for.
    """
    refuse_fields(options, where, _REFUSED, dict.fromkeys(("frequency", "effective-mass", "ranking"), _ALL))
    count = len(model.independent)
    if count > LARGEST:
        raise FEImportError(
            Cause.MODE_COUNT,
            "too many dofs to keep them all",
            where=f"{where}: reduction.method",
            value=count,
            limit=LARGEST,
            remedy="use method = 'craig-bampton'",
        )
    rigid = model.rigid_body_modes()[model.independent]
    return Basis(expanded(model, np.eye(count)), 0, rigid, no_fixed_interface_modes())
