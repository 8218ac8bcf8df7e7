"""Spatial frame elements with two nodes and 6 dofs per node, Euler-Bernoulli or Timoshenko.

The interpolation is the exact static one of the Timoshenko beam (Przemieniecki, Theory of Matrix Structural
Analysis, 1968, ch. 5 and 11; Friedman & Kosmatka, 1993); Euler-Bernoulli is its limit Φ = 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from fe_import.elements.sections import SectionConstants
from fe_import.model import Array, BeamLines, IntArray, ThermalLoad

_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(4)  # exact for the sixth-degree products of the shape functions
_POINTS, _WEIGHTS = (_POINTS + 1) / 2, _WEIGHTS / 2

STIFFNESS_PARTS = ("axial", "torsion", "bending about y", "bending about z")


@dataclass(frozen=True)
class FrameElement:
    """One straight element.

    Attributes
    ----------
    nodes : (int, int)
    axes : (3, 3) array
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

    nodes: tuple[int, int]
    axes: Array
    length: float
    section: SectionConstants
    youngs_modulus: float
    shear_modulus: float
    density: float
    thermal_expansion: float = 0.0


def local_axes(start: Array, end: Array, local_z: Array) -> Array:
    """(3, 3) rows: unit x from ``start`` to ``end``, z as near ``local_z`` as possible, y = z × x."""
    x = (end - start) / np.linalg.norm(end - start)
    y = np.cross(local_z, x)
    y /= np.linalg.norm(y)
    return np.stack([x, y, np.cross(x, y)])


def shear_flexibility(element: FrameElement, shear: bool) -> tuple[float, float]:
    """Φ_y = 12 E I_z / (κ_y G A L²) for bending about z (deflection along y), and Φ_z likewise; 0 without shear."""
    if not shear:
        return 0.0, 0.0
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
    """(12, 12) stiffness in local axes, split into axial, torsion and the two bendings."""
    s, length, e = element.section, element.length, element.youngs_modulus
    parts = {name: np.zeros((12, 12), _scalar(element)) for name in STIFFNESS_PARTS}
    pair = np.array([[1.0, -1.0], [-1.0, 1.0]])
    parts["axial"][np.ix_([0, 6], [0, 6])] = e * s.area / length * pair
    parts["torsion"][np.ix_([3, 9], [3, 9])] = element.shear_modulus * s.torsion_constant / length * pair
    phis = shear_flexibility(element, shear)
    for name, inertia, phi, (dofs, signs) in zip(
        ("bending about z", "bending about y"), (s.inertia_z, s.inertia_y), phis, _PLANES, strict=True
    ):
        a, b = 6 * length, length**2
        block = np.array(
            [
                [12, a, -12, a],
                [a, (4 + phi) * b, -a, (2 - phi) * b],
                [-12, -a, 12, -a],
                [a, (2 - phi) * b, -a, (4 + phi) * b],
            ]
        )
        block = block * (e * inertia / ((1 + phi) * length**3))
        parts[name][np.ix_(dofs, dofs)] = block * np.outer(signs, signs)
    return parts


def element_stretch(element: FrameElement, shear: bool) -> Array:
    """(12, 12) ∫ (v'² + w'²) dx in local axes: geometric stiffness per axial force."""
    result = np.zeros((12, 12))
    for phi, (dofs, signs) in zip(shear_flexibility(element, shear), _PLANES, strict=True):
        slope = deflection_slopes(_POINTS, element.length, phi)
        block = element.length * np.einsum("p,pi,pj->ij", _WEIGHTS, slope, slope)
        result[np.ix_(dofs, dofs)] += block * np.outer(signs, signs)
    return result


def element_mass(element: FrameElement, shear: bool, mass: str, rotary_inertia: bool) -> Array:
    """(12, 12) mass matrix in local axes.

    Parameters
    ----------
    mass : str
        ``"consistent"`` or ``"lumped"`` (half of the element at either node).
    rotary_inertia : bool
        Whether cross sections resist turning, ρ diag(I_y + I_z, I_y, I_z) per length. Without it the consistent
        mass keeps the torsional part, the lumped one is made of point masses.
    """
    s, length, rho = element.section, element.length, element.density
    polar = s.inertia_y + s.inertia_z
    result = np.zeros((12, 12), _scalar(element))
    if mass == "lumped":
        node = np.zeros(6, result.dtype)
        node[:3] = s.area
        if rotary_inertia:
            node[3:] = polar, s.inertia_y, s.inertia_z
        np.fill_diagonal(result, np.tile(node * rho * length / 2, 2))
        return result
    line = np.array([[2.0, 1.0], [1.0, 2.0]]) * rho * length / 6
    result[np.ix_([0, 6], [0, 6])] = s.area * line
    result[np.ix_([3, 9], [3, 9])] = polar * line
    for inertia, phi, (dofs, signs) in zip(
        (s.inertia_z, s.inertia_y), shear_flexibility(element, shear), _PLANES, strict=True
    ):
        deflection, slope = bending_shapes(_POINTS, length, phi)
        block = s.area * np.einsum("p,pi,pj->ij", _WEIGHTS, deflection, deflection)
        if rotary_inertia:
            block = block + inertia * np.einsum("p,pi,pj->ij", _WEIGHTS, slope, slope)
        result[np.ix_(dofs, dofs)] += rho * length * block * np.outer(signs, signs)
    return result


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
    rows: list[IntArray] = []
    masses: list[Array] = []
    parts: dict[str, list[Array]] = {name: [] for name in STIFFNESS_PARTS}
    for element in elements:
        turn = np.kron(np.eye(4), element.axes)
        masses.append(turn.T @ element_mass(element, shear, mass, rotary_inertia) @ turn)
        for name, block in element_stiffness(element, shear).items():
            parts[name].append(turn.T @ block @ turn)
        rows.append(np.concatenate([6 * n + np.arange(6) for n in element.nodes]))
    dofs = np.stack(rows)
    i, j = np.repeat(dofs, 12, axis=1).ravel(), np.tile(dofs, (1, 12)).ravel()
    size = 6 * node_count

    def assemble(blocks: list[Array]) -> sp.csc_array:
        matrix = sp.coo_array((np.stack(blocks).ravel(), (i, j)), shape=(size, size)).tocsc()
        return ((matrix + matrix.T) / 2).tocsc()

    assembled = {name: assemble(blocks) for name, blocks in parts.items()}
    stiffness = sum(assembled.values(), start=sp.csc_array((size, size)))
    return assemble(masses), stiffness.tocsc(), assembled


def beam_lines(elements: Sequence[FrameElement], shear: bool, mass: str, rotary_inertia: bool) -> BeamLines:
    """Lines of frame elements; see `assemble_frame` for the options."""
    polar = np.array([[e.section.inertia_y + e.section.inertia_z, e.section.inertia_y, e.section.inertia_z]
                      for e in elements])  # fmt: skip
    density = np.array([e.density for e in elements])
    rotary = polar * density[:, None]
    if not rotary_inertia:
        rotary[:, 1:] = 0.0
        if mass == "lumped":
            rotary[:, 0] = 0.0
    return BeamLines(
        nodes=np.array([e.nodes for e in elements], dtype=np.int64),
        axes=np.stack([e.axes for e in elements]),
        lengths=np.array([e.length for e in elements]),
        shear=np.array([shear_flexibility(e, shear) for e in elements]),
        mass=density * np.array([e.section.area for e in elements]),
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
