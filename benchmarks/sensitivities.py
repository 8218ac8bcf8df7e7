"""What derivatives of a run cost, in runs: against parameters and coordinates, with the count behind it.

``python benchmarks/sensitivities.py [SCENE]``; processor time, so that other work on the machine counts less.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import erls
from erls.sensitivity.equations import Equations
from erls.sensitivity.forward import differentiated
from erls.sensitivity.parameters import parameters_of
from erls.sensitivity.sensitivities import scheme_of
from erls.sensitivity.variants import differences

DATA = Path(__file__).parents[1] / "data"
MODES = (2, 6, 12)
COUNTS = (1, 4, 40)
KEYS = [
    *(f"gravity.{axis}" for axis in range(3)),
    "payloads.0.mass",
    *(f"payloads.0.offset.{axis}" for axis in range(3)),
    *(f"base.{field}.{axis}" for field in ("position", "rotation_deg") for axis in range(3)),
    *(f"joints.{k}.dh.{field}" for k in range(3) for field in ("a", "d")),
    *(f"joints.{k}.drive.motion.to_deg" for k in range(3)),
    *(f"joints.{k}.stiffness" for k in range(3)),
    *(f"joints.{k}.damping" for k in range(3)),
    *(f"joints.{k}.motor.{field}" for k in range(3) for field in ("mass", "rotor_inertia")),
    *(f"links.{k}.mesh_pose.{field}.{axis}" for k in range(3) for field in ("position",) for axis in range(2)),
]


def spent(work: Callable[[], Any]) -> tuple[float, Any]:
    """Processor time of the second of two calls [s], and what it gives."""
    work()
    begun = time.process_time()
    found = work()
    return time.process_time() - begun, found


def main(path: Path) -> None:
    """Print the table."""
    print("coordinates  knots  parameters  packing [runs]  derivatives [runs]  evaluations per knot: run, derivatives")
    for modes in MODES:
        overrides = ['payloads=[{point="end3", mass=0.1}]', *(f"links.{k}.elastic_modes={modes}" for k in range(3))]
        scene: Any = erls.load_scene(path, overrides)
        run_s, run = spent(lambda scene=scene: erls.simulate(scene, verdict=False))
        knots, n = run.solution.y.shape
        for count in COUNTS:
            given = parameters_of(run.scene, KEYS[:count])
            packing_s, found = spent(lambda given=given, run=run: differences(run, given))
            begun = time.process_time()
            differentiated(run, found, scheme_of(run))
            spent_s = time.process_time() - begun
            own = run.solution.work.rhs_calls / knots
            each = [one.variants for one in Equations(run, found, scheme_of(run)).differences if one is not None]
            told = f"{own:8.1f} {4 * n + sum(map(len, each)):8d}"
            print(f"{n:11d} {knots:6d} {len(given):11d} {packing_s / run_s:15.2f} {spent_s / run_s:19.1f} {told}")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else DATA / "robot" / "three_link.toml")
