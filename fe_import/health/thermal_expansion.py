"""Whether the modes kept expand with temperature as the full model does."""

from __future__ import annotations

import numpy as np

from fe_import.modal.model import HealthCheck
from fe_import.model import Array, FEModel
from fe_import.reduction.free_body import inertia_relief

_EXACT = 1e-6  # of the energy; rounding leaves 1e-9 on a slender link


def check_expansion(model: FEModel, force: Array | None, omega: Array) -> tuple[HealthCheck, ...]:
    """Work of the thermal forces on the free link: of its modes, Σ f²/ω², against that of the full model.

    Parameters
    ----------
    model : FEModel
    force : (m,) array or None
        Generalized thermal force per kelvin; nothing is checked without one.
    omega : (m,) array
        Circular frequencies, 0 for the first six [rad/s].
    """
    if model.thermal is None or force is None or not model.thermal.force.any():
        return ()
    load = model.thermal.force
    full = float(load @ inertia_relief(model, load[:, None])[:, 0])
    kept = float(np.sum((force[6:] / omega[6:]) ** 2))
    return (HealthCheck("thermal expansion against the full model", abs(kept / full - 1), _EXACT),)
