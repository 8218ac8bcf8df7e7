"""Whether the modes kept answer static loads at the interfaces as the link does, where that was promised."""

from __future__ import annotations

import numpy as np

from fe_import.modal_file import HealthCheck
from fe_import.model import Array

_EXACT = 1e-6  # rounding leaves 1e-9 on a slender solid


def check_static(reference: Array | None, interface_shapes: Array, omega: Array) -> tuple[HealthCheck, ...]:
    """Static flexibility between the interfaces, inertia-relieved, against a reference.

    Not to be met by ``mode-displacement``: what fails there says why not to use it.

    Parameters
    ----------
    reference : (b, b) array or None
        Nothing is checked without one.
    interface_shapes : (b, m) array
        Interface displacements and rotations of the orthonormal modes.
    omega : (m,) array
        Circular frequencies, 0 for the first six [rad/s].
    """
    if reference is None:
        return ()
    elastic = interface_shapes[:, 6:] / omega[6:]
    size = np.sqrt(np.diag(reference))
    error = np.abs(elastic @ elastic.T - reference) / np.outer(size, size)
    return (HealthCheck("static flexibility between the interfaces", float(error.max()), _EXACT),)
