"""The readers of erls with small sound files, for `fuzzing`."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import scenes
from fuzzing import Facts, Reader
from fuzzing_facts import content, taken
from fuzzing_hdf5 import edited

import erls
from erls.mechanism.tables import read_csv
from erls.report.mode_page import Printed, read_printed
from erls.run.chain.run import ChainRun
from erls.run.file import load_run
from erls.scene.build import build_mechanism
from erls.scene.chain import SceneRecord
from erls.scene.read import load_scene

SCENE = b"""gravity = [0.0, 0.0, -9.81]
[simulation]
duration = 0.5
gauge = "joint-angle"
step = 1e-3
[base]
rotation_deg = [0.0, 0.0, 90.0]
[[joints]]
name = "shoulder"
dh = { convention = "standard", a = 0.5, alpha_deg = 90.0 }
drive = { type = "motion", motion = { shape = "polynomial", from_deg = 0.0, to_deg = 60.0, duration = 0.3 } }
[[joints]]
name = "elbow"
dh = { convention = "standard", a = 0.5 }
initial = { position_deg = 10.0, rate_deg = 0.0 }
stiffness = 5.0
friction = { force = 0.05 }
drive = { type = "torque", profiles = [{ shape = "step", start = 0.1, end = 0.4, value = -0.5 }] }
[[links]]
name = "upper"
[links.rigid]
mass = 0.5
centre_of_mass = [0.2, 0, 0]
inertia = [1e-3, 2e-3, 2e-3]
points = { in = [0, 0, 0], out = [0.5, 0, 0] }
[[links]]
name = "lower"
[links.rigid]
mass = 0.5
centre_of_mass = [0.2, 0, 0]
inertia = [1e-3, 2e-3, 2e-3]
points = { end = [0.5, 0, 0] }
[[points]]
name = "hand"
link = "lower"
node = "end"
[[payloads]]
point = "hand"
mass = 0.3
"""
TABLE = "".join(f"{0.01 * k:.2f}, {np.sin(k):.6f}, {np.cos(k):.6f}\n" for k in range(12))
PRINTED = b"""# Table 3 of a paper
# with a note
elastic_modes,t,joint shoulder,point tip x
0,0.5,125.90,-0.2931
2,0.5,115.30,-0.2607
4,0.5,114.30,-0.2596
6,0.5,114.25,-0.2615
"""


def run_bytes() -> bytes:
    """A short run of a flexible link and a rigid one."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        scenes.l_link(folder, 1, reduction={"fixed_interface_modes": 1, "elastic_modes": 2})
        rigid = {"mass": 0.5, "centre_of_mass": [0.2, 0, 0], "inertia": [1e-3, 2e-3, 2e-3], "points": {"in": [0, 0, 0]}}
        dh = {"convention": "standard", "a": 0.5}
        data = {
            "simulation": {"duration": 0.002, "step": 5e-4},
            "joints": [{"name": "a", "dh": dh}, {"name": "b", "dh": dh}],
            "links": [{"name": "l", "model": "link.toml"}, {"name": "r", "rigid": rigid}],
            "points": [{"name": "tip", "link": "l", "node": "tip"}],
        }
        run = erls.simulate(scenes.write_toml(folder / "scene.toml", data))
        erls.save_run(folder / "r.h5", run)
        return (folder / "r.h5").read_bytes()


def run_facts(run: ChainRun) -> Facts:
    """Scene, knots, models, and what the run says of itself."""
    links = [link.model for link in run.formulation.mechanism.links]
    solution = run.solution
    parts: list[Any] = [solution.t, solution.y, solution.v, solution.a, run.wall_s, str(run.failure), *run.warnings]
    return content({"scene": run.scene.record, "name": run.scene.path.name, "parts": parts, "links": links})


def scene_of(folder: Path) -> SceneRecord:
    """The record of a scene that can be built."""
    scene = load_scene(folder / "scene.toml")
    build_mechanism(scene)
    return scene.record


def _rows(table: np.ndarray) -> Facts:
    return frozenset(map(tuple, table.tolist()))


def _printed_facts(printed: Printed) -> Facts:
    """All but the note, which may say anything."""
    head = (printed.time, printed.columns)
    return frozenset([head, *((modes, *values) for modes, values in printed.rows.items())])


def _load(folder: Path) -> ChainRun:
    return load_run(folder / "r.h5")


def _run_files() -> Iterator[Reader]:
    held = {"r.h5": run_bytes()}
    yield Reader("run file", held, ("r.h5",), _load, run_facts, binary=True, exact=True)
    yield Reader("run file, edited", held, ("r.h5",), _load, run_facts, damage=edited, exact=True)


def _scenes() -> Iterator[Reader]:
    yield Reader("scene.toml", {"scene.toml": SCENE}, ("scene.toml",), scene_of, content, judge=taken)


def _tables() -> Iterator[Reader]:
    countless: dict[str, Any] = {"counts": False, "ends": False}
    held = {"t.csv": TABLE.encode()}
    yield Reader("table of a drive", held, ("t.csv",), lambda f: read_csv(f / "t.csv", "drive"), _rows, **countless)
    held = {"p.csv": PRINTED}
    yield Reader(
        "published figures", held, ("p.csv",), lambda f: read_printed(f / "p.csv"), _printed_facts, **countless
    )


GROUPS: dict[str, Callable[[], Iterator[Reader]]] = {"run files": _run_files, "scenes": _scenes, "tables": _tables}
