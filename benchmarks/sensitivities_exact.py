"""How right derivatives of runs are: parameters of every kind on an L, a robot, a loop, and nodes, against other runs.

``python benchmarks/sensitivities_exact.py [SCENE ...]``, some of ``l robot loop nodal``; all by themselves. A row is a
parameter. Those of mechanisms are held against a complex step through the scheme (`tests/erls/complex_runs.py` and
`complex_nodal_runs.py`: no derivative of `erls.sensitivity` takes part): the largest difference over all knots of
coordinates and of rates, each per the largest of its kind. The adjoint method is compared directly, too: of a sum of
all coordinates (of nodes: of what a run keeps of their frames) at three knots, with weights drawn at random, per the
sum of the sizes of its terms.

Those of links, whose reductions take no complex numbers, are held against central differences of fourth order of runs
with the same steps, whose iterations end at rounding (`tests/erls/held_runs.py`), which is what limits these. The
derivative is that of the run itself with its iterations carried as far: where they end at the run's tolerance it is
the derivative at other states, off by as much of what is largest in them (3e-4 of a density that moves 50 nm). Square
links part their equal frequencies as one of their sides grows.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests/erls"))

import complex_nodal_runs  # noqa: E402
import complex_runs  # noqa: E402
from held_runs import collocated, tightened  # noqa: E402
from test_sensitivities import DRIVEN, OF_MECHANISM  # noqa: E402

import erls  # noqa: E402
from erls.equations import side_by_side  # noqa: E402
from erls.run.chain.run import ChainRun  # noqa: E402
from erls.sensitivity import forward, nodal_adjoint, nodal_forward  # noqa: E402
from erls.sensitivity.adjoint import gradients  # noqa: E402
from erls.sensitivity.parameters import Parameter, parameters_of  # noqa: E402
from erls.sensitivity.sensitivities import scheme_of  # noqa: E402
from erls.sensitivity.variants import Variant, differences  # noqa: E402

DATA = ROOT / "data"
LIMITS = (0.0, 1e-16, 1e-15, 1e-14, 1e-13)
"""Of iterations, in the unit of `Options.newton_tolerance`: below what rounding leaves, steps are halved."""
Outputs = dict[str, Callable[[ChainRun], Any]]


@dataclass(frozen=True)
class Case:
    """A scene, a point that is looked at, and parameters of its mechanism and of its links."""

    path: Path
    overrides: list[str]
    point: str
    of_mechanism: list[str]
    of_links: dict[str, float]

    @property
    def outputs(self) -> Outputs:
        """What is asked of a run by parameters of links."""
        return {"place": lambda run: run.position(self.point, [0.5 * run.end, run.end])}


L_OVERRIDES = [
    "simulation.step=1e-3",
    "simulation.duration=0.02",
    'payloads=[{point="tip", mass=0.2, inertia=[1.2e-4, 1.2e-4, 2e-4], offset=[0.0, 0.01, 0.02]}]',
    'loads=[{point="elbow", force=[0.0, 1.0, 2.0], factor=[{shape="step", start=0.008, value=1.0}]}]',
    "joints.0.initial={position_deg=-2.0, rate=0.5}",
    "joints.0.stiffness=3.0",
    "joints.0.rest_deg=5.0",
    "joints.0.damping=0.2",
    "joints.0.friction={force=0.3, transition_rate=0.3}",
    "joints.0.motor={rotor_inertia=1e-4, gear_ratio=30.0}",
]
L_KEYS = [
    *("gravity.2", "base.rotation_deg.0", "joints.0.dh.alpha_deg", "joints.0.stiffness", "joints.0.rest_deg"),
    *("joints.0.damping", "joints.0.friction.force", "joints.0.friction.transition_rate"),
    *("joints.0.motor.rotor_inertia", "joints.0.motor.gear_ratio"),
    *("joints.0.initial.position_deg", "joints.0.initial.rate"),
    *("payloads.0.mass", "payloads.0.offset.1", "payloads.0.inertia.2", "loads.0.force.2"),
]
L_LINKS = {
    "links.l.model.sections.leg.width": 0.01,
    "links.l.model.sections.leg.height": 0.01,
    "links.l.model.materials.steel.density": 7800.0,
    "links.l.model.frame.nodes.tip.1": 0.02,
}
ARMS = {
    "links.forearm.model.sections.bar.width": 0.01,
    "links.upper_arm.model.sections.bar.height": 0.01,
    "links.upper_arm.model.materials.aluminium.youngs_modulus": 7e10,
    "links.forearm.model.frame.nodes.tip.0": 0.02,
}
LOOP_OVERRIDES = [
    'simulation.integrator="lobatto"',
    "simulation.duration=0.02",
    "initial.deformation=zero",
    'payloads=[{point="coupler_middle", mass=0.05, offset=[0.0, 0.0, 0.01]}]',
    'loads=[{point="pin", force=[1.0, 0.0, 2.0], factor=[{shape="step", start=0.008, value=1.0}]}]',
    "joints.1.stiffness=0.5",
    "joints.1.rest_deg=5.0",
    "joints.1.damping=0.02",
    "joints.2.friction={force=0.1, transition_rate=0.3}",
    "joints.2.motor={rotor_inertia=1e-5, gear_ratio=10.0}",
]
LOOP_KEYS = [
    *("gravity.2", "base.rotation_deg.0", *(f"joints.{k}.dh.a" for k in range(3)), "joints.0.drive.motion.to_deg"),
    *("joints.0.drive.motion.from_deg", "joints.1.stiffness", "joints.1.rest_deg", "joints.1.damping"),
    *("joints.2.friction.force", "joints.2.friction.transition_rate"),
    *("joints.2.motor.rotor_inertia", "joints.2.motor.gear_ratio"),
    *("payloads.0.mass", "payloads.0.offset.2", "loads.0.force.2", "loops.0.position.0", "loops.0.position.2"),
]
LOOP_LINKS = {
    "links.coupler.model.sections.bar.width": 0.001,
    "links.rocker.model.materials.aluminium.density": 1300.0,
    "links.coupler.model.materials.aluminium.youngs_modulus": 3.5e10,
}
ROBOT = DATA / "robot" / "two_link.toml"
NODES = ['simulation.formulation="nodal"', "simulation.elements_per_member=2"]
CASES = {
    "l": Case(DATA / "l_shape" / "steel_tall.toml", L_OVERRIDES, "tip", L_KEYS, L_LINKS),
    "robot": Case(ROBOT, [*DRIVEN, "simulation.step=1e-3"], "end2", OF_MECHANISM, ARMS),
    "loop": Case(DATA / "four_bar" / "flexible.toml", LOOP_OVERRIDES, "coupler_middle", LOOP_KEYS, LOOP_LINKS),
    "nodal": Case(ROBOT, [*NODES, *DRIVEN, "simulation.step=1e-3"], "end2", OF_MECHANISM, ARMS),
}


def of_mechanism(case: Case, run: ChainRun) -> None:
    """Rows of parameters of the mechanism."""
    given = parameters_of(run.scene, case.of_mechanism)
    made, nodal = differences(run, given), NODES[0] in case.overrides
    if nodal:
        n = run.formulation.system.size  # type: ignore[attr-defined]
        found = nodal_forward.changes_of(run, made)[..., : 2 * n].reshape(len(run.solution.t), len(given), 2, n)
    else:
        found = forward.differentiated(run, made, scheme_of(run))[:, :2].transpose(0, 3, 1, 2)
    knots = np.linspace(len(run.solution.t) // 3, len(run.solution.t) - 1, 3).astype(int).tolist()
    length = run.solution.y.shape[1]
    weights = np.random.default_rng(0).normal(size=(3, length))
    if nodal:
        weights[:, 12 * run.formulation.system.count :] = 0.0  # type: ignore[attr-defined]
    seeds = {knot: np.stack([w, 0 * w, 0 * w])[..., None] for knot, w in zip(knots, weights, strict=True)}
    back = nodal_adjoint.gradients(run, made, seeds, 1) if nodal else gradients(run, made, scheme_of(run), seeds, 1)
    for k, parameter in enumerate(given):
        expected = _complex(run, parameter, nodal)
        scale = np.abs(expected).max(axis=(0, 2)) + 1e-300
        if nodal:  # nodes whose rates change by rounding alone
            scale[1] += scale[0] / run.end
        apart = np.abs(found[:, k] - expected).max(axis=(0, 2)) / scale
        terms = weights * np.array([_frames(run, x, expected[x, 0]) if nodal else expected[x, 0] for x in knots])
        adjoint = abs(back[k, 0] - terms.sum()) / (np.abs(terms).sum() + 1e-300)
        print(f"{parameter.key:58} {apart[0]:9.0e} {apart[1]:9.0e} {adjoint:9.0e}", flush=True)


def _frames(run: ChainRun, knot: int, change: np.ndarray) -> np.ndarray:
    """(N,) what small changes (n,) of nodes, in their axes, make of what a run keeps of a knot."""
    result, system = np.zeros(run.solution.y.shape[1]), run.formulation.system  # type: ignore[attr-defined]
    kept = run.solution.y[knot, : 12 * system.count].reshape(-1, 12)
    turned, moved = kept[:, 3:].reshape(-1, 3, 3), change.reshape(-1, 6)
    place = np.einsum("kij,kj->ki", turned, moved[:, :3])
    turn = np.cross(turned, moved[:, None, 3:])
    result[: 12 * system.count] = np.hstack([place, turn.reshape(-1, 9)]).ravel()
    return result


def _complex(run: ChainRun, parameter: Parameter, nodal: bool) -> np.ndarray:
    """(k, 2, n)"""
    step = 1e-3 * parameter.size
    if nodal:
        return complex_nodal_runs.differentiated(run, complex_nodal_runs.given(run, parameter, step))
    radius = None if scheme_of(run).count > 1 else run.scene.record.simulation.spectral_radius
    return complex_runs.differentiated(run, complex_runs.given(run, parameter, step), radius)[:, :2]


def of_links(case: Case, run: ChainRun) -> None:
    """Rows of parameters of links: those of a run whose iterations end at rounding, too."""
    keys, place = case.of_links, case.outputs
    made = differences(run, parameters_of(run.scene, keys))
    own, others = _others(run, [list(one.variants) for one in made])
    found = [erls.sensitivities(own, place, keys, method) for method in ("forward", "adjoint")]
    for one, runs in zip(made, others, strict=True):
        key, parts = one.parameter.key, zip(one.variants, runs, strict=True)
        expected = sum((variant.weight * np.asarray(place["place"](other)) for variant, other in parts), np.zeros(3))
        scale = np.abs(expected).max()
        apart = [np.abs(each.derivatives["place"][key] - expected).max() / scale for each in found]
        print(f"{key:58} {apart[0]:9.0e} {'':9} {apart[1]:9.0e}", flush=True)


def _others(run: ChainRun, variants: list[list[Variant]]) -> tuple[ChainRun, list[list[ChainRun]]]:
    """The run and those at other values, by the same steps."""
    if run.scene.record.simulation.integrator == "lobatto":
        own = collocated(run, Variant(0.0, 0.0, run.formulation))
        return own, [[collocated(own, variant) for variant in some] for some in variants]
    for limit in LIMITS:
        own = tightened(run, run.formulation, limit)
        found = [[tightened(own, variant.formulation, limit) for variant in some] for some in variants]
        if all(np.array_equal(other.solution.t, own.solution.t) for some in found for other in some):
            return own, found
    raise SystemExit("at no limit iterations of all runs end with the same steps")


def main(names: list[str]) -> None:
    """Print the tables."""
    side_by_side.WORTH = 0  # exact tangents, however short a run is
    for name in names:
        case, begun = CASES[name], time.process_time()
        scene: Any = erls.load_scene(case.path, case.overrides)
        run: Any = erls.simulate(scene, verdict=False)
        print(f"\n{name}: {len(run.solution.t)} knots, {run.solution.y.shape[1]} coordinates")
        print(f"{'of the mechanism, against complex steps':58} {'places':>9} {'rates':>9} {'adjoint':>9}")
        of_mechanism(case, run)
        print(f"{'of links, against differences of runs':58} {'forward':>9} {'':9} {'adjoint':>9}")
        of_links(case, run)
        print(f"{time.process_time() - begun:.0f} s of the processor")


if __name__ == "__main__":
    main(sys.argv[1:] or list(CASES))
