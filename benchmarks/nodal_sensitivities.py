"""What derivatives of a nodal run cost, in runs: against elements, parameters and how steps are chosen, part by part.

``python benchmarks/nodal_sensitivities.py [SCENE]``; processor time, so that other work on the machine counts less.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import erls
from erls.sensitivity.nodal_forward import differentiated
from erls.sensitivity.outputs import derivative_of
from erls.sensitivity.parameters import parameters_of
from erls.sensitivity.variants import differences

DATA = Path(__file__).parents[1] / "data"
KEYS = [f"links.{link}.model.sections.bar.{side}" for link in ("upper_arm", "forearm") for side in ("width", "height")]
FREE = ['joints.0.drive={type="free"}', 'joints.1.drive={type="free"}', 'simulation.formulation="nodal"']


def spent(work: Callable[[], Any]) -> tuple[float, Any]:
    """Processor time of the second of two calls [s], and what it gives."""
    work()
    begun = time.process_time()
    found = work()
    return time.process_time() - begun, found


def main(path: Path) -> None:
    """Print the table."""
    print("elements of a link  steps  chosen by  parameters  run [s]  variants, motion, outputs [runs]  in all")
    for elements in (4, 20):
        for chosen in ("simulation.step=1e-3", "simulation.tolerance=1e-4"):
            overrides = [*FREE, f"simulation.elements_per_member={elements}", chosen, "simulation.duration=0.5"]
            scene: Any = erls.load_scene(path, overrides)
            run_s, run = spent(lambda scene=scene: erls.simulate(scene, verdict=False))
            for count in (1, 4):
                given = parameters_of(run.scene, KEYS[:count])
                variants_s, found = spent(lambda given=given, run=run: _made(differences(run, given)))
                motion_s, motion = spent(lambda found=found, run=run: differentiated(run, found))
                rest = np.ones(run.solution.y.shape[1]), _ends(run)

                def outputs(run: Any = run, found: Any = found, motion: Any = motion, rest: Any = rest) -> None:
                    for k, one in enumerate(found):
                        derivative_of(_ends, "end", run, one, motion[..., k], *rest)

                outputs_s, _ = spent(outputs)
                parts = [x / run_s for x in (variants_s, motion_s, outputs_s)]
                print(
                    f"{elements:18} {len(run.solution.t):6}  {chosen[11:15]:9} {count:11} {run_s:8.3f}  "
                    + " ".join(f"{x:9.2f}" for x in parts)
                    + f" {1 + sum(parts):13.2f}"
                )


def _ends(run: Any) -> Any:
    return run.position("end2", np.linspace(0.0, 0.5, 50))


def _made(found: Any) -> Any:
    for one in found:
        assert len(one.variants)
    return found


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else DATA / "robot" / "two_link.toml")
