"""Floating frames at the inboard interface and along the mean axes: what is left between them, on the tall steel L.

Both span the same deformations: mean-axis shapes are the tangent ones less rigid-body motion. A displacement that is
linear in one frame is not in another that turns by φ against it, so that points differ by φ times the deflection, of
second order: 2.3e-5 m over 2 s. With second-order kinematics (`geometric_stiffening`, `foreshortening`) displacements
are right to second order in either frame; what is left, below 1e-6 m over the 2 s, are inertia forces of second order:
with them, too (`modal_inertia`), the frames differ by displacements of third order and by the mesh.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scenes

import erls

SECOND = "-modal_inertia"
MODAL = "all"


def _apart(folder: Path, stiffer: float, effects: str, duration: float, step: float) -> float:
    """Largest difference of a coordinate of the tip [m]."""
    source = scenes.ROOT / "data/l_shape"
    (folder / "links").mkdir(exist_ok=True)
    for name in ("l_shape.toml", "links/steel_tall.toml"):
        text = (source / name.replace("l_shape", "steel_tall")).read_text(encoding="utf-8")
        assert ("youngs_modulus = 2e11" in text) == ("links" in name)
        text = text.replace("youngs_modulus = 2e11", f"youngs_modulus = {2e11 * stiffer}")
        (folder / name).write_text(text, encoding="utf-8")
    changes = [f"simulation.duration={duration}", f"simulation.step={step}", f"simulation.effects={effects}"]
    changes += ["simulation.formulation=ffr"]
    t = np.linspace(0, duration, 41)
    tips = []
    for frame in ("tangent", "mean-axis"):
        scene = erls.load_scene(folder / "l_shape.toml", [*changes, f"simulation.body_frame={frame}"])
        tips.append(erls.simulate(scene).position("tip", t))
    return float(np.abs(tips[0] - tips[1]).max())


def test_frames_differ_in_second_order(tmp_path: Path) -> None:
    """Four times the modulus, a quarter of the deflection, a sixteenth of the distance, within 5 %; then below 1e-6 m.

    Second-order kinematics leave less than a twentieth of it.
    """
    soft, stiff = (_apart(tmp_path, stiffer, "linear", 0.2, 1e-3) for stiffer in (1.0, 4.0))
    assert soft / stiff == pytest.approx(16.0, rel=0.05)
    assert stiff < 1e-6
    assert _apart(tmp_path, 1.0, SECOND, 0.2, 1e-3) < soft / 20


def test_modal_inertia_is_what_frames_lack(tmp_path: Path) -> None:
    """Over 0.03 s: without it a sixteenth at a quarter of the deflection, within 15 %; with it a fiftieth of that."""
    soft, stiff = (_apart(tmp_path, e, SECOND, 0.03 / e**0.5, 4e-4 / e**0.5) for e in (1.0, 4.0))
    assert soft / stiff == pytest.approx(16.0, rel=0.15)
    assert _apart(tmp_path, 1.0, MODAL, 0.03, 4e-4) < soft / 50


def test_frames_agree_to_a_micrometre(tmp_path: Path) -> None:
    """Over 0.6 of the 2 s of the scene, with its step and second-order kinematics; linear ones stay within 3e-5 m."""
    assert _apart(tmp_path, 1.0, SECOND, 0.6, 5e-4) < 1e-6
    assert 1e-5 < _apart(tmp_path, 1.0, "linear", 0.5, 1e-3) < 3e-5
