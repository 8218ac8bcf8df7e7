"""What derivatives of a run cost, in runs, the run included: against parameters and coordinates, with their counts.

``python benchmarks/sensitivities.py [SCENE]``; processor time, so that other work on the machine counts less. With
``--memory`` what the adjoint method takes beside a run of 1e5 steps.
"""

from __future__ import annotations

import resource
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import erls
from erls.sensitivity.equations import Equations
from erls.sensitivity.parameters import parameters_of
from erls.sensitivity.sensitivities import scheme_of
from erls.sensitivity.variants import differences

DATA = Path(__file__).parents[1] / "data"
MODES = (2, 6, 12)
CASES = ((1, "forward"), (4, "forward"), (40, "forward"), (40, "adjoint"))
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
OUTPUT: dict[str, Callable[[Any], Any]] = {"height": lambda run: run.position("end3", run.end)[2]}
HEADER = (
    "coordinates  knots  parameters  method   whole | run  tangents   packing   forces     rest"
    " | evaluations a knot: run, tangents, by parameters"
)


def spent(work: Callable[[], Any]) -> tuple[float, Any]:
    """Processor time of the second of two calls [s], and what it gives."""
    work()
    begun = time.process_time()
    found = work()
    return time.process_time() - begun, found


def costs(run: Any, run_s: float, count: int, method: Any) -> str:
    """A row of the table."""
    knots, n = run.solution.y.shape
    given = parameters_of(run.scene, KEYS[:count])
    whole_s, _ = spent(lambda: erls.sensitivities(run, OUTPUT, KEYS[:count], method))
    made_s, equations = spent(lambda: Equations(run, differences(run, given), scheme_of(run)))
    stretches = [(walk, *ends) for walk in equations.walks for ends in equations.stretches(walk)]
    tangents_s = forces_s = 0.0
    for walk, first, end in stretches:
        begun = time.process_time()
        stretch = equations.stretch(walk, first, end)
        between = time.process_time()
        equations.forces(stretch.knots)
        tangents_s, forces_s = tangents_s + between - begun, forces_s + time.process_time() - between
    rest_s = whole_s - tangents_s - forces_s - made_s
    terms = [one.terms for one in equations.derivatives if one is not None]
    each = sum(sum(term.apart != 0 for term in some) if some[0].weight else 1 for some in terms)  # 1: does not act
    each += any(term.apart == 0 for some in terms for term in some)
    passes = "a program" if equations.evaluation.taped else f"{4 * n}"
    parts = "".join(f"{part / run_s:9.2f}" for part in (tangents_s, made_s, forces_s, rest_s))
    own = run.solution.work.rhs_calls / knots
    return (
        f"{n:11d} {knots:6d} {len(given):11d}  {method:7s} {1 + whole_s / run_s:6.1f} | 1.0 {parts}"
        f" | {own:.1f}, {passes}, {each}"
    )


def memory() -> None:
    """Of the adjoint of 1e5 steps of an L with 18 coordinates."""
    settings = ["simulation.step=1e-5", "simulation.duration=1.0"]
    scene: Any = erls.load_scene(DATA / "l_shape" / "steel_tall.toml", settings)
    run: Any = erls.simulate(scene, verdict=False)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    own = sum(x.nbytes for x in (run.solution.t, run.solution.y, run.solution.v, run.solution.a))
    output = {"tip": lambda run: run.position("tip", run.end)[2]}
    begun = time.process_time()
    erls.sensitivities(run, output, ["gravity.2", "joints.0.damping"], "adjoint")
    spent_s = time.process_time() - begun
    after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    print(
        f"{len(run.solution.t)} knots, {run.solution.y.shape[1]} coordinates: the run {own / 1e6:.0f} MB, "
        f"the adjoint {(after - before) / 1e3:.0f} MB beside it, the process {after / 1e3:.0f} MB; {spent_s:.0f} s"
    )


def main(path: Path) -> None:
    """Print the table."""
    print(HEADER)
    for modes in MODES:
        overrides = ['payloads=[{point="end3", mass=0.1}]', *(f"links.{k}.elastic_modes={modes}" for k in range(3))]
        scene: Any = erls.load_scene(path, overrides)
        run_s, run = spent(lambda scene=scene: erls.simulate(scene, verdict=False))
        for count, method in CASES:
            print(costs(run, run_s, count, method), flush=True)


if __name__ == "__main__":
    if "--memory" in sys.argv:
        memory()
    else:
        main(Path(sys.argv[1]) if len(sys.argv) > 1 else DATA / "robot" / "three_link.toml")
