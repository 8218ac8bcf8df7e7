"""What the second-order motion of masses adds to the kinetic energy: momenta, spin and modal terms of `SecondOrder`."""

from __future__ import annotations

import numpy as np

from fe_import.model import Array
from fe_import.second_order.composition import composed, composed_rotation, paired

Pair = tuple[Array, Array]  # Ψ of a displacement and of a rotation vector, (3, n, n) each

LEVI_CIVITA = np.zeros((3, 3, 3))
for _a, _b, _c in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
    LEVI_CIVITA[_a, _b, _c], LEVI_CIVITA[_a, _c, _b] = 1.0, -1.0


def of_moments(linear: Array, moment: Array) -> tuple[Array, Array]:
    """Momentum (6, m, m) and spin (3, 3, m, m) of ∫ρ Ψ (3, m, m) and ∫ρ x ⊗ Ψ (3, 3, m, m)."""
    turning = np.einsum("ecd,cdab->eab", LEVI_CIVITA, moment)
    spin = -moment.transpose(1, 0, 2, 3)
    trace = np.einsum("ccab->ab", moment)
    for c in range(3):
        spin[c, c] += trace
    return np.concatenate([linear, turning]), spin


def of_masses(masses: Array, positions: Array, field: Array) -> tuple[Array, Array]:
    """Of point masses (k,) at positions (k, 3) with a second-order displacement (k, 3, m, m)."""
    moments = np.concatenate([masses[None], masses * positions.T]) @ field.reshape(len(field), -1)
    linear, *moment = moments.reshape(4, *field.shape[1:])
    return of_moments(linear, np.stack(moment))


def of_modes(shapes: Array, momenta: Array) -> Array:
    """Modal terms (n, m, m) of the momenta (..., 3, m, m) of parts that move or turn by ``shapes`` (..., 3, n)."""
    rows = int(np.prod(shapes.shape[:-1]))  # -1 cannot be told where there are no modes
    flat = shapes.reshape(rows, shapes.shape[-1])
    return np.asarray(np.tensordot(flat.T, momenta.reshape(rows, *momenta.shape[-2:]), 1))


def of_inertia(inertia: Array, phi: Array, field: Array) -> tuple[Array, Array]:
    """Of a turning inertia; see `of_inertias`."""
    momentum, spin, _ = of_inertias(inertia[None], phi[None], field[None])
    return momentum, spin


def of_inertias(inertia: Array, phi: Array, field: Array) -> tuple[Array, Array, Array]:
    """Of all of k turning inertias, and the moment of momentum (k, 3, m, m) of each.

    The angular velocity in the body's own axes holds θ̇₂ - ½ φ × φ̇ and ω × θ₂ + ½ φ × (φ × ω) in second order; the
    kinetic energy of the linear modes has the terms of first order with each other.

    Parameters
    ----------
    inertia : (k, 3, 3) array
    phi : (k, 3, m) array
        Rotations.
    field : (k, 3, m, m) array
        Second-order rotation vectors.
    """
    m = phi.shape[-1]
    momentum = np.zeros((6, m, m))
    own = (inertia @ (field - paired(phi, phi) / 2).reshape(len(field), 3, m * m)).reshape(field.shape)
    momentum[3:] = own.sum(axis=0)
    once = np.tensordot(np.tensordot(inertia, field, ([0], [0])), LEVI_CIVITA, ([1, 2], [0, 2])).transpose(0, 3, 1, 2)
    product = np.tensordot(inertia @ phi, phi, ([0], [0])).transpose(0, 2, 1, 3)
    twice = (product + product.transpose(0, 1, 3, 2)) / 2
    twice -= np.tensordot(inertia, phi.swapaxes(1, 2) @ phi, ([0], [0]))
    return momentum, once + twice, own


def of_body(
    mass: float, inertia: Array, place: Array, arm: Array, moved: Array, own: Array, fields: Pair
) -> tuple[Array, Array, Array]:
    """Momentum, spin and modal terms of a small body.

    Parameters
    ----------
    mass : float
    inertia : (3, 3) array
    place, arm : (3,) arrays
        Where it is, from the origin and from the reference.
    moved, own : (6, m) arrays
        Its displacement and rotation in the modes, relative to the reference and as they are.
    fields : tuple of (3, n, n) arrays
        Relative to the reference.
    """
    phi = own[3:] - moved[3:]  # of the reference
    full, turned = composed(fields[0], moved[:3], phi, arm), composed_rotation(fields[1], moved[3:], phi)
    masses = of_masses(np.array([mass]), place[None], full[None])
    turning = of_inertia(inertia, own[3:], turned)
    modal = of_modes(own[:, 6:], np.concatenate([masses[0][:3], turning[0][3:]]))
    return masses[0] + turning[0], masses[1] + turning[1], modal
