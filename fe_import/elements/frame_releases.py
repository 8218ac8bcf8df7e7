"""Frame elements whose ends do not pass on all components (pin flags)."""

from __future__ import annotations

import numpy as np

from fe_import.elements.frame import FrameElement, element_stiffness
from fe_import.model import Array

_LOOSE = 1e-9  # of the stiffness of the released components: below it they form a mechanism


def released_motion(element: FrameElement, released: tuple[int, ...]) -> Array:
    """(12, 12) local components of the element's ends per those of what holds them: no force in released ones.

    Raises
    ------
    ValueError
        Releases that leave the element a mechanism.
    """
    motion = np.eye(12)
    if not released:
        return motion
    stiffness = sum(element_stiffness(element, True).values(), np.zeros((12, 12)))
    free = np.array(sorted(set(released)))
    held = np.setdiff1d(np.arange(12), free)
    scale = 1 / np.sqrt(np.diag(stiffness)[free])
    inner = stiffness[np.ix_(free, free)] * np.outer(scale, scale)
    if np.linalg.eigvalsh(inner)[0] < _LOOSE:
        raise ValueError("its releases leave a beam that moves without strain")
    motion[free] = 0.0
    motion[np.ix_(free, held)] = -scale[:, None] * np.linalg.solve(
        inner, scale[:, None] * stiffness[np.ix_(free, held)]
    )
    return motion
