"""The fast slider-crank of data/slider_crank: distance from exact beams, and processor time, of what a rod can be.

Prints, for 1 to 8 pieces and with geometric stiffening: the largest distance of the rod's middle and of the slider from
the exact beams of fast_beams.toml over the whole motion, what the run itself estimates, and the time of one core. Then
how far the exact beams lie from the figures of tests/data/fast_slider_crank.csv.
"""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

import erls
from erls import simulate
from erls.maths.so3 import Array
from erls.run.watches.deflection_range import deflection_errors

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "data" / "slider_crank"
CASES = {
    f"{n} pieces" if n > 1 else "one body": (f"links.rod.substructures={n}", "simulation.effects=linear")
    for n in (1, 2, 4, 5, 8)
} | {"stiffened, ffr": (), "stiffened, erls": ("simulation.formulation=erls",)}


def off_chord(pin: Array, middle: Array, slider: Array) -> Array:
    """(k,) deflection of the middle off the line from pin to slider, left positive [m]."""
    chord = (slider - pin) / np.linalg.norm(slider - pin, axis=1)[:, None]
    away = middle - pin
    return np.asarray(chord[:, 0] * away[:, 2] - chord[:, 2] * away[:, 0])


def main() -> None:
    """Print the tables."""
    exact = simulate(FOLDER / "fast_beams.toml")
    t = np.linspace(0.0, exact.end, 1001)  # type: ignore[union-attr]
    truth = [exact.position(name, t) for name in ("middle", "end")]  # type: ignore[arg-type]
    print(f"{'':16} {'middle [m]':>11} {'slider [m]':>11} {'estimate':>9} {'time [s]':>9}")
    for name, overrides in CASES.items():
        scene = erls.load_scene(FOLDER / "fast.toml", overrides)
        begun = time.process_time()
        run = erls.simulate(scene)
        spent = time.process_time() - begun
        found = [run.position(point, np.minimum(t, run.end)) for point in ("middle", "slider")]
        off = [np.linalg.norm(a - b, axis=1).max() for a, b in zip(found, truth, strict=True)]
        known = deflection_errors(run).get("rod")
        estimate = "-" if known is None else f"{known.error:.1e}"
        print(f"{name:16} {off[0]:11.1e} {off[1]:11.1e} {estimate:>9} {spent:9.2f}")
    figures = np.loadtxt(ROOT / "tests" / "data" / "fast_slider_crank.csv", delimiter=",")
    at = np.minimum(figures[:, 0] * exact.end / 8, exact.end)  # type: ignore[union-attr]
    pin, middle, slider = (exact.position(name, at) for name in ("pin", "middle", "end"))  # type: ignore[arg-type]
    print("exact beams against the figures: slider", np.abs(slider[:, 0] - figures[:, 1]).max(), "m, deflection",
          np.abs(off_chord(pin, middle, slider) - figures[:, 2]).max(), "m")  # fmt: skip


if __name__ == "__main__":
    main()
