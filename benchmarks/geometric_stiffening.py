"""Distance of modal links from geometrically exact beams: linear, with stiffening, with foreshortening; and its price.

    python benchmarks/geometric_stiffening.py

Tip over the whole motion, steps of 0.25 ms (spin-up: 10 ms, lag and steady stretch against exact beams); CPU time.
"""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

import erls

ROOT = Path(__file__).parents[1]
EFFECTS = ("all", "all,geometric_stiffening", "all,geometric_stiffening,foreshortening")
CASES = (
    ("l_shape/steel_flat.toml", "tip", "l_shape_nonlinear_beam", "steel_flat", ("erls",)),
    ("l_shape/steel_tall.toml", "tip", "l_shape_nonlinear_beam", "steel_tall", ("erls",)),
    ("l_shape/aluminium.toml", "tip", "l_shape_nonlinear_beam", "aluminium", ("erls",)),
    ("robot/two_link.toml", "end2", "two_link_nonlinear_beam", "end2", ("erls", "ffr")),
)
LARGEST_LAG, STRETCH = -0.57384, 5.145e-4  # of the exact spin-up beam [m]


def table(name: str) -> dict[str, np.ndarray]:
    """Columns of a reference trajectory by name."""
    path = ROOT / f"tests/data/{name}.csv"
    columns = [line for line in path.read_text().splitlines() if line.startswith("#")][-1].lstrip("# ").split(",")
    return dict(zip(columns, np.loadtxt(path, delimiter=",").T, strict=True))


def main() -> None:
    """Print one line per run."""
    for scene, point, reference, prefix, formulations in CASES:
        exact = table(reference)
        places = np.stack([exact[f"{prefix}_{axis}"] for axis in "xyz"], axis=1)
        for formulation in formulations:
            for effects in EFFECTS:
                changes = [f"effects={effects}", "simulation.step=2.5e-4", f"simulation.formulation={formulation}"]
                begun = time.process_time()
                run = erls.simulate(erls.load_scene(ROOT / "data" / scene, changes))
                spent = time.process_time() - begun
                far = np.linalg.norm(run.position(point, exact["t"]) - places, axis=1).max()
                print(f"{scene:28}{formulation:6}{effects:46}{far:9.1e} m{spent:7.1f} s", flush=True)
    for formulation in ("erls", "ffr"):
        run = erls.simulate(erls.load_scene(ROOT / "data/spin_up/beam.toml", [f"simulation.formulation={formulation}"]))
        times = np.linspace(0.0, 20.0, 2001)
        x, y, _ = run.position("tip", times).T
        angle = run.joint_angle("hub", times)
        lag = (np.cos(angle) * y - np.sin(angle) * x).min() / LARGEST_LAG - 1
        stretch = (np.hypot(x[-1], y[-1]) - 10.0) / STRETCH - 1
        print(f"spin_up/beam.toml {formulation}: lag {100 * lag:+.2f} %, steady stretch {100 * stretch:+.2f} %")


if __name__ == "__main__":
    main()
