"""Figures of shells from the scenes of ``data/shells/``: ours, published or in closed form, and the difference.

`benchmarks/shells.py` prints them. Finer meshes than those that are shipped are made here, of the same surfaces.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "erls"))
sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "fe_import"))
from shell_benchmarks import TWISTED, on_annulus, on_blade, on_cylinder, on_hemisphere, on_roof
from shell_flight import momenta
from shell_meshes import ShellGrid, shell_grid, write_deck

import erls
from erls.run.bodies.motion import BodyMotion
from erls.run.bodies.rest import BodyRest

DATA = Path(__file__).parents[1] / "data"


@dataclass(frozen=True)
class Figure:
    """A row: what, ours, published or in closed form, and what the difference is a share of (nothing: of itself)."""

    name: str
    ours: float
    other: float
    scale: float = 0.0

    @property
    def apart(self) -> float:
        """The difference, as a share."""
        return (self.ours - self.other) / (self.scale or abs(self.other))


def at_rest(file: str, *changes: str) -> BodyRest:
    """A scene under its loads."""
    run = erls.simulate(erls.load_scene(DATA / f"{file}.toml", list(changes)), verdict=False)
    assert isinstance(run, BodyRest)
    return run


def moved(run: BodyRest, point: str, axis: int) -> float:
    """How far a node went under the whole load, without its sign."""
    built = run.origin.poses[run.assembly.numbers[point], axis, 3]
    return abs(float(run.position(point, run.end)[axis] - built))


def _ends(grid: ShellGrid) -> dict[str, Any]:
    return {"END": grid.at[0], "MIDDLE": grid.at[-1], "CROWN": grid.at[:, 0], "SIDE": grid.at[:, -1]}


SETS: dict[str, tuple[Callable[[float, float], tuple[float, float, float]], Callable[[ShellGrid], dict[str, Any]]]] = {
    "roof": (on_roof, _ends),
    "cylinder": (on_cylinder, _ends),
    "hemisphere": (on_hemisphere, lambda grid: {"SIDE_Y": grid.at[:, 0], "SIDE_X": grid.at[:, -1]}),
    "annulus": (on_annulus, lambda grid: {"FREE": grid.at[:, 0], "CLAMPED": grid.at[:, -1]}),
    "twisted": (on_blade, lambda grid: {"ROOT": grid.at[0], "TIP": grid.at[-1]}),
}
"""Surfaces over the unit square, and the sets of their scenes."""


def on_mesh(name: str, nx: int, ny: int, *changes: str) -> BodyRest:
    """A shipped scene at rest on a mesh of nx by ny."""
    place, sets = SETS[name]
    with tempfile.TemporaryDirectory() as folder:
        grid = shell_grid(nx, ny, place, "quad4")
        path = write_deck(Path(folder) / "mesh.inp", grid, **sets(grid))
        return at_rest(f"shells/{name}", f"shells.0.mesh={path}", *changes)


_SMALL = [f"loads.{k}.force={force}" for k, force in enumerate(("[1e-3,0,0]", "[0,-1e-3,0]"))]
LINEAR: dict[str, tuple[str, int, float, float, list[str]]] = {
    "roof": ("edge", 1, 1e3, 0.3024, []),
    "cylinder": ("loaded", 1, 1.0, 1.8248e-5, []),
    "hemisphere": ("pulled", 0, 1e3, 0.0940, [*_SMALL, "simulation.load_steps=1"]),
}
"""Point, axis, units of the load, published figure, changes: of small displacements."""


def standard() -> Iterator[Figure]:
    """The standard set, linear, on meshes of 8, 16 and 32, and the cylinder once more."""
    for name, (point, axis, unit, published, changes) in LINEAR.items():
        for n in (8, 16, 32, 48) if name == "cylinder" else (8, 16, 32):
            ours = unit * moved(on_mesh(name, n, n, *changes), point, axis)
            yield Figure(f"{name}, {n} x {n}", ours, published)


def twisted() -> Iterator[Figure]:
    """The pre-twisted cantilever beside what is published, and beside beams of as many elements along it."""
    for thickness, published in TWISTED.items():
        size = 1.0 if thickness > 0.1 else 1e-6
        words = f"twisted, {thickness:g} thick"
        for way, axis, wanted in (("in plane", 2, published[0]), ("out of plane", 1, published[1])):
            force = f"loads.0.force={[size * (k == axis) for k in range(3)]}"
            beams = moved(at_rest("statics/twisted_beam", force, f"sections.flat.height={thickness}"), "tip", axis)
            yield Figure(f"{words}, {way}, our beams", beams, wanted)
            for nx, ny in ((12, 2), (24, 4), (48, 8)):
                run = on_mesh("twisted", nx, ny, force, f"shells.0.thickness={thickness}")
                ours = moved(run, "tip", axis)
                yield Figure(f"{words}, {way}, {nx} x {ny}", ours, wanted)
            yield Figure(f"{words}, {way}, beside our beams", ours, beams)
    soft = moved(on_mesh("twisted", 24, 4, "shells.0.drilling=0.01"), "tip", 2)
    yield Figure("twisted, thick, in plane, a hundredth of the drilling", soft, TWISTED[0.32][0])


def thin() -> Iterator[Figure]:
    """A strip of eight elements under a force at its end, as its thickness goes from a tenth of its length to a
    ten-thousandth: beside Timoshenko's cantilever.
    """
    for share in (1e-1, 1e-2, 1e-3, 1e-4):
        thickness, youngs = 12 * share, 1200.0
        bending = youngs * thickness**3 / 12
        exact = 1e-3
        force = exact / (12**3 / (3 * bending) + 12 / (5 / 6 * youngs / 2 * thickness))
        run = at_rest("shells/roll_up", "shells.strip.elements=[8,1]", f"shells.strip.thickness={thickness}",
                      f"loads.0.force=[0,0,{force}]", "loads.0.moment=[0,0,0]")  # fmt: skip
        yield Figure(f"strip, thickness / length {share:g}", moved(run, "b", 2), exact)


def large() -> Iterator[Figure]:
    """The hemisphere and the annulus at large displacement, on the shipped and on finer meshes."""
    for name, meshes, points in (
        ("hemisphere", ((16, 16), (24, 24), (32, 32)), (("pulled", 0, 4.067), ("pushed", 1, 8.178))),
        ("annulus", ((6, 48), (10, 80), (14, 112)), (("inner", 2, 13.891), ("outer", 2, 17.528))),
    ):
        for nx, ny in meshes:
            run = on_mesh(name, nx, ny)
            for point, axis, published in points:
                yield Figure(f"{name}, {point}, {nx} x {ny}", moved(run, point, axis), published)


def _fold(run: BodyRest, first: float) -> float:
    """Moment of the whole width [N m]: work per rotation from a share of the load parameter on."""
    loads = run.loads(run.times)
    begin = int(np.flatnonzero(loads < first).max()) + 1
    samples = run.samples(run.times[begin:].tolist())
    moments = [sample["connections"]["turn"]["moment"][1] for sample in samples]
    return 2 * abs(float(np.trapezoid(moments, loads[begin:]) / (loads[-1] - loads[begin])))


_MOTION = [f"connections.0.motion.{key}" for key in ("values_deg=[-75,0,75,150]", "rates_deg=[75,75]")]
_EQUAL = (*_MOTION, "shells.0.mesh=meshes/tape_coarse.inp", "simulation.load_steps=60")


def paths() -> Iterator[Figure]:
    """Paths past limits, and the hinge of tape spring in both senses."""
    yield Figure("two bars, first limit", at_rest("statics/two_bars").statics.turns[0].t, 0.370064700095)
    yield Figure("Lee's frame, first limit [kN]", 30 * at_rest("statics/lee_frame").statics.turns[0].t, 18.55)
    yield Figure("tape spring, opposite sense [N m]", _fold(at_rest("shells/tape_spring"), 30 / 90), 0.0393)
    yield Figure("tape spring, equal sense [N m]", _fold(at_rest("shells/tape_spring", *_EQUAL), 95 / 150), 0.0211)


def _motion(file: str, *changes: str) -> BodyMotion:
    run = erls.simulate(erls.load_scene(DATA / f"shells/{file}.toml", list(changes)), verdict=False)
    assert isinstance(run, BodyMotion)
    assert run.failure is None
    return run


def _order(group: str) -> float:
    """Order in time of the plate at 40 ms, of 2 by 2 elements, all of whose bending these steps resolve."""
    steps = (1.25e-4, 6.25e-5, 3.125e-5)
    changes = ["shells.0.elements=[2,2]", "simulation.duration=0.04", f"simulation.group={group}"]
    places = [_motion("plate", *changes, f"simulation.step={step}").position("c", 0.04) for step in steps]
    apart = [float(np.linalg.norm(one - other)) for one, other in pairwise(places)]
    return float(np.log2(apart[0] / apart[1]))


def flight() -> Iterator[Figure]:
    """A plate that a force sends off: its impulse, what it keeps from 30 to 100 ms, order in time (of 2 x 2 elements in
    steps of 0.125 to 0.03 ms, which resolve them); a panel that unfolds: its energy.
    """
    impulse = np.array([0.02, 0.0, 0.08])
    size = float(np.linalg.norm(impulse))
    for group in ("R3xSO(3)", "SE(3)"):
        for step in (1e-3, 5e-4, 2.5e-4):
            run = _motion("plate", "simulation.duration=0.1", f"simulation.step={step}", f"simulation.group={group}")
            (first, second), words = momenta(run, [0.03, 0.1]), f"plate, {group}, {1e3 * step:g} ms"
            yield Figure(f"{words}: momentum off the impulse", float(np.linalg.norm(first[:3] - impulse)), 0.0, size)
            yield Figure(f"{words}: change of momentum", float(np.linalg.norm((second - first)[:3])), 0.0, size)
            spin = float(np.linalg.norm(first[3:]))
            turned = float(np.linalg.norm((second - first)[3:]))
            yield Figure(f"{words}: change of angular momentum", turned, 0.0, spin)
            t, energy = run.energies()[:2]
            free = energy[t >= 0.03 - 1e-9]
            yield Figure(f"{words}: largest energy while free [J]", float(free.max()), float(free[0]))
            yield Figure(f"{words}: least energy while free [J]", float(free.min()), float(free[0]))
        yield Figure(f"plate, {group}: order in time", _order(group), 2.0)
    energy = _motion("panel").energies()[1]
    yield Figure("panel: energy at the end [J]", float(energy[-1]), float(energy[0]))
    yield Figure("panel: largest energy [J]", float(energy.max()), float(energy[0]))
