"""Random mechanisms with closed loops, built from the places of their joints."""

from __future__ import annotations

from typing import Any

from random_chains import Built, link_table, random_links
from random_draws import Draws, rounded
from random_drives import Scale, random_acting
from random_links import GRAVITY, RandomLink
from random_loops_planar import Linkage, closing_fields, rotation
from random_sizes import Sizes


def random_closed(seed: int, kind: str, sizes: Sizes) -> Built:
    """A linkage of ``sizes``."""
    draws, linkage = Draws(seed, "joints"), sizes.linkage
    assert linkage is not None
    links = random_links(seed, sizes, planar=True)
    how = draws.pick({"as it is": 0.2, "level": 0.5, "anyhow": 0.3})
    base = [0.0, 0.0, 0.0] if how == "as it is" else [90.0, 0.0, 0.0] if how == "level" else draws.turn_deg()
    mass = sum(link.mass for link in links)
    reach = max(sizes.lengths)
    scale = Scale(True, 1.0, sizes.time, 0.5 * mass * GRAVITY * reach, mass * reach**2 / 3)
    convention = draws.pick({"standard": 0.5, "modified": 0.5})
    joints = _joints(draws, linkage, links, convention, kind, scale, sizes)
    tables: dict[str, Any] = {"base": {"rotation_deg": base}, "joints": joints}
    tables["links"] = [link_table(link, link.aligned_deg) for link in links]
    last = links[-1].name
    points = [{"name": f"end {k}", "link": link.name, "node": "tip"} for k, link in enumerate(links[:-1])]
    points.append({"name": "middle", "link": links[min(1, len(links) - 1)].name, "node": "side"})
    if linkage.welded:
        first = links[linkage.welded - 1].name
        closing = {"link": last, "node": "tip", "to_link": first, "to_node": "tip", "type": linkage.closing}
    else:
        more = closing_fields(draws, linkage, rotation(base), scale.inertia / scale.time)
        if linkage.kind == "slider-crank" and linkage.closing != "line":
            links, last = [*links, _slider(draws, links)], "slider"
            tables["links"].append({"name": last, **links[-1].fields})
        closing = {"link": last, "node": "pin" if last == "slider" else "tip", **more}
        if linkage.kind == "five-bar" and draws.chance(0.6):
            span = rounded(sizes.time * draws.uniform(1.0, 3.0))
            motion = {"shape": "polynomial", "from": 0.0, "to": draws.signed(0.05, 0.3), "duration": span}
            closing["drive"] = {"type": "motion", "motion": motion}
    tables["loops"] = [{"name": "closing", **closing}]
    tables["points"] = points
    if draws.chance(0.3):
        payload = {"point": "end 0", "mass": rounded(links[0].mass * draws.log_uniform(0.05, 1.0))}
        tables["payloads"] = [payload]
    return Built(links, tables)


def _joints(
    draws: Draws,
    linkage: Linkage,
    links: list[RandomLink],
    convention: str,
    kind: str,
    scale: Scale,
    sizes: Sizes,
) -> list[dict[str, Any]]:
    """Of a chain from ground to ground, or of two arms on it."""
    found, directions, places = [], linkage.directions, linkage.places
    before, lengths = 0.0, [link.length for link in links]
    arms = linkage.welded or len(links)
    order = [*range(arms), *range(len(links) - 1, arms - 1, -1)]  # the second arm comes in from its ground
    for number, k in enumerate(order):
        second = number >= arms
        direction = directions[k] + (_HALF if second else 0.0)
        base = number in (0, arms)
        start = direction - (0.0 if base else before)
        before = direction
        start = (start + _HALF) % (2 * _HALF) - _HALF
        along = lengths[number] if convention == "standard" else 0.0 if base else lengths[number - 1]
        joint: dict[str, Any] = {"name": f"j{number}", "dh": {"convention": convention, "a": rounded(along, 12)}}
        if base and number:
            joint |= {"on": "ground", "branch": {"position": [places[-1].real, places[-1].imag, 0.0]}}
        drive = linkage.drive if number == 0 else "free"
        room = scale.within(linkage.room / 1.5) if number == 0 else scale
        if kind == "limited" and number == 0:
            drive = "limited"
        joint |= random_acting(draws, room, start, sizes.duration, drive, False)
        if number:
            joint["initial"] = {"position": rounded(start, 12)}
            for name in ("stiffness", "rest", "motor"):  # springs of passive joints would fight each other
                joint.pop(name, None)
        if kind == "stick-slip":
            slow = rounded(draws.log_uniform(1e-3, 1e-2) / scale.time)
            joint["friction"] = {"force": rounded(draws.uniform(0.02, 0.2) * scale.load), "transition_rate": slow}
        found.append(joint)
    if linkage.kind == "slider-crank" and linkage.closing != "line":
        length = lengths[-1] if convention == "modified" else 0.0
        start = (-before + _HALF) % (2 * _HALF) - _HALF
        found.append({"name": "pin", "dh": {"convention": convention, "a": rounded(length, 12)}})
        found[-1]["initial"] = {"position": rounded(start, 12)}
    return found


_HALF = 3.141592653589793  # a half turn


def _slider(draws: Draws, links: list[RandomLink]) -> RandomLink:
    """A rigid body that a guide holds."""
    mass = rounded(links[-1].mass * draws.log_uniform(0.2, 3.0))
    across = rounded(mass * (0.05 * links[-1].length) ** 2)
    body = {"mass": mass, "inertia": [across] * 3, "points": {"pin": [0.0, 0.0, 0.0]}}
    still = (0.0, 0.0, 0.0)
    return RandomLink("slider", still, still, mass, 0.0, "rigid", fields={"rigid": body})
