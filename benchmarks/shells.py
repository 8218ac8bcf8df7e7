"""Shells beside published figures, closed forms, beams, solids and CalculiX: ours, the other, the difference.

    python benchmarks/shells.py [--NAME ...] [--page] [--json FILE]

All tables (a quarter of an hour of one core, most of it the large displacements on fine meshes), or those that are
named. `--page` puts them into docs/shells.md as they come out, each as soon as it is there, `--json` their figures into
a file, so that parts add up:

- `--standard`, `--twisted`, `--thin`, `--large`, `--paths`, `--flight`: scenes of `data/shells/`, geometrically exact
  shells (`benchmarks/shell_figures.py`); `--patches`: constant strains on a distorted mesh, turns as rigid bodies;
- `--links`: the shells of links, quadrangles and triangles, on the standard set and the pre-twisted cantilever with the
  drilling factors stated: ours / published on three meshes;
- `--bracket`: the first six free frequencies of a folded bracket (0.2 and 0.15 m by 0.1 m, 5 mm of aluminium, a
  twentieth of the width): shells of two meshes, hexahedra of 20 nodes about the same middle surface, and where `ccx` is
  there, CalculiX's S8R on the mesh of the shells, whose deck we read, too;
- `--roll-up`: the three numerical models of the slides for the strip rolled up by 360 degrees, and what else the
  tangents take there; `--right-angle`: what iteration matrices take for the right-angle cantilever over 30 s;
- `--chain`: a strip on a hinge as ERLS, FFR and nodal shells on three meshes; `--arm-stress`: stress in the bracket of
  `data/shells/bracket_arm.toml`, as either has it.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import re
import shutil
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "erls"))
sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "fe_import"))
import shell_figures
from shell_benchmarks import PUBLISHED, TWISTED, twisted
from shell_brackets import calculix_bracket, deck_bracket, gmsh_brackets, shell_bracket, solid_bracket
from shell_figures import Figure
from test_shell_chains import arm, described, strip
from test_shells import curved, patch_errors

import erls
from erls.errors import SimulationError
from erls.files.output import replacing
from erls.run.bodies.motion import BodyMotion
from erls.run.bodies.rest import BodyRest, work
from erls.view.figures import figure_of

DATA = Path(__file__).parents[1] / "data"
PAGE = Path(__file__).parents[1] / "docs/shells.md"
MESHES = {"standard": (8, 16, 32), "twisted": ((12, 2), (24, 4), (48, 8))}


ROLL_UP = ((2, "full", 1), (2, "frozen", 2), (4, "frozen", 1), (4, "full", 1), (4, "material", 1))
"""The models of the slides, then ours: elements, tangent, load steps."""


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
            print(f"{name:<44}  {str(problem).split('; got')[0]}", flush=True)
            continue
        assert isinstance(run, BodyRest)
        took, off = work(run.statics), float(np.abs(run.position("b", 1.0)).max())
        found[name] = {**took, "off_m": off}
        counts = f"{took['iterations']:11d}{took['factorizations']:10d}{took['cut_steps']:8d}"
        print(f"{name:<44}{counts}{off:10.1e}", flush=True)
    return found


def right_angle() -> dict[str, Any]:
    """What iteration matrices take over 30 s, for a given step: iterations, factorizations, both as work, one of the
    latter for the six iterations that `erls.integrate.lie_generalized_alpha` takes it for, and time of the processor.
    """
    found: dict[str, Any] = {}
    heads = ("iterations", 11), ("factored", 10), ("halved", 8), ("work", 8), ("of update", 11), ("time [s]", 10)
    print(f"{'right-angle cantilever':<28}" + "".join(f"{x:>{n}}" for x, n in (*heads, heads[4])))
    for group in ("SE(3)", "R3xSO(3)"):
        for step in (0.2, 0.1, 0.05, 0.025, 0.01, 0.0025):
            first: tuple[float, float] | None = None
            for matrix in ("update", "auto", "frozen"):
                name = f"{group}, {step:g} s, {matrix}"
                changes = [f"simulation.{k}={v}" for k, v in
                           {"group": group, "step": step, "iteration_matrix": matrix}.items()]  # fmt: skip
                scene, times = erls.load_scene(DATA / "shells/right_angle.toml", changes), []
                try:
                    for _ in range(3):
                        began = time.process_time()
                        run = erls.simulate(scene, verdict=False)
                        times.append(time.process_time() - began)
                except SimulationError as problem:
                    found[name] = str(problem)
                    print(f"{name:<28}  {str(problem).split('; got')[0]}", flush=True)
                    continue
                assert isinstance(run, BodyMotion)
                work, halved = run.solution.work, run.solution.halved
                own = work.newton_iterations / halved.given, work.factorizations / halved.given
                spent = own[0] + 6 * own[1], min(times)
                first = first or spent
                found[name] = {"iterations": own[0], "factored": own[1], "halved": halved.steps, "time_s": spent[1]}
                counts = f"{own[0]:11.2f}{own[1]:10.2f}{halved.steps:8d}"
                shares = [f"{x:{width}.2f}{x / y:11.2f}" for x, y, width in zip(spent, first, (8, 10), strict=True)]
                print(f"{name:<28}{counts}{''.join(shares)}", flush=True)
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


def figures(rows: Callable[[], Iterator[Figure]]) -> Callable[[], dict[str, Any]]:
    """A table of rows that are made one by one."""

    def table() -> dict[str, Any]:
        print(str(rows.__doc__).strip().replace("\n    ", "\n"))
        print(f"{'':<58}{'ours':>14}{'other':>14}{'apart':>10}")
        found = {}
        for row in rows():
            found[row.name] = {"ours": row.ours, "other": row.other, "apart": row.apart}
            apart = f"{100 * row.apart:9.2f}%" if abs(row.apart) > 1e-4 else f"{row.apart:10.1e}"
            print(f"{row.name:<58}{row.ours:14.7g}{row.other:14.7g}{apart}", flush=True)
        return found

    return table


def patches() -> Iterator[Figure]:
    """Constant strains on a distorted mesh of exact shells; energy and forces of a turn as a rigid body."""
    for name, error in patch_errors().items():
        yield Figure(f"patch, {name}", error, 0.0, 1.0)
    system = curved()
    rest = np.zeros(system.size)
    turn = np.eye(4)
    turn[:3, :3] = Rotation.from_rotvec([2.0, -1.5, 0.7]).as_matrix()
    turn[:3, 3] = 3.0, -2.0, 5.0
    bent = system.compose(system.start, 0.2 * np.random.default_rng(1).normal(size=system.size))
    energy = float(system.energies(bent, rest)[1])
    turned = float(system.energies(system.at(turn @ system.start.poses, system.start), rest)[1])
    yield Figure("energy after a turn by 150 degrees, of that when strained", turned, 0.0, energy)
    again = float(system.energies(system.at(turn @ bent.poses, bent), rest)[1])
    yield Figure("energy when strained, after the turn", again, energy)


def links() -> dict[str, Any]:
    """Shells of links, linear: ours / published."""
    found: dict[str, Any] = {}
    print(f"{'standard set':<34}" + "".join(f"{f'{n} x {n}':>10}" for n in MESHES["standard"]))
    for of, published in PUBLISHED.items():
        for kind in ("quad4", "tri3"):
            row = [of(n, kind) / published for n in MESHES["standard"]]
            found[f"{of.__name__} {kind}"] = row
            print(f"{of.__name__ + ' ' + kind + f' ({published:g})':<34}" + "".join(f"{x:10.4f}" for x in row))
    print(f"\n{'pre-twisted cantilever':<34}" + "".join(f"{f'{a} x {b}':>20}" for a, b in MESHES["twisted"]))
    for thickness, published in TWISTED.items():
        for kind, drilling in (("quad4", 0.01), ("quad4", 1.0), ("tri3", 0.01)):
            rows = [twisted(*mesh, thickness, kind, drilling) for mesh in MESHES["twisted"]]
            ratios = [[a / b for a, b in zip(row, published, strict=True)] for row in rows]
            name = f"{kind}, {thickness:g} thick, drilling {drilling:g}"
            found[f"twisted {name}"] = ratios
            print(f"{name:<34}" + "".join(f"{a:12.4f}{b:8.4f}" for a, b in ratios))
    return found


def bracket() -> dict[str, Any]:
    """First six free frequencies of the bracket [Hz]."""
    found: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as folder:
        shells = {f"shells, {turns}": shell_bracket(Path(folder), turns) for turns in (1, 2)}
        judges = {f"hex20, {turns}": solid_bracket(Path(folder), turns) for turns in (2, 3, 4)}
        if shutil.which("ccx"):
            judges["S8R of CalculiX"] = calculix_bracket(Path(folder), 2)
            shells["shells, deck of S8R"] = deck_bracket(Path(folder))
        else:
            print("\nCalculiX (ccx) is not installed: no S8R")
        of_gmsh = gmsh_brackets(Path(folder))
    print("first six free frequencies of the bracket [Hz]")
    for name, values in {**judges, **shells}.items():
        found[name] = values.tolist()
        print(f"{name:<22}" + "".join(f"{v:10.2f}" for v in values))
    for name in list(judges)[2:]:
        for own, values in list(shells.items())[1:]:
            off = np.abs(values / judges[name] - 1).max()
            print(f"{own} against {name}: {100 * off:.2f} % at most")
    print("the shipped bracket, meshed by gmsh, with its holes, 5 mm thick")
    for name, values in zip(("shells of gmsh", "hex20 about them"), of_gmsh, strict=True):
        found[name] = values.tolist()
        print(f"{name:<22}" + "".join(f"{v:10.2f}" for v in values))
    print(f"apart: {100 * np.abs(of_gmsh[0] / of_gmsh[1] - 1).max():.2f} % at most")
    return found


def arm_stress() -> dict[str, Any]:
    """Largest von Mises stress in the bracket of the arm, over its thickness, as ERLS, FFR and nodal shells have it."""
    found: dict[str, Any] = {}
    times = (0.02, 0.04, 0.06)
    heads = "".join(f"{f'{1e3 * t:g} ms':>10}" for t in times)
    print(f"{'bracket arm, stress [MPa]':<28}{heads}{'end off [m]':>14}")
    first = None
    for name, step in (("erls", 0.0), ("ffr", 0.0), ("nodal", 2e-3), ("nodal", 5e-4)):
        changes = [f"simulation.duration={times[-1]}", f"simulation.formulation={name}"]
        changes += [f"simulation.step={step}"] if step else []
        run = erls.simulate(erls.load_scene(DATA / "shells/bracket_arm.toml", changes), verdict=False)
        poses = figure_of(run, 1.0, "stress").poses(times)
        largest = [float(np.fmax.reduce(pose.values()[0])) for pose in poses]
        place = run.position("end", np.array(times))
        first = place if first is None else first
        off, words = float(np.abs(place - first).max()), name + (f", {1e3 * step:g} ms" if step else "")
        found[words] = {"stress_MPa": largest, "off_m": off}
        print(f"{words:<28}" + "".join(f"{x:10.2f}" for x in largest) + f"{off:14.1e}", flush=True)
    return found


TABLES: dict[str, Callable[[], dict[str, Any]]] = {
    "patches": figures(patches),
    "standard": figures(shell_figures.standard),
    "twisted": figures(shell_figures.twisted),
    "thin": figures(shell_figures.thin),
    "large": figures(shell_figures.large),
    "paths": figures(shell_figures.paths),
    "flight": figures(shell_figures.flight),
    "links": links,
    "bracket": bracket,
    "roll-up": roll_up,
    "right-angle": right_angle,
    "chain": chain,
    "arm-stress": arm_stress,
}


class Told(io.StringIO):
    """What is printed is kept."""

    def __init__(self) -> None:
        super().__init__()
        self._out = sys.stdout

    def write(self, text: str, /) -> int:
        self._out.write(text)
        self._out.flush()
        return super().write(text)


def onto_page(name: str, table: str) -> None:
    """Put a table into its block, ```text NAME, of the page."""
    lines = "".join(f"{line.rstrip()}\n" for line in table.strip("\n").split("\n"))
    block, page = re.compile(rf"(```text {name}\n).*?(?=```)", flags=re.DOTALL), PAGE.read_text(encoding="utf-8")
    if not block.search(page):
        sys.exit(f"{PAGE}: has no block ```text {name}; add it where the table is to stand")
    with replacing(PAGE) as path:
        path.write_text(block.sub(lambda found: found[1] + lines, page), encoding="utf-8")


def onto_file(path: Path, name: str, found: dict[str, Any]) -> None:
    """Put figures beside those that a file has."""
    known = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    path.write_text(json.dumps({**known, name: found}, indent=1), encoding="utf-8")


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--page", action="store_true", help="put the tables into docs/shells.md, too")
    parser.add_argument("--json", type=Path, help="put the figures into a file, too")
    for name in TABLES:
        parser.add_argument(f"--{name}", action="store_true", help="this table")
    asked = vars(parser.parse_args())
    chosen = [name for name in TABLES if asked[name.replace("-", "_")]] or list(TABLES)
    for name in chosen:
        with contextlib.redirect_stdout(Told()) as told:
            found = TABLES[name]()
        print(flush=True)
        if asked["page"]:
            onto_page(name, told.getvalue())
        if asked["json"]:
            onto_file(asked["json"], name, found)


if __name__ == "__main__":
    main()
