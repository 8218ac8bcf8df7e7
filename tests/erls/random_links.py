"""Random links of few beam elements, sized as an engineer would: by how far they bend under their own load."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

from random_draws import Draws, rounded

GRAVITY = 9.81  # m/s²; what mechanisms are sized for, with and without weight

MATERIALS: dict[str, tuple[float, float, float, float]] = {
    "steel": (2.1e11, 0.3, 7850.0, 12e-6),
    "titanium": (1.1e11, 0.33, 4430.0, 9e-6),
    "aluminium": (7e10, 0.33, 2700.0, 23e-6),
    "laminate": (4e10, 0.3, 1600.0, 2e-6),
    "wood": (1e10, 0.35, 600.0, 5e-6),
    "polyamide": (2.5e9, 0.39, 1150.0, 80e-6),
    "polyethylene": (8e8, 0.42, 950.0, 150e-6),
    "rubber": (1e7, 0.48, 1100.0, 200e-6),
}
"""Young's modulus [Pa], Poisson's ratio, density [kg/m³], expansion [1/K]."""
SOFTEST = {"polyethylene": 8.0, "rubber": 0.5, "polyamide": 20.0}
"""Lengths [m] beyond which a link of this material would not carry itself."""
THINNEST, THICKEST = 1 / 60, 1 / 5  # height of a section over the length of a link


@dataclass(frozen=True)
class RandomLink:
    """A link of a random scene.

    Attributes
    ----------
    name : str
    tip : (3,) floats
        Outboard interface from the inboard one, mesh frame [m].
    side : (3,) floats
        A further interface.
    mass : float
        [kg]
    bend : float
        How far the tip sags, held at the root, under the load that it was sized for [m]; 0 of a rigid link.
    material : str
        ``rigid`` of a rigid link.
    description : dict
        Tables of its description; empty of a rigid link.
    fields : dict
        What its table in the scene says beside name, model and pose.
    """

    name: str
    tip: tuple[float, float, float]
    side: tuple[float, float, float]
    mass: float
    bend: float
    material: str
    description: dict[str, Any] = field(default_factory=dict)
    fields: dict[str, Any] = field(default_factory=dict)

    @property
    def length(self) -> float:
        """Between the interfaces [m]."""
        return math.hypot(*self.tip)

    @property
    def aligned_deg(self) -> list[float]:
        """Rotation of the mesh frame that puts the tip on the x-axis: about x into the plane, then about z [deg]."""
        x, y, z = self.tip
        across = math.hypot(y, z)
        about_x = -math.degrees(math.atan2(z, y)) if across else 0.0
        return [rounded(about_x, 12), 0.0, rounded(-math.degrees(math.atan2(across, x)), 12)]


def random_link(
    draws: Draws, name: str, length: float, carried: float, material: str, sag: float, planar: bool, bears: bool
) -> RandomLink:
    """A link between interfaces ``length`` apart.

    Parameters
    ----------
    draws : Draws
    name : str
    length : float
        [m]
    carried : float
        Mass that its tip carries [kg].
    material : str
        A name of `MATERIALS`, or ``rigid``.
    sag : float
        Wanted sag of its tip over its length; sections stay between `THINNEST` and `THICKEST`.
    planar : bool
        Whether its own shape stays in the plane of x and y.
    bears : bool
        Whether joints may stand on its side, which is then an interface.
    """
    shape = draws.pick({"straight": 0.7, "bent": 0.17, "spatial": 0.08 * (not planar), "ring": 0.02})
    nodes = _nodes(draws, shape, length)
    tip, side = nodes["tip"], nodes["side"]
    if material == "rigid":
        return _rigid_link(draws, name, tip, side)
    modulus, ratio, density, expansion = MATERIALS[material]
    height = rounded(min(max(_height(length, carried, density, modulus, sag), THINNEST * length), THICKEST * length))
    section, area, second_moment = _section(draws, height)
    path = [nodes[n] for n in nodes if n != "far"]
    mass = density * area * math.fsum(math.dist(a, b) for a, b in pairwise(path))
    bend = GRAVITY * length**3 * (density * area * length / 8 + carried / 3) / (modulus * second_moment)
    members = [("root", "side"), ("side", "tip")]
    if shape == "ring":
        members += [("root", "far"), ("far", "tip")]
    elements = [draws.whole(1, 3) for _ in members]
    lumped = draws.chance(0.1)
    interfaces = ("root", "tip", "side") if bears else ("root", "tip")
    inner = sum(elements) - len(members) + len(nodes) - len(interfaces)  # nodes
    stuff = {"youngs_modulus": modulus, "poissons_ratio": ratio, "density": density, "thermal_expansion": expansion}
    description: dict[str, Any] = {
        "units": {"unusual": True},  # from 0.1 mm to 50 m: nothing slipped
        "materials": {material: stuff},
        "sections": {"section": section},
        "frame": {
            "theory": draws.pick({"timoshenko": 0.8, "euler-bernoulli": 0.2}),
            "mass": "lumped" if lumped else "consistent",
            "nodes": {key: list(at) for key, at in nodes.items()},
            "members": [
                {"from": a, "to": b, "elements": count, "material": material, "section": "section"}
                for (a, b), count in zip(members, elements, strict=True)
            ],
        },
        "interfaces": [{"name": n, "node": n} for n in interfaces],
        "reduction": _reduction(draws, (3 if lumped else 6) * inner),
    }
    if draws.chance(0.5):
        description["damping"] = _damping(draws, math.sqrt(GRAVITY / bend))
    if draws.chance(0.08):
        description["masses"] = [{"node": "tip", "mass": rounded(mass * draws.uniform(0.1, 1.0))}]
    fields: dict[str, Any] = {}
    if draws.chance(0.05):
        fields["temperature_change"] = draws.signed(5.0, 60.0)
        description["temperature_change"] = 0.0
    if draws.chance(0.04):
        fields["flexible"] = False
    return RandomLink(name, tip, side, rounded(mass), bend, material, description, fields)


def _height(length: float, carried: float, density: float, modulus: float, sag: float) -> float:
    """Of a square section whose tip sags by ``sag`` of the length: E h⁴/12 sag = g L² (ρ h² L/8 + m/3) [m]."""
    second, first, zeroth = modulus * sag / 12, GRAVITY * length**3 * density / 8, GRAVITY * length**2 * carried / 3
    return math.sqrt((first + math.sqrt(first**2 + 4 * second * zeroth)) / (2 * second))


def _nodes(draws: Draws, shape: str, length: float) -> dict[str, tuple[float, float, float]]:
    """Named nodes in the order of the load path; ``far`` is off it."""
    half = draws.uniform(0.35, 0.65) * length
    if shape == "straight":
        found = {"side": (half, 0.0, 0.0), "tip": (length, 0.0, 0.0)}
    elif shape == "ring":
        off = 0.1 * length
        found = {"side": (half, off, 0.0), "tip": (length, 0.0, 0.0), "far": (half, -off, 0.0)}
    else:
        turn = math.radians(draws.uniform(30.0, 90.0))
        rise = math.radians(draws.uniform(20.0, 60.0)) if shape == "spatial" else 0.0
        rest = (math.cos(turn), math.sin(turn) * math.cos(rise), math.sin(turn) * math.sin(rise))
        whole = math.hypot(half + half * rest[0], half * rest[1], half * rest[2])
        leg = half * length / whole  # so that the interfaces are as far apart as wanted
        found = {"side": (leg, 0.0, 0.0), "tip": (leg + leg * rest[0], leg * rest[1], leg * rest[2])}
    exact = {name: tuple(rounded(x, 9) for x in at) for name, at in found.items()}
    return {"root": (0.0, 0.0, 0.0), **exact}  # type: ignore[dict-item]


def _rigid_link(
    draws: Draws, name: str, tip: tuple[float, float, float], side: tuple[float, float, float]
) -> RandomLink:
    """A slender rigid body."""
    length = math.hypot(*tip)
    mass = rounded(draws.log_uniform(0.5, 20.0) * length**3)
    middle = [rounded(x * draws.uniform(0.4, 0.6), 9) for x in tip]
    across = mass * length**2 / 12
    inertia = [rounded(across * draws.uniform(0.5, 1.0)), rounded(across * draws.uniform(0.5, 1.0)), rounded(across)]
    points = {"root": [0.0, 0.0, 0.0], "tip": list(tip), "side": list(side)}
    body = {"mass": mass, "centre_of_mass": middle, "inertia": inertia, "points": points}
    return RandomLink(name, tip, side, mass, 0.0, "rigid", fields={"rigid": body})


def _section(draws: Draws, height: float) -> tuple[dict[str, Any], float, float]:
    """A section of about that height, its area [m²] and its smaller second moment [m⁴]."""
    shape = draws.pick({"square": 0.3, "rectangular": 0.35, "circular": 0.15, "tubular": 0.1, "rectangular-tube": 0.1})
    wide = rounded(height * draws.uniform(1.2, 3.0))
    wall = rounded(height * draws.uniform(0.1, 0.25))
    if shape == "square":
        return {"shape": "rectangular", "width": height, "height": height}, height**2, height**4 / 12
    if shape == "rectangular":
        flat = draws.chance(0.5)
        sides = {"width": wide, "height": height} if flat else {"width": height, "height": wide}
        return {"shape": shape, **sides}, wide * height, wide * height**3 / 12
    if shape == "circular":
        return {"shape": shape, "diameter": height}, math.pi * height**2 / 4, math.pi * height**4 / 64
    inner = height - 2 * wall
    if shape == "tubular":
        second = math.pi * (height**4 - inner**4) / 64
        return {"shape": shape, "outer_diameter": height, "thickness": wall}, math.pi * (height - wall) * wall, second
    area = wide * height - (wide - 2 * wall) * inner
    second = (wide * height**3 - (wide - 2 * wall) * inner**3) / 12
    return {"shape": shape, "width": wide, "height": height, "thickness": wall}, area, second


def _reduction(draws: Draws, most: int) -> dict[str, Any]:
    """Mostly all modes that matter, sometimes few; ``most`` with the interfaces held."""
    methods = {"craig-bampton": 0.8, "craig-chang": 0.08, "guyan": 0.05, "mode-displacement": 0.03, "none": 0.04}
    method = draws.pick(methods)
    found: dict[str, Any] = {"method": method}
    if method == "craig-bampton":
        found["fixed_interface_modes"] = min(draws.pick({1: 1, 2: 2, 3: 2, 4: 2, 6: 2}), most)
        if draws.chance(0.15):
            found["truncation"] = "clamped"
    if method in ("craig-chang", "mode-displacement"):
        found["free_modes"] = draws.whole(2, 8)
    if draws.chance(0.5):
        found["elastic_modes"] = draws.whole(1, 6 if method == "craig-bampton" else 4)
        if "free_modes" in found:
            found["elastic_modes"] = min(found["elastic_modes"], found["free_modes"])
    if found.get("elastic_modes", 0) == 0 and draws.chance(0.1):
        found["static_correction"] = method == "craig-bampton"
    return found


def _damping(draws: Draws, slowest: float) -> dict[str, Any]:
    """Modal damping; ``slowest``: about the lowest angular frequency [1/s]."""
    ratio = draws.log_uniform(1e-3, 0.1)
    if draws.chance(0.7):
        return {"ratio": ratio}
    return {"rayleigh": {"alpha": rounded(ratio * slowest), "beta": rounded(ratio / slowest)}}
