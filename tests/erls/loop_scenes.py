"""Linkages with closed loops that tests vary, and closed forms of planar ones."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import scenes

from erls.equations.formulation import TreeFormulation
from erls.equations.loops.closed_chain import ClosedChain
from erls.equations.registry import TREES
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.run.chain.run import ChainRun
from erls.scene.chain import Simulation
from erls.simulation.simulate import simulate

LENGTHS, GROUND = (0.15, 0.45, 0.35), 0.5
MASSES = (0.3, 0.9, 0.7)
PARALLELOGRAM, PARALLELOGRAM_MASSES = (0.2, 0.5, 0.2), (0.3, 0.9, 0.3)
FORMULATIONS: dict[str, dict[str, Any]] = {
    "erls": {"formulation": "erls"},
    "minimum-norm": {"formulation": "erls", "gauge": "minimum-norm"},
    "ffr": {"formulation": "ffr"},
    "mean-axis": {"formulation": "ffr", "body_frame": "mean-axis"},
}


def steady(start_deg: float, rate_deg: float) -> dict[str, Any]:
    """A joint driven at a constant rate."""
    times = [-1.0, 0.0, 1.0, 2.0]
    values = [start_deg + rate_deg * t for t in times]
    motion = {"shape": "table", "times": times, "values_deg": values, "rates_deg": [rate_deg, rate_deg]}
    return {"type": "motion", "motion": motion}


def bar(length: float, mass: float) -> dict[str, Any]:
    """A rigid bar along x."""
    across = mass * length**2 / 12
    points = {"root": [0.0, 0.0, 0.0], "middle": [length / 2, 0.0, 0.0], "tip": [length, 0.0, 0.0]}
    inertia = [1e-5, across, across]
    return {"mass": mass, "centre_of_mass": [length / 2, 0.0, 0.0], "inertia": inertia, "points": points}


def joint(name: str, length: float, degrees: float | None = None, **more: Any) -> dict[str, Any]:
    """A revolute joint of a planar linkage."""
    start = {} if degrees is None else {"initial": {"position_deg": degrees}}
    return {"name": name, "dh": {"convention": "standard", "a": length}, **start, **more}


def four_bar(**changes: Any) -> dict[str, Any]:
    """A rigid four-bar in the plane of x and z; its crank starts at 60 deg."""
    names = ("crank", "coupler", "rocker")
    starts = zip(LENGTHS, (60.0, -40.0, -100.0), strict=True)
    joints = [joint(f"j{k}", length, angle) for k, (length, angle) in enumerate(starts)]
    links = [
        {"name": name, "rigid": bar(length, mass), "mesh_pose": {"frame": "joint"}}
        for name, length, mass in zip(names, LENGTHS, MASSES, strict=True)
    ]
    points = [{"name": f"{name} {node}", "link": name, "node": node} for name in names for node in ("middle", "tip")]
    loops = [{"name": "pivot", "link": "rocker", "node": "tip", "position": [GROUND, 0.0, 0.0]}]
    data = {
        "simulation": {"duration": 0.5, "step": 1e-3},
        "base": {"rotation_deg": [90.0, 0.0, 0.0]},
        "joints": joints,
        "links": links,
        "points": points,
        "loops": loops,
    }
    return scenes.merged(data, changes)


def parallelogram(**changes: Any) -> dict[str, Any]:
    """A rigid one, released at 60 deg; all links are in line twice in each turn."""
    names, starts = ("crank", "coupler", "rocker"), (60.0, -60.0, -120.0)
    data = four_bar()
    data["joints"] = [joint(f"j{k}", *pair) for k, pair in enumerate(zip(PARALLELOGRAM, starts, strict=True))]
    data["links"] = [
        {"name": name, "rigid": bar(length, mass), "mesh_pose": {"frame": "joint"}}
        for name, length, mass in zip(names, PARALLELOGRAM, PARALLELOGRAM_MASSES, strict=True)
    ]
    data["loops"] = [{"name": "closing", "link": "rocker", "node": "tip", "position": [PARALLELOGRAM[1], 0.0, 0.0]}]
    data["points"] = [{"name": "end", "link": "coupler", "node": "tip"}]
    return scenes.merged(data, changes)


def driven(data: dict[str, Any], drive: dict[str, Any]) -> dict[str, Any]:
    """The same with a drive on the first joint."""
    first = {k: v for k, v in data["joints"][0].items() if k != "initial"}
    return {**data, "joints": [{**first, "drive": drive}, *data["joints"][1:]]}


def rocker_first(rate_deg: float) -> dict[str, Any]:
    """The four-bar from its other end, driven from 80 deg on: crank and coupler come in line on both sides."""
    first, second, third = LENGTHS
    starts = zip((third, second, first), (80.0, -100.0, -40.0), strict=True)
    links = [
        {"name": name, "rigid": bar(length, 0.5), "mesh_pose": {"frame": "joint"}}
        for name, length in (("rocker", third), ("coupler", second), ("crank", first))
    ]
    data = {**four_bar(), "joints": [joint(f"j{k}", *pair) for k, pair in enumerate(starts)], "links": links}
    data["loops"] = [{"name": "pivot", "link": "crank", "node": "tip", "position": [GROUND, 0.0, 0.0]}]
    return driven({**data, "points": []}, steady(80.0, rate_deg))


def slider_crank(**changes: Any) -> dict[str, Any]:
    """A rigid slider-crank along x: a prismatic joint of the slider to the ground closes it."""
    data = four_bar()
    slider = {"mass": 0.5, "inertia": [1e-4, 1e-4, 1e-4], "points": {"tip": [0.0, 0.0, 0.0]}}
    data["joints"][1:] = [joint("j1", LENGTHS[1], -75.0), joint("j2", 0.0, 15.0)]
    data["links"][2] = {"name": "slider", "rigid": slider}
    data["points"] = [*data["points"][:4], {"name": "slider", "link": "slider", "node": "tip"}]
    guide = {"name": "guide", "type": "prismatic", "link": "slider", "node": "tip", "axis": [1.0, 0.0, 0.0]}
    data["loops"] = [{**guide, "position": [0.0, 0.0, 0.0]}]
    return scenes.merged(data, changes)


def run(folder: Path, data: dict[str, Any], name: str = "erls", **simulation: Any) -> ChainRun:
    """Simulate in one of `FORMULATIONS`, or another by name; adaptive integrators choose their steps unless told."""
    settings = {**data["simulation"], **FORMULATIONS.get(name, {"formulation": name}), **simulation}
    if simulation.get("integrator", "generalized_alpha") != "generalized_alpha" and "step" not in simulation:
        settings["step"] = 0.1
    return simulate(scenes.write_toml(folder / "loop.toml", {**data, "simulation": settings}), verdict=False)


def chain(folder: Path, data: dict[str, Any], name: str = "erls") -> ClosedChain:
    """Equations of motion in one of `FORMULATIONS`."""
    mechanism = scenes.mechanism(scenes.write_toml(folder / "loop.toml", data))
    return ClosedChain(tree(mechanism, name))


def tree(mechanism: Mechanism, name: str) -> TreeFormulation:
    """Equations of motion of a chain in one of `FORMULATIONS`."""
    settings = FORMULATIONS[name]
    return TREES[settings["formulation"]](mechanism, Simulation(duration=1.0, **settings))


def work(run: ChainRun, *joints: str) -> float:
    """∫ effort · rate dt over a run, by Gauss's rule with 24 points."""
    at, weights = np.polynomial.legendre.leggauss(24)
    t = run.end * (at + 1) / 2
    power = sum(run.joint_effort(name, t) * run.joint_rate(name, t) for name in joints)
    return float(weights @ power) * run.end / 2


def four_bar_angles(crank: Array) -> tuple[Array, Array]:
    """Absolute angles of coupler and rocker, from the crank outward: two circles meet on the upper side."""
    first, second, third = LENGTHS
    across = GROUND - first * np.exp(1j * crank)  # from the crank's pin to the ground pivot
    reach = np.abs(across)
    inner = np.arccos((reach**2 + second**2 - third**2) / (2 * reach * second))
    coupler = np.angle(across) + inner
    rocker = np.angle(across - second * np.exp(1j * coupler))
    return coupler, rocker
