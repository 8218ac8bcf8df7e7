"""Seeded random scenes with their link descriptions, as users write them: the same on every machine.

| subject | distribution |
|---|---|
| kind | 86 % usual; soft (sags of 1 to 20 % of a length), chaotic (free, undamped), inverted (upright) ... |
| | ... stick-slip, limited (motors at their limits), fast (spun up): 2 to 3 % each |
| mechanism | 52 % chains, 20 % trees, 28 % loops: four-bars, slider-cranks, five-bars, hanging chains, two arms |
| links | 1 to 6, most often 2 or 3; loops 2 to 5; each rigid in 15 %, all of a scene in 12 % |
| size | whole mechanism: 70 % 0.1 to 3 m, 15 % 1 mm to 0.1 m, 15 % 3 to 50 m |
| material | steel, titanium, aluminium, laminate, wood, polyamide, polyethylene, rubber; of one kind in 70 % |
| sections | sized for a sag of 1e-5 to 1e-2 of the length under the own load; square, rectangular, round, tubes |
| shape | straight, bent, spatial, ring; 1 to 3 elements per member, 2 members (ring 4); in trees 3 interfaces |
| reduction | Craig-Bampton with 1 to 6 fixed-interface modes (80 %), the others; half keep 1 to 8 elastic modes |
| joints | revolute 78 %, the other eight kinds 1.5 to 6 % each |
| conventions | both; 15 % of chains mix them, as trees do |
| base | as it is, axes horizontal, or turned anyhow, a third each |
| drives | free, torque (all profiles), motion (all shapes), pd (with limit, feed-forward) |
| in joints | springs 15 %, dampers 40 %, friction 15 %, rotors 20 % |
| gravity | as it is 75 %, none 15 %, another 10 % |
| payload, motor mass, temperature, events, static start | 35 %, 8 %, 5 %, 8 %, 25 % |
| formulation | erls 60 % (minimum-norm 8 % of it), ffr 30 % (mean-axis, absolute, substructures), nodal 10 % |
| effects | all 60 %, auto 15 %, linear 12 %, all but one of the smaller ones 13 % |
| integrator | default 50 %, lobatto and auto 18 %, generalized-α 24 %, SciPy's 8 % |
| tolerance | default 1e-4 m in half of the middle sizes, otherwise 2e-5 to 5e-4 of the size |
| duration | 0.4 to 2 periods of a pendulum of that size, fewer where links swing fast: some 100 to 3000 steps |
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import scenes
from random_chains import random_chain
from random_draws import Draws
from random_links import RandomLink
from random_loops import random_closed
from random_settings import random_settings
from random_sizes import random_sizes

EXTREMES = {"soft": 0.03, "chaotic": 0.02, "inverted": 0.02, "stick-slip": 0.025, "limited": 0.02, "fast": 0.025}
KINDS = {"usual": 0.86, **EXTREMES}
MECHANISMS = {"chain": 0.52, "tree": 0.2, "loop": 0.28}


@dataclass(frozen=True)
class RandomScene:
    """A random scene.

    Attributes
    ----------
    seed : int
    tables : dict
        Of the scene.
    links : dict of dict
        Link descriptions by name of file.
    labels : dict of str
        Class by subject, for tables of results.
    """

    seed: int
    tables: dict[str, Any]
    links: dict[str, dict[str, Any]]
    labels: dict[str, str] = field(default_factory=dict)

    def write(self, folder: Path) -> Path:
        """Its files in a folder; the path of the scene's."""
        folder.mkdir(parents=True, exist_ok=True)
        for name, description in self.links.items():
            scenes.write_toml(folder / name, description)
        return scenes.write_toml(folder / "scene.toml", self.tables)

    def changed(self, simulation: dict[str, Any], **of_links: Any) -> RandomScene:
        """The same with other settings, None removes one; ``reduction`` and ``elements`` (a factor) of all links."""
        settings = {**self.tables["simulation"], **simulation}
        tables = {**self.tables, "simulation": {k: v for k, v in settings.items() if v is not None}}
        return RandomScene(self.seed, tables, {n: _link(d, **of_links) for n, d in self.links.items()}, self.labels)


def _link(description: dict[str, Any], reduction: dict[str, Any] | None = None, elements: int = 1) -> dict[str, Any]:
    frame = description["frame"]
    members = [{**member, "elements": elements * member["elements"]} for member in frame["members"]]
    found = {**description, "frame": {**frame, "members": members}}
    return found if reduction is None else {**found, "reduction": reduction}


def random_scene(seed: int) -> RandomScene:
    """The scene of a seed.

    Parameters
    ----------
    seed : int

    Returns
    -------
    RandomScene
    """
    draws = Draws(seed, "scene")
    kind, mechanism = draws.pick(KINDS), draws.pick(MECHANISMS)
    if kind in ("chaotic", "inverted"):
        mechanism = "chain"
    sizes = random_sizes(Draws(seed, "sizes"), kind, mechanism)
    built = random_closed(seed, kind, sizes) if mechanism == "loop" else random_chain(seed, kind, mechanism, sizes)
    links: list[RandomLink] = built.links
    tables: dict[str, Any] = {"name": f"random {seed}", **_surroundings(draws, built.tables)}
    simulation = random_settings(Draws(seed, "settings"), kind, built, sizes)
    if simulation["formulation"] == "nodal":  # it has no modes that could be damped
        for link in links:
            link.description.pop("damping", None)
    tables = {"simulation": simulation, **tables, **built.tables}
    files = {f"{link.name}.toml": link.description for link in links if link.description}
    softest = max(link.bend / link.length for link in links if link.length) if files else 0.0
    sags = {"1e-3 and more": 1e-3, "1e-4 to 1e-3": 1e-4, "below 1e-4": 0.0}
    effects = simulation["effects"]
    labels = {
        "kind": kind,
        "mechanism": sizes.linkage.kind if sizes.linkage is not None else mechanism,
        "links": str(len(links)),
        "formulation": _formulation(simulation),
        "integrator": simulation.get("integrator", "default"),
        "effects": "all but one" if effects.startswith("-") else effects,
        "sag": next(name for name, low in sags.items() if softest > low) if files else "rigid",
        "size": "small" if sizes.whole < 0.1 else "large" if sizes.whole > 3 else "middle",
        "friction": "yes" if "friction" in str(tables["joints"]) else "no",
        "limit": "yes" if "torque_limit" in str(tables["joints"]) else "no",
    }
    return RandomScene(seed, tables, files, labels)


def _surroundings(draws: Draws, built: dict[str, Any]) -> dict[str, Any]:
    """Gravity and the start of the links."""
    found: dict[str, Any] = {}
    weight = draws.pick({"earth": 0.75, "none": 0.15, "other": 0.1})
    floats = any(joint.get("type") == "floating" for joint in built["joints"])
    if weight == "none" or floats:
        found["gravity"] = [0.0, 0.0, 0.0]
    elif weight == "other":
        found["gravity"] = [draws.signed(0.0, 4.0), draws.signed(0.0, 4.0), draws.uniform(-10.0, -1.0)]
    if draws.chance(0.25):
        found["initial"] = {"deformation": "static"}
    return found


def _formulation(simulation: dict[str, Any]) -> str:
    for name in ("gauge", "body_frame", "coordinates"):
        if name in simulation:
            return f"{simulation['formulation']}, {simulation[name]}"
    return str(simulation["formulation"])
