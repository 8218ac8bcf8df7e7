"""Random chains of one to three flexible links, for what leaving out effects or vibrations does to them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import scenes

_Drives = Callable[[np.random.Generator, float], dict[str, Any]]


def random_led_chain(folder: Path, seed: int) -> Path:
    """A scene whose joints all follow prescribed motions, for longer."""
    return random_chain(folder, seed, _led, 3.0)


def random_chain(folder: Path, seed: int, drives: _Drives | None = None, longer: float = 1.0) -> Path:
    """A scene: stiff or soft, slow or fast, with drives of every kind, from a seed."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 4))
    joints, links = [], []
    duration = longer * float(rng.uniform(0.3, 0.8))
    for k in range(count):
        length, stiff = float(rng.uniform(0.3, 0.7)), float(10 ** rng.uniform(-1.9, -1.3))
        steel = bool(rng.integers(2))
        youngs_modulus, density = (2e11, 7800.0) if steel else (7e10, 2700.0)
        material = {"youngs_modulus": youngs_modulus, "poissons_ratio": 0.3, "density": density}
        bend = rng.uniform(-0.15, 0.15, 2)
        scenes.arm_link(
            folder,
            materials={"m": material},
            sections={"s": {"shape": "rectangular", "width": stiff, "height": stiff * float(rng.uniform(0.6, 1.6))}},
            frame={"nodes": {"root": [0.0, 0.0, 0.0], "tip": [length, *bend.tolist()]}},
            reduction={"fixed_interface_modes": 4, "elastic_modes": int(rng.integers(3, 9))},
        )
        (folder / "arm.toml").rename(folder / f"arm{k}.toml")
        dh = {"convention": "standard", "a": length, "alpha_deg": float(rng.uniform(-90, 90))}
        joints.append({"name": f"j{k}", "dh": dh, **(drives or _drive)(rng, duration)})
        links.append({"name": f"l{k}", "model": f"arm{k}.toml", "mesh_pose": {"frame": "joint"}})
        if rng.random() < 0.4:
            links[-1]["damping"] = {"ratio": float(rng.uniform(0.002, 0.05))}
    data: dict[str, Any] = {
        "simulation": {"duration": duration, "step": 5e-4, "effects_tolerance": float(10 ** rng.uniform(-4, -2.3))},
        "base": {"rotation_deg": rng.uniform(-90, 90, 3).tolist()},
        "joints": joints,
        "links": links,
        "points": [{"name": f"p{k}", "link": f"l{k}", "node": "tip"} for k in range(count)],
    }
    if rng.random() < 0.5:
        data["payloads"] = [{"point": f"p{count - 1}", "mass": float(rng.uniform(0.05, 0.5))}]
    if rng.random() < 0.3:
        data["initial"] = {"deformation": "static"}
    return scenes.write_toml(folder / f"{'led' if drives else 'chain'}{seed}.toml", data)


def _led(rng: np.random.Generator, duration: float) -> dict[str, Any]:
    end, start = float(rng.uniform(-120, 120)), float(rng.choice([0.0, 0.1 * duration]))
    lasting, degree = duration * float(rng.uniform(0.2, 0.9)), int(rng.choice([3, 5, 7]))
    motions: list[dict[str, Any]] = [
        {"shape": "polynomial", "from_deg": 0.0, "to_deg": end, "start": start, "duration": lasting, "degree": degree},
        {"shape": "spin_up", "rate_deg": end, "start": start, "duration": lasting, "degree": degree},
        {
            "shape": "waypoints",
            "times": [start, start + lasting / 2, start + lasting],
            "values_deg": [0.0, end, end / 3],
            "degree": degree,
        },
        {
            "shape": "table",
            "times": np.linspace(0.0, duration, 6).tolist(),
            "values": rng.uniform(-0.5, 0.5, 6).tolist(),
        },
        {"shape": "sine", "amplitude_deg": end / 20, "frequency_hz": float(10 ** rng.uniform(-0.5, 1.0))},
    ]
    return {"drive": {"type": "motion", "motion": motions[int(rng.integers(len(motions)))]}}


def _drive(rng: np.random.Generator, duration: float) -> dict[str, Any]:
    kind = rng.integers(5)
    end = float(rng.uniform(-120, 120))
    lasting = duration * float(rng.uniform(0.5, 1.2))
    motion = {"shape": "polynomial", "from_deg": 0.0, "to_deg": end, "duration": lasting}
    if kind == 0:
        return {"drive": {"type": "motion", "motion": motion}}
    if kind == 1:
        gains = {"proportional_gain": float(rng.uniform(20, 300)), "derivative_gain": float(rng.uniform(0.5, 5))}
        return {"drive": {"type": "pd", **gains, "motion": motion}, "motor": {"rotor_inertia": 2e-3}}
    if kind == 2:
        profile = {"shape": "step", "start": 0.02, "end": 0.4 * duration, "value": float(rng.uniform(-4, 4))}
        return {"drive": {"type": "torque", "profiles": [profile]}, "damping": float(rng.uniform(0, 0.2))}
    start = {"position_deg": float(rng.uniform(-60, 60)), "rate_deg": float(rng.uniform(-200, 200))}
    return {"initial": start, "motor": {"rotor_inertia": float(10 ** rng.uniform(-5, -2))}}
