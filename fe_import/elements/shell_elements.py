"""The registry of shell elements, and their kinematics: strains of the reference surface from nodal components.

A point at the height z of a shell whose nodes lie on its reference surface is at X + z n; it moves by u + z a,
a = θ × n the change of the director, every node with its displacement u and its rotation vector θ (all three
components). With G_α = X,α the covariant strains are

    ε_αβ = (G_α·u,β + G_β·u,α)/2,   κ_αβ = (G_α·a,β + G_β·a,α + n,α·u,β + n,β·u,α)/2,   γ_α = G_α·a + n·u,α,

and those of Green and Lagrange add products of the same fields (`products`). Shear strains are interpolated from points
where they do not lock: MITC4 (E. N. Dvorkin & K.-J. Bathe, Eng. Comput. 1 (1984) 77-88) and MITC3+ (Y. Lee, P.-S. Lee
& K.-J. Bathe, Comput. Struct. 138 (2014) 12-23). In the surface the quadrangle has the four incompatible modes of
R. L. Taylor, P. J. Beresford & E. L. Wilson (1976), the triangle sides that bend with the rotations of their ends about
the normal (D. J. Allman, Comput. Struct. 19 (1984) 1-8).

Directors are those of each element, at its own corners: neighbours may meet at any angle. To add a type: a subclass of
`ShellElement` and its entry in ``SHELL_ELEMENTS``; the tests over the registry then include it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from fe_import.model import Array


@dataclass(frozen=True)
class Fields:
    """Fields of the reference surface at points of elements, linear in m variables: (e, q, 3, m) each.

    Attributes
    ----------
    slopes : pair of arrays
        u,1 and u,2.
    director : array
        a.
    director_slopes : pair of arrays
        a,1 and a,2.
    """

    slopes: tuple[Array, Array]
    director: Array
    director_slopes: tuple[Array, Array]


@dataclass(frozen=True)
class Surface:
    """Reference surfaces of elements at points: tangents G_1, G_2, director n and its slopes, (e, q, 3) each."""

    tangents: tuple[Array, Array]
    director: Array
    director_slopes: tuple[Array, Array]

    @property
    def area(self) -> Array:
        """(e, q) per area of the reference cell."""
        return np.asarray(np.linalg.norm(np.cross(*self.tangents), axis=-1))


class ShellElement(ABC):
    """One type of shell elements.

    Attributes
    ----------
    name, meshio_name : str
    corners : int
    points, weights : (q, 2), (q,) arrays
        Quadrature on the reference cell.
    inner : int
        Variables within the element, which are eliminated.
    """

    name: str
    meshio_name: str
    corners: int
    points: Array
    weights: Array
    inner: int

    @property
    def variables(self) -> int:
        """Six of each node, and the inner ones."""
        return 6 * self.corners + self.inner

    @abstractmethod
    def shapes(self, points: Array) -> tuple[Array, Array]:
        """(q, k) shape functions and (q, 2, k) their slopes at points of the reference cell."""

    @abstractmethod
    def directors(self, corners: Array) -> Array:
        """(e, k, 3) unit normals of elements with corners (e, k, 3), at these."""

    @abstractmethod
    def tied_shear(self, points: Array) -> tuple[Array, Array]:
        """Where shear is taken, (p, 2), and weights (q, 2, p, 2) of its components there, for those at points."""

    @abstractmethod
    def add_inner(self, corners: Array, directors: Array, points: Array, fields: Fields) -> None:
        """Add what inner variables, and rotations about the normal, do to the fields (e, q, 3, variables)."""

    def surface(self, corners: Array, directors: Array, points: Array) -> Surface:
        """Reference surfaces at points."""
        shapes, slopes = self.shapes(points)
        along = np.einsum("qak,ekc->aeqc", slopes, corners)
        turning = np.einsum("qak,ekc->aeqc", slopes, directors)
        return Surface((along[0], along[1]), np.einsum("qk,ekc->eqc", shapes, directors), (turning[0], turning[1]))

    def fields(self, corners: Array, directors: Array, points: Array) -> Fields:
        """Fields at points of elements, in all their variables: node by node u then θ, then the inner ones."""
        shapes, slopes = self.shapes(points)
        count, q, n = len(corners), len(points), self.variables
        result = Fields(
            (np.zeros((count, q, 3, n)), np.zeros((count, q, 3, n))),
            np.zeros((count, q, 3, n)),
            (np.zeros((count, q, 3, n)), np.zeros((count, q, 3, n))),
        )
        for k in range(self.corners):
            u, theta = slice(6 * k, 6 * k + 3), slice(6 * k + 3, 6 * k + 6)
            turn = np.cross(np.eye(3), directors[:, k, None]).swapaxes(1, 2)[:, None]  # a = θ × n
            result.director[..., theta] = shapes[:, k, None, None] * turn
            for axis in range(2):
                result.slopes[axis][..., u] = slopes[:, axis, k, None, None] * np.eye(3)
                result.director_slopes[axis][..., theta] = slopes[:, axis, k, None, None] * turn
        self.add_inner(corners, directors, points, result)
        return result


class Quadrangle(ShellElement):
    """Four nodes: MITC4, with incompatible modes along the surface."""

    name, meshio_name, corners, inner = "quad4", "quad", 4, 4
    _AT = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    points = _AT / np.sqrt(3)
    weights = np.ones(4)

    def shapes(self, points: Array) -> tuple[Array, Array]:
        """Bilinear."""
        r, s = (1 + points[:, a, None] * self._AT[:, a] for a in range(2))
        return r * s / 4, np.stack([self._AT[:, 0] * s, r * self._AT[:, 1]], axis=1) / 4

    def directors(self, corners: Array) -> Array:
        """Of the bilinear surface."""
        _, slopes = self.shapes(self._AT)
        normals = np.cross(*np.einsum("qak,ekc->aeqc", slopes, corners))
        return np.asarray(normals / np.linalg.norm(normals, axis=-1, keepdims=True))

    def tied_shear(self, points: Array) -> tuple[Array, Array]:
        """γ_1 from the middles of the sides s = ±1, γ_2 from those of r = ±1."""
        middles = np.array([[0.0, -1.0], [0.0, 1.0], [-1.0, 0.0], [1.0, 0.0]])
        weights = np.zeros((len(points), 2, 4, 2))
        for axis, places in ((0, (0, 1)), (1, (2, 3))):
            across = points[:, 1 - axis]
            weights[:, axis, places[0], axis], weights[:, axis, places[1], axis] = (1 - across) / 2, (1 + across) / 2
        return middles, weights

    def add_inner(self, corners: Array, directors: Array, points: Array, fields: Fields) -> None:
        """Displacements (1 - r²) and (1 - s²) along both axes of the surface at the centre.

        With the Jacobian of the centre constant strains stay exact.
        """
        centre = self.surface(corners, directors, np.zeros((1, 2)))
        here = self.surface(corners, directors, points)
        reference = middle_axis(centre.tangents)[:, 0]
        axes, own, rises = tangent_axes(centre, reference), tangent_axes(here, reference), duals(centre)
        steps = -2 * points  # slopes of the two modes by their own coordinate
        scale = centre.area / here.area  # (e, q)
        for mode in range(2):
            rise = np.einsum("eqic,eqc->eqi", axes, rises[mode])  # of ξ_mode along the axes of the centre
            gradient = scale[..., None] * steps[None, :, mode, None] * rise
            for axis in range(2):
                along = np.einsum("eqc,eqic->eqi", here.tangents[axis], own)
                slope = np.einsum("eqi,eqi->eq", along, gradient)
                for i in range(2):
                    fields.slopes[axis][..., 24 + 2 * mode + i] += slope[..., None] * own[:, :, i]


class Triangle(ShellElement):
    """Three nodes: MITC3+, with sides that bend along the surface."""

    name, meshio_name, corners, inner = "tri3", "triangle", 3, 2
    points = np.array([[1 / 6, 1 / 6], [2 / 3, 1 / 6], [1 / 6, 2 / 3]])
    weights = np.full(3, 1 / 6)
    _SLOPES = np.array([[-1.0, 1.0, 0.0], [-1.0, 0.0, 1.0]])

    def shapes(self, points: Array) -> tuple[Array, Array]:
        """Linear."""
        r, s = points.T
        return np.stack([1 - r - s, r, s], axis=1), np.tile(self._SLOPES, (len(points), 1, 1))

    def directors(self, corners: Array) -> Array:
        """Its normal."""
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        unit = normals / np.linalg.norm(normals, axis=-1, keepdims=True)
        return np.repeat(unit[:, None], 3, axis=1)

    def tied_shear(self, points: Array) -> tuple[Array, Array]:
        """MITC3+, with tying points D, E, F at the distance 1e-4 from the centre."""
        d = 1e-4
        places = np.array(
            [[1 / 6, 2 / 3], [2 / 3, 1 / 6], [1 / 6, 1 / 6], [1 / 3 + d, 1 / 3 - 2 * d], [1 / 3 - 2 * d, 1 / 3 + d],
             [1 / 3 + d, 1 / 3 + d]]
        )  # fmt: skip
        a, b, c, at_d, at_e, at_f = range(6)
        r, s = points.T
        weights = np.zeros((len(points), 2, 6, 2))
        weights[:, 0, b], weights[:, 1, a] = (2 / 3, -1 / 3), (-1 / 3, 2 / 3)
        weights[:, :, c] += 1 / 3
        for axis, share in ((0, (3 * s - 1) / 3), (1, (1 - 3 * r) / 3)):
            for place, sign in ((at_f, (1, -1)), (at_d, (-1, 0)), (at_e, (0, 1))):
                weights[:, axis, place] += share[:, None] * np.array(sign)
        return places, weights

    def add_inner(self, corners: Array, directors: Array, points: Array, fields: Fields) -> None:
        """A rotation that is 27 r s (1 - r - s), and midpoints of sides that move with the rotations of their ends."""
        r, s = points.T
        third = 1 - r - s
        hump = 27 * r * s * third
        rise = 27 * np.stack([s * third - r * s, r * third - r * s])
        surface = self.surface(corners, directors, points)
        axes = tangent_axes(surface, middle_axis(surface.tangents)[:, 0])
        for i in range(2):
            turn = np.cross(axes[:, :, i], surface.director)
            fields.director[..., 18 + i] += hump[:, None] * turn
            for axis in range(2):
                fields.director_slopes[axis][..., 18 + i] += rise[axis][:, None] * turn
        shapes, slopes = self.shapes(points)
        for i, j in ((0, 1), (1, 2), (2, 0)):
            normal = directors[:, 0]
            bulge = np.einsum("ec,ed->ecd", np.cross(normal, corners[:, j] - corners[:, i]), normal)[:, None] / 8
            for axis in range(2):
                along = 4 * (slopes[:, axis, i] * shapes[:, j] + shapes[:, i] * slopes[:, axis, j])
                fields.slopes[axis][..., 6 * i + 3 : 6 * i + 6] += along[:, None, None] * bulge
                fields.slopes[axis][..., 6 * j + 3 : 6 * j + 6] -= along[:, None, None] * bulge


def tangent_axes(surface: Surface, reference: Array) -> Array:
    """(e, q, 2, 3) unit axes along the surface, the first the projection of ``reference`` (e, 3)."""
    normal = np.cross(*surface.tangents)
    unit = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
    along = reference[:, None] - np.einsum("ec,eqc->eq", reference, unit)[..., None] * unit
    one = along / np.linalg.norm(along, axis=-1, keepdims=True)
    return np.stack([one, np.cross(unit, one)], axis=2)


def duals(surface: Surface) -> tuple[Array, Array]:
    """(e, q, 3) gradients of the reference coordinates along the surface."""
    first, second = surface.tangents
    normal = np.cross(first, second)
    squared = np.einsum("eqc,eqc->eq", normal, normal)[..., None]
    return np.cross(second, normal) / squared, np.cross(normal, first) / squared


def middle_axis(tangents: tuple[Array, Array]) -> Array:
    """(..., 3) axis between the first tangent and the second turned back by a right angle: that of a square's side."""
    first, second = (t / np.linalg.norm(t, axis=-1, keepdims=True) for t in tangents)
    normal = np.cross(first, second)
    unit = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
    between = first + np.cross(second, unit)
    return np.asarray(between / np.linalg.norm(between, axis=-1, keepdims=True))


SHELL_ELEMENTS: dict[str, ShellElement] = {element.name: element for element in (Quadrangle(), Triangle())}
