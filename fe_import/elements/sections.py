"""Cross sections of frame links: schema records and the constants that the element needs.

Local axes: x along the member, width along y, height along z. I_y = ∫ z² dA bends in the x-z plane.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import msgspec

from fe_import.errors import Cause, FEImportError


@dataclass(frozen=True)
class SectionConstants:
    """Area [m²], second moments [m⁴], torsion constant [m⁴], shear factors (effective / full area)."""

    area: float
    inertia_y: float
    inertia_z: float
    torsion_constant: float
    shear_factor_y: float
    shear_factor_z: float


class Rectangular(msgspec.Struct, tag="rectangular", tag_field="shape", forbid_unknown_fields=True, frozen=True):
    """Solid rectangle.

    Attributes
    ----------
    width, height : float
        Along local y and along local z [m].
    shear_factor : float
        Effective area in shear over the area, both directions; 5/6 unless given.
    torsion_constant : float, optional
        Instead of Saint-Venant's [m⁴].
    """

    width: float
    height: float
    shear_factor: float = 5 / 6
    torsion_constant: float | None = None


class Circular(msgspec.Struct, tag="circular", tag_field="shape", forbid_unknown_fields=True, frozen=True):
    """Solid circle.

    Attributes
    ----------
    diameter : float
        [m]
    shear_factor : float, optional
        Effective area in shear over the area; after Cowper (1966) unless given.
    torsion_constant : float, optional
        Instead of the polar moment [m⁴].
    """

    diameter: float
    shear_factor: float | None = None
    torsion_constant: float | None = None


class Tubular(msgspec.Struct, tag="tubular", tag_field="shape", forbid_unknown_fields=True, frozen=True):
    """Circular tube.

    Attributes
    ----------
    outer_diameter : float
        [m]
    thickness : float, optional
        Of the wall [m]; give this or ``diameter_ratio``.
    diameter_ratio : float, optional
        Inner over outer diameter.
    shear_factor : float, optional
        Effective area in shear over the area; after Cowper (1966) unless given.
    torsion_constant : float, optional
        Instead of the polar moment [m⁴].
    """

    outer_diameter: float
    thickness: float | None = None
    diameter_ratio: float | None = None
    shear_factor: float | None = None
    torsion_constant: float | None = None

    @property
    def inner_diameter(self) -> float:
        """[m]"""
        if self.diameter_ratio is not None:
            return self.outer_diameter * self.diameter_ratio
        return self.outer_diameter - 2 * (self.thickness or 0.0)


class RectangularTube(
    msgspec.Struct, tag="rectangular-tube", tag_field="shape", forbid_unknown_fields=True, frozen=True
):
    """Thin-walled rectangular tube (Bredt's torsion constant; shear carried by the walls along the force).

    Attributes
    ----------
    width, height : float
        Outer size along local y and along local z [m].
    thickness : float
        Of the walls [m].
    shear_factor_y, shear_factor_z : float, optional
        Effective area in shear over the area; that of the walls along the force unless given.
    torsion_constant : float, optional
        Instead of Bredt's [m⁴].
    """

    width: float
    height: float
    thickness: float
    shear_factor_y: float | None = None
    shear_factor_z: float | None = None
    torsion_constant: float | None = None


class Constants(msgspec.Struct, tag="constants", tag_field="shape", forbid_unknown_fields=True, frozen=True):
    """Given constants of any section.

    Attributes
    ----------
    area : float
        [m²]
    inertia_y, inertia_z : float
        ∫z²dA, for bending in the local x-z plane, and ∫y²dA, in the x-y plane [m⁴].
    torsion_constant : float
        [m⁴]
    shear_factor_y, shear_factor_z : float
        Effective area in shear over the area; 5/6 unless given.
    """

    area: float
    inertia_y: float
    inertia_z: float
    torsion_constant: float
    shear_factor_y: float = 5 / 6
    shear_factor_z: float = 5 / 6


Section = Rectangular | Circular | Tubular | RectangularTube | Constants


_ZETA_5 = 1.03692775514336992633


def rectangle_torsion_constant(width: float, height: float) -> float:
    """Saint-Venant torsion constant of a rectangle [m⁴] (Timoshenko & Goodier, Theory of Elasticity, art. 109)."""
    long, short = max(width, height), min(width, height)
    # Σ tanh(n ...) / n⁵ over odd n, with Σ 1 / n⁵ = 31/32 ζ(5) split off: what remains falls exponentially
    series = 31 / 32 * _ZETA_5 + sum((math.tanh(n * math.pi * long / (2 * short)) - 1) / n**5 for n in range(1, 15, 2))
    return long * short**3 * (1 / 3 - 64 / math.pi**5 * (short / long) * series)


def _cowper_tube(ratio: float, nu: float) -> float:
    """Shear factor of a hollow circle with inner/outer radius ``ratio`` (Cowper 1966)."""
    s = (1 + ratio**2) ** 2
    return 6 * (1 + nu) * s / ((7 + 6 * nu) * s + (20 + 12 * nu) * ratio**2)


def box_constants(width: float, height: float, wall_y: float, wall_z: float) -> SectionConstants:
    """Of a thin-walled box of outer size ``width`` along y, ``height`` along z.

    ``wall_y`` is the thickness, along y, of the walls across y; ``wall_z`` that of those across z. Torsion after Bredt,
    4 A² / ∮ ds/t; shear is carried by the walls along the force.
    """
    inner_y, inner_z = width - 2 * wall_y, height - 2 * wall_z
    area = width * height - inner_y * inner_z
    mean_y, mean_z = width - wall_y, height - wall_z
    return SectionConstants(
        area,
        (width * height**3 - inner_y * inner_z**3) / 12,
        (width**3 * height - inner_y**3 * inner_z) / 12,
        4 * (mean_y * mean_z) ** 2 / (2 * mean_y / wall_z + 2 * mean_z / wall_y),
        2 * wall_z * mean_y / area,
        2 * wall_y * mean_z / area,
    )


def _constants(section: Section, poissons_ratio: float) -> SectionConstants:
    match section:
        case Rectangular(width=b, height=h):
            k = section.shear_factor
            return SectionConstants(b * h, b * h**3 / 12, b**3 * h / 12, rectangle_torsion_constant(b, h), k, k)
        case Circular(diameter=d):
            k = section.shear_factor or _cowper_tube(0.0, poissons_ratio)
            i = math.pi * d**4 / 64
            return SectionConstants(math.pi * d**2 / 4, i, i, 2 * i, k, k)
        case Tubular(outer_diameter=d):
            inner = section.inner_diameter
            k = section.shear_factor or _cowper_tube(inner / d, poissons_ratio)
            i = math.pi * (d**4 - inner**4) / 64
            return SectionConstants(math.pi * (d**2 - inner**2) / 4, i, i, 2 * i, k, k)
        case RectangularTube(width=b, height=h, thickness=t):
            c = box_constants(b, h, t, t)
            factors = section.shear_factor_y or c.shear_factor_y, section.shear_factor_z or c.shear_factor_z
            return SectionConstants(c.area, c.inertia_y, c.inertia_z, c.torsion_constant, *factors)
        case Constants():
            return SectionConstants(
                section.area,
                section.inertia_y,
                section.inertia_z,
                section.torsion_constant,
                section.shear_factor_y,
                section.shear_factor_z,
            )


def check_section(section: Section, where: str) -> None:
    """Refuse dimensions that no section has.

    Parameters
    ----------
    section : Section
    where : str
        File and field, for messages.

    Raises
    ------
    FEImportError
        A dimension that is not positive and finite, or a wall thicker than the section.
    """
    for name in section.__struct_fields__:
        value = getattr(section, name)
        if value is not None and not (math.isfinite(value) and value > 0):
            raise FEImportError(
                Cause.BAD_FIELD,
                f"{name} must be positive",
                where=f"{where}.{name}",
                value=value,
                remedy="give a length, area or factor above 0",
            )
    if isinstance(section, Tubular):
        _check_wall(section, where)
    if isinstance(section, (Tubular, RectangularTube)):
        outer = section.outer_diameter if isinstance(section, Tubular) else min(section.width, section.height)
        if section.thickness is not None and 2 * section.thickness > outer:
            raise FEImportError(
                Cause.BAD_FIELD,
                "the wall is thicker than half the section",
                where=f"{where}.thickness",
                value=section.thickness,
                limit=outer / 2,
                remedy="give a wall below half the outer size",
            )


def _check_wall(section: Tubular, where: str) -> None:
    """One way to say how thick it is."""
    if (section.thickness is None) == (section.diameter_ratio is None):
        raise FEImportError(
            Cause.BAD_FIELD,
            "a tube needs exactly one of 'thickness' and 'diameter_ratio'",
            where=where,
            remedy="say how thick its wall is",
        )
    if section.diameter_ratio is not None and not section.diameter_ratio < 1:
        raise FEImportError(
            Cause.BAD_FIELD,
            "the bore is as wide as the tube",
            where=f"{where}.diameter_ratio",
            value=section.diameter_ratio,
            limit=1,
            remedy="give inner over outer diameter, below 1",
        )


def section_constants(section: Section, poissons_ratio: float, torsion: str, where: str) -> SectionConstants:
    """Constants of a section, checked.

    Parameters
    ----------
    section : Section
    poissons_ratio : float
        Enters the shear factor of round sections.
    torsion : str
        ``"saint-venant"`` or ``"polar"`` (I_y + I_z, as some programs take it).
    where : str
        File and field, for messages.

    Raises
    ------
    FEImportError
        See `check_section`.
    """
    check_section(section, where)
    c = _constants(section, poissons_ratio)
    given = section.torsion_constant
    j = given if given is not None else c.inertia_y + c.inertia_z if torsion == "polar" else c.torsion_constant
    return SectionConstants(c.area, c.inertia_y, c.inertia_z, j, c.shear_factor_y, c.shear_factor_z)
