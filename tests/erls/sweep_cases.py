"""Sweeps that tests share; importable by workers."""

from __future__ import annotations

from scenes import ROOT

from erls.run.record import Run

SCENE = ROOT / "data/l_shape/steel_tall.toml"
ANGLE, TOLERANCE = "joints.shoulder.initial.position_deg", "simulation.tolerance"
SHORT = ("simulation.duration=0.01",)
GRID = {ANGLE: (0.0, 10.0, 20.0), TOLERANCE: (1e-3, 1e-5)}
GET = ("tip.x@end", "max(tip.distance)", "shoulder.angle@0.005", "energy.total@end")


def height(run: Run) -> dict[str, float]:
    """A reduction of one's own."""
    return {"height": float(run.position("tip", run.end)[2])}
