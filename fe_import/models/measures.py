"""How far the matrices of a model are from those of a free link: symmetry, definiteness, resistance to rigid motion."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from fe_import.model import FEModel, magnitudes

GROUNDING = 1e-7  # exported matrices carry 6 to 14 digits; a real ground spring is far above


def asymmetry(matrix: sp.csc_array) -> float:
    """‖A - Aᵀ‖ / ‖A‖ of a matrix without duplicate entries."""
    total, mirrored = float(np.linalg.norm(matrix.data)), matrix.T.tocsc()
    if not total:
        return 0.0
    if np.array_equal(matrix.indptr, mirrored.indptr) and np.array_equal(matrix.indices, mirrored.indices):
        return float(np.linalg.norm(matrix.data - mirrored.data)) / total
    return float(np.linalg.norm((matrix - mirrored).data)) / total


def grounding(model: FEModel) -> float:
    """Largest force that a rigid-body motion causes, relative to the forces of its terms |K| |r|."""
    rigid = model.rigid_body_modes()
    force = np.abs(model.stiffness @ rigid).max(axis=0)
    terms = (magnitudes(model.stiffness) @ np.abs(rigid)).max(axis=0)
    return float((force / np.where(terms > 0, terms, 1)).max())


def negative_diagonal(matrix: sp.csc_array) -> float:
    """Most negative diagonal entry, per the largest."""
    diagonal = matrix.diagonal()
    largest = np.abs(diagonal).max(initial=0.0)
    return float(max(0.0, -diagonal.min()) / largest) if largest else 0.0
