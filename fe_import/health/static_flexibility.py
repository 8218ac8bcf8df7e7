"""How much of the answer to static loads at the interfaces the modes kept lack; nothing, where that was promised."""

from __future__ import annotations

import numpy as np

from fe_import.modal.model import NO_LIMIT, HealthCheck
from fe_import.model import Array

_EXACT = 1e-6  # rounding leaves 1e-9 on a slender solid
_FLEXIBLE = 1e-4  # of the softest displacement or rotation; a component that all its inertia sits on has 0


def check_static(
    reference: Array | None, interface_shapes: Array, omega: Array, promised: bool
) -> tuple[HealthCheck, ...]:
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
    promised : bool
        Whether it has to be exact; otherwise it is reported only.
    """
    if reference is None:
        return ()
    elastic = interface_shapes[:, 6:] / omega[6:]
    limit = _EXACT if promised else NO_LIMIT
    error = flexibility_error(elastic @ elastic.T, reference)
    return (HealthCheck("static flexibility between the interfaces", error, limit),)


def flexibility_error(found: Array, reference: Array) -> float:
    """Largest error of a flexibility (b, b) between interfaces, as a share of what the two components give way alone;
    0 where there is none.
    """
    size = np.sqrt(np.diag(reference)).reshape(-1, 2, 3)
    size = np.maximum(size, _FLEXIBLE * size.max(axis=(0, 2), keepdims=True, initial=0.0)).ravel()
    return float((np.abs(found - reference) / np.outer(size, size)).max(initial=0.0))
