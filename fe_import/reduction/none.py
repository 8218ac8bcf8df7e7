"""No reduction: all independent dofs are kept, which gives the older ERLS-FEM formulation."""

from __future__ import annotations

import scipy.sparse as sp

from fe_import.errors import Cause, FEImportError
from fe_import.link import Reduction
from fe_import.model import FEModel
from fe_import.reduction.base import Basis, no_fixed_interface_modes

LARGEST = 2000  # independent dofs; a dense eigenproblem of this size takes seconds, its invariants 0.4 GB


def no_reduction(model: FEModel, options: Reduction, where: str) -> Basis:
    """Unit displacements of every independent dof.

    Raises
    ------
    FEImportError
        The model has more than `LARGEST` dofs, or fixed-interface modes are asked for.
    """
    count = len(model.independent)
    if options.fixed_interface_modes:
        raise FEImportError(
            Cause.BAD_FIELD,
            "a model that is not reduced has no fixed-interface modes",
            where=f"{where}: reduction.fixed_interface_modes",
            value=options.fixed_interface_modes,
            remedy="remove the field, or use method = 'craig-bampton'",
        )
    if count > LARGEST:
        raise FEImportError(
            Cause.MODE_COUNT,
            "too many dofs to keep them all",
            where=f"{where}: reduction.method",
            value=count,
            limit=LARGEST,
            remedy="use method = 'craig-bampton'",
        )
    size = model.mass.shape[0]
    vectors = sp.eye_array(size).toarray() if model.coupling is None else model.coupling.toarray()
    return Basis(vectors, 0, model.rigid_body_modes()[model.independent], no_fixed_interface_modes())


