"""Floating frames at the inboard interface and along the mean axes: what is left between them, on the tall steel L.

Both span the same deformations: mean-axis shapes are the tangent ones less rigid-body motion. A displacement that is
linear in one frame is not in another that turns by φ against it, so that points differ by φ times the deflection, of
second order: 2.3e-5 m over 2 s. With second-order kinematics (`geometric_stiffening`, `foreshortening`) the
displacement is right to second order in either frame, and what is left is of third order.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scenes

import erls

SECOND = '"all,geometric_stiffening,foreshortening"'


def _apart(folder: Path, stiffer: float, effects: str, duration: float) -> float:
    """Largest distance of the tips [m]; step 1 ms."""
    source = scenes.ROOT / "data/l_shape"
    (folder / "links").mkdir(exist_ok=True)
    for name in ("l_shape.toml", "links/steel_tall.toml"):
        text = (source / name.replace("l_shape", "steel_tall")).read_text(encoding="utf-8")
        assert ("youngs_modulus = 2e11" in text) == ("links" in name)
        text = text.replace("youngs_modulus = 2e11", f"youngs_modulus = {2e11 * stiffer}")
        (folder / name).write_text(text, encoding="utf-8")
    changes = [f"simulation.duration={duration}", "simulation.step=1e-3", f"simulation.effects={effects}"]
    changes += ["simulation.formulation=ffr"]
    t = np.linspace(0, duration, 41)
    tips = []
    for frame in ("tangent", "mean-axis"):
        scene = erls.load_scene(folder / "l_shape.toml", [*changes, f"simulation.body_frame={frame}"])
        tips.append(erls.simulate(scene).position("tip", t))
    return float(np.linalg.norm(tips[0] - tips[1], axis=1).max())


@pytest.mark.parametrize(("effects", "order"), [("all", 2.0), (SECOND, 3.0)])
def test_frames_differ_by_a_power_of_the_deflection(tmp_path: Path, effects: str, order: float) -> None:
    """Four times the modulus, a quarter of the deflection: 4² and 4³ times nearer, the power within 0.25."""
    soft, stiff = (_apart(tmp_path, stiffer, effects, 0.2) for stiffer in (1.0, 4.0))
    assert np.log(soft / stiff) / np.log(4.0) == pytest.approx(order, abs=0.25)


def test_frames_agree_to_a_micrometre(tmp_path: Path) -> None:
    """Over the 2 s of the scene, with second-order kinematics; the linear ones stay within 3e-5 m."""
    assert _apart(tmp_path, 1.0, SECOND, 2.0) < 1e-6
    assert 1e-5 < _apart(tmp_path, 1.0, "all", 0.5) < 3e-5
