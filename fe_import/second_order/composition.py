"""From the field relative to the reference interface to the field over all modal coordinates.

In a mode the reference moves by u₀ and turns by φ₀ = Θ q, both linear in q. A point at d from it then stands at
u₀ + exp(φ₀)(d + u) with its relative displacement u; of second order are, beside its own part, φ₀ × u and
½ φ₀ × (φ₀ × d); and of the rotation vector ½ φ₀ × θ (Baker, Campbell, Hausdorff).
"""

from __future__ import annotations

import numpy as np

from fe_import.model import Array


def paired(a: Array, b: Array) -> Array:
    """(..., 3, m, k) cross products a_i × b_j of the columns of (..., 3, m) and (..., 3, k) arrays."""
    ax, ay, az = (a[..., i, :, None] for i in range(3))
    bx, by, bz = (b[..., i, None, :] for i in range(3))
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=-3)


def twice_turned(phi: Array, arm: Array) -> Array:
    """(..., 3, m, m) second-order displacement of ``arm`` (..., 3) by rotation vectors (..., 3, m).

    ½ (φ_a × (φ_b × d) + φ_b × (φ_a × d)).
    """
    along = (arm[..., None, :] @ phi)[..., None, :]
    once = phi[..., None] * along
    inner = phi.swapaxes(-1, -2) @ phi
    return np.asarray((once + np.swapaxes(once, -1, -2)) / 2 - arm[..., :, None, None] * inner[..., None, :, :])


def composed(relative: Array, u: Array, phi: Array, arm: Array) -> Array:
    """Displacement over all coordinates.

    Parameters
    ----------
    relative : (..., 3, n, n) array
        Ψ relative to the reference, over the elastic coordinates.
    u : (..., 3, m) array
        Displacements relative to the reference; zero in the rigid-body modes.
    phi : (3, m) array
        Rotation of the reference.
    arm : (..., 3) array
        From the reference, undeformed.

    Returns
    -------
    (..., 3, m, m) array
    """
    phi = np.broadcast_to(phi, u.shape)
    once = paired(phi, u)
    result = once + np.swapaxes(once, -1, -2) + twice_turned(phi, arm)
    result[..., 6:, 6:] += relative
    return np.asarray(result)


def composed_rotation(relative: Array, theta: Array, phi: Array) -> Array:
    """(..., 3, m, m) rotation vector over all coordinates from rotations ``theta`` (..., 3, m) relative to the
    reference; see `composed`.
    """
    once = paired(np.broadcast_to(phi, theta.shape), theta)
    result = (once + np.swapaxes(once, -1, -2)) / 2
    result[..., 6:, 6:] += relative
    return np.asarray(result)
