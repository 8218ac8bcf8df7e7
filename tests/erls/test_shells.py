"""Geometrically exact shells: derivatives, rigid motions, patches, roll-up, published figures, motions beside beams."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg as sla
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from shell_flight import momenta

import erls
from erls.equations.nodal.assembly import NodalSystem
from erls.equations.nodal.scenes.build import assemble
from erls.equations.nodal.scenes.shell_mesh import mesh_of
from erls.equations.nodal.scenes.shell_refined import refined_mesh
from erls.equations.nodal.shell import Shell, Shells, lumped_shells
from erls.equations.nodal.surfaces import corner_frames
from erls.errors import Cause, SceneError, SimulationError
from erls.run.bodies.motion import BodyMotion
from erls.run.bodies.rest import BodyRest
from fe_import.errors import FEImportError

ROOT = Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "tests" / "fe_import"))
from shell_benchmarks import TWISTED, twisted_grid  # noqa: E402
from shell_meshes import ShellGrid, dofs, plate, shell_grid, write_deck  # noqa: E402
from test_shell_elements import TURN, distorted, states  # noqa: E402

Array = NDArray[np.float64]


def shells_of(grid: ShellGrid, thickness: float = 0.1, drilling: float = 1.0) -> NodalSystem:
    """Of rubber, and nothing else."""
    poses = np.tile(np.eye(4), (len(grid.nodes), 1, 1))
    poses[:, :3, 3] = grid.nodes
    make = plate(200.0, 0.3, thickness)
    frames = corner_frames(grid.nodes, grid.elements, 25.0, "")
    made = [
        Shell(tuple(map(int, cell)), frame, make.stiffness(), make.moments(), drilling)
        for cell, frame in zip(grid.elements, frames, strict=True)
    ]
    return NodalSystem(poses, [Shells(made, poses)])


def curved() -> NodalSystem:
    """Two elements, bent and twisted."""
    return shells_of(shell_grid(2, 1, lambda a, b: (12 * a, b + 0.2 * a * b, 0.3 * a * a * b), "quad4"))


def test_forces_are_the_slope_of_the_energy_and_tangents_theirs() -> None:
    """By central differences, to 1e-8, far from where it is built."""
    system, rng = curved(), np.random.default_rng(0)
    rest, step = np.zeros(system.size), 1e-6
    q = system.compose(system.start, 0.2 * rng.normal(size=system.size))
    forces = system.residual(0.0, q, rest, rest)
    full, _ = system.stiffness_and_damping(0.0, q, rest, rest, None, material=False)
    full = sp.csc_array(full).toarray()
    slope, tangent = np.zeros(system.size), np.zeros((system.size, system.size))
    for k, way in enumerate(np.eye(system.size)):
        ahead, back = (system.compose(q, sign * step * way) for sign in (1, -1))
        slope[k] = (system.energies(ahead, rest)[1] - system.energies(back, rest)[1]) / (2 * step)
        apart = system.residual(0.0, ahead, rest, rest) - system.residual(0.0, back, rest, rest)
        tangent[:, k] = apart / (2 * step)
    np.testing.assert_allclose(forces, slope, atol=1e-8 * np.abs(forces).max())
    np.testing.assert_allclose(full, tangent, atol=1e-8 * np.abs(full).max())
    bare = [
        sp.csc_array(system.stiffness_and_damping(0.0, system.start, rest, rest, None, material=m)[0]).toarray()
        for m in (True, False)
    ]
    np.testing.assert_allclose(bare[0], bare[1], atol=1e-12 * np.abs(bare[1]).max())


def test_rigid_motions_strain_nothing_and_forces_balance() -> None:
    """As far as it turns: energy at rounding; of a strained one it stays, and forces and moments sum up to nothing."""
    system, rng = curved(), np.random.default_rng(1)
    rest = np.zeros(system.size)
    moved = np.eye(4)
    moved[:3, :3], moved[:3, 3] = Rotation.from_rotvec([2.0, -1.5, 0.7]).as_matrix(), [3.0, -2.0, 5.0]
    turned = system.at(moved @ system.start.poses, system.start)
    assert np.abs(system.residual(0.0, turned, rest, rest)).max() < 1e-12 * 200.0
    q = system.compose(system.start, 0.2 * rng.normal(size=system.size))
    energy = system.energies(q, rest)[1]
    assert system.energies(system.at(moved @ q.poses, q), rest)[1] == pytest.approx(energy, rel=1e-12)
    forces = system.residual(0.0, q, rest, rest).reshape(-1, 6)
    world = np.einsum("kij,kj->ki", q.poses[:, :3, :3], forces[:, :3])
    moments = np.einsum("kij,kj->ki", q.poses[:, :3, :3], forces[:, 3:]) + np.cross(q.poses[:, :3, 3], world)
    assert np.abs(world.sum(axis=0)).max() < 1e-12 * np.abs(world).max()
    assert np.abs(moments.sum(axis=0)).max() < 1e-11 * np.abs(moments).max()


def patch_errors() -> dict[str, float]:
    """Of constant strains, small, on a distorted mesh: largest error, in shares of the largest motion."""
    found = {}
    grid, flat = distorted("quad4")
    system = shells_of(grid, 0.05)
    rest = np.zeros(system.size)
    stiffness = sp.csc_array(system.stiffness_and_damping(0.0, system.start, rest, rest, None, material=False)[0])
    fixed = dofs(np.setdiff1d(grid.at, grid.at[1:-1, 1:-1]))
    for name, state in states(flat).items():
        exact = np.hstack([state[:, :3] @ TURN.T, state[:, 3:] @ TURN.T]).ravel()
        free, moved = np.setdiff1d(np.arange(len(exact)), fixed), exact.copy()
        moved[free] = sla.spsolve(stiffness[free][:, free], -(stiffness[free][:, fixed] @ exact[fixed]))
        found[name] = float(np.abs(moved - exact).max() / np.abs(exact).max())
    return found


def test_patches() -> None:
    """To 1e-10."""
    found = patch_errors()
    assert len(found) == 6
    assert max(found.values()) < 1e-10


@pytest.mark.parametrize(("tangent", "most"), [("full", 6), ("material", 12)])
@pytest.mark.parametrize("elements", [4, 8])
def test_roll_up(tangent: str, most: int, elements: int) -> None:
    """A full circle in one load step: its end back at its start to 1e-10."""
    settings = [f"shells.strip.elements=[{elements},1]", f"simulation.tangent={tangent}"]
    run = erls.simulate(erls.load_scene(ROOT / "data/shells/roll_up.toml", settings))
    assert isinstance(run, BodyRest)
    assert len(run.statics.path) == 1
    assert run.statics.path[0].iterations <= most
    assert run.statics.cut_steps == 0
    assert np.abs(run.position("b", 1.0)).max() < 1e-10
    assert np.abs(run.position("c", 1.0) - [0, 1, 0]).max() < 1e-10
    assert run.trust.verdict == "good"


def test_half_a_turn_within_an_element_is_named() -> None:
    """Two elements at 360° stand on the cut of the logarithm and are right; beyond, the cause is told."""
    path = ROOT / "data/shells/roll_up.toml"
    changes = ["shells.strip.elements=[2,1]", "simulation.load_steps=4"]
    run = erls.simulate(erls.load_scene(path, changes), verdict=False)
    assert np.abs(run.position("b", 1.0)).max() < 1e-9
    with pytest.raises(SimulationError, match=r"turns by half a circle.*179.9.*more elements") as found:
        erls.simulate(erls.load_scene(path, [*changes, "loads.0.moment=[0.0,-0.06,0.0]"]), verdict=False)
    assert found.value.cause == Cause.NO_EQUILIBRIUM


def test_twisted_beam() -> None:
    """Published figures to 1 % (thick) and 2 % (thin), in plane and out of plane; drilling moves the thick one."""
    path = ROOT / "data/shells/twisted.toml"
    for thickness, (inside, outside) in TWISTED.items():
        size = 1.0 if thickness > 0.1 else 1e-6
        found = []
        for axis, force in ((2, [0.0, 0.0, size]), (1, [0.0, size, 0.0])):
            settings = [f"shells.blade.thickness={thickness}", f"loads.0.force={force}"]
            run = erls.simulate(erls.load_scene(path, settings), verdict=False)
            found.append(float(run.position("tip", 1.0)[axis]))
        assert found == pytest.approx([inside, outside], rel=0.01 if thickness > 0.1 else 0.02)
    soft = erls.simulate(erls.load_scene(path, ["shells.blade.drilling=0.01"]), verdict=False)
    assert float(soft.position("tip", 1.0)[2]) / TWISTED[0.32][0] == pytest.approx(1.0037, abs=1e-3)


def test_a_refined_mesh_keeps_its_numbers_and_its_surface() -> None:
    """And its sets; new nodes of the blade lie on its helicoid to 1e-4."""
    path = ROOT / "data/shells/twisted.toml"
    scene = erls.load_scene(path)
    shell = scene.record.shells[0]
    places, cells, _ = mesh_of(shell, scene.folder, "")
    finer = refined_mesh(shell, scene.folder, "")
    assert len(finer.cells) == 4 * len(cells)
    np.testing.assert_array_equal(np.array(finer.places)[: len(places)], places)
    assert [len(finer.sets[name]) for name in ("ROOT", "TIP")] == [9, 9]
    assert len(finer.sets["SURFACE"]) == len(finer.places)
    width = np.array(finer.places)  # x turns the width by 90 degrees over the length of 12: on the helicoid to 1e-4
    angle = np.pi / 2 * width[:, 0] / 12
    assert np.abs(width[:, 1] * np.sin(angle) - width[:, 2] * np.cos(angle)).max() < 1e-4


def test_a_mesh_from_a_file_is_judged_as_a_patch_is(tmp_path: Path) -> None:
    """The same elements either way: the same error stated, of the size of what finer ones move."""
    text = (ROOT / "data/shells/roll_up.toml").read_text().replace("follower = true", "follower = false")
    text = text.replace("elements = [4, 1]", "elements = [3, 1]")
    text = text.replace("moment = [0.0, -0.05235987755982988, 0.0]", "force = [0.0, 0.0, 1e-3]")
    write_deck(tmp_path / "strip.inp", shell_grid(3, 1, lambda a, b: (12 * a, b, 0.0), "quad4"))
    patch, mesh = tmp_path / "patch.toml", tmp_path / "mesh.toml"
    patch.write_text(text)
    text = re.sub(r"corners = .*\nelements = .*", 'mesh = "strip.inp"', text)
    mesh.write_text(text.replace("strip:start", "strip:ROOT").replace("strip:end", "strip:TIP"))
    found = [erls.simulate(path) for path in (patch, mesh)]
    stated = [run.accuracy.total for run in found if run.accuracy is not None and run.accuracy.total is not None]
    assert stated[1] == pytest.approx(stated[0], rel=1e-6)
    finer = erls.simulate(erls.load_scene(patch, ["shells.strip.elements=[24,1]"]), verdict=False)
    off = float(np.linalg.norm(found[1].position("b", 1.0) - finer.position("b", 1.0)))
    assert off < stated[1] < 4 * off


def strip_scene(folder: Path, kind: str, more: str, clamped: bool = False) -> Path:
    """A strip of aluminium without contraction across on a hinge, or clamped, of shells or beams."""
    nodes = {"a": [0, -0.015, 0], "b": [0.5, -0.015, 0], "c": [0.5, 0.015, 0], "d": [0, 0.015, 0]}
    if kind == "beam":
        nodes = {"a": [0, 0, 0], "b": [0.5, 0, 0]}
        part = '[sections.s]\nshape = "rectangular"\nwidth = 0.03\nheight = 0.002\n[[beams]]\nname = "strip"\n'
        part += 'from = "a"\nto = "b"\nelements = 10\nmaterial = "m"\nsection = "s"\n'
        holds = [("hinge", "a")]
    else:
        part = '[[shells]]\nname = "strip"\ncorners = ["a", "b", "c", "d"]\nelements = [20, 1]\nmaterial = "m"\n'
        part += "thickness = 0.002\n"
        holds = [("hinge", "a"), ("hinge2", "d")]
    text = more + "\n[materials.m]\nyoungs_modulus = 70e9\npoissons_ratio = 0.0\ndensity = 2700.0\n[nodes]\n"
    text += "".join(f"{name} = {[float(x) for x in at]}\n" for name, at in nodes.items()) + part
    for name, node in holds:
        kind_of = "revolute" if name == "hinge" else "cylindrical"
        free = f'"{kind_of}"\naxis = [0.0, 1.0, 0.0]' if not clamped else '"fixed"'
        text += f'[[connections]]\nname = "{name}"\nnode = "{node}"\ntype = {free}\n'
    path = folder / f"{kind}.toml"
    path.write_text(text)
    return path


def test_a_strip_swings_and_vibrates_as_beams_do(tmp_path: Path) -> None:
    """Places in a motion to 2e-3 of its length, and its energy; the first frequencies to 2 %."""
    motion = 'gravity = [0.0, 0.0, -9.81]\n[simulation]\ntype = "dynamics"\nduration = 0.3\n'
    scenes = [erls.load_scene(strip_scene(tmp_path, kind, motion)) for kind in ("shell", "beam")]
    found = [erls.simulate(scene, verdict=False) for scene in scenes]
    for t in (0.1, 0.2, 0.3):
        places = [(found[0].position("b", t) + found[0].position("c", t)) / 2, found[1].position("b", t)]
        assert np.linalg.norm(places[0] - places[1]) < 2e-3 * 0.5
    kinetic, potential = found[0].energy([0.0, 0.1, 0.2, 0.3])
    total = kinetic + potential
    assert np.ptp(total) < 2e-3 * kinetic.max()
    modes = 'gravity = [0.0, 0.0, 0.0]\n[simulation]\ntype = "frequencies"\ncount = 8\n'
    held = [erls.load_scene(strip_scene(tmp_path, kind, modes, clamped=True)) for kind in ("shell", "beam")]
    shells, beams = (erls.simulate(scene, verdict=False) for scene in held)
    values = [np.array([mode["frequency_hz"] for mode in run.summary()["modes"]]) for run in (shells, beams)]
    own, bending = values[0], values[1][:2]
    for frequency in bending:
        assert np.abs(own / frequency - 1).min() < 0.02


def test_a_plate_keeps_its_momentum_in_flight() -> None:
    """On R3xSO(3) the impulse of the force, and to rounding; its energy swings by a quarter of half the step."""
    swings = []
    for step in (2.5e-4, 1.25e-4):
        coarse = ["shells.0.elements=[2,2]", "simulation.duration=0.04", f"simulation.step={step}"]
        scene = erls.load_scene(ROOT / "data/shells/plate.toml", [*coarse, "simulation.group=R3xSO(3)"])
        run = erls.simulate(scene, verdict=False)
        assert isinstance(run, BodyMotion)
        first, last = momenta(run, [0.03, 0.04])
        np.testing.assert_allclose(first[:3], [0.02, 0.0, 0.08], rtol=0, atol=1e-12)
        np.testing.assert_allclose(last[:3], first[:3], rtol=0, atol=1e-12)
        assert np.abs(last[3:] - first[3:]).max() < 1e-6 * np.abs(first[3:]).max()
        t, energy = run.energies()[:2]
        swings.append(np.ptp(energy[t > 0.03]) / energy[-1])
    assert swings[0] < 5e-4
    assert swings[0] / swings[1] == pytest.approx(4.0, abs=0.2)


def test_mass_and_folds() -> None:
    """Quarters of the mass at the corners; elements that meet at a fold keep their normals."""
    grid = shell_grid(2, 1, lambda a, b: (a if a <= 0.5 else 0.5, b, 0.0 if a <= 0.5 else a - 0.5), "quad4")
    frames = corner_frames(grid.nodes, grid.elements, 25.0, "")
    np.testing.assert_allclose(frames[0, :, :3, 2], np.tile([0, 0, 1], (4, 1)), atol=1e-12)
    np.testing.assert_allclose(np.abs(frames[1, :, :3, 2]), np.tile([1, 0, 0], (4, 1)), atol=1e-12)
    smooth = corner_frames(grid.nodes, grid.elements, 120.0, "")
    assert np.abs(smooth[0, 1, :3, 2] - smooth[1, 0, :3, 2]).max() < 1e-12
    poses = np.tile(np.eye(4), (len(grid.nodes), 1, 1))
    poses[:, :3, 3] = grid.nodes
    make = plate(1.0, 0.3, 0.1, 5.0, 0.02)
    made = [
        Shell(tuple(map(int, cell)), frame, make.stiffness(), make.moments())
        for cell, frame in zip(grid.elements, frames, strict=True)
    ]
    bodies = lumped_shells(made, poses)
    assert sum(body.mass for body in bodies) == pytest.approx(5.0 * 0.1 * 1.0)
    assert bodies[0].centre == pytest.approx([0.0, 0.0, 0.02])


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        (["shells.strip.thickness=0.0"], "shells\\[0\\].thickness"),
        (["shells.strip.material=steel"], "did you mean|rubber"),
        (["shells.strip.elements=[0,1]"], "no such number of elements"),
        (["shells.strip.drilling=-1.0"], "drilling"),
        (["shells.strip.mesh=none.inp"], "give one of 'corners' and 'mesh'"),
        (["connections.0.node=strip:begin"], "strip:start"),
        (["loads.0.node=strip/9/9"], "strip"),
    ],
)
def test_faults_are_named(settings: list[str], told: str) -> None:
    """One message each."""
    with pytest.raises((SceneError, FEImportError), match=told):
        erls.load_scene(ROOT / "data/shells/roll_up.toml", settings)


def test_meshes_and_sets_are_theirs(tmp_path: Path) -> None:
    """Unknown sets and files are refused when the mesh is read; triangles are elements with a corner that stands twice:
    the twisted cantilever of triangles within 3 % of the published deflection, twice as coarse as its quadrangles.
    """
    text = (ROOT / "data/shells/twisted.toml").read_text().replace("meshes/", f"{ROOT}/data/shells/meshes/")
    path = tmp_path / "scene.toml"
    path.write_text(text.replace("blade:TIP", "blade:END"))
    with pytest.raises((SceneError, FEImportError), match="blade:TIP"):
        assemble(erls.load_scene(path))
    path.write_text(text.replace("twisted.inp", "absent.inp"))
    with pytest.raises(SceneError, match="no such mesh file"):
        assemble(erls.load_scene(path))
    write_deck(tmp_path / "triangles.inp", twisted_grid(12, 2, "tri3"))
    path.write_text(text.replace(f"{ROOT}/data/shells/meshes/twisted.inp", "triangles.inp"))
    run = erls.simulate(erls.load_scene(path), verdict=False)
    assert isinstance(run, BodyRest)
    assert run.position("tip", 1.0)[2] == pytest.approx(TWISTED[0.32][0], rel=0.03)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (("tip = [12.0, 0.0, 0.0]", "tip = [12.0, 0.0, 0.0]\nloose = [1.0, 2.0, 3.0]"), "nodes.loose: no beam ends"),
        (("[[loads]]", '[[springs]]\ntype = "line"\nnode = "tip"\nto = "blade/999"\n[[loads]]'), "springs\\[0\\].to"),
        (("[[loads]]", '[[springs]]\ntype = "line"\nnode = "blade:TIP"\nto = "tip"\n[[loads]]'), "springs\\[0\\].node"),
    ],
)
def test_nodes_of_meshes_are_there(tmp_path: Path, change: tuple[str, str], told: str) -> None:
    """What only the mesh can tell is told with its field."""
    text = (ROOT / "data/shells/twisted.toml").read_text().replace("meshes/", f"{ROOT}/data/shells/meshes/")
    path = tmp_path / "scene.toml"
    path.write_text(text.replace(*change))
    with pytest.raises((SceneError, FEImportError), match=told):
        assemble(erls.load_scene(path))
