"""Servo conditions: paths, measures, and the tables of scenes that state them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scenes

import erls
from erls.errors import Cause, SceneError
from erls.inverse.conditions import Along, Angle, Condition, Conditions, Demand, Joints, Together
from erls.inverse.frames import PointMotion, point_motions
from erls.inverse.problem import problem_of
from erls.mechanism.paths import CirclePath, LinePath
from erls.mechanism.paths import Path as PathRecord
from erls.mechanism.place import Place

PLANAR = scenes.ROOT / "data" / "inverse" / "two_link_planar.toml"
HERE = Place(Path(), "scene.toml: servo[0].path")

PATHS: dict[str, tuple[PathRecord, Any]] = {
    "line": (
        LinePath(from_=(0.0, 1.0, 2.0), to=(1.0, 1.0, -2.0), start=0.5, duration=2.0, degree=3),
        lambda s: (s, 1.0, 2 - 4 * s),
    ),
    "circle": (
        CirclePath(centre=(1.0, 0.0, 3.0), from_=(1.0, 2.0, 3.0), turn_deg=90.0, start=0.5, duration=2.0, degree=3),
        lambda s: (1 - 2 * np.sin(np.pi / 2 * s), 2 * np.cos(np.pi / 2 * s), 3.0),
    ),
}


@pytest.mark.parametrize("name", PATHS)
def test_paths_follow_their_closed_form(name: str) -> None:
    """At their ends, before and after, and half-way; derivatives against differences of fourth order."""
    record, form = PATHS[name]
    curves = record.build(HERE)
    for t, share in ((0.0, 0.0), (0.5, 0.0), (1.0, 3 / 16 - 2 / 64), (1.5, 0.5), (2.5, 1.0), (9.0, 1.0)):
        np.testing.assert_allclose([c.value(t) for c in curves], form(share), atol=1e-14)
    h = 1e-3
    for curve in curves:
        assert curve.breakpoints == (0.5, 2.5)
        around = [curve.derivatives(1.1 + k * h) for k in (-2, -1, 1, 2)]
        for order in (0, 1):
            a, b, c, d = (x[order] for x in around)
            slope = (8 * (c - b) - (d - a)) / (12 * h)
            assert slope == pytest.approx(curve.derivatives(1.1)[order + 1], abs=1e-9)


def test_a_polynomial_of_degree_nine_has_four_vanishing_derivatives() -> None:
    """By its own powers of the time since its start."""
    curve = LinePath(from_=(0.0, 0.0, 0.0), to=(1.0, 0.0, 0.0), duration=1.0).build(HERE)[0]
    powers = np.polynomial.Polynomial(curve.coefficients[1])  # type: ignore[attr-defined]
    for at in (0.0, 1.0):
        assert [powers.deriv(k)(at) for k in range(1, 5)] == pytest.approx([0.0] * 4, abs=1e-10)
    assert (powers(0.0), powers(1.0)) == pytest.approx((0.0, 1.0), abs=1e-12)


@pytest.mark.parametrize(
    ("field", "changes"),
    [
        ("to", {"to": (0.0, 1.0, 2.0)}),
        ("duration", {"duration": 0.0}),
        ("degree", {"degree": 4}),
    ],
)
def test_lines_that_lead_nowhere_are_refused(field: str, changes: dict[str, Any]) -> None:
    """With the field."""
    given = {"from_": (0.0, 1.0, 2.0), "to": (1.0, 1.0, 2.0), "duration": 1.0, **changes}
    with pytest.raises(SceneError) as caught:
        LinePath(**given).build(HERE)
    assert caught.value.where == f"scene.toml: servo[0].path.{field}"


@pytest.mark.parametrize(
    ("field", "changes"),
    [
        ("normal", {"normal": (0.0, 0.0, 0.0)}),
        ("from", {"from_": (0.0, 0.0, 0.0)}),
        ("from", {"from_": (1.0, 0.0, 0.5)}),
        ("turn_deg", {"turn_deg": 0.0}),
    ],
)
def test_circles_that_are_none_are_refused(field: str, changes: dict[str, Any]) -> None:
    """With the field."""
    given = {"centre": (0.0, 0.0, 0.0), "from_": (1.0, 0.0, 0.0), "duration": 1.0, **changes}
    with pytest.raises(SceneError) as caught:
        CirclePath(**given).build(HERE)
    assert caught.value.where == f"scene.toml: servo[0].path.{field}"


@pytest.mark.parametrize("formulation", ["erls", "ffr"])
@pytest.mark.parametrize(
    "measure",
    [
        Along(0, np.array([0.0, 1.0, 0.0])),
        Angle(0, np.array([0.1, -0.2, 0.0]), np.eye(3)[:2]),
        Together(np.array([1.0, -0.5])),
    ],
    ids=lambda measure: type(measure).__name__,
)
def test_measures_agree_with_differences(measure: Any, formulation: str) -> None:
    """Rows, rates and second derivatives of a bent, moving robot against differences along a parabola in time."""
    loaded = erls.load_scene(PLANAR, [f"simulation.formulation={formulation}", "links.0.elastic_modes=4"])
    servoed = problem_of(loaded).flexible  # type: ignore[arg-type]
    rng = np.random.default_rng(3)
    y, v, a = rng.normal(size=(3, servoed.tree.size)) * 0.01
    y[1], v, a = 1.2, 10 * v, 100 * a

    def at(tau: float) -> Any:
        state = (y + tau * v + tau**2 / 2 * a)[None], (v + tau * a)[None]
        points = point_motions(servoed.system, 1, 0, np.zeros(1), *state)
        return measure.at(points, servoed.joints(np.zeros(1), *state))

    now, h = at(0.0), 1e-4
    around = [at(k * h) for k in (-2, -1, 1, 2)]

    def slope(name: str) -> float:
        far, near, after, beyond = (getattr(each, name)[0] for each in around)
        return float((8 * (after - near) - (beyond - far)) / (12 * h))

    assert now.rate[0] == pytest.approx(now.rows[0] @ v, rel=1e-12)
    assert now.rate[0] == pytest.approx(slope("value"), rel=1e-7)
    assert now.bias[0] + now.rows[0] @ a == pytest.approx(slope("rate"), rel=1e-7)


def test_whole_turns_of_an_angle_count_nothing() -> None:
    """A point that has gone round is where it was demanded to be."""
    place = np.array([[[-1.0, 1e-9, 0.0]]])
    still = np.zeros_like(place)
    motion: Any = (place, still, still, np.zeros((1, 1, 3, 1)))
    curve = LinePath(from_=(0.0, 0.0, 0.0), to=(1.0, 0.0, 0.0), duration=1.0).build(HERE)[0]
    every = (Condition("angle", "rad", Angle(0, np.zeros(3), np.eye(3)[:2]), curve),)
    none = Joints(*(np.zeros((1, 0)),) * 3, np.zeros((0, 1)))
    demand = Demand(np.zeros(1), *(np.full((1, 1), x) for x in (-np.pi, 0.0, 0.0)))
    held = Conditions(every, ()).held(demand, PointMotion(*motion), none)
    assert abs(held.gap[0, 0]) < 1e-8


FAULTS = [
    ('servo.0.point="tp"', "servo[0].point", Cause.BAD_REFERENCE),
    ("servo.0.joints={ shoulder = 1.0 }", "servo[0]", Cause.BAD_FIELD),
    ('servo.0.coordinates=["x", "w"]', "servo[0].coordinates[1]", Cause.BAD_REFERENCE),
    ('servo.0.coordinates=["x", "x"]', "servo[0].coordinates[1]", Cause.BAD_FIELD),
    ("servo.0.coordinates=[]", "servo[0]", Cause.BAD_FIELD),
    ("servo.0.about={}", "servo[0]", Cause.BAD_FIELD),
    ('servo.0.motion={ shape = "sine", amplitude = 0.1, frequency_hz = 1.0 }', "servo[0]", Cause.BAD_FIELD),
    ('inverse.drives=["wrist"]', "inverse.drives[0]", Cause.BAD_REFERENCE),
    ('inverse.drives=["elbow", "elbow"]', "inverse.drives[1]", Cause.BAD_FIELD),
    ("inverse.bandwidth=0.0", "inverse.bandwidth", Cause.BAD_FIELD),
    ("inverse.speed=1.0", "inverse", Cause.UNKNOWN_FIELD),
    ("servo.0.path.radius=1.0", "servo[0].path", Cause.UNKNOWN_FIELD),
    ('servo=[{ joints = { shoulder = 0.0 }, path = { shape = "line", from = [0.0, 0.0, 0.0], to = [1.0, 0.0, 0.0], '
     "duration = 1.0 } }]", "servo[0].joints.shoulder", Cause.BAD_FIELD),
]  # fmt: skip


@pytest.mark.parametrize(("change", "where", "cause"), FAULTS)
def test_faulty_demands_are_refused_with_their_place(change: str, where: str, cause: Cause) -> None:
    """Before any link is reduced."""
    with pytest.raises(Exception, match=r".*") as caught:
        erls.load_scene(PLANAR, [change])
    assert getattr(caught.value, "cause", None) == cause, caught.value
    assert caught.value.where.startswith(f"{PLANAR}: {where}")  # type: ignore[attr-defined]
