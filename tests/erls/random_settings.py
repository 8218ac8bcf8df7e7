"""Random settings of simulations: formulations, effects, integrators, tolerances, durations."""

from __future__ import annotations

import math
from typing import Any

from random_chains import FREE, Built
from random_draws import Draws, rounded
from random_links import GRAVITY
from random_sizes import Sizes

MOST_STEPS, MOST_PERIODS = 3000, 20
STIFF = ("radau", "lsoda")
DEFAULT_TOLERANCE = 1e-4  # m, where none is given
ANY = ("rk45", "dop853", "radau", "bdf", "lsoda")
SMALLER = (
    "coriolis",
    "centrifugal_load",
    "inertia_first_order",
    "inertia_second_order",
    "spin_softening",
    "geometric_stiffening",
    "foreshortening",
    "modal_inertia",
    "motor_inertia",
    "modal_damping",
)
"""Effects of which one is left out."""


def random_settings(draws: Draws, kind: str, built: Built, sizes: Sizes) -> dict[str, Any]:
    """The table ``simulation``."""
    types = {joint.get("type", "revolute") for joint in built.tables["joints"]}
    loops = "loops" in built.tables
    found: dict[str, Any] = {"duration": sizes.duration}
    found |= _formulation(draws, built, types, loops)
    effects = draws.pick({"all": 0.6, "auto": 0.15, "linear": 0.12, "but": 0.13})
    found["effects"] = f"-{draws.one_of(SMALLER)}" if effects == "but" else effects
    if found["formulation"] == "nodal" and effects != "all":
        found["effects"] = "all"
    tolerance = rounded(sizes.whole * draws.log_uniform(2e-5, 5e-4))
    if not 0.3 <= sizes.whole <= 10 or draws.chance(0.5):
        found["tolerance"] = min(max(tolerance, 1e-7), 2e-3)
    found |= _integrator(draws, built, sizes, found)
    independent = "coordinates" not in found and found["formulation"] != "nodal" and not loops
    flexible = any(link.description for link in built.links)
    whole = not any(link.get("substructures") for link in built.tables["links"])
    if independent and flexible and whole and types.isdisjoint({"spherical", "floating"}) and draws.chance(0.03):
        found["bandwidth"] = rounded(2.0 * _slowest(built))
    if draws.chance(0.05):
        found["output_step"] = rounded(found["duration"] / 250)
    if draws.chance(0.08):
        _event(draws, built, sizes)
    return found


def _slowest(built: Built) -> float:
    """About the lowest frequency of a link with what it carries [Hz]; 0 where all are rigid."""
    bends = [link.bend for link in built.links if link.bend]
    return math.sqrt(GRAVITY / max(bends)) / (2 * math.pi) if bends else 0.0


def _formulation(draws: Draws, built: Built, types: set[str], loops: bool) -> dict[str, Any]:
    name = draws.pick({"erls": 0.6, "ffr": 0.3, "nodal": 0.1})
    found: dict[str, Any] = {"formulation": name}
    special = draws.pick({"plain": 0.74, "first": 0.1, "second": 0.08, "third": 0.08})
    if name == "erls" and special == "second" and types.isdisjoint({"spherical", "floating", "screw"}):
        found["gauge"] = "minimum-norm"
    if name == "ffr" and special == "first":
        found["body_frame"] = "mean-axis"
    if name == "ffr" and special == "second" and not loops and types.isdisjoint(FREE):
        found["coordinates"] = "absolute"
    if name == "ffr" and special == "third":
        for table, link in zip(built.tables["links"], built.links, strict=True):
            if link.description and len(link.description["frame"]["members"]) == 2:
                table["substructures"] = 2
    return found


def _integrator(draws: Draws, built: Built, sizes: Sizes, settings: dict[str, Any]) -> dict[str, Any]:
    """Integrator, step, and a duration that it can do."""
    slow = _slowest(built)
    tolerance = settings.get("tolerance", DEFAULT_TOLERANCE)
    swings = max((link.bend for link in built.links), default=0.0) > 3 * tolerance
    duration = min(sizes.duration, MOST_PERIODS / slow) if slow and swings else sizes.duration
    name = draws.pick({"": 0.5, "lobatto": 0.12, "auto": 0.06, "generalized_alpha": 0.24, "scipy": 0.08})
    if settings["formulation"] == "nodal":
        name = draws.pick({"auto": 0.1, "generalized_alpha": 0.9})
        duration = min(0.5 * duration, 20 / slow if slow else duration)
        settings["tolerance"] = rounded(max(tolerance, 1e-4 * sizes.whole))
    if settings.get("coordinates"):
        name = "generalized_alpha"
    found: dict[str, Any] = {"duration": rounded(duration)}
    if name == "scipy":
        rigid = not any(link.description for link in built.links)
        found["integrator"] = draws.one_of(ANY if rigid else STIFF)
        if not rigid:  # their steps follow the fastest mode, damped or not
            found["duration"] = rounded(min(0.05 * duration, 1 / slow))
            for link in built.links:
                if link.description:
                    link.description["reduction"]["elastic_modes"] = 1
                    link.description["reduction"].pop("static_correction", None)
        return {**found, "rtol": draws.one_of((1e-5, 1e-6, 1e-8 if rigid else 1e-6))}
    if name == "generalized_alpha":
        step = min(sizes.time / 100, 1 / (30 * slow) if slow else math.inf) * draws.one_of((0.5, 1.0, 2.0))
        found |= {"integrator": name, "step": rounded(step), "duration": rounded(min(duration, MOST_STEPS * step))}
        if draws.chance(0.4):
            found["spectral_radius"] = draws.one_of((0.5, 0.9, 1.0))
    elif name:
        found["integrator"] = name
    return found


def _event(draws: Draws, built: Built, sizes: Sizes) -> None:
    point = built.tables["points"][0]["name"]
    event = {"name": "crossing", "point": point, "coordinate": draws.one_of("xyz"), "stop": draws.chance(0.3)}
    built.tables["events"] = [{**event, "value": rounded(draws.uniform(-0.3, 0.3) * sizes.whole)}]
