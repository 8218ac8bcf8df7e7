"""Spatial frame elements with two nodes and 6 dofs per node, Euler-Bernoulli or Timoshenko.

The interpolation is the exact static one of the Timoshenko beam (Przemieniecki, Theory of Matrix Structural
Analysis, 1968, ch. 5 and 11; Friedman & Kosmatka, 1993); Euler-Bernoulli is its limit Φ = 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp

from fe_import.elements.sections import SectionConstants
from fe_import.model import Array, BeamLines, ThermalLoad

_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(4)  # exact for the sixth-degree products of the shape functions
_POINTS, _WEIGHTS = (_POINTS + 1) / 2, _WEIGHTS / 2

STIFFNESS_PARTS = ("axial", "torsion", "bending about y", "bending about z")


@dataclass(frozen=True)
class FrameElement:
    """One straight element, or many (`stacked`), whose numbers are then arrays (e,).

    Attributes
    ----------
    nodes : (int, int), or (e, 2) array
    axes : (3, 3) array, or (e, 3, 3)
        Rows are the local x, y, z axes in the mesh frame.
    length : float
        [m]
    section : SectionConstants
    youngs_modulus, shear_modulus : float
        [Pa]
    density : float
        [kg/m³]
    thermal_expansion : float
        [1/K]
    """

    nodes: Any
    axes: Array
    length: Any
    section: SectionConstants
    youngs_modulus: Any
    shear_modulus: Any
    density: Any
    thermal_expansion: Any = 0.0


def stacked(elements: Sequence[FrameElement]) -> FrameElement:
    """All of them as one."""
    sections: list[dict[str, Any]] = [vars(element.section) for element in elements]
    section: dict[str, Any] = {name: np.array([each[name] for each in sections]) for name in sections[0]}
    numbers = ("length", "youngs_modulus", "shear_modulus", "density", "thermal_expansion")
    return FrameElement(
        nodes=np.array([element.nodes for element in elements], dtype=np.int64),
        axes=np.stack([element.axes for element in elements]),
        section=SectionConstants(**section),
        **{name: np.array([getattr(element, name) for element in elements]) for name in numbers},
    )


def local_axes(start: Array, end: Array, local_z: Array) -> Array:
    """(..., 3, 3) rows: unit x from ``start`` to ``end``, z as near ``local_z`` as possible, y = z × x."""
    x = (end - start) / np.linalg.norm(end - start, axis=-1, keepdims=True)
    y = np.cross(local_z, x)
    y /= np.linalg.norm(y, axis=-1, keepdims=True)
    return np.stack([x, y, np.cross(x, y)], axis=-2)


def shear_flexibility(element: FrameElement, shear: bool) -> tuple[Any, Any]:
    """Φ_y = 12 E I_z / (κ_y G A L²) for bending about z (deflection along y), and Φ_z likewise; 0 without shear."""
    if not shear:
        return (np.zeros(np.shape(element.length)),) * 2
    s, g = element.section, element.shear_modulus * element.section.area * element.length**2
    e = 12 * element.youngs_modulus
    return e * s.inertia_z / (s.shear_factor_y * g), e * s.inertia_y / (s.shear_factor_z * g)


def bending_shapes(xi: Array, length: Array | float, phi: Array | float) -> tuple[Array, Array]:
    """Deflection and rotation of the cross section at ξ = x/L per unit (v₁, θ₁, v₂, θ₂), each (..., points, 4), of
    elements with lengths and Φ (..., 1), or of one.
    """
    x2, x3 = xi**2, xi**3
    bubble = phi / 2 * (xi - x2)
    deflection = np.stack(
        [
            1 - 3 * x2 + 2 * x3 + phi * (1 - xi),
            length * (xi - 2 * x2 + x3 + bubble),
            3 * x2 - 2 * x3 + phi * xi,
            length * (x3 - x2 - bubble),
        ],
        axis=-1,
    )
    slope = np.stack(
        [
            6 / length * (x2 - xi),
            1 - 4 * xi + 3 * x2 + phi * (1 - xi),
            6 / length * (xi - x2),
            3 * x2 - 2 * xi + phi * xi,
        ],
        axis=-1,
    )
    whole = np.asarray(1 + phi)[..., None]
    return deflection / whole, slope / whole


def deflection_slopes(xi: Array, length: float, phi: float) -> Array:
    """dv/dx of the deflections of `bending_shapes`, (points, 4)."""
    x2, bubble = xi**2, phi / 2 * (1 - 2 * xi)
    slopes = [
        6 * (x2 - xi) - phi,
        length * (1 - 4 * xi + 3 * x2 + bubble),
        6 * (xi - x2) + phi,
        length * (3 * x2 - 2 * xi - bubble),
    ]
    return np.stack(slopes, axis=-1) / ((1 + phi) * length)


# local dofs of bending in the x-y plane (v, θ_z) and in the x-z plane (w, -θ_y): index and sign
_PLANES = (
    (np.array([1, 5, 7, 11]), np.array([1.0, 1.0, 1.0, 1.0])),
    (np.array([2, 4, 8, 10]), np.array([1.0, -1.0, 1.0, -1.0])),
)


def _scalar(element: FrameElement) -> np.dtype[np.generic]:
    """Of its numbers, which may be complex: derivatives of matrices by complex steps."""
    own = element.length, element.youngs_modulus, element.shear_modulus, element.density
    return np.result_type(np.float64, *own, *vars(element.section).values())


def element_stiffness(element: FrameElement, shear: bool) -> dict[str, Array]:
    """(..., 12, 12) stiffness in local axes, split into axial, torsion and the two bendings."""
    s, length, e = element.section, np.asarray(element.length), element.youngs_modulus
    parts = {name: np.zeros((*length.shape, 12, 12), _scalar(element)) for name in STIFFNESS_PARTS}
    pair = np.array([[1.0, -1.0], [-1.0, 1.0]])
    parts["axial"][_places([0, 6])] = _wide(e * s.area / length) * pair
    parts["torsion"][_places([3, 9])] = _wide(element.shear_modulus * s.torsion_constant / length) * pair
    phis = shear_flexibility(element, shear)
    for name, inertia, phi, (dofs, signs) in zip(
        ("bending about z", "bending about y"), (s.inertia_z, s.inertia_y), phis, _PLANES, strict=True
    ):
        a, b, c = 6 * length, length**2, np.full_like(length, 12.0)
        near, far = (4 + phi) * b, (2 - phi) * b
        rows = ((c, a, -c, a), (a, near, -a, far), (-c, -a, c, -a), (a, far, -a, near))
        block = np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
        block = block * _wide(e * inertia / ((1 + phi) * length**3))
        parts[name][_places(dofs)] = block * np.outer(signs, signs)
    return parts


def _wide(numbers: Any) -> Array:
    """(..., 1, 1) of numbers (...)."""
    return np.asarray(numbers)[..., None, None]


def _places(dofs: Any) -> tuple[Any, ...]:
    """Rows and columns of matrices (..., 12, 12)."""
    return (..., *np.ix_(dofs, dofs))


def element_stretch(element: FrameElement, shear: bool) -> Array:
    """(12, 12) ∫ (v'² + w'²) dx in local axes: geometric stiffness per axial force."""
    result = np.zeros((12, 12))
    for phi, (dofs, signs) in zip(shear_flexibility(element, shear), _PLANES, strict=True):
        slope = deflection_slopes(_POINTS, element.length, phi)
        block = element.length * np.einsum("p,pi,pj->ij", _WEIGHTS, slope, slope)
        result[np.ix_(dofs, dofs)] += block * np.outer(signs, signs)
    return result


def element_mass(element: FrameElement, shear: bool, mass: str, rotary_inertia: bool) -> Array:
    """(..., 12, 12) mass matrix in local axes.

    Parameters
    ----------
    mass : str
        ``"consistent"`` or ``"lumped"`` (half of the element at either node).
    rotary_inertia : bool
        Whether cross sections resist turning, ρ diag(I_y + I_z, I_y, I_z) per length. Without it the consistent
        mass keeps the torsional part, the lumped one is made of point masses.
    """
    s, length, rho = element.section, np.asarray(element.length), element.density
    polar = s.inertia_y + s.inertia_z
    result = np.zeros((*length.shape, 12, 12), _scalar(element))
    if mass == "lumped":
        turning = (polar, s.inertia_y, s.inertia_z) if rotary_inertia else (0.0,) * 3
        for place, share in enumerate((s.area, s.area, s.area, *turning) * 2):
            result[..., place, place] = share * rho * length / 2
        return result
    line = np.array([[2.0, 1.0], [1.0, 2.0]]) * _wide(rho) * _wide(length) / 6
    result[_places([0, 6])] = _wide(s.area) * line
    result[_places([3, 9])] = _wide(polar) * line
    for inertia, phi, (dofs, signs) in zip(
        (s.inertia_z, s.inertia_y), shear_flexibility(element, shear), _PLANES, strict=True
    ):
        deflection, slope = bending_shapes(_POINTS, length[..., None], np.asarray(phi)[..., None])
        block = _wide(s.area) * _weighted(deflection)
        if rotary_inertia:
            block = block + _wide(inertia) * _weighted(slope)
        result[_places(dofs)] += _wide(rho * length) * block * np.outer(signs, signs)
    return result


def _weighted(shapes: Array) -> Array:
    """(..., 4, 4) integrals over ξ of products of shapes (..., points, 4)."""
    return (shapes * _WEIGHTS[:, None]).swapaxes(-1, -2) @ shapes


def assemble_frame(
    node_count: int, elements: Sequence[FrameElement], *, shear: bool, mass: str, rotary_inertia: bool
) -> tuple[sp.csc_array, sp.csc_array, dict[str, sp.csc_array]]:
    """Mass, stiffness and the parts of the stiffness of a frame, 6 dofs per node in the mesh frame.

    Parameters
    ----------
    node_count : int
    elements : sequence of FrameElement
    shear : bool
        Timoshenko (True) or Euler-Bernoulli.
    mass, rotary_inertia
        See `element_mass`.

    Returns
    -------
    mass, stiffness : (6 n, 6 n) sparse CSC
    parts : dict of sparse CSC
        The stiffness split by `STIFFNESS_PARTS`.
    """
    every = stacked(elements)
    turn = np.zeros((len(elements), 12, 12))
    for k in range(0, 12, 3):
        turn[:, k : k + 3, k : k + 3] = every.axes
    dofs = (6 * every.nodes[..., None] + np.arange(6)).reshape(-1, 12)
    i, j = np.repeat(dofs, 12, axis=1).ravel(), np.tile(dofs, (1, 12)).ravel()
    size = 6 * node_count

    def assemble(blocks: Array) -> sp.csc_array:
        turned = turn.swapaxes(1, 2) @ blocks @ turn
        matrix = sp.coo_array((turned.ravel(), (i, j)), shape=(size, size)).tocsc()
        return ((matrix + matrix.T) / 2).tocsc()

    assembled = {name: assemble(blocks) for name, blocks in element_stiffness(every, shear).items()}
    stiffness = sum(assembled.values(), start=sp.csc_array((size, size)))
    return assemble(element_mass(every, shear, mass, rotary_inertia)), stiffness.tocsc(), assembled


def beam_lines(elements: Sequence[FrameElement], shear: bool, mass: str, rotary_inertia: bool) -> BeamLines:
    """Lines of frame elements; see `assemble_frame` for the options."""
    every = stacked(elements)
    s, density = every.section, every.density
    rotary = np.stack([s.inertia_y + s.inertia_z, s.inertia_y, s.inertia_z], axis=1) * density[:, None]
    if not rotary_inertia:
        rotary[:, 1:] = 0.0
        if mass == "lumped":
            rotary[:, 0] = 0.0
    return BeamLines(
        nodes=every.nodes,
        axes=every.axes,
        lengths=every.length,
        shear=np.stack(shear_flexibility(every, shear), axis=1),
        mass=density * s.area,
        rotary=rotary,
        lumped=mass == "lumped",
    )


def thermal_load(node_count: int, elements: Sequence[FrameElement], change: float) -> ThermalLoad:
    """What a uniform temperature change does to frame elements: ε = u' - α ΔT, so N = E A (u' - α ΔT), no bending.

    Parameters
    ----------
    node_count : int
    elements : sequence of FrameElement
        Their ends, in order, are the sites of `fe_import.elements.section_forces.FrameSections`.
    change : float
        [K]
    """
    axial = np.array([e.youngs_modulus * e.section.area * e.thermal_expansion for e in elements])
    along = np.stack([e.axes[0] for e in elements]) * axial[:, None]
    nodes = np.array([e.nodes for e in elements])
    force = np.zeros((node_count, 6))
    np.add.at(force[:, :3], nodes[:, 0], -along)
    np.add.at(force[:, :3], nodes[:, 1], along)
    restrained = np.zeros((2 * len(elements), 6))
    restrained[:, 0] = -np.repeat(axial, 2)
    return ThermalLoad(change, force.ravel(), restrained)
