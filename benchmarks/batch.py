"""What a batch costs: variants of the steel L in one process, and with as many workers as there are cores.

    python benchmarks/batch.py [VARIANTS] [REPEATS]

The two take turns, so that both meet the same load of the machine; 200 variants and 5 turns unless given. The first
turn with workers starts them; the others find them there. Prints wall time per variant, CPU time per variant of this
process, the ratio of wall times in each turn, and that of the shortest ones; at the end what the workers took. Another
process on the same cores takes from the ratio, not from the CPU time.
"""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

import erls
from erls.parallel.workers import IDLE
from erls.run.chain.run import ChainRun

SCENE = Path(__file__).parents[1] / "data/l_shape/steel_flat.toml"
SETTINGS = ["simulation.integrator=lobatto", "simulation.tolerance=1e-3", "simulation.duration=2.0"]


def timed(variants: list[list[str]], workers: int | None) -> tuple[float, float]:
    """Wall and CPU time of this process for all variants [s]."""
    wall, cpu = time.perf_counter(), time.process_time()
    runs = erls.simulate_many(SCENE, variants, workers=workers)
    assert all(isinstance(run, ChainRun) for run in runs)
    return time.perf_counter() - wall, time.process_time() - cpu


def main() -> None:
    """Print a row for each turn."""
    count, repeats = [*map(int, sys.argv[1:3]), *(200, 5)[len(sys.argv) - 1 :]][:2]
    variants = [[*SETTINGS, f"joints.0.initial.position_deg={90 * k / count}"] for k in range(count)]
    timed(variants[:2], 1)  # reduces and compiles
    alone, together = [], []
    print(f"{count} variants, {os.cpu_count()} cores; ms per variant: wall (CPU of this process)")
    for turn in range(repeats):
        alone.append(timed(variants, 1))
        together.append(timed(variants, None))
        one, all_ = ("{:.2f} ({:.2f})".format(*(1e3 * s / count for s in times[-1])) for times in (alone, together))
        ratio = alone[-1][0] / together[-1][0]
        print(f"alone {one:<14} with workers {all_:<14} ratio {ratio:.2f}", "" if turn else "(starts them)", flush=True)
    print(f"shortest against shortest: {min(alone)[0] / min(together)[0]:.2f}")
    IDLE.dismiss()
    took = os.times()
    print(f"CPU of the workers: {took.children_user + took.children_system:.2f} s for {repeats} turns")


if __name__ == "__main__":
    main()
