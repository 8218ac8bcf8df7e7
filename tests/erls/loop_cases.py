"""Closed chains at random states by the kernels: ``python loop_cases.py FOLDER OUTPUT.npz`` saves the results."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import chain_cases
import numpy as np
import scenes
from chain_cases import PD, QUINTIC, SINE, SPRING, TORQUE

from erls.equations.erls.formulation import Erls
from erls.equations.loops.closed_chain import ClosedChain
from erls.integrate.closed_loops import TiedCoordinates
from erls.integrate.constrained import ConstrainedOptions, ConstrainedSolution
from erls.integrate.lie_generalized_alpha import lie_generalized_alpha
from erls.mechanism.chain import Mechanism, poses

AXIS = [0.3, -0.5, 0.8]
MOVED = {"drive": {"type": "motion", "motion": SINE}}
RISING = {"drive": {"type": "motion", "motion": QUINTIC}}
# chain of `scenes.three_links`, or the first one with parallel axes; loops from the end of link c "to" the root of
# another link or the ground
CASES: dict[str, tuple[str, list[dict[str, Any]]]] = {
    "revolute": ("revolute", [{"type": "revolute"}]),
    "spring on a turn": ("parallel", [{"type": "revolute", "coordinate_deg": 200.0, **SPRING}]),
    "controlled turn": ("parallel", [{"type": "revolute", "drive": {**PD, "torque_limit": 5.0}}]),
    "driven turn": ("parallel", [{"type": "revolute", "coordinate": 0.25, **MOVED, **SPRING}]),
    "screw": ("revolute", [{"type": "screw", "pitch": 0.05, **SPRING}]),
    "driven screw": ("revolute", [{"type": "screw", "pitch": -0.08, "coordinate": 0.1, **RISING}]),
    "torque on a slide": ("revolute", [{"type": "prismatic", "drive": TORQUE, **SPRING}]),
    "driven slide": ("mixed", [{"type": "prismatic", "coordinate": 0.1, **RISING}]),
    "cylindrical": ("prescribed", [{"type": "cylindrical"}]),
    "spherical": ("mixed", [{"type": "spherical"}]),
    "fixed": ("revolute", [{"type": "fixed"}]),
    "line to another link": ("revolute", [{"type": "line", "to": "a"}]),
    "planar to another link": ("mixed", [{"type": "planar", "to": "a"}]),
    "two loops": ("revolute", [{"type": "spherical"}, {"type": "line", "link": "b", "node": "tip"}]),
}
WELL_CONDITIONED = ("spherical", "line to another link", "two loops")


def chain(folder: Path, name: str) -> ClosedChain:
    """The ERLS equations of a case, closed where it starts; files go to ``folder``."""
    return ClosedChain(Erls(mechanism(folder, name)))


def mechanism(folder: Path, name: str, source: dict[str, str] = scenes.ARM) -> Mechanism:
    """The mechanism of a case; ``source`` says where the model of its links comes from."""
    kind, loops = CASES[name]
    spatial = "revolute" if kind == "parallel" else kind
    data = scenes.read_toml(scenes.three_links(folder, spatial, source, payloads=[{"point": "end", "mass": 0.2}]))
    if kind == "parallel":
        for joint in data["joints"]:
            del joint["dh"]["alpha_deg"]
    open_chain = scenes.mechanism(scenes.write_toml(folder / "open.toml", data))
    frames = poses(open_chain, np.array([joint.position for joint in open_chain.joints]))

    def place(link: str, node: str) -> np.ndarray:
        k = "abc".index(link)
        at = open_chain.links[k].model.nodes[open_chain.links[k].model.node_names[node]]
        return np.asarray(frames[k][:3, :3] @ at + frames[k][:3, 3])

    data["loops"] = []
    for number, given in enumerate(loops):
        loop = {"name": f"loop {number}", "link": "c", "node": "tip", **given}
        here, to = place(loop["link"], loop["node"]), loop.pop("to", None)
        across = here - place(to, "root") if to else here
        if loop["type"] == "line":
            loop["axis"] = across.tolist() if to else AXIS
        elif loop["type"] == "planar":
            loop["axis"] = np.cross(across, AXIS).tolist()
        elif loop["type"] in ("prismatic", "screw", "cylindrical"):
            loop["axis"] = AXIS
        data["loops"].append({**loop, **({"to_link": to, "to_node": "root"} if to else {"position": here.tolist()})})
    return scenes.mechanism(scenes.write_toml(folder / "closed.toml", data))


def states(closed: ClosedChain, name: str) -> list[chain_cases.State]:
    """Random states near the start, loops open by some millimetres, seeded by the name of the case."""
    rng = np.random.default_rng(sum(map(ord, name)))
    result = []
    for t in (0.03, 0.35):
        y, v, a = rng.uniform(-1, 1, (3, closed.size))
        for modes in (values[len(closed.bare.free_joints) :] for values in (y, v)):
            modes *= 1e-2  # unit torsion turns a link by a thousand
        result.append(chain_cases.State(t, closed.start.y + 2e-3 * y, v, a))
    return result


def steps(
    closed: ClosedChain, y: np.ndarray, v: np.ndarray, duration: float, step: float, compiled: bool
) -> ConstrainedSolution:
    """Generalized-α by kernels or with dense factors."""
    options = ConstrainedOptions(step=step, compiled=compiled)
    return lie_generalized_alpha(TiedCoordinates(closed), (0.0, duration), y, v, options)


def all_results(folder: Path) -> dict[str, np.ndarray]:
    """Every function in every case at one state, by 'case/function', and some steps."""
    result = {}
    for name in CASES:
        closed = chain(folder, name)
        assert closed.compiled is not None
        at = states(closed, name)[1]
        for what, values in chain_cases.evaluate(closed.compiled, at).items():
            result[f"{name}/{what}"] = values
        if name in WELL_CONDITIONED:
            for what, values in zip(("place", "rate"), closed.compiled.closed(at.t, at.y, at.v), strict=True):
                result[f"{name}/closed {what}"] = values
    y, v = closed.initial_state()
    result["steps"] = steps(closed, y, v, 5e-3, 1e-3, True).y * closed.metres
    return result


if __name__ == "__main__":
    np.savez(sys.argv[2], **all_results(Path(sys.argv[1])))
