"""Random chains and trees: joints of all kinds, both Denavit-Hartenberg conventions."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from random_draws import Draws, rounded
from random_drives import Scale, random_acting
from random_links import GRAVITY, RandomLink, random_link
from random_sizes import Sizes

TYPES = {
    "revolute": 0.78,
    "prismatic": 0.06,
    "screw": 0.03,
    "cylindrical": 0.03,
    "universal": 0.03,
    "spherical": 0.025,
    "planar": 0.015,
    "floating": 0.015,
    "fixed": 0.015,
}
FREE = {
    "cylindrical": {"slide": False, "turn": True},
    "universal": {"x": True, "y": True},
    "planar": {"x": False, "y": False, "turn": True},
    "floating": {"x": False, "y": False, "z": False},
    "spherical": {},
}
"""Coordinates of joints that have several, along which something can act, and whether they turn."""
VECTORS = ("spherical", "floating")
DRIVES = {"free": 0.3, "torque": 0.18, "motion": 0.3, "pd": 0.22}
SCREW = 0.02  # advance per radian over the size of the mechanism


@dataclass(frozen=True)
class Built:
    """A mechanism: its links, the tables of its scene, and which links nothing stands on."""

    links: list[RandomLink]
    tables: dict[str, Any]


def random_links(seed: int, sizes: Sizes, planar: bool, tree: bool = False) -> list[RandomLink]:
    """The links of a scene, each with a stream of its own."""
    found: list[RandomLink] = []
    carried = 0.0
    for k in reversed(range(len(sizes.lengths))):  # each is sized for what it carries
        draws, length, material, sag = Draws(seed, f"link {k}"), sizes.lengths[k], sizes.materials[k], sizes.sags[k]
        found.insert(0, random_link(draws, f"l{k}", length, carried, material, sag, planar, tree))
        carried += (0.5 if planar else 1.0) * found[0].mass  # in a loop the other side carries its part
    return found


def random_chain(seed: int, kind: str, mechanism: str, sizes: Sizes) -> Built:
    """A chain or a tree."""
    draws, tree = Draws(seed, "joints"), mechanism == "tree"
    links = random_links(seed, sizes, planar=False, tree=tree)
    parents = [None if k == 0 else k - 1 for k in range(len(links))]
    mixed = tree or draws.chance(0.15)
    if tree:
        parents = [None if k == 0 or draws.chance(0.15) else draws.whole(0, k - 1) for k in range(len(links))]
    conventions = [draws.pick({"standard": 0.5, "modified": 0.5}) for _ in links]
    if not mixed:
        conventions = conventions[:1] * len(links)
    swings = kind in ("chaotic", "inverted")
    tables: dict[str, Any] = {"base": _base(draws, swings), "joints": [], "links": []}
    points, payloads = _points(draws, links, [p for p in parents if p is not None])
    load = sum(payload["mass"] for payload in payloads)
    for k, link in enumerate(links):
        own = Draws(seed, f"joint {k}")
        joint: dict[str, Any] = {"name": f"j{k}", "type": "revolute" if swings else own.pick(TYPES)}
        joint["dh"] = _row(own, link, conventions[k], links[k - 1] if k else None, mixed, swings)
        if mixed and k:
            bearing = parents[k]
            joint |= _branch(own, None if bearing is None else links[bearing], sizes.whole, tree)
        outer = [links[j] for j in range(k, len(links)) if k in _path(parents, j)]
        joint |= _acting(own, joint["type"], kind, _scale(outer, load, sizes), sizes, k)
        if own.chance(0.08):
            joint.setdefault("motor", {}).setdefault("mass", rounded(0.2 * link.mass * own.uniform(0.1, 1.0)))
            if joint["type"] in FREE or joint["type"] == "fixed":
                del joint["motor"]
        tables["joints"].append(joint)
        roll = own.uniform(-180.0, 180.0) if own.chance(0.3) and not any(link.tip[1:]) else 0.0
        tables["links"].append(link_table(link, [roll, 0.0, 0.0] if roll else link.aligned_deg))
    return Built(links, {**tables, "points": points, **({"payloads": payloads} if payloads else {})})


def link_table(link: RandomLink, turned_deg: list[float]) -> dict[str, Any]:
    """The table of a link in the scene."""
    pose: dict[str, Any] = {"frame": "joint"}
    if any(turned_deg):
        pose["rotation_deg"] = turned_deg
    model = {"model": f"{link.name}.toml"} if link.description else {}
    return {"name": link.name, **model, "mesh_pose": pose, **link.fields}


def _path(parents: list[int | None], k: int) -> list[int]:
    """Joints between the ground and a link, its own included."""
    found: list[int] = []
    at: int | None = k
    while at is not None:
        found.append(at)
        at = parents[at]
    return found


def _base(draws: Draws, swings: bool) -> dict[str, Any]:
    how = "level" if swings else draws.pick({"as it is": 1, "level": 1, "anyhow": 1})
    if how == "as it is":
        return {}
    return {"rotation_deg": [90.0, 0.0, 0.0] if how == "level" else draws.turn_deg()}


def _row(
    draws: Draws, link: RandomLink, convention: str, before: RandomLink | None, mixed: bool, parallel: bool
) -> dict[str, Any]:
    """A row that meets the interfaces of the links: the length of the own link, or (modified) of the one before."""
    kind = 0.0 if parallel else draws.pick({0.0: 0.45, 90.0: 0.2, -90.0: 0.1, 1.0: 0.25})
    twist = draws.uniform(-90.0, 90.0) if kind == 1.0 else kind
    carried = before is not None and not mixed
    length = link.length if convention == "standard" else before.length if before is not None and carried else 0.0
    row: dict[str, Any] = {"convention": convention, "a": rounded(length, 12)}
    if twist:
        row["alpha_deg"] = twist
    if not parallel and draws.chance(0.2):
        row["d"] = rounded(draws.uniform(0.0, 0.2) * link.length)
    if not parallel and draws.chance(0.2):
        row["theta_deg"] = draws.uniform(-90.0, 90.0)
    return row


def _branch(draws: Draws, parent: RandomLink | None, size: float, tree: bool) -> dict[str, Any]:
    turn = [draws.one_of((0.0, 0.0, 90.0, -90.0)), 0.0, draws.uniform(-60.0, 60.0)]
    if parent is None:
        place = [rounded(draws.uniform(-0.5, 0.5) * size) for _ in range(3)]
        return {"on": "ground", "branch": {"position": place, "rotation_deg": turn}}
    at = draws.pick({"tip": 0.7, "side": 0.3 * tree})
    place = list(parent.tip if at == "tip" else parent.side)
    return {"on": parent.name, "at": at, "branch": {"position": place, "rotation_deg": turn}}


def _scale(outer: list[RandomLink], payload: float, sizes: Sizes) -> Scale:
    mass, reach = payload + sum(link.mass for link in outer), sum(link.length for link in outer)
    return Scale(True, 1.0, sizes.time, 0.5 * mass * GRAVITY * reach, mass * reach**2 / 3)


def sliding(scale: Scale, sizes: Sizes) -> Scale:
    """The same of a slide."""
    mass = scale.inertia * 3 / max(sizes.whole, 1e-9) ** 2
    return Scale(False, 0.2 * sizes.whole, scale.time, mass * GRAVITY, mass)


def _acting(draws: Draws, joint: str, kind: str, scale: Scale, sizes: Sizes, k: int) -> dict[str, Any]:
    """What acts in a joint of any type."""
    if joint == "fixed":
        return {}
    weights = {"limited": {"limited": 1}, "chaotic": {"free": 1}, "inverted": {"free": 1}}.get(kind, DRIVES)
    start = math.radians(draws.uniform(-90.0, 90.0))
    if kind == "inverted":
        start = math.pi / 2 * (k == 0) + draws.signed(0.0, 1e-3)
    if kind == "chaotic":
        start = draws.uniform(-math.pi, math.pi)
    if joint in FREE:
        found: dict[str, Any] = {}
        for name, turns in FREE[joint].items():
            own = scale if turns else sliding(scale, sizes)
            held = joint != "floating" and not turns
            drive = draws.pick({"free": 0.7, "torque": 0.15, "pd": 0.15})
            found[name] = random_acting(draws, own, start if turns else 0.0, sizes.duration, drive, False, held)
        for name in ("turn_x", "turn_y", "turn_z") if joint in VECTORS else ():
            turn, rate = draws.uniform(-1.0, 1.0), draws.signed(0.0, 0.5 / scale.time)
            found[name] = {"initial": {"position": turn, "rate": rate}}
        return {"coordinates": found} if found else {}
    if joint == "prismatic":
        return random_acting(draws, sliding(scale, sizes), 0.0, sizes.duration, draws.pick(weights), True, held=True)
    found = random_acting(draws, scale, start, sizes.duration, draws.pick(weights), True)
    if joint == "screw":
        found["pitch"] = rounded(draws.signed(0.2, 1.0) * SCREW * sizes.whole)
    if kind in ("chaotic", "inverted"):
        found = {"initial": found["initial"]}
    if kind == "stick-slip":
        slow = rounded(draws.log_uniform(1e-3, 1e-2) * scale.size / scale.time)
        found["friction"] = {"force": rounded(draws.uniform(0.2, 0.8) * scale.load), "transition_rate": slow}
    if kind == "fast" and k == 0:
        rate = rounded(draws.signed(3.0, 8.0) / scale.time)
        motion = {"shape": "spin_up", "rate": rate, "duration": rounded(0.4 * sizes.duration)}
        found = {"drive": {"type": "motion", "motion": motion}}
    return found


Tables = list[dict[str, Any]]


def _points(draws: Draws, links: list[RandomLink], bearing: list[int]) -> tuple[Tables, Tables]:
    """Named points at all ends, sometimes one more; payloads on some ends."""
    points, payloads = [], []
    for k, link in enumerate(links):
        if k in bearing and draws.chance(0.8):
            continue
        points.append({"name": f"end {k}", "link": link.name, "node": "tip"})
        if draws.chance(0.35) and k not in bearing:
            mass = rounded(link.mass * draws.log_uniform(0.05, 1.0))
            payload: dict[str, Any] = {"point": f"end {k}", "mass": mass}
            if draws.chance(0.4):
                payload["offset"] = [rounded(0.1 * link.length * draws.uniform(-1.0, 1.0)) for _ in range(3)]
                payload["inertia"] = [rounded(mass * (0.05 * link.length) ** 2)] * 3
            payloads.append(payload)
    if draws.chance(0.3):
        points.append({"name": "middle", "link": links[0].name, "node": "side"})
    return points, payloads
