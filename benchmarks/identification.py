"""Identification over many seeded trials: do 95 % intervals cover 95 %, and are they as narrow as they can be?

    python benchmarks/identification.py [--trials 300] [--workers 2]

A pendulum with a spring, a damper and a payload whose hinge angle and tip carry white noise, seeds 0 and on. Prints for
each parameter how often its interval holds the truth, its mean half-width over the Cramér-Rao value (from differences
of tight runs at the truth), the mean deviation over its own uncertainty, and the time a fit takes.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
import scipy.stats

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "erls")]

TRUE = {"joints.hinge.damping": 0.05, "joints.hinge.stiffness": 3.0}
ROWS = 200


def trial(seed: int) -> list[tuple[float, float]]:
    """Values and half-widths."""
    from test_identify import AWAY, FIT, record, scene

    import erls

    with tempfile.TemporaryDirectory() as folder:
        path = scene(Path(folder))
        found = erls.identify(path, record(Path(folder), path, seed, ROWS), FIT, overrides=AWAY)
    return [(found.parameters[key].value, float(found.parameters[key].half_width or np.inf)) for key in TRUE]


def bound() -> list[float]:
    """Cramér-Rao standard deviations at the truth."""
    from test_identify import NOISE, scene

    import erls

    with tempfile.TemporaryDirectory() as folder:
        path, t = scene(Path(folder)), np.linspace(0.0, 2.0, ROWS)
        slopes = []
        for key, value in TRUE.items():
            ends = []
            for side in (-1, 1):
                changed = ["simulation.tolerance=1e-8", f"{key}={value * (1 + side * 1e-3)!r}"]
                run = erls.simulate(erls.load_chain(path, changed), verdict=False)
                angle, height = run.joint_angle("hinge", t), run.position("tip", t)[:, 2]
                ends.append(np.concatenate([angle / NOISE["hinge.angle"], height / NOISE["tip.z"]]))
            slopes.append((ends[1] - ends[0]) / (2e-3 * value))
        return np.sqrt(np.diag(np.linalg.inv(np.array(slopes) @ np.array(slopes).T))).tolist()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=300)
    parser.add_argument("--workers", type=int, default=2)
    asked = parser.parse_args()
    begun = time.perf_counter()
    with ProcessPoolExecutor(asked.workers) as pool:
        found = np.array(list(pool.map(trial, range(asked.trials), chunksize=4)))
    spent = (time.perf_counter() - begun) * asked.workers / asked.trials
    wide = float(scipy.stats.t.ppf(0.975, 2 * ROWS - len(TRUE)))
    print(f"{asked.trials} trials, {spent:.2g} s each")
    print(f"{'parameter':<26}{'coverage':>10}{'half-width / Cramér-Rao':>26}{'bias / deviation':>18}")
    for k, ((key, true), least) in enumerate(zip(TRUE.items(), bound(), strict=True)):
        values, widths = found[:, k, 0], found[:, k, 1]
        covered = float((np.abs(values - true) <= widths).mean())
        bias = float((values.mean() - true) / values.std())
        print(f"{key:<26}{covered:>10.3f}{widths.mean() / (wide * least):>26.3f}{bias:>18.3f}")


if __name__ == "__main__":
    main()
