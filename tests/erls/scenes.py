"""Link descriptions and scenes that tests vary, written to a folder."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

from erls.equations.erls.formulation import Erls
from erls.equations.erls.paper.dense_chain import DenseChain
from erls.mechanism.chain import Mechanism
from erls.scene.build import build_mechanism
from erls.scene.read import is_body_scene, load_scene

ROOT = Path(__file__).parents[2]
SHARED = ROOT.parent / "shared"

L_LINK: dict[str, Any] = {
    "materials": {"m": {"youngs_modulus": 2e11, "poissons_ratio": 0.33, "density": 7800.0}},
    "sections": {"s": {"shape": "rectangular", "width": 0.01, "height": 0.03}},
    "frame": {
        "theory": "timoshenko",
        "mass": "consistent",
        "nodes": {"root": [0.0, 0.0, 0.0], "elbow": [0.5, 0.0, 0.0], "tip": [0.5, 0.5, 0.0]},
        "members": [
            {"from": "root", "to": "elbow", "elements": 2, "material": "m", "section": "s"},
            {"from": "elbow", "to": "tip", "elements": 2, "material": "m", "section": "s"},
        ],
    },
    "interfaces": [{"name": "root", "node": "root"}, {"name": "tip", "node": "tip"}],
    "reduction": {"method": "craig-bampton"},
}

L_SCENE: dict[str, Any] = {
    "simulation": {"duration": 2.0, "step": 5e-4},
    "base": {"rotation_deg": [-90.0, 0.0, 0.0]},
    "joints": [{"name": "shoulder", "dh": {"convention": "standard", "alpha_deg": 90.0}}],
    "links": [{"name": "l", "model": "link.toml"}],
    "points": [
        {"name": "elbow", "link": "l", "node": "elbow"},
        {"name": "tip", "link": "l", "node": "tip"},
    ],
}


def toml(value: Any) -> str:
    """A TOML value, tables inline."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f'"{k}" = {toml(v)}' for k, v in value.items()) + " }"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(toml(v) for v in value) + "]"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)  # the same escapes
    return repr(float(value)) if isinstance(value, float) else repr(value)  # NumPy's floats too


def write_toml(path: Path, data: dict[str, Any]) -> Path:
    """Write a table as a TOML file."""
    path.write_text("".join(f"{key} = {toml(value)}\n" for key, value in data.items()), encoding="utf-8")
    tomllib.loads(path.read_text(encoding="utf-8"))
    return path


def merged(base: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    """A copy of nested tables with changes."""
    result = dict(base)
    for key, value in changes.items():
        old = result.get(key)
        result[key] = merged(old, value) if isinstance(old, dict) and isinstance(value, dict) else value
    return result


def l_link(folder: Path, elements: int = 2, **changes: Any) -> Path:
    """The L-shaped link (steel tall unless changed) with ``elements`` per leg, in ``folder``/link.toml."""
    data = merged(L_LINK, changes)
    members = [{**m, "elements": elements} for m in data["frame"]["members"]]
    return write_toml(folder / "link.toml", {**data, "frame": {**data["frame"], "members": members}})


def l_scene(folder: Path, **changes: Any) -> Path:
    """The L pendulum on ``folder``/link.toml."""
    return write_toml(folder / "scene.toml", merged(L_SCENE, changes))


def mechanism(path: Path) -> Mechanism:
    """The mechanism of a scene file, its links linear unless it names its effects."""
    scene = load_scene(path)
    return build_mechanism(scene if scene.record.simulation.effects != "all" else load_scene(path, [LINEAR])).mechanism


def erls(mechanism: Mechanism, gauge: str = "joint-angle") -> Any:
    """ERLS equations of a mechanism: by recursion in the joint-angle gauge, dense in the other."""
    return Erls(mechanism) if gauge == "joint-angle" else DenseChain(mechanism, gauge)


def equations(path: Path, gauge: str = "joint-angle") -> Any:
    """ERLS equations of a scene file."""
    return erls(mechanism(path), gauge)


LINEAR = "simulation.effects=linear"
"""Links as in the papers: for what is said of linear equations."""
ARM = {"model": "arm.toml"}
"""The link of `arm_link` as a link of a scene names it."""
ARM_LINK: dict[str, Any] = {
    "materials": {"m": {"youngs_modulus": 7e10, "poissons_ratio": 0.33, "density": 2700.0}},
    "sections": {"s": {"shape": "rectangular", "width": 0.01, "height": 0.02}},
    "frame": {
        "nodes": {"root": [0.0, 0.0, 0.0], "tip": [0.5, 0.05, 0.1]},
        "members": [{"from": "root", "to": "tip", "elements": 3, "material": "m", "section": "s"}],
    },
    "interfaces": [{"name": "root", "node": "root"}, {"name": "tip", "node": "tip"}],
    "reduction": {"fixed_interface_modes": 4, "elastic_modes": 7},
}


def arm_link(folder: Path, **changes: Any) -> Path:
    """A straight link out of every plane, in ``folder``/arm.toml."""
    return write_toml(folder / "arm.toml", merged(ARM_LINK, changes))


def three_links(folder: Path, kind: str = "revolute", source: dict[str, str] = ARM, **changes: Any) -> Path:
    """A spatial chain of three flexible links: ``revolute``, ``mixed`` (a prismatic joint, both conventions) or
    ``prescribed`` (the second joint driven); ``source`` says where the links' model comes from.
    """
    arm_link(folder)
    joints: list[dict[str, Any]] = [
        {"name": "j1", "dh": {"convention": "standard", "a": 0.5, "alpha_deg": 70.0, "d": 0.1}},
        {"name": "j2", "dh": {"convention": "standard", "a": 0.4, "alpha_deg": -30.0, "theta_deg": 10.0}},
        {"name": "j3", "dh": {"convention": "standard", "a": 0.3, "alpha_deg": 20.0}},
    ]
    if kind == "mixed":
        joints[1] = {"name": "j2", "type": "prismatic", "dh": {"convention": "modified", "a": 0.4, "alpha_deg": 50.0}}
        joints[2]["dh"]["convention"] = "modified"
    if kind == "prescribed":
        motion = {"shape": "sine", "amplitude": 0.5, "frequency_hz": 1.0, "phase_deg": 90.0}
        joints[1]["drive"] = {"type": "motion", "motion": motion}
    pose = {"position": [-0.4, 0.02, 0.03], "rotation_deg": [5.0, -10.0, 20.0]}
    links = [
        {"name": "a", **source, "mesh_pose": {"frame": "joint"}},
        {"name": "b", **source, "mesh_pose": pose},
        {"name": "c", **source, "mesh_pose": {"frame": "joint", "rotation_deg": [0.0, 15.0, 0.0]}},
    ]
    data = {
        "simulation": {"duration": 0.2, "step": 1e-3},
        "base": {"position": [0.1, 0.2, 0.3], "rotation_deg": [20.0, 30.0, -10.0]},
        "joints": joints,
        "links": links,
        "points": [{"name": "end", "link": "c", "node": "tip"}],
    }
    return write_toml(folder / "three.toml", merged(data, changes))


def read_toml(path: Path) -> dict[str, Any]:
    """The tables of a TOML file."""
    return tomllib.loads(path.read_text(encoding="utf-8"))


def shipped() -> list[Path]:
    """Scenes of ``data/`` that are chains of links."""
    found = ((p, tomllib.loads(p.read_text(encoding="utf-8"))) for p in sorted((ROOT / "data").rglob("*.toml")))
    return [p for p, data in found if "simulation" in data and not is_body_scene(data)]
