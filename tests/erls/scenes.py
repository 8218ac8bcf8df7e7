"""Link descriptions and scenes that tests vary, written to a folder."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import tomllib

from erls.build import build_mechanism
from erls.formulations.erls import Erls
from erls.mechanism.chain import Mechanism
from erls.scene import load_scene

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
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    return repr(value)


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
    """The mechanism of a scene file."""
    return build_mechanism(load_scene(path)).mechanism


def equations(path: Path, gauge: str = "joint-angle") -> Erls:
    """ERLS equations of a scene file."""
    return Erls(mechanism(path), gauge)
