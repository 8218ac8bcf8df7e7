"""Flexible links: ratios of stiffness, many modes, soft links, equal frequencies, spin-up."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import scenes

from erls.errors import Cause
from erls.maths.so3 import Array
from hard_cases.case import Case, Truth, at, closed, fine, of_subject
from hard_cases.truths import ends_of_bars, falling_cantilever, swinging

_NODAL = "simulation.formulation=nodal"
_G = 9.81


def beam(length: float, modulus: float = 2e11, elements: int = 8, modes: int = 6, **more: Any) -> dict[str, Any]:
    """A straight steel bar of 1 cm × 1 cm along x, without shear, all modes of the reduction kept."""
    data = {
        "units": {"unusual": True},  # one is far stiffer than any material
        "materials": {"m": {"youngs_modulus": modulus, "poissons_ratio": 0.3, "density": 7800.0}},
        "sections": {"s": {"shape": "rectangular", "width": 0.01, "height": 0.01}},
        "frame": {
            "theory": "euler-bernoulli",
            "nodes": {"root": [0.0, 0.0, 0.0], "tip": [length, 0.0, 0.0]},
            "members": [{"from": "root", "to": "tip", "elements": elements, "material": "m", "section": "s"}],
        },
        "interfaces": [{"name": "root", "node": "root"}, {"name": "tip", "node": "tip"}],
        "reduction": {"method": "craig-bampton", "fixed_interface_modes": modes},
    }
    return scenes.merged(data, more)


def arms(
    lengths: tuple[float, ...], models: tuple[str, ...], degrees: tuple[float, ...], **more: Any
) -> dict[str, Any]:
    """Flexible links on each other, let go in the plane of x and z; joint angles in degrees."""
    data = {
        "gravity": [0.0, 0.0, -_G],
        "simulation": {"duration": 0.5},
        "base": {"rotation_deg": [90.0, 0.0, 0.0]},
        "joints": [
            {"name": f"j{k}", "dh": {"convention": "standard", "a": length}, "initial": {"position_deg": angle}}
            for k, (length, angle) in enumerate(zip(lengths, degrees, strict=True))
        ],
        "links": [
            {"name": f"b{k}", "model": f"{model}.toml", "mesh_pose": {"frame": "joint"}}
            for k, model in enumerate(models)
        ],
        "points": [{"name": f"tip{k}", "link": f"b{k}", "node": "tip"} for k in range(len(models))],
    }
    return scenes.merged(data, more)


def _as_rigid(length: float) -> Truth:
    """A bar that is as good as rigid: the elliptic function of a thin one, within its rotary inertia, 1e-4 of it."""
    width = 0.01
    inertia = length**2 / 3 + width**2 / 12
    swing = swinging(np.pi / 2, np.sqrt(_G * length / 2 / inertia))
    return closed(lambda t: ends_of_bars([length], (swing(t) - np.pi / 2)[None]), "elliptic function", 1e-9)


def _better(formulation: str, tolerance: float, times: int = 1, **links: dict[str, Any]) -> Any:
    """The case with a formulation, a tolerance, other links, and so many elements in place of each."""

    def better(case: Case) -> Case:
        changes = (f"simulation.formulation={formulation}", f"simulation.tolerance={tolerance:g}")
        return dataclasses.replace(case.changed(*changes), links={**case.links, **links})

    return better


def _cantilever(name: str, **more: Any) -> Case:
    """A clamped square bar that meets its weight at once, along its diagonal: equal frequencies both ways."""
    length, g = 1.0, 0.0981
    area, second = 1e-4, 1e-8 / 12
    tip = falling_cantilever(length, 2e11 * second, 7800 * area, 7800 * area * g)

    def places(t: Array) -> Array:
        each = -tip(t) / np.sqrt(2)
        return np.stack([np.full_like(t, length), each, each], axis=1)[:, None]

    scene = {
        "gravity": [0.0, -g / np.sqrt(2), -g / np.sqrt(2)],
        "simulation": {"duration": 0.5, "tolerance": 1e-6},
        "joints": [{"name": "clamp", "type": "fixed", "dh": {"convention": "standard"}}],
        "links": [{"name": "bar", "model": "bar.toml", "mesh_pose": {"frame": "joint"}}],
        "points": [{"name": "tip", "link": "bar", "node": "tip"}],
    }
    links = {"bar": beam(length, elements=16, modes=12, frame={"rotary_inertia": False})}
    # of second order in the deflection of 0.1 mm: 1e-8 m
    return Case(name, scene, closed(places, "sum over 24 modes of the beam", 1e-8), links=links, **more)


_FLAT = {"materials": {"m": {"youngs_modulus": 2e9}}, "sections": {"s": {"width": 0.03, "height": 0.01}}}
_SOFT = (-0.30558, 0.47490, -0.46490)
_SPIN_UP = scenes.ROOT / "data/spin_up/beam.toml"


def _spun(name: str, rate: float, **more: Any) -> Case:
    """The beam of Kane, Ryan and Banerjee, first bending frequency 3.8 rad/s, judged by beam elements."""
    changes = (f"joints.hub.drive.motion.rate={rate}", "simulation.duration=16.0", *more.pop("changes", ()))
    good = (_better("nodal", 1e-4), _better("nodal", 2e-5))
    return Case(name, _SPIN_UP, fine("beam elements, a fifth of the tolerance", *good), changes=changes, **more)


_LINEAR = {"nodal": "beam elements always stiffen"}
_BENT = ("simulation.effects=linear",)
CASES = of_subject(
    "flexible links",
    [
        Case(
            "bar of 5e6 times the stiffness of steel",
            arms((0.5,), ("bar",), (0.0,)),
            _as_rigid(0.5),
            links={"bar": beam(0.5, 1e18)},
            fast=("erls", "ffr"),
        ),
        Case(
            "links of stiffness 1e6 : 1 on each other",
            arms((0.4, 0.4), ("stiff", "soft"), (0.0, 0.0), simulation={"duration": 0.3}),
            fine("beam elements, tolerance / 30", _better("nodal", 1e-5), _better("nodal", 3e-6)),
            links={"stiff": beam(0.4, 1e15), "soft": beam(0.4, 1e9)},
        ),
        Case(
            "links of stiffness 1e9 : 1 on each other",
            arms((0.4, 0.4), ("stiff", "soft"), (0.0, 0.0), simulation={"duration": 0.3}),
            fine("beam elements, tolerance / 30", _better("nodal", 1e-5), _better("nodal", 3e-6)),
            links={"stiff": beam(0.4, 1e18), "soft": beam(0.4, 1e9)},
        ),
        Case(
            "a link of 400 modes",
            arms((0.5,), ("bar",), (0.0,), simulation={"duration": 0.2}),
            fine(
                "60 modes, tolerance / 100",
                _better("erls", 1e-5, bar=beam(0.5, elements=80, modes=54)),
                _better("erls", 1e-6, bar=beam(0.5, elements=80, modes=54)),
            ),
            links={"bar": beam(0.5, elements=80, modes=394)},
            not_here={"nodal": "has no modes"},
        ),
        _cantilever("equal frequencies: a square bar that meets its weight", fast=("erls", "ffr")),
        Case(
            "flat L of a hundredth of the stiffness, at 0.5 s",
            {**scenes.L_SCENE, "simulation": {"duration": 0.5}},
            at(0.5, "tip", _SOFT, 2e-4, "a figure for beams, ± 2e-4"),
            links={"link": scenes.merged(scenes.L_LINK, _FLAT)},
        ),
        _spun("spin-up below the first frequency", 3.0),
        _spun("spin-up at the first frequency", 3.8),
        _spun("spin-up above the first frequency", 6.0),
        _spun("spin-up below the first frequency, linear links", 3.0, changes=_BENT, not_here=_LINEAR),
        _spun(
            "spin-up above the first frequency, linear links",
            6.0,
            changes=_BENT,
            not_here=_LINEAR,
            ends={"all": Cause.RUNAWAY},
            told="geometric_stiffening",
        ),
    ],
)
