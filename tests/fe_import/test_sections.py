"""Cross sections: closed forms, published constants, a second series, thin limits, faults."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fe_import.elements.sections import (
    Circular,
    Constants,
    Rectangular,
    RectangularTube,
    Section,
    SectionConstants,
    Tubular,
    rectangle_torsion_constant,
    section_constants,
)
from fe_import.errors import Cause, FEImportError

SIZES = st.floats(1e-3, 1e2)


def constants(section: Section, nu: float = 0.3, torsion: str = "saint-venant") -> SectionConstants:
    return section_constants(section, nu, torsion, "l.toml: sections.s")


def test_rectangle_closed_forms() -> None:
    c = constants(Rectangular(width=0.03, height=0.01))
    assert c.area == pytest.approx(3e-4, rel=1e-15)
    assert c.inertia_y == pytest.approx(0.03 * 0.01**3 / 12, rel=1e-15)
    assert c.inertia_z == pytest.approx(0.01 * 0.03**3 / 12, rel=1e-15)
    assert (c.shear_factor_y, c.shear_factor_z) == (5 / 6, 5 / 6)


def test_published_torsion_constants_of_rectangles() -> None:
    """J = β a b³: Timoshenko & Goodier to three digits, the square to four, 30 x 10 mm to eight."""
    table = {1.2: 0.166, 1.5: 0.196, 2.0: 0.229, 2.5: 0.249, 3.0: 0.263, 4.0: 0.281, 5.0: 0.291, 10.0: 0.312}
    for ratio, beta in table.items():
        assert rectangle_torsion_constant(ratio, 1.0) == pytest.approx(beta * ratio, abs=6e-4 * ratio)
    assert rectangle_torsion_constant(2.0, 2.0) / 16 == pytest.approx(0.1406, abs=5e-5)
    assert rectangle_torsion_constant(0.03, 0.01) == pytest.approx(7.8995079e-9, abs=5e-17)


def test_torsion_constant_against_the_double_series() -> None:
    """Prandtl's function as a double sine series, independent of the single series in use; its tail is 2e-8."""
    n = np.arange(1.0, 1200.0, 2.0)
    for a, b in ((1.0, 1.0), (3.0, 1.0), (1.0, 7.0)):
        terms = 1 / np.multiply.outer(n**2, n**2) / np.add.outer((n / a) ** 2, (n / b) ** 2)
        series = 256 * a * b / math.pi**6 * terms.sum()
        assert rectangle_torsion_constant(a, b) == pytest.approx(series, rel=1e-7)


def test_torsion_constant_of_a_strip() -> None:
    """b t³/3 (1 - 0.630 t/b), Saint-Venant; 0.630 is 192/π⁵ Σ 1/n⁵ = 0.63025."""
    for b in (20.0, 1e3, 1e6):
        assert rectangle_torsion_constant(b, 1.0) == pytest.approx(b / 3 * (1 - 0.63025 / b), rel=1e-6)


@settings(max_examples=50, deadline=None)
@given(SIZES, SIZES, st.floats(1e-3, 1e3))
def test_rectangle_turns_and_scales(b: float, h: float, scale: float) -> None:
    """Turned by 90° the inertias swap; lengths to the fourth power. Below polar, above half of thin-strip torsion."""
    c, turned = (constants(Rectangular(width=x, height=y)) for x, y in ((b, h), (h, b)))
    assert (c.inertia_y, c.inertia_z) == pytest.approx((turned.inertia_z, turned.inertia_y), rel=1e-14)
    assert c.torsion_constant == turned.torsion_constant
    scaled = constants(Rectangular(width=b * scale, height=h * scale))
    assert scaled.torsion_constant == pytest.approx(c.torsion_constant * scale**4, rel=1e-12)
    assert c.torsion_constant < c.inertia_y + c.inertia_z


def test_circle() -> None:
    """πd²/4, πd⁴/64, J = 2I; Cowper's 6(1+ν)/(7+6ν) = 0.886 at ν = 0.3 (Cowper 1966)."""
    c = constants(Circular(diameter=0.02))
    assert c.area == pytest.approx(math.pi * 1e-4, rel=1e-15)
    assert c.inertia_y == c.inertia_z == pytest.approx(math.pi * 0.02**4 / 64, rel=1e-15)
    assert c.torsion_constant == pytest.approx(2 * c.inertia_y, rel=1e-15)
    assert c.shear_factor_y == c.shear_factor_z == pytest.approx(7.8 / 8.8, rel=1e-15)
    assert round(c.shear_factor_y, 3) == 0.886


def test_tube_between_circle_and_thin_wall() -> None:
    """Outer minus inner circle; without a hole the circle; Bredt's 2πr³t and Cowper's 2(1+ν)/(4+3ν) when thin.

    The thin forms hold to (t/r)²: J is 2πr³t (1 + t²/4r²) exactly.
    """
    tube = constants(Tubular(outer_diameter=0.05, thickness=0.004))
    outer, inner = (constants(Circular(diameter=d)) for d in (0.05, 0.042))
    for field in ("area", "inertia_y", "inertia_z", "torsion_constant"):
        assert getattr(tube, field) == pytest.approx(getattr(outer, field) - getattr(inner, field), rel=1e-14)
    assert inner.shear_factor_y > tube.shear_factor_y
    full = constants(Tubular(outer_diameter=0.05, thickness=0.025))
    assert vars(full) == pytest.approx(vars(outer), rel=1e-14)
    thin, r, t = constants(Tubular(outer_diameter=1.001, thickness=0.001)), 0.5, 0.001
    bredt = 2 * math.pi * r**3 * t
    assert thin.torsion_constant == pytest.approx(bredt * (1 + t**2 / (4 * r**2)), rel=1e-10)
    assert thin.torsion_constant == pytest.approx(bredt, rel=(t / r) ** 2)
    assert thin.inertia_y == pytest.approx(bredt / 2, rel=(t / r) ** 2)
    assert thin.shear_factor_y == pytest.approx(2.6 / 4.9, rel=1e-5)
    assert round(thin.shear_factor_y, 2) == 0.53  # Cowper's table, ν = 0.3


def test_rectangular_tube() -> None:
    """Outer minus inner rectangle; Bredt's 4 A² t / U; walls along the force carry the shear."""
    b, h, t = 0.06, 0.04, 0.003
    tube = constants(RectangularTube(width=b, height=h, thickness=t))
    outer, inner = (constants(Rectangular(width=b - s, height=h - s)) for s in (0.0, 2 * t))
    for field in ("area", "inertia_y", "inertia_z"):
        assert getattr(tube, field) == pytest.approx(getattr(outer, field) - getattr(inner, field), rel=1e-13)
    enclosed, around = (b - t) * (h - t), 2 * (b + h - 2 * t)
    assert tube.torsion_constant == pytest.approx(4 * enclosed**2 * t / around, rel=1e-14)
    assert tube.shear_factor_y * tube.area == pytest.approx(2 * t * (b - t), rel=1e-14)
    assert tube.shear_factor_z * tube.area == pytest.approx(2 * t * (h - t), rel=1e-14)
    assert tube.shear_factor_y + tube.shear_factor_z == pytest.approx(1.0, rel=1e-14)
    square = constants(RectangularTube(width=b, height=b, thickness=t))
    assert square.torsion_constant == pytest.approx((b - t) ** 3 * t, rel=1e-14)


def test_given_values_win() -> None:
    """A given torsion constant and shear factor replace the computed ones, whatever the torsion model."""
    for torsion in ("saint-venant", "polar"):
        c = constants(Rectangular(width=1.0, height=2.0, torsion_constant=0.3, shear_factor=0.7), torsion=torsion)
        assert (c.torsion_constant, c.shear_factor_y, c.shear_factor_z) == (0.3, 0.7, 0.7)
        given_constants = Constants(area=1.0, inertia_y=2.0, inertia_z=3.0, torsion_constant=4.0, shear_factor_z=0.5)
        c = constants(given_constants, torsion=torsion)
        assert c == SectionConstants(1.0, 2.0, 3.0, 4.0, 5 / 6, 0.5)
    assert constants(Circular(diameter=1.0, shear_factor=0.9)).shear_factor_y == 0.9
    tube = constants(RectangularTube(width=1.0, height=1.0, thickness=0.1, shear_factor_y=0.4))
    assert tube.shear_factor_y == 0.4
    assert tube.shear_factor_z == pytest.approx(0.5)


def test_polar_torsion() -> None:
    c = constants(Rectangular(width=0.01, height=0.03), torsion="polar")
    assert c.torsion_constant == c.inertia_y + c.inertia_z


SOUND: dict[type[Any], dict[str, float]] = {
    Rectangular: {"width": 0.01, "height": 0.02, "shear_factor": 0.8, "torsion_constant": 1e-9},
    Circular: {"diameter": 0.02, "shear_factor": 0.9, "torsion_constant": 1e-9},
    Tubular: {"outer_diameter": 0.02, "thickness": 0.001, "shear_factor": 0.5, "torsion_constant": 1e-9},
    RectangularTube: {
        "width": 0.02,
        "height": 0.03,
        "thickness": 0.001,
        "shear_factor_y": 0.4,
        "shear_factor_z": 0.6,
        "torsion_constant": 1e-9,
    },
    Constants: {
        "area": 1e-4,
        "inertia_y": 1e-9,
        "inertia_z": 1e-9,
        "torsion_constant": 1e-9,
        "shear_factor_y": 0.8,
        "shear_factor_z": 0.8,
    },
}


@pytest.mark.parametrize("bad", [0.0, -1.0, math.nan, math.inf])
@pytest.mark.parametrize(("shape", "field"), [(s, f) for s, fields in SOUND.items() for f in fields])
def test_every_dimension_must_be_positive(shape: type[Any], field: str, bad: float) -> None:
    constants(shape(**SOUND[shape]))
    with pytest.raises(FEImportError) as caught:
        constants(shape(**{**SOUND[shape], field: bad}))
    assert caught.value.cause is Cause.BAD_FIELD
    assert caught.value.where == f"l.toml: sections.s.{field}"
    assert caught.value.remedy


@pytest.mark.parametrize(
    "section",
    [
        Tubular(outer_diameter=0.02, thickness=0.0101),
        RectangularTube(width=0.02, height=0.03, thickness=0.0101),
        RectangularTube(width=0.03, height=0.02, thickness=0.0101),
    ],
)
def test_wall_thicker_than_the_section(section: Section) -> None:
    with pytest.raises(FEImportError, match="thicker than half") as caught:
        constants(section)
    assert caught.value.where == "l.toml: sections.s.thickness"
    assert (caught.value.value, caught.value.limit) == (0.0101, 0.01)
