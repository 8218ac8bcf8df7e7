"""Scenes of bodies that tests vary."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import scenes

# a cantilever of rubber, 2 m long
STRIP: dict[str, Any] = {
    "gravity": [0.0, 0.0, 0.0],
    "simulation": {"type": "statics"},
    "materials": {"rubber": {"youngs_modulus": 1e6, "poissons_ratio": 0.0, "density": 1000.0}},
    "sections": {"strip": {"shape": "rectangular", "width": 0.1, "height": 0.02}},
    "nodes": {"root": [0.0, 0.0, 0.0], "tip": [2.0, 0.0, 0.0]},
    "beams": [{"name": "strip", "from": "root", "to": "tip", "elements": 8, "material": "rubber", "section": "strip"}],
    "connections": [{"name": "clamp", "type": "fixed", "node": "root"}],
    "loads": [{"node": "tip", "force": [0.0, 0.0, 1e-3]}],
}

# a pendulum: a body on a pin at the origin
PENDULUM: dict[str, Any] = {
    "simulation": {"type": "dynamics", "duration": 0.2, "step": 1e-3},
    "bodies": [{"name": "bob", "mass": 2.0, "inertia": [0.1, 0.2, 0.3], "position": [1.0, 0.0, 0.0]}],
    "connections": [{"name": "pin", "type": "revolute", "node": "bob", "position": [0, 0, 0], "axis": [0, 1, 0]}],
}


def body_scene(folder: Path, base: dict[str, Any], **changes: Any) -> Path:
    """``base`` with changes, in ``folder``/bodies.toml."""
    return scenes.write_toml(folder / "bodies.toml", scenes.merged(base, changes))
