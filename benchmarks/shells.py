"""Shells beside published figures, and a bracket beside solids and CalculiX.

    python benchmarks/shells.py [--scenes | --roll-up | --right-angle | --chain] [--json FILE]

The standard set on three meshes, quadrangles and triangles of links and geometrically exact shells (`exact`, of small
displacements), and the pre-twisted cantilever, thick and thin, with the drilling factors stated: ours / published.
Then the first six free frequencies of a folded bracket (0.2 and 0.15 m by 0.1 m, 5 mm of aluminium, a twentieth of the
width): shells of two meshes, hexahedra of 20 nodes about the same middle surface, CalculiX's S8R on the mesh of the
shells where `ccx` is there.

With `--scenes` instead the shipped scenes of large displacements, paths included (minutes); with `--roll-up` the three
numerical models of the slides for the strip rolled up by 360 degrees, and what else the tangents take there; with
`--right-angle` what iteration matrices take for the right-angle cantilever over 30 s; with `--chain` a strip on a hinge
as ERLS, FFR and nodal shells on three meshes.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "erls"))
sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "fe_import"))
import shell_meshes
from shell_benchmarks import PUBLISHED, TWISTED, twisted
from shell_brackets import calculix_bracket, shell_bracket, solid_bracket
from shell_meshes import ShellGrid
from test_shell_chains import arm, described, strip

import erls
from erls.equations.nodal.assembly import NodalSystem
from erls.equations.nodal.shell import Shell, Shells
from erls.equations.nodal.surfaces import corner_frames
from erls.errors import SimulationError
from erls.run.bodies.motion import BodyMotion
from erls.run.bodies.rest import BodyRest, work
from fe_import.elements.laminates import Laminate

DATA = Path(__file__).parents[1] / "data"
MESHES = {"standard": (8, 16, 32), "twisted": ((12, 2), (24, 4), (48, 8))}


def exact_stiffness(grid: ShellGrid, make: Laminate, drilling: float) -> sp.csc_array:
    """Of geometrically exact shells where they are built, row 6 * node + component."""
    poses = np.tile(np.eye(4), (len(grid.nodes), 1, 1))
    poses[:, :3, 3] = grid.nodes
    frames = corner_frames(grid.nodes, grid.elements, 25.0, "mesh")
    made = [
        Shell(tuple(map(int, cell)), frame, make.stiffness(), make.moments(), drilling)
        for cell, frame in zip(grid.elements, frames, strict=True)
    ]
    system = NodalSystem(poses, [Shells(made, poses)])
    rest = np.zeros(system.size)
    return sp.csc_array(system.stiffness_and_damping(0.0, system.start, rest, rest, None, material=True)[0])


def _last(run: BodyRest, point: str, axis: int) -> float:
    built = run.origin.poses[run.assembly.numbers[point], axis, 3]
    return abs(float(run.position(point, run.end)[axis] - built))


def _fold(run: BodyRest, first: float) -> float:
    """Moment of the whole width [N m]: work per rotation from a share of the load parameter on."""
    loads = run.loads(run.times)
    begin = int(np.flatnonzero(loads < first).max()) + 1
    samples = run.samples(run.times[begin:].tolist())
    moments = [sample["connections"]["turn"]["moment"][1] for sample in samples]
    return 2 * abs(float(np.trapezoid(moments, loads[begin:]) / (loads[-1] - loads[begin])))


_MOTION = [f"connections.0.motion.{key}" for key in ("values_deg=[-75,0,75,150]", "rates_deg=[75,75]")]
_EQUAL = [*_MOTION, "shells.0.mesh=meshes/tape_coarse.inp", "simulation.load_steps=60"]
SCENES: tuple[tuple[str, str, list[str], Callable[[BodyRest], float], float], ...] = (
    ("two bars, first limit", "statics/two_bars", [], lambda run: run.statics.turns[0].t, 0.370064700095),
    ("Lee's frame, first limit [kN]", "statics/lee_frame", [], lambda run: 30 * run.statics.turns[0].t, 18.55),
    ("hemisphere, pulled", "shells/hemisphere", [], lambda run: _last(run, "pulled", 0), 4.067),
    ("hemisphere, pushed", "shells/hemisphere", [], lambda run: _last(run, "pushed", 1), 8.178),
    ("annulus, inner", "shells/annulus", [], lambda run: _last(run, "inner", 2), 13.891),
    ("annulus, outer", "shells/annulus", [], lambda run: _last(run, "outer", 2), 17.528),
    ("tape spring, opposite sense", "shells/tape_spring", [], lambda run: _fold(run, 30 / 90), 0.0393),
    ("tape spring, equal sense", "shells/tape_spring", _EQUAL, lambda run: _fold(run, 95 / 150), 0.0211),
)
ROLL_UP = ((2, "full", 1), (2, "frozen", 2), (4, "frozen", 1), (4, "full", 1), (4, "material", 1))
"""The models of the slides, then ours: elements, tangent, load steps."""


def scenes() -> dict[str, Any]:
    """Shipped scenes beside what is published."""
    found: dict[str, Any] = {}
    print(f"{'scene':<32}{'ours':>12}{'published':>12}{'apart':>9}{'time [s]':>10}")
    for name, file, changes, quantity, published in SCENES:
        run = erls.simulate(erls.load_scene(DATA / f"{file}.toml", changes), verdict=False)
        assert isinstance(run, BodyRest)
        ours = quantity(run)
        found[name] = {"ours": ours, "published": published, "wall_s": run.wall_s}
        apart = f"{100 * (ours / published - 1):8.2f}%"
        print(f"{name:<32}{ours:12.6g}{published:12.6g}{apart}{run.wall_s:10.1f}", flush=True)
    return found


def roll_up() -> dict[str, Any]:
    """Iterations of the strip, how often load steps are halved, and how far its end is from its start."""
    found: dict[str, Any] = {}
    print(f"{'roll-up by 360 degrees':<44}{'iterations':>11}{'factored':>10}{'halved':>8}{'off [m]':>10}")
    for elements, tangent, steps in ROLL_UP:
        name = f"{elements} elements, {tangent} tangent, load steps: {steps}"
        changes = [f"shells.strip.elements=[{elements},1]", f"simulation.tangent={tangent}"]
        scene = erls.load_scene(DATA / "shells/roll_up.toml", [*changes, f"simulation.load_steps={steps}"])
        try:
            run = erls.simulate(scene, verdict=False)
        except SimulationError as problem:
            found[name] = str(problem)
            print(f"{name:<44}  {problem}", flush=True)
            continue
        assert isinstance(run, BodyRest)
        took, off = work(run.statics), float(np.abs(run.position("b", 1.0)).max())
        found[name] = {**took, "off_m": off}
        counts = f"{took['iterations']:11d}{took['factorizations']:10d}{took['cut_steps']:8d}"
        print(f"{name:<44}{counts}{off:10.1e}", flush=True)
    return found


def right_angle() -> dict[str, Any]:
    """Work of iteration matrices on three steps, over 30 s, on both groups."""
    found: dict[str, Any] = {}
    heads = f"{'iterations':>11}{'factored':>10}{'halved':>8}{'time [s]':>10}{'of update':>11}"
    print(f"{'right-angle cantilever':<28}{heads}")
    for group in ("SE(3)", "R3xSO(3)"):
        for step in (0.1, 0.05, 0.025):
            first = 0.0
            for matrix in ("update", "auto", "frozen"):
                name = f"{group}, {step:g} s, {matrix}"
                changes = [f"simulation.{k}={v}" for k, v in
                           {"group": group, "step": step, "iteration_matrix": matrix}.items()]  # fmt: skip
                try:
                    scene = erls.load_scene(DATA / "shells/right_angle.toml", changes)
                    runs = [erls.simulate(scene, verdict=False) for _ in range(3)]
                except SimulationError as problem:
                    found[name] = str(problem)
                    print(f"{name:<28}  {problem}", flush=True)
                    continue
                run = runs[-1]
                assert isinstance(run, BodyMotion)
                work, halved, wall = run.solution.work, run.solution.halved, min(r.wall_s for r in runs)
                first = first or wall
                own = work.newton_iterations / halved.given, work.factorizations / halved.given
                found[name] = {"iterations": own[0], "factored": own[1], "halved": halved.steps, "wall_s": wall}
                counts = f"{own[0]:11.2f}{own[1]:10.2f}{halved.steps:8d}"
                print(f"{name:<28}{counts}{wall:10.2f}{wall / first:11.2f}", flush=True)
    return found


def chain() -> dict[str, Any]:
    """Tips, over 0.1 s, of a strip of 600 by 60 by 3 mm that a hinge turns by 60 degrees in 0.2 s, under its weight."""
    found: dict[str, Any] = {}
    times = np.linspace(0.0, 0.1, 101)
    print(f"{'strip':<8}{'deflects [m]':>14}{'ERLS-FFR [m]':>14}{'ERLS-nodal [m]':>16}{'nodal, ms a step':>18}")
    for nx, ny in ((8, 2), (16, 4), (32, 8)):
        with tempfile.TemporaryDirectory() as folder:
            described(Path(folder), strip(nx, ny))
            link = [{"name": "strip", "model": "link.toml"}]
            rigid = erls.simulate(erls.load_scene(arm(Path(folder), "erls", links=[link[0] | {"flexible": False}])))
            runs = {name: erls.simulate(erls.load_scene(arm(Path(folder), name)), verdict=False)
                    for name in ("erls", "ffr", "nodal")}  # fmt: skip
        at = {name: run.position("tip", times) for name, run in runs.items()}
        bent = float(np.abs(at["erls"] - rigid.position("tip", times)).max())
        off = [float(np.abs(at["erls"] - at[other]).max()) for other in ("ffr", "nodal")]
        cost = 1e3 * runs["nodal"].wall_s / runs["nodal"].solution.work.steps
        found[f"{nx} x {ny}"] = {"deflection_m": bent, "ffr_m": off[0], "nodal_m": off[1], "ms_per_step": cost}
        print(f"{f'{nx} x {ny}':<8}{bent:14.4e}{off[0]:14.1e}{off[1]:16.1e}{cost:18.2f}", flush=True)
    return found


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path, help="write the figures to a file, too")
    kinds = parser.add_mutually_exclusive_group()
    kinds.add_argument("--scenes", action="store_true", help="shipped scenes of large displacements")
    kinds.add_argument("--roll-up", action="store_true", help="tangents of the strip rolled up by 360 degrees")
    kinds.add_argument("--right-angle", action="store_true", help="iteration matrices of the right-angle cantilever")
    kinds.add_argument("--chain", action="store_true", help="a link of shells as ERLS, FFR and nodal shells")
    asked = parser.parse_args()
    for name, table in (("scenes", scenes), ("roll_up", roll_up), ("right_angle", right_angle), ("chain", chain)):
        if getattr(asked, name):
            _write(asked.json, table())
            return
    shell_meshes.EXACT.append(exact_stiffness)
    found: dict[str, Any] = {}
    print(f"{'standard set':<34}" + "".join(f"{f'{n} x {n}':>10}" for n in MESHES["standard"]))
    for of, published in PUBLISHED.items():
        for kind in ("quad4", "tri3", "exact"):
            row = [of(n, kind) / published for n in MESHES["standard"]]
            found[f"{of.__name__} {kind}"] = row
            print(f"{of.__name__ + ' ' + kind + f' ({published:g})':<34}" + "".join(f"{x:10.4f}" for x in row))
    print(f"\n{'pre-twisted cantilever':<34}" + "".join(f"{f'{a} x {b}':>20}" for a, b in MESHES["twisted"]))
    for thickness, published in TWISTED.items():
        for kind, drilling in (("quad4", 0.01), ("quad4", 1.0), ("tri3", 0.01), ("exact", 1.0)):
            rows = [twisted(*mesh, thickness, kind, drilling) for mesh in MESHES["twisted"]]
            ratios = [[a / b for a, b in zip(row, published, strict=True)] for row in rows]
            name = f"{kind}, {thickness:g} thick, drilling {drilling:g}"
            found[f"twisted {name}"] = ratios
            print(f"{name:<34}" + "".join(f"{a:12.4f}{b:8.4f}" for a, b in ratios))
    with tempfile.TemporaryDirectory() as folder:
        shells = {f"shells, {turns}": shell_bracket(Path(folder), turns) for turns in (1, 2)}
        judges = {f"hex20, {turns}": solid_bracket(Path(folder), turns) for turns in (2, 3, 4)}
        if shutil.which("ccx"):
            judges["S8R of CalculiX"] = calculix_bracket(Path(folder), 2)
        else:
            print("\nCalculiX (ccx) is not installed: no S8R")
    print("\nfirst six free frequencies of the bracket [Hz]")
    for name, values in {**judges, **shells}.items():
        found[f"bracket {name}"] = values.tolist()
        print(f"{name:<22}" + "".join(f"{v:10.2f}" for v in values))
    for name in list(judges)[2:]:
        values = judges[name]
        off = np.abs(shells["shells, 2"] / values - 1).max()
        print(f"finer shells against {name}: {100 * off:.2f} % at most")
    _write(asked.json, found)


def _write(path: Path | None, found: dict[str, Any]) -> None:
    if path:
        path.write_text(json.dumps(found, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
