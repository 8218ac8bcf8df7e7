"""Strains of shell elements along their surface, in local Cartesian axes, many elements at a time.

Eight components: ε_11, ε_22, 2 ε_12 of the reference surface, κ_11, κ_22, 2 κ_12, and the shear strains γ_1, γ_2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fe_import.elements.shell_elements import Fields, ShellElement, Surface, duals, middle_axis, tangent_axes
from fe_import.model import Array

COMPONENTS = 8
_PAIRS = ((0, 0), (1, 1), (0, 1))


@dataclass(frozen=True)
class ShellPoints:
    """Elements of one type at the points of their quadrature.

    Attributes
    ----------
    element : ShellElement
    corners, directors : (e, k, 3) arrays
    axes : (e, q, 3, 3) array
        Rows: two axes along the surface, and its normal.
    rises : (e, q, 2, 2) array
        Of the reference coordinates (first) along the two axes (second).
    area : (e, q) array
        With the weights of the quadrature.
    """

    element: ShellElement
    corners: Array
    directors: Array
    axes: Array
    rises: Array
    area: Array


def shell_points(element: ShellElement, corners: Array, reference: Array | None = None) -> ShellPoints:
    """At the points of the element's own quadrature.

    Parameters
    ----------
    element : ShellElement
    corners : (e, k, 3) array
    reference : (e, 3) array, optional
        Directions whose projections on the surface are the first axes; from the element's sides unless given.
    """
    directors = element.directors(corners)
    if reference is None:
        centre = element.surface(corners, directors, element.points.mean(axis=0, keepdims=True))
        reference = middle_axis(centre.tangents)[:, 0]
    surface = element.surface(corners, directors, element.points)
    axes = tangent_axes(surface, reference)
    rises = np.stack([np.einsum("eqc,eqic->eqi", dual, axes) for dual in duals(surface)], axis=2)
    normal = np.cross(axes[:, :, 0], axes[:, :, 1])[:, :, None]
    return ShellPoints(
        element, corners, directors, np.concatenate([axes, normal], axis=2), rises, surface.area * element.weights
    )


def strains(at: ShellPoints) -> Array:
    """(e, q, 8, variables) linear strains."""
    element, corners, directors = at.element, at.corners, at.directors
    here = element.surface(corners, directors, element.points)
    fields = element.fields(corners, directors, element.points)
    places, weights = element.tied_shear(element.points)
    tied = element.surface(corners, directors, places)
    shear = _shear(tied, element.fields(corners, directors, places))
    membrane = [_along(here.tangents, fields.slopes, a, b) for a, b in _PAIRS]
    bending = [
        _along(here.tangents, fields.director_slopes, a, b) + _along(here.director_slopes, fields.slopes, a, b)
        for a, b in _PAIRS
    ]
    return cartesian(at, membrane, bending, shear, weights)


def products(at: ShellPoints, first: Array, second: Array) -> Array:
    """(e, q, 8, pairs) strains of Green and Lagrange of second order, of pairs of motions.

    ``first``, ``second`` (e, variables, pairs): ``products(at, v, v)`` belongs to v = φ_p q_p, half of the mixed second
    derivative to two modes.
    """
    element, corners, directors = at.element, at.corners, at.directors
    places, weights = element.tied_shear(element.points)
    parts = []
    for points in (element.points, places):
        surface, one, other = (
            element.surface(corners, directors, points),
            *(_moved(element.fields(corners, directors, points), motion) for motion in (first, second)),
        )
        turned = _twice_turned(element, directors, points, first, second)
        parts.append((surface, one, other, turned))
    here, one, other, (_, rises) = parts[0]
    membrane = [_both(one.slopes, other.slopes, a, b) / 2 for a, b in _PAIRS]
    bending = [
        (_both(one.slopes, other.director_slopes, a, b) + _both(other.slopes, one.director_slopes, a, b)) / 2
        + _along(here.tangents, rises, a, b)
        for a, b in _PAIRS
    ]
    tied, one, other, (second_turn, _) = parts[1]
    shear = [
        (np.einsum("eqcm,eqcm->eqm", one.slopes[a], other.director)
         + np.einsum("eqcm,eqcm->eqm", other.slopes[a], one.director)) / 2
        + np.einsum("eqc,eqcm->eqm", tied.tangents[a], second_turn)
        for a in range(2)
    ]  # fmt: skip
    return cartesian(at, membrane, bending, shear, weights)


def drilling(at: ShellPoints) -> Array:
    """(e, q, variables) rotations about the normal less those of the surface."""
    element, size = at.element, at.element.variables
    fields = element.fields(at.corners, at.directors, element.points)
    shapes, _ = element.shapes(element.points)
    result = np.zeros((*at.area.shape, size))
    for k in range(element.corners):
        result[..., 6 * k + 3 : 6 * k + 6] = shapes[:, k, None] * at.axes[:, :, 2]
    for i, sign in ((0, -0.5), (1, 0.5)):  # (e2 · u,1 - e1 · u,2)/2
        slope = sum(at.rises[:, :, a, i, None, None] * fields.slopes[a] for a in range(2))
        result += sign * np.einsum("eqc,eqcn->eqn", at.axes[:, :, 1 - i], slope)
    return result


def _along(tangents: tuple[Array, Array], slopes: tuple[Array, Array], a: int, b: int) -> Array:
    """(e, q, m) (t_a · s_b + t_b · s_a)/2."""
    one = np.einsum("eqc,eqcn->eqn", tangents[a], slopes[b])
    return np.asarray(one if a == b else (one + np.einsum("eqc,eqcn->eqn", tangents[b], slopes[a])) / 2)


def _both(first: tuple[Array, Array], second: tuple[Array, Array], a: int, b: int) -> Array:
    """(e, q, m) (s_a · t_b + s_b · t_a)/2."""
    one = np.einsum("eqcn,eqcn->eqn", first[a], second[b])
    return np.asarray(one if a == b else (one + np.einsum("eqcn,eqcn->eqn", first[b], second[a])) / 2)


def _shear(surface: Surface, fields: Fields) -> list[Array]:
    """γ_1, γ_2, (e, p, m) each."""
    return [
        np.einsum("eqc,eqcn->eqn", surface.tangents[a], fields.director)
        + np.einsum("eqc,eqcn->eqn", surface.director, fields.slopes[a])
        for a in range(2)
    ]


def cartesian(
    at: ShellPoints, membrane: list[Array], bending: list[Array], shear: list[Array], weights: Array
) -> Array:
    """(e, q, 8, m) from covariant components at the points, shear from those at its own points."""
    result = np.zeros((*at.area.shape, COMPONENTS, membrane[0].shape[-1]))
    for start, (first, second, mixed) in ((0, membrane), (3, bending)):
        for row, (i, j) in enumerate(_PAIRS):
            c = at.rises[..., None]
            value = c[:, :, 0, i] * c[:, :, 0, j] * first + c[:, :, 1, i] * c[:, :, 1, j] * second
            value += (c[:, :, 0, i] * c[:, :, 1, j] + c[:, :, 1, i] * c[:, :, 0, j]) * mixed
            result[:, :, start + row] = value if i == j else 2 * value
    taken = np.einsum("qapb,bepm->eqam", weights, np.stack(shear))
    result[:, :, 6:] = np.einsum("eqai,eqam->eqim", at.rises, taken)
    return result


def _moved(fields: Fields, motion: Array) -> Fields:
    """Fields of motions (e, variables, m)."""

    def of(field: Array) -> Array:
        return np.asarray(np.einsum("eqcn,enm->eqcm", field, motion, optimize=True))

    u, a = fields.slopes, fields.director_slopes
    return Fields((of(u[0]), of(u[1])), of(fields.director), (of(a[0]), of(a[1])))


def _twice_turned(
    element: ShellElement, directors: Array, points: Array, first: Array, second: Array
) -> tuple[Array, tuple[Array, Array]]:
    """Director of second order, ½ θ × (θ × n), and its slopes; inner rotations are left out."""
    shapes, slopes = element.shapes(points)
    nodal = []
    for k in range(element.corners):
        one, other = first[:, 6 * k + 3 : 6 * k + 6], second[:, 6 * k + 3 : 6 * k + 6]
        n = directors[:, k, :, None]
        inner = [np.cross(theta, n, axis=1) for theta in (one, other)]
        nodal.append((np.cross(one, inner[1], axis=1) + np.cross(other, inner[0], axis=1)) / 4)
    turned = np.stack(nodal, axis=1)  # (e, k, 3, m)
    along = np.einsum("qak,ekcm->aeqcm", slopes, turned)
    return np.einsum("qk,ekcm->eqcm", shapes, turned), (along[0], along[1])
