"""The check report of a reduction: what a careful engineer verifies before trusting a modal file.

Model for it: the `cbcheck` report of pyyeti. All limits are relative.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from fe_import.errors import Cause, FEImportError
from fe_import.inertia import InertiaInvariants, mass_properties
from fe_import.modal_file import HealthCheck
from fe_import.model import Array, FEModel

_ROUNDING = 1e-9  # symmetry, mass properties: sums of many terms of one sign in double precision
_GROUNDING = 1e-7  # exported matrices carry 6 to 14 digits; a real ground spring is far above


def _norm(matrix: sp.csc_array) -> float:
    return float(np.sqrt(matrix.multiply(matrix).sum()))


def asymmetry(matrix: sp.csc_array) -> float:
    """‖A - Aᵀ‖ / ‖A‖."""
    total = _norm(matrix)
    return _norm((matrix - matrix.T).tocsc()) / total if total else 0.0


def grounding(model: FEModel) -> float:
    """Largest force that a rigid-body motion causes, relative to the forces of its terms |K| |r|."""
    rigid = model.rigid_body_modes()
    force = np.abs(model.stiffness @ rigid).max(axis=0)
    terms = (abs(model.stiffness) @ np.abs(rigid)).max(axis=0)
    return float((force / np.where(terms > 0, terms, 1)).max())


def check_model(model: FEModel, where: str) -> tuple[HealthCheck, ...]:
    """Checks of the full matrices; a model that fails one is refused.

    Raises
    ------
    FEImportError
        Asymmetric (NOT_DEFINITE) or grounded (GROUNDED) matrices; negative diagonal.
    """
    checks = (
        HealthCheck("mass matrix: asymmetry", asymmetry(model.mass), _ROUNDING),
        HealthCheck("stiffness matrix: asymmetry", asymmetry(model.stiffness), _ROUNDING),
        HealthCheck("mass matrix: negative diagonal", _negative_diagonal(model.mass), 0.0),
        HealthCheck("stiffness matrix: negative diagonal", _negative_diagonal(model.stiffness), 0.0),
        HealthCheck("grounding force of rigid-body motions", grounding(model), _GROUNDING),
    )
    for check in checks:
        if not check.ok:
            cause = Cause.GROUNDED if "grounding" in check.name else Cause.NOT_DEFINITE
            raise FEImportError(
                cause,
                f"{check.name} is not zero",
                where=where,
                value=check.value,
                limit=check.limit,
                remedy="a link must be free: remove supports and springs to ground, export symmetric matrices",
            )
    return checks


def _negative_diagonal(matrix: sp.csc_array) -> float:
    diagonal = matrix.diagonal()
    return float(max(0.0, -diagonal.min()) / np.abs(diagonal).max())


def check_reduction(
    model: FEModel, shapes: Array, stiffness: Array, omega: Array, invariants: InertiaInvariants
) -> tuple[HealthCheck, ...]:
    """Checks of the reduced link against the full model."""
    rigid = model.rigid_body_modes()
    scale = np.abs(rigid).max(axis=0)
    reproduced = np.abs(shapes @ invariants.rigid - rigid).max(axis=0) / scale
    full = mass_properties(rigid.T @ (model.mass @ rigid))
    reduced = mass_properties(invariants.rigid_mass_matrix)
    size = np.linalg.norm(np.ptp(model.nodes, axis=0))
    inertia_scale = np.abs(full.inertia).max()
    elastic = omega[6:] ** 2
    identity = np.eye(len(omega))
    checks = [
        HealthCheck("rigid-body motion by geometry, reproduced by the modes", float(reproduced.max()), _ROUNDING),
        HealthCheck("mass against the full model", abs(reduced.mass / full.mass - 1), _ROUNDING),
        HealthCheck(
            "centre of mass against the full model, per size",
            float(np.abs(reduced.centre_of_mass - full.centre_of_mass).max() / size),
            _ROUNDING,
        ),
        HealthCheck(
            "inertia against the full model",
            float(np.abs(reduced.inertia - full.inertia).max() / inertia_scale),
            _ROUNDING,
        ),
        HealthCheck("orthonormality of the modes", float(np.abs(invariants.m - identity).max()), _ROUNDING),
    ]
    if len(elastic):
        strain = np.abs(np.diag(stiffness)[:6]).max() / elastic[0]
        spread = np.abs(np.diag(stiffness)[6:] / elastic - 1).max()
        checks += [
            HealthCheck("strain energy of rigid-body modes, per first elastic mode", float(strain), 1e-6),
            HealthCheck("Rayleigh quotients against squared frequencies", float(spread), 1e-6),
        ]
    return tuple(checks)
