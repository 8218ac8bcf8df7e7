"""Figures of inverse dynamics: what forward runs miss, order of the step, and cost over steps and modes.

``python benchmarks/inverse.py [figures] [cost] [shooting] [zeros] [nodal]``; processor time, so that other work on the
machine counts less.
"""

from __future__ import annotations

import sys
import time
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

import erls
from erls.tracking.confirm import confirmed

DATA = Path(__file__).parents[1] / "data"
ARM, PLANAR = (DATA / "inverse" / f"{name}.toml" for name in ("arm", "two_link_planar"))
ROBOT = DATA / "robot" / "two_link.toml"
FFR = "simulation.formulation=ffr"
CIRCLE = 'servo.0.path={shape="circle", centre=[0.5, 0.4, 0.0], from=[0.5, 0.5, 0.0], start=0.6, duration=0.8}'
SPATIAL = (
    'servo=[{point="end2", coordinates=["y", "z"], '
    'path={shape="line", from=[1.0, 0.0, 0.0], to=[0.8, 0.4, 0.2], start=0.3, duration=0.8}}]'
)
CASES: dict[str, tuple[Path, tuple[str, ...], tuple[str, ...]]] = {
    **{f"arm, erls, {h:g} ms": (ARM, (f"simulation.step={h / 1e3}",), ("erls",)) for h in (4, 2, 1)},
    **{f"arm, ffr, {h:g} ms": (ARM, (f"simulation.step={h / 1e3}", FFR), ("ffr",)) for h in (4, 2)},
    "arm on nodes": (ARM, ("simulation.step=0.004", "simulation.elements_per_member=16"), ("nodal",)),
    "planar robot, line": (PLANAR, (), ("erls", "nodal")),
    "planar robot, circle": (PLANAR, (CIRCLE,), ("erls", "nodal")),
    "spatial robot under weight": (ROBOT, (SPATIAL, "simulation.step=0.002"), ("erls",)),
}


def figures() -> None:
    """Print what forward runs miss."""
    print("case, forward run: tip error, of rigid feed-forward [mm]; peak efforts, of rigid links; ahead [s]; work [s]")
    for name, (path, changes, runs) in CASES.items():
        begun = time.process_time()
        found = erls.invert(erls.load_scene(path, changes))
        spent = time.process_time() - begun
        for formulation in runs:
            elastic = confirmed(found, found.efforts, found.start, formulation)
            rigid = confirmed(found, found.rigid_efforts, found.rigid_start, formulation)
            both = (found.efforts, found.rigid_efforts)
            peaks = "; ".join(", ".join(f"{np.abs(x).max():.4g}" for x in each.values()) for each in both)
            errors = f"{1e3 * elastic.error:.5f}, {1e3 * rigid.error:.4f}"
            print(f"{name}, {formulation}: {errors}; {peaks}; {found.pre_actuation():.3f}; {spent:.1f}", flush=True)


SHOT: dict[str, tuple[str, ...]] = {
    "passive_arm": (),
    "arm": ("simulation.step=0.002",),
    "three_legs": ("simulation.step=0.004",),
}


def shooting() -> None:
    """Print by how much efforts of multiple shooting differ from those of collocation, in the same steps."""
    for name, changes in SHOT.items():
        scene = erls.load_scene(DATA / "inverse" / f"{name}.toml", changes)
        begun, found = time.process_time(), dict[str, Any]()
        for method in ("collocation", "shooting"):
            found[method] = np.stack(list(erls.invert(scene, method=method).efforts.values()))
        apart, size = (float(np.abs(x).max()) for x in (found["shooting"] - found["collocation"], found["collocation"]))
        work = time.process_time() - begun
        what = f"{name}, {', '.join(changes)}"
        print(f"{what}: {apart:.1e} N m of {size:.4g}, {apart / size:.1e}; {work:.0f} s", flush=True)


def zeros() -> None:
    """Print the first zero of the parallel robot by each formulation, over elements of the nodal one."""
    legs = DATA / "inverse" / "three_legs.toml"
    inputs = [f"joint.motor_{k}.effort" for k in (1, 2, 3)]
    outputs = ["point.middle.x", "point.middle.y", "point.first.x"]
    nodal = [("simulation.formulation=nodal", f"simulation.elements_per_member={n}") for n in (2, 4, 8)]
    for changes in (("simulation.formulation=erls",), (FFR,), *nodal):
        model = erls.linearize(erls.load_scene(legs, changes), at=0.0, inputs=inputs, outputs=outputs)
        print(f"{', '.join(changes)}: {np.abs(model.zeros()).min() / (2 * np.pi):.3f} Hz", flush=True)


NODAL: dict[str, tuple[Path, tuple[str, ...]]] = {
    "arm": (ARM, ("simulation.step=0.008", "simulation.elements_per_member=8", "inverse.bandwidth=60.0")),
    "planar robot": (PLANAR, ("simulation.step=0.008", "simulation.elements_per_member=4", "inverse.bandwidth=60.0")),
    "parallel robot": (DATA / "inverse" / "three_legs.toml", ("simulation.step=0.004",)),
}


def nodal() -> None:
    """Print what nodal runs miss with drives found in modes and on nodes, and how far models are apart that both run
    with the former (`erls compare`): that is what inversions differ by.
    """
    from tempfile import TemporaryDirectory

    from erls.files.csv_table import write_columns
    from erls.studies.compare import compare
    from erls.tracking.files import columns

    for name, (path, changes) in NODAL.items():
        begun = time.process_time()
        modal, own = (erls.invert(erls.load_scene(path, (*changes, f"simulation.formulation={f}"))) for f in RUNS)
        work = time.process_time() - begun
        missed = [1e3 * confirmed(x, x.efforts, x.start, "nodal").error for x in (modal, own)]
        with TemporaryDirectory() as folder:
            table = Path(folder) / "drives.csv"
            write_columns(table, {title: x.tolist() for title, x in columns(modal).items()})
            numbers = {joint.name: k for k, joint in enumerate(modal.problem.mechanism.joints)}
            drives = [
                f'joints.{numbers[drive]}.drive={{type="torque", profiles=[{{shape="table", file="{table}", '
                f'column={k + 1}, interpolation="cubic"}}]}}'
                for k, drive in enumerate(modal.efforts)
            ]
            start = [f"joints.{numbers[joint]}.initial={{position={x!r}}}" for joint, x in modal.start.items()]
            fine = f"simulation.step={modal.problem.step / FINEST!r}"
            found = compare(path, RUNS, overrides=(*changes, *drives, *start, fine), workers=1).pairs[0]
        apart = 1e3 * max(found.points[point.name].largest for point in modal.problem.conditions.points)
        what = f"{name}: modes {missed[0]:.4f}, nodes {missed[1]:.4f}, models apart {apart:.4f} mm"
        print(f"{what} (as expected: {found.as_expected}); {work:.0f} s", flush=True)


RUNS = ("erls", "nodal")
FINEST = 16
"""Steps of compared runs between two knots: four would leave 3 to 8 µm in those of the parallel robot, more than its
models are apart."""


def spent(*changes: str) -> tuple[float, int]:
    """Processor time of an iteration [s], and coordinates; the second of two inversions."""
    for _ in range(2):
        begun = time.process_time()
        found: Any = erls.invert(erls.load_scene(PLANAR, ["inverse.bandwidth=20.0", *changes]))
        whole = time.process_time() - begun
    return whole / found.iterations, int(found.problem.flexible.tree.size)


def cost() -> None:
    """Print work over steps and over modes, and the powers by which it grows."""
    base = spent("simulation.step=0.004")[0]
    for step in (0.002, 0.001):
        ratio = spent(f"simulation.step={step}")[0] / base
        print(f"{0.004 / step:g} times the steps: {ratio:.2f} times the work of an iteration", flush=True)
    counts = [spent(f"links.0.elastic_modes={m}", f"links.1.elastic_modes={m}") for m in (3, 6, 12)]
    for (first, few), (second, more) in pairwise(counts):
        power = np.log(second / first) / np.log(more / few)
        print(f"{few} to {more} coordinates: {second / first:.2f} times the work, power {power:.2f}", flush=True)


if __name__ == "__main__":
    chosen = sys.argv[1:] or ["figures", "cost", "shooting", "zeros", "nodal"]
    for part in chosen:
        {"figures": figures, "cost": cost, "shooting": shooting, "zeros": zeros, "nodal": nodal}[part]()
