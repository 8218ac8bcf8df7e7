"""Static starts: columns short of and beyond their buckling loads, flutter, what stands on its head, sleeping tops."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
import scenes
import scipy.integrate

from erls.equations.stability import Stability
from erls.errors import Cause
from erls.maths.so3 import Array
from hard_cases.case import Case, Made, Measure, measured, of_subject
from hard_cases.flexible import beam
from hard_cases.pendulums import G, planar, thin
from hard_cases.tops import CRITICAL, SLEEPING, spinning

_GREENHILL, _EULER = 7.8373, np.pi**2 / 4  # E I / L²: weight, and load at the tip, at which a clamped column buckles
_LEAN = 1.0  # degrees
_BENDING = 2e11 * 1e-8 / 12  # N m², of a square bar of 1 cm
_BEAM = {"elements": 16, "modes": 8}


def _stability(made: Made) -> Stability:
    found = made.run.stability
    assert found is not None
    return found


def _left(exact: float) -> Callable[[Made], Measure]:
    return lambda made: Measure("stiffness left, off by", abs(_stability(made).stiffness_left - exact), 0.01)


def _root(exact: complex, most: float) -> Callable[[Made], Measure]:
    def measure(made: Made) -> Measure:
        root = _stability(made).root
        assert root is not None
        return Measure("root, off by", abs(root - exact) / abs(exact), most)

    return measure


def _growth(least: float, most: float) -> Callable[[Made], Measure]:
    """Real part of the rightmost root, over its size."""

    def measure(made: Made) -> Measure:
        root = _stability(made).root
        assert root is not None
        share = root.real / abs(root)
        return Measure("growth / size of the root", share, most if share >= least else -np.inf)

    return measure


def _column(name: str, weight: float = 0.0, load: float = 0.0, tilt_deg: float = 0.0, **more: Any) -> Case:
    """A clamped square bar of 1 m that stands, under shares of the weight, or load at the tip, at which it buckles."""
    mass = 7800.0 * 1e-4
    scene = {
        "gravity": [0.0, 0.0, -weight * _GREENHILL * _BENDING / mass],
        "simulation": {"duration": 0.01, "step": 1e-3},
        "base": {"rotation_deg": [0.0, -90.0 + tilt_deg, 0.0]},
        "initial": {"deformation": "static", **more.pop("initial", {})},
        "joints": [{"name": "clamp", "type": "fixed", "dh": {"convention": "standard"}}],
        "links": [{"name": "column", "model": "column.toml", "mesh_pose": {"frame": "joint"}}],
        "points": [{"name": "tip", "link": "column", "node": "tip"}],
    }
    if load:
        scene["loads"] = [{"point": "tip", "force": [0.0, 0.0, -load * _EULER * _BENDING]}]
    return Case(name, scene, links={"column": beam(1.0, **_BEAM)}, **more)


def _hanging_over(made: Made) -> Measure:
    """Where the elastica under its own weight has its tip: E I φ'' = -w (1 - s) sin φ of the angle from upright."""
    lean, weight = np.radians(_LEAN), 1.2 * _GREENHILL

    def slope(s: Array, x: Array) -> Array:
        return np.stack([x[1], -weight * (1 - s) * np.sin(x[0])])

    s = np.linspace(0.0, 1.0, 201)
    guess = np.stack([lean + 1.5 * s, 1.5 * (1 - s)])
    found = scipy.integrate.solve_bvp(slope, lambda a, b: np.array([a[0] - lean, b[1]]), s, guess, tol=1e-9)
    angle = found.sol(np.linspace(0.0, 1.0, 2001))[0]
    tip = np.trapezoid(np.sin(angle), dx=1 / 2000), np.trapezoid(np.cos(angle), dx=1 / 2000)
    place = made.run.position("tip", 0.0)
    return Measure("tip, off by / length", float(np.hypot(abs(place[0]) - tip[0], place[2] - tip[1])), 3e-3)


def _leaning(name: str, **more: Any) -> Case:
    """A column twenty times as long as thick, of as much E I, that leans by 1°."""
    case = _column(name, 1.2, tilt_deg=_LEAN, **more)
    thick = {"materials": {"m": {"youngs_modulus": 2e11 / 5**4, "density": 7800.0 / 5**2}}}
    thick["sections"] = {"s": {"width": 0.05, "height": 0.05}}
    return dataclasses.replace(case, links={"column": scenes.merged(case.links["column"], thick)})


def _beck(share: float, growth: Callable[[Made], Measure]) -> Case:
    changes = (f"loads.0.force=[{-2105.0 / 0.9 * share}, 0.0, 0.0]", "simulation.duration=0.02")
    finer = {"nodal": ("simulation.elements_per_member=20",)}
    path = scenes.ROOT / "data/beck/column.toml"
    truth = measured("roots that pair up at 20.05 E I / L²", growth)
    return Case(f"Beck's column at {share:g} of its load", path, truth, changes=changes, also=finer)


def _standing(degrees: float, exact: complex, **more: Any) -> dict[str, Any]:
    scene = planar([thin(0.5, 1.0)], [np.radians(degrees)], simulation={"duration": 0.5, "step": 1e-3})
    truth = measured("√(3 g / 2 L)", _root(exact, 1e-7))
    return {"scene": {**scene, "initial": {"deformation": "static"}}, "truth": truth, **more}


def _sleeping(share: float) -> Case:
    """Upright, at a share of 2 √(m g s J₁) / J₃; small leanings z = x + i y: J₁ z̈ - i J₃ Ω ż - m g s z = 0."""
    across, along, weight = 0.01 + 0.1**2, 0.005, G * 0.1
    spin = share * CRITICAL
    exact = float(np.roots([across, -1j * along * spin, -weight]).real.max())

    def growth(made: Made) -> Measure:
        root = _stability(made).root
        assert root is not None
        return Measure("growth, off by / spin", abs(root.real - exact) / spin, 1e-6)

    turning = "rotation vectors turn with the top: no root is given of such a start"
    scene = spinning((0.0, 0.0, spin), 0.2, gravity=(0.0, 0.0, -G), simulation={"step": 1e-3}, **SLEEPING)
    scene = {**scene, "initial": {"deformation": "static"}}
    name, truth = f"sleeping top at {share:g} of its critical spin", measured("roots of a sleeping top", growth)
    return Case(name, scene, truth, not_here={"erls": turning, "ffr": turning})


_RATE = float(np.sqrt(1.5 * G / 0.5))
_REFUSED = {"ends": {"all": Cause.UNSTABLE_START}, "told": "link 'column' buckles"}
CASES = of_subject(
    "static starts",
    [
        _column("column at 0.9 of Greenhill's weight", 0.9, truth=measured("1 - P / P_c", _left(0.1)), fast=("erls",)),
        _column("column at 1.01 of Greenhill's weight", 1.01, **_REFUSED, fast=("erls", "nodal")),
        _column("column at 0.9 of Euler's load", load=0.9, truth=measured("1 - P / P_c", _left(0.1))),
        _column("column at 1.01 of Euler's load", load=1.01, **_REFUSED),
        _column("column at 30 times Greenhill's weight, leaning by 1°", 30.0, tilt_deg=1.0, **_REFUSED, fast=("erls",)),
        _column(
            "column at 1.2 of Greenhill's weight, allowed to stand",
            1.2,
            initial={"allow_unstable": True},
            truth=measured("1 - P / P_c", _left(-0.2)),
        ),
        _leaning(
            "column at 1.2 of Greenhill's weight, leaning by 1°",
            truth=measured("elastica under its weight", _hanging_over),
            also={"nodal": ("simulation.elements_per_member=32",)},
            ends=dict.fromkeys(("erls", "ffr"), Cause.UNSTABLE_START),
        ),
        _beck(0.9, _growth(-1e-6, 1e-6)),
        _beck(1.1, _growth(0.05, 1.0)),
        Case("a bar on its head", **_standing(90.0, _RATE), told="disturbances grow", fast=("erls", "nodal")),
        Case("a bar that hangs", **_standing(-90.0, 1j * _RATE), fast=("erls",)),
        _sleeping(1.1),
        _sleeping(0.8),
    ],
)
