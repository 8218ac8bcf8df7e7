"""Static fields less what vibration modes hold of them: residual vectors.

After Dickens, Nakagawa & Wittbrodt (Computers & Structures 62, 1997), "modal truncation augmentation", and Rubin
(AIAA J. 13, 1975).
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from fe_import.model import Array

_NEW = 1e-7  # share of a static field, in the energy norm, that counts as new; rounding leaves 1e-9 and less


def residual_vectors(static: Array, loads: Array, omega: Array, modes: Array, stiffness: sp.csc_array) -> Array:
    """What static fields add to modes: x - Φ Ω⁻² Φᵀf, orthonormal in the energy norm.

    Parameters
    ----------
    static : (f, n) array
        Responses x to the loads.
    loads : (f, n) array
    omega : (m,) array
    modes : (f, m) array
        Mass-orthonormal modes that the responses are made of.
    stiffness : (f, f) sparse

    Returns
    -------
    (f, k) array
        k <= n: directions that the modes hold already are left out.
    """
    size = np.sqrt(np.einsum("fn,fn->n", static, stiffness @ static).clip(min=0))
    used = size > 1e-14 * size.max(initial=0.0)
    rest = (static[:, used] - modes @ ((modes.T @ loads[:, used]) / omega[:, None] ** 2)) / size[used]
    energy, turn = np.linalg.eigh(rest.T @ (stiffness @ rest))
    new = energy > _NEW**2
    return np.asarray(rest @ turn[:, new] / np.sqrt(energy[new]))
