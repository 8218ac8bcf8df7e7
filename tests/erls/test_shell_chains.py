"""Links of shells as nodal elements: beside their own finite-element models, closed forms, ERLS and FFR."""

from __future__ import annotations

import functools
import sys
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg as sla
from numpy.typing import NDArray

import erls
from erls.equations.nodal.assembly import NodalSystem
from erls.equations.nodal.equations import Nodal
from erls.equations.nodal.parts import LinkParts, carried, link_parts
from erls.equations.nodal.rigid_body import RigidBodies
from erls.equations.nodal.shell import Shells
from erls.equations.nodal.surfaces import corner_frames
from erls.errors import Cause, SceneError
from erls.maths.se3 import pose
from erls.mechanism.links import Link
from erls.run.chain.run import ChainRun
from erls.run.chain.shells_file import read_shells, write_shells
from erls.run.file import load_run, save_run
from fe_import.description.link import load_link
from fe_import.files.hdf5.values import Reader
from fe_import.models.link_shells import link_shells
from fe_import.models.model import build_model
from fe_import.reduce import reduce_link

ROOT = Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "tests" / "fe_import"))
from link_files import write_toml  # noqa: E402
from shell_meshes import ShellGrid, shell_grid, write_deck  # noqa: E402

Array = NDArray[np.float64]
ALU = {"youngs_modulus": 7e10, "poissons_ratio": 0.33, "density": 2700.0}


def strip(nx: int, ny: int) -> ShellGrid:
    """600 by 60 mm."""
    return shell_grid(nx, ny, lambda a, b: (0.6 * a, 0.06 * (b - 0.5), 0.0), "quad4")


def folded(nx: int, ny: int, kind: str) -> ShellGrid:
    """The same, its second half upright."""
    return shell_grid(nx, ny, lambda a, b: (0.6 * min(a, 0.5), 0.06 * (b - 0.5), max(0.6 * a - 0.3, 0.0)), kind)


def described(folder: Path, grid: ShellGrid, **changes: Any) -> Path:
    """A link of it, 3 mm thick, with its ends held rigidly."""
    write_deck(folder / "shell.inp", grid)
    shell = {"mesh": "shell.inp", "material": "m", "thickness": 0.003}
    ends = [{"name": name.lower(), "face": name, "coupling": "rigid"} for name in ("ROOT", "TIP")]
    kept = {"fixed_interface_modes": 8, "elastic_modes": 14}
    return write_toml(
        folder / "link.toml",
        {"materials": {"m": ALU}, "shell": shell, "interfaces": ends, "reduction": kept} | changes,
    )


def link_of(path: Path) -> Link:
    """As scenes build it."""
    file = load_link(path)
    model = reduce_link(file)
    inboard, damping = model.interface_nodes[0], np.zeros(model.elastic_modes)
    own = np.diag(model.stiffness)[6:].copy()
    return Link("plate", model, model.invariants, inboard, own, damping, shells=link_shells(file))


def frequencies(stiffness: Any, mass: Any, count: int = 6) -> Array:
    """The first of a free structure [Hz]."""
    stiffness, mass = sp.csc_array(stiffness), sp.csc_array(mass)
    near = -((2 * np.pi * 5.0) ** 2)
    squares = sla.eigsh(stiffness, 6 + count, mass, sigma=near, return_eigenvectors=False)
    return np.asarray(np.sqrt(np.sort(squares)[6:]) / (2 * np.pi))


def system_of(parts: LinkParts) -> NodalSystem:
    """A free link."""
    poses = np.array([pose(position=x) for x in parts.nodes])
    return NodalSystem(poses, [Shells(parts.shells, poses), RigidBodies(parts.bodies, np.zeros(3))])


def nodal_frequencies(link: Link, times: int) -> Array:
    """Of nodal shells."""
    system = system_of(link_parts(link, None, times))
    rest = np.zeros(system.size)
    stiffness, _ = system.stiffness_and_damping(0.0, system.start, rest, rest, None, material=True)
    return frequencies(stiffness, system.mass_matrix(0.0, system.start))


@functools.cache
def _judges() -> list[Array]:
    """Frequencies of the folded strip of linear shells, on two meshes."""
    found = []
    with tempfile.TemporaryDirectory() as folder:
        for n in (16, 32):
            fine = load_link(described(Path(folder), folded(n, n // 4, "quad4")))
            found.append(frequencies(*build_model(fine).reduced_matrices()[::-1], 4))
    return found


@pytest.mark.parametrize("kind", ["quad4", "tri3"])
def test_frequencies_beside_those_of_linear_shells(tmp_path: Path, kind: str) -> None:
    """Two discretizations, of a folded strip, meet as the mesh is cut: at most 1/1.8 of the largest distance is left
    each time, then 0.5 % in bending and 2 % in torsion, from linear shells extrapolated with second order.
    """
    link, (coarse, fine) = link_of(described(tmp_path, folded(8, 2, kind))), _judges()
    exact = (4 * fine - coarse) / 3
    off = [np.abs(nodal_frequencies(link, times)[:4] / exact - 1) for times in (1, 2, 4)]
    assert off[1].max() < off[0].max() / 1.8
    assert off[2].max() < off[1].max() / 1.8
    assert (off[2] < [5e-3, 5e-3, 5e-3, 2e-2]).all()


def test_mass_is_that_of_the_model(tmp_path: Path) -> None:
    """Point masses and payloads included, what interfaces hold rigidly too; six motions without force."""
    path = described(tmp_path, folded(6, 2, "quad4"))
    deck = (tmp_path / "shell.inp").read_text()
    deck += "*ELEMENT, TYPE=MASS, ELSET=M\n1000, 8\n1001, 1\n*MASS, ELSET=M\n0.2\n"
    (tmp_path / "shell.inp").write_text(deck)
    link = link_of(path)
    parts, whole = link_parts(link, None, 1), link.model.full_mass_properties
    assert sum(body.mass for body in parts.bodies) == pytest.approx(whole.mass, rel=1e-12)
    places = np.array([parts.nodes[body.node] + body.centre for body in parts.bodies])
    masses = np.array([body.mass for body in parts.bodies])
    np.testing.assert_allclose(masses @ places / masses.sum(), whole.centre_of_mass, atol=1e-12)
    assert len(parts.nodes) == 7 * 3 - 2 * 3 + 2
    system = system_of(parts)
    rest, moved = np.zeros(system.size), pose(np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0], np.ones(3))
    moved[:3, :3] *= np.linalg.det(moved[:3, :3])
    turned = system.at(moved @ system.start.poses, system.start)
    assert np.abs(system.residual(0.0, turned, rest, rest)).max() < 1e-12 * 7e10 * 0.003


def test_layers_turn_with_their_direction(tmp_path: Path) -> None:
    """A plate whose fibres run across, by their angle or by their direction, bends as its linear shells do, to 1 %;
    fibres along it would make this three times as high.
    """
    fibres = ALU | {"transverse_modulus": 7e9, "shear_modulus": 3e9, "poissons_ratio": 0.3}
    found = []
    for angle, direction in ((90.0, [1.0, 0.0, 0.0]), (0.0, [0.0, 1.0, 0.0])):
        shell = {"mesh": "shell.inp", "layers": [{"material": "m", "thickness": 0.003, "angle": angle}],
                 "direction": direction}  # fmt: skip
        path = described(tmp_path, strip(16, 2), materials={"m": fibres}, shell=shell)
        found.append(nodal_frequencies(link_of(path), 2))
        fine = described(tmp_path, strip(32, 4), materials={"m": fibres}, shell=shell)
        exact = frequencies(*build_model(load_link(fine)).reduced_matrices()[::-1])
        np.testing.assert_allclose(found[-1][:2], exact[:2], rtol=1e-2)
    np.testing.assert_allclose(*found, rtol=1e-9)


def arm(folder: Path, formulation: str, **changes: Any) -> Path:
    """A strip that turns about a vertical axis by 60 degrees in 0.2 s, and falls meanwhile, 0.1 s in all."""
    motion = {"shape": "polynomial", "from_deg": 0.0, "to_deg": 60.0, "duration": 0.2, "degree": 7}
    return write_toml(
        folder / "arm.toml",
        {
            "simulation": {"duration": 0.1, "formulation": formulation, "integrator": "generalized_alpha",
                           "step": 1e-3},
            "joints": [{"name": "j", "dh": {"convention": "modified"}, "drive": {"type": "motion", "motion": motion}}],
            "links": [{"name": "strip", "model": "link.toml"}],
            "points": [{"name": "tip", "link": "strip", "node": "tip"}],
        }
        | changes,
    )  # fmt: skip


def run_of(path: Path, verdict: bool = False) -> ChainRun:
    """Without further runs."""
    run = erls.simulate(erls.load_scene(path), verdict=verdict)
    assert isinstance(run, ChainRun)
    return run


def test_a_shell_link_judges_the_others(tmp_path: Path) -> None:
    """ERLS and FFR within 3 % of the deflection: 8 elements along the strip leave 2.6 %, twice as many half of it
    (`benchmarks/shells.py --chain`). The file of the run holds its shells, so that it is read without their mesh.
    """
    described(tmp_path, strip(8, 2))
    runs = {name: run_of(arm(tmp_path, name)) for name in ("erls", "ffr", "nodal")}
    times = np.linspace(0.0, 0.1, 41)
    places = {name: run.position("tip", times) for name, run in runs.items()}
    still = run_of(arm(tmp_path, "erls", links=[{"name": "strip", "model": "link.toml", "flexible": False}]))
    deflection = np.abs(places["erls"] - still.position("tip", times)).max()
    assert deflection > 1e-3
    assert np.abs(places["erls"] - places["nodal"]).max() < 0.03 * deflection
    assert np.abs(places["ffr"] - places["nodal"]).max() < 0.03 * deflection
    nodal = runs["nodal"]
    assert isinstance(nodal.formulation, Nodal)
    assert nodal.formulation.describe()["elements"] == 16
    modes = [run.series(times).modal[0] for run in (runs["erls"], nodal)]
    assert np.abs(modes[0] - modes[1]).max() < 0.05 * np.abs(modes[0]).max()
    save_run(tmp_path / "run.h5", nodal)
    (tmp_path / "shell.inp").unlink()
    again = load_run(tmp_path / "run.h5")
    assert isinstance(again, ChainRun)
    np.testing.assert_array_equal(again.position("tip", times), places["nodal"])


def _negative(at: tuple[int, ...]) -> Callable[[Array], None]:
    def change(values: Array) -> None:
        values[at] *= -1.0

    return change


def _put(at: tuple[int, ...], value: float) -> Callable[[Array], None]:
    def change(values: Array) -> None:
        values[at] = value

    return change


HOSTILE: tuple[tuple[str, Callable[[Array], None], str], ...] = (
    ("stiffness", _negative((0,)), "row 0 is not symmetric and positive"),
    ("stiffness", _negative((0, 3, 3)), "row 0 is not symmetric and positive"),  # of bending, a millionth of membranes
    ("stiffness", _put((0, 0, 1), 0.0), "row 0 is not symmetric and positive"),
    ("stiffness", _put((), 0.0), "row 0 is not symmetric and positive"),
    ("moments", _negative((0, 2)), "row 0 is of no density"),
    ("moments", _put((0, 1), 100.0), "row 0 is of no density"),
    ("drilling", _put((), -0.5), "a stiffness is not negative"),
    ("cells", _put((1, 1), 1), "row 1 is no quadrangle or triangle"),
    ("masses", _put((0, 0), -1.0), "row 0 is negative"),
    ("masses", _put((0, 5), 1.0), "row 0 is not of a symmetric and positive inertia"),
)


def test_embedded_shells_are_checked(tmp_path: Path) -> None:
    """Signs and symmetry of what a run file says of shells: refused by name, never integrated."""
    link = link_of(described(tmp_path, strip(2, 2)))
    assert link.shells is not None
    mass = np.array([[1.0, 0, 0, 0, 1e-3, 0, 0, 0, 1e-3, 0, 0, 0, 1e-3]])
    shells = replace(link.shells, masses=mass, mass_nodes=np.array([0]))
    for name, change, told in ((None, None, None), *HOSTILE):
        with h5py.File(tmp_path / "file.h5", "w") as file:
            write_shells(file.create_group("shells"), shells)
            reader = Reader(file["shells"], "file.h5", SceneError, Cause.RUN_FILE)
            if name is None:
                np.testing.assert_array_equal(read_shells(reader, 99).stiffness, shells.stiffness)
                continue
            values = np.array(file["shells"][name][()])
            assert change is not None
            assert told is not None
            change(values)
            file["shells"][name][...] = values
            with pytest.raises(SceneError, match=told):
                read_shells(reader, 99)


def test_what_nodal_shells_cannot_do_is_named(tmp_path: Path) -> None:
    """Averaged interfaces, springs of the mesh file, modal damping."""
    averaged = [
        {"name": "root", "face": "ROOT"},
        {"name": "tip", "face": "SIDE", "coupling": "averaged", "weights": "uniform"},
    ]
    path = described(tmp_path, strip(4, 2), interfaces=averaged)
    deck = (tmp_path / "shell.inp").read_text()
    (tmp_path / "shell.inp").write_text(deck + "*NSET, NSET=SIDE\n10, 13, 11\n")
    with pytest.raises(SceneError, match="on average"):
        link_parts(link_of(path), None, 1)
    link = link_of(described(tmp_path, strip(4, 2)))
    with pytest.raises(SceneError, match="damped"):
        link_parts(replace(link, damping=np.ones(link.elastic_modes)), None, 1)
    assert link.shells is not None
    with pytest.raises(SceneError, match="SPRINGA"):
        link_parts(replace(link, shells=replace(link.shells, others=("SPRINGA",))), None, 1)


def test_only_layers_need_a_direction_within_their_surface() -> None:
    """Two squares across a fold: along the normal of the second one, a direction is good for the first one's layers."""
    places = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [1, 0, 1], [1, 1, 1]], dtype=float)
    cells, along = np.array([[0, 1, 2, 3], [1, 4, 5, 2]]), np.array([1.0, 0.0, 0.0])
    found = corner_frames(places, cells, 25.0, "link", np.array([along, 0 * along]))
    np.testing.assert_allclose(found[0, :, :3, 0], np.tile(along, (4, 1)), atol=1e-15)
    with pytest.raises(SceneError, match="direction of layers stands on the surface"):
        corner_frames(places, cells, 25.0, "link", along)


def test_what_no_shell_carries_is_refused() -> None:
    with pytest.raises(SceneError, match="sits where the mesh has no shell"):
        carried(np.array([0, -1, 1]), 1, "link 'panel'")
