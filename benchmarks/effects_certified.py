"""Errors that `effects = "auto"` certifies, beside the actual ones against all effects.

    python benchmarks/effects_certified.py [random scenes, 24]

For shipped scenes and random chains of one to three links: what auto leaves out at the scene's tolerance, the error
that it certifies, the actual one against `all` at the same settings, and times of integration; then each effect in turn
left out of each chain and certified alike. The ratio actual / certified should stay below 3.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests/erls"))

from effect_scenes import random_chain  # noqa: E402

import erls  # noqa: E402
from erls.build import build_mechanism  # noqa: E402
from erls.effects import in_order  # noqa: E402
from erls.errors import SimulationError  # noqa: E402
from erls.run import Run  # noqa: E402
from erls.selection.certify import certify  # noqa: E402
from erls.selection.choice import candidates  # noqa: E402
from erls.selection.outputs import watched_nodes  # noqa: E402

SHIPPED = [
    "l_shape/steel_flat.toml",
    "l_shape/steel_tall.toml",
    "l_shape/aluminium.toml",
    "l_shape/torque.toml",
    "robot/two_link.toml",
    "four_bar/rigid.toml",
    "four_bar/flexible.toml",
    "slider_crank/flexible.toml",
]
FLOOR = 1e-8  # m: what the iterations of a run leave
TIMES = 501


def distance(run: Run, other: Run) -> float:
    """Largest distance of watched points."""
    from erls.selection.outputs import Outputs, largest_distance

    times = np.linspace(0.0, other.end, TIMES)
    sides = []
    for one in (run, other):
        outputs = Outputs(one.scene, one.formulation, watched_nodes(other.formulation.mechanism))
        sides.append([outputs.positions(state) for state in one.states(times)])
    return largest_distance(*sides)


def check(path: Path, changes: tuple[str, ...], each: bool = True) -> list[float]:
    """Ratios of actual to certified errors of one scene, printed."""
    scene = erls.load_scene(path, changes)
    mechanism = build_mechanism(scene).mechanism
    reference = erls.simulate(scene)
    scene = erls.load_scene(path, [*changes, "effects=auto"])
    run = erls.simulate(scene)
    certificate = run.certificate
    assert certificate is not None
    off = in_order(mechanism.effects - run.formulation.mechanism.effects)
    ratios = [ratio(distance(run, reference), certificate.error)]
    print(
        f"{path.name:22s} {scene.record.simulation.formulation:5s} auto without {len(off):2d}: certified "
        f"{certificate.error:.2e} of {certificate.tolerance:.1e} m, ratio {ratios[0]:5.2f}; "
        f"{reference.wall_s:.3f} s -> {run.wall_s:.3f} s, choosing and certifying {certificate.wall_s:.3f} s"
        + ("" if certificate.ok else "  BEYOND THE TOLERANCE"),
        flush=True,
    )
    found: list[str] = []
    for name in candidates(mechanism, scene.record.simulation.formulation) if each else ():
        try:
            less = erls.simulate(erls.load_scene(path, [*changes, f"effects=-{name}"]))
            certified = certify(less, mechanism).error
        except SimulationError as problem:
            found.append(f"{name}: {problem.cause}")
            continue
        actual = distance(less, reference)
        found.append(f"{name} {actual:.1e} {ratio(actual, certified):.2f}")
        if actual < 0.3:  # beyond, two motions have nothing in common any more
            ratios.append(ratio(actual, certified))
    if found:
        print("    " + ", ".join(found), flush=True)
    return ratios


def ratio(actual: float, certified: float) -> float:
    """Actual over certified error, both raised to what a run resolves."""
    return max(actual, FLOOR) / max(certified, FLOOR)


def main() -> None:
    """All scenes, then the worst ratio."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 24
    ratios: list[float] = []
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(count):
            formulation = "ffr" if seed % 8 == 3 else "erls"
            ratios += check(random_chain(Path(folder), seed), (f"simulation.formulation={formulation}",))
    for name in SHIPPED:
        ratios += check(ROOT / "data" / name, (), "l_shape" in name or "robot" in name)
        if "l_shape" in name:
            ratios += check(ROOT / "data" / name, ("simulation.formulation=ffr",), False)
    print(f"{len(ratios)} errors; actual / certified at most {max(ratios):.2f}, {sum(r > 3 for r in ratios)} above 3")


if __name__ == "__main__":
    main()
