"""What the second-order motion of masses adds to the kinetic energy: momenta, spin and modal terms of `SecondOrder`."""

from __future__ import annotations

import numpy as np

from fe_import.model import Array
from fe_import.second_order.composition import composed, composed_rotation

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
    linear = np.einsum("k,kiab->iab", masses, field)
    return of_moments(linear, np.einsum("k,kc,kdab->cdab", masses, positions, field))


def of_modes(shapes: Array, momenta: Array) -> Array:
    """Modal terms (n, m, m) of the momenta (..., 3, m, m) of parts that move or turn by ``shapes`` (..., 3, n)."""
    rows = int(np.prod(shapes.shape[:-1]))  # -1 cannot be told where there are no modes
    flat = shapes.reshape(rows, shapes.shape[-1])
    return np.asarray(np.tensordot(flat.T, momenta.reshape(rows, *momenta.shape[-2:]), 1))


def of_inertia(inertia: Array, phi: Array, field: Array) -> tuple[Array, Array]:
    """Of a turning inertia.

    The angular velocity in the body's own axes holds θ̇₂ - ½ φ × φ̇ and ω × θ₂ + ½ φ × (φ × ω) in second order; the
    kinetic energy of the linear modes has the terms of first order with each other.

    Parameters
    ----------
    inertia : (3, 3) array
    phi : (3, m) array
        Rotation.
    field : (3, m, m) array
        Second-order rotation vector.
    """
    count = phi.shape[1]
    momentum = np.zeros((6, count, count))
    turned = np.einsum("def,ea,fb->dab", LEVI_CIVITA, phi, phi)
    momentum[3:] = np.einsum("cd,dab->cab", inertia, field - turned / 2)
    once = np.einsum("ce,edf,fab->cdab", inertia, LEVI_CIVITA, field)
    product = np.einsum("ea,db->edab", phi, phi)
    product = (product + product.transpose(0, 1, 3, 2)) / 2
    twice = np.einsum("ce,edab->cdab", inertia, product)
    twice -= np.einsum("cd,ab->cdab", inertia, phi.T @ phi)
    return momentum, once + twice


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
