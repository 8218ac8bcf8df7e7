"""Loops of flexible links: frames and conditions against differences, two formulations, statics, work."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import loop_scenes
import numpy as np
import pytest
import scenes

from erls.equations.formulation import TreeFormulation
from erls.equations.loops.closed_chain import ClosedChain
from erls.equations.loops.tied import Tied
from erls.errors import Cause, SimulationError
from erls.maths.se3 import pose
from erls.maths.so3 import Array, fixed_axes, skew
from erls.mechanism.chain import Mechanism
from erls.mechanism.joint_types import HOLDING_TYPES, JOINT_TYPES
from erls.mechanism.links import link_mass_properties
from erls.mechanism.loops import Loop, LoopEnd
from erls.run.chain.link_loads import link_loads

STEP = 1e-6
OFFSET = pose(fixed_axes(0.3, -0.5, 0.8), np.array([0.02, -0.01, 0.03]))


def _random(tree: TreeFormulation) -> tuple[Array, Array]:
    rng = np.random.default_rng(5)
    y, v = rng.uniform(-1, 1, (2, tree.size))
    f = len(tree.free_joints)
    y[f:], v[f:] = 2e-2 * y[f:], 1e-1 * v[f:]
    return y, v


def _ends(mechanism: Mechanism) -> list[LoopEnd]:
    return [LoopEnd(k, link.model.interface_nodes[1].node, OFFSET) for k, link in enumerate(mechanism.links)]


def _held(mechanism: Mechanism, name: str) -> TreeFormulation:
    """Equations of the chain, loops holding the end of every link."""
    ground = LoopEnd(None, 0, OFFSET)
    loops = [Loop(str(k), JOINT_TYPES["spherical"], ground, end) for k, end in enumerate(_ends(mechanism))]
    return loop_scenes.tree(replace(mechanism, loops=tuple(loops)), name)


@pytest.mark.parametrize("name", loop_scenes.FORMULATIONS)
def test_frames_move_with_their_twists(tmp_path: Path, name: str) -> None:
    """Twist = derivative of the pose, rows · rates beside prescribed joints, bias = derivative of the twist; 1e-7."""
    tree = _held(scenes.mechanism(scenes.three_links(tmp_path, "prescribed")), name)
    y, v = _random(tree)
    t, still = 0.2, np.zeros(tree.size)
    found = tree.frames(t, y, v)
    at_rest = tree.frames(t, y, still)
    ahead, behind = (tree.frames(t + s * STEP, y + s * STEP * v, v) for s in (1, -1))
    for one, rest, after, before in zip(found, at_rest, ahead, behind, strict=True):
        size = 1e-7 * max(1.0, float(np.abs(one.bias).max()))
        turning = one.pose[:3, :3].T @ (after.pose - before.pose)[:3] / (2 * STEP)
        np.testing.assert_allclose(turning[:, 3], one.twist[:3], atol=size)
        np.testing.assert_allclose(turning[:, :3], skew(one.twist[3:]), atol=size)
        np.testing.assert_allclose(one.rows[:, tree.free] @ v, one.twist - rest.twist, atol=1e-10)
        np.testing.assert_allclose((after.twist - before.twist) / (2 * STEP), one.bias, atol=size)
        assert np.abs(one.bias).max() > 0.1


@pytest.mark.parametrize("name", loop_scenes.FORMULATIONS)
def test_frames_sit_where_runs_draw_the_nodes(tmp_path: Path, name: str) -> None:
    """Origin = drawn node plus the arm turned by its rotation, to second order in that rotation."""
    tree = _held(scenes.mechanism(scenes.three_links(tmp_path)), name)
    y, v = _random(tree)
    state = tree.state(0.0, y, v)
    for k, frame in enumerate(tree.frames(0.0, y, v)):
        model, world = tree.mechanism.links[k].model, state.poses[k]
        node = model.interface_nodes[1].node
        translation, rotation = model.node_shape(node)
        assert rotation is not None
        phi = rotation @ state.modal[k]
        local = model.nodes[node] + translation @ state.modal[k] + OFFSET[:3, 3] + np.cross(phi, OFFSET[:3, 3])
        distance = np.linalg.norm(world[:3, :3] @ local + world[:3, 3] - frame.pose[:3, 3])
        assert distance < float(phi @ phi) * float(np.linalg.norm(OFFSET[:3, 3])) + 1e-14


@pytest.mark.parametrize("kind", HOLDING_TYPES)
def test_conditions_against_differences(tmp_path: Path, kind: str) -> None:
    """Φ̇ and Φ̈ of each kind of closing joint, between two links and to the ground; names for every row. 1e-6."""
    mechanism = scenes.mechanism(scenes.three_links(tmp_path, "mixed"))
    ends, ground = _ends(mechanism), LoopEnd(None, 0, OFFSET)
    loops = Loop("a", JOINT_TYPES[kind], ends[0], ends[2]), Loop("b", JOINT_TYPES[kind], ground, ends[1])
    tree = loop_scenes.tree(replace(mechanism, loops=loops), "ffr")
    tied = Tied(tree)
    y, v = _random(tree)
    found = tied.closure(0.0, y, v)
    ahead, behind = (tied.closure(0.0, y + s * STEP * v, v) for s in (1, -1))
    np.testing.assert_allclose((ahead.violation - behind.violation) / (2 * STEP), found.rate, atol=1e-7)
    np.testing.assert_allclose((ahead.rate - behind.rate) / (2 * STEP), found.bias, atol=1e-6)
    np.testing.assert_allclose(found.rows[:, tree.free] @ v, found.rate, atol=1e-12)
    freedoms = {"revolute": 1, "prismatic": 1, "cylindrical": 2, "spherical": 3, "fixed": 0, "line": 4}
    freedoms |= {"planar": 3, "universal": 2, "screw": 1}
    assert len(found.violation) == len(tied.rows.names) == 2 * (6 - freedoms[kind])


def _soft(folder: Path, data: dict[str, Any], softness: float, names: tuple[str, ...]) -> dict[str, Any]:
    """The linkage with slender flexible links in two modes beside the axial one; deflections grow with ``softness``."""
    for name, record in zip(("crank", "coupler", "rocker"), data["links"], strict=False):
        if name not in names:
            continue
        length = record["rigid"]["points"]["tip"][0]
        material = {"youngs_modulus": 7e10 / softness, "poissons_ratio": 0.33, "density": 2700.0}
        link = {
            "units": {"unusual": True},
            "materials": {"m": material},
            "sections": {"s": {"shape": "rectangular", "width": 0.008, "height": 0.02}},
            "frame": {
                "nodes": {"root": [0.0, 0.0, 0.0], "tip": [length, 0.0, 0.0]},
                "members": [{"from": "root", "to": "tip", "elements": 4, "material": "m", "section": "s"}],
            },
            "interfaces": [{"name": "root", "node": "root"}, {"name": "tip", "node": "tip"}],
            "reduction": {"fixed_interface_modes": 2, "elastic_modes": 6},
        }
        scenes.write_toml(folder / f"{name}.toml", link)
        record.pop("rigid")
        record["model"] = f"{name}.toml"
    middle = {"name": "middle", "link": "coupler", "position": [loop_scenes.LENGTHS[1] / 2, 0.0, 0.0]}
    data["points"] = [*(p for p in data["points"] if p["node"] != "middle"), middle]
    return data


def _turn(data: dict[str, Any]) -> dict[str, Any]:
    """The crank makes a third of a turn within a second, so slowly that deflections follow the loads."""
    move = {"shape": "polynomial", "from_deg": 60.0, "to_deg": 180.0, "duration": 1.0}
    return loop_scenes.driven(data, {"type": "motion", "motion": move})


SCENES = {
    "four-bar": (loop_scenes.four_bar, ("coupler", "rocker")),
    "slider-crank": (loop_scenes.slider_crank, ("crank", "coupler")),
}


@pytest.mark.parametrize("scene", SCENES)
def test_formulations_agree_to_second_order(tmp_path: Path, scene: str) -> None:
    """Twice the stiffness halves the deflection and quarters the distance of ERLS and FFR, within 5 %.

    The deflection is that of the coupler's middle against the rigid linkage; step 3 ms, static start.
    """
    make, names = SCENES[scene]
    t = np.linspace(0, 0.15, 4)
    distances, deflections = [], []
    rigid = loop_scenes.run(tmp_path, _turn(make()), duration=0.15, step=3e-3).position("coupler middle", t)
    for softness in (4.0, 2.0):
        runs = []
        for name in ("erls", "ffr"):
            data = _soft(tmp_path, make(initial={"deformation": "static"}), softness, names)
            runs.append(loop_scenes.run(tmp_path, _turn(data), name, duration=0.15, step=3e-3, effects="linear"))
        apart = [np.abs(runs[0].position(p, t) - runs[1].position(p, t)).max() for p in ("middle", "coupler tip")]
        distances.append(max(apart))
        deflections.append(np.abs(runs[0].position("middle", t) - rigid).max())
    assert 1.9 < deflections[0] / deflections[1] < 2.1
    assert 3.8 < distances[0] / distances[1] < 4.2
    assert distances[0] < 0.03 * deflections[0]


@pytest.mark.parametrize("name", ["erls", "minimum-norm", "ffr", "mean-axis"])
def test_static_start_is_at_rest(tmp_path: Path, name: str) -> None:
    """With the crank held, a loop in equilibrium under its weight does not accelerate; and it has moved."""
    data = _soft(tmp_path, loop_scenes.four_bar(initial={"deformation": "static"}), 1.0, ("coupler", "rocker"))
    still = {"shape": "polynomial", "from_deg": 60.0, "to_deg": 60.0, "duration": 1.0}
    chain = loop_scenes.chain(tmp_path, loop_scenes.driven(data, {"type": "motion", "motion": still}), name)
    y, v = chain.initial_state()
    gaps = chain.openings(chain.closure(0.0, y, v))
    assert np.abs(gaps).max() < 1e-13
    loose = np.abs(chain.acceleration(0.0, chain.start.y, v) * chain.metres).max()
    assert np.abs(chain.acceleration(0.0, y, v) * chain.metres).max() < 1e-7 * loose
    assert np.abs((y - chain.start.y) * chain.metres).max() > 1e-6


def test_loads_on_a_link_include_those_of_its_loop(tmp_path: Path) -> None:
    """At rest the joints and the loop carry the rocker: forces and moments add up with its weight, 1e-6 of that."""
    data = _soft(tmp_path, loop_scenes.four_bar(initial={"deformation": "static"}), 1.0, ("coupler", "rocker"))
    still = {"shape": "polynomial", "from_deg": 60.0, "to_deg": 60.0, "duration": 1.0}
    run = loop_scenes.run(tmp_path, loop_scenes.driven(data, {"type": "motion", "motion": still}), duration=1e-3)
    link, state = run.formulation.mechanism.links[2], run.states([0.0])[0]
    wrenches = link_loads(run.instants([0.0]), 2).interfaces.reshape(2, 6)
    properties = link_mass_properties(link)
    world = state.poses[2][:3, :3]
    weight = world.T @ run.formulation.mechanism.gravity * properties.mass
    np.testing.assert_allclose(wrenches[:, :3].sum(axis=0), -weight, atol=1e-6 * np.linalg.norm(weight))
    moment = np.cross(properties.centre_of_mass, weight)
    for wrench, interface in zip(wrenches, link.model.interface_nodes, strict=True):
        moment += wrench[3:] + np.cross(interface.position, wrench[:3])
    deflection = 1e-3 * np.linalg.norm(wrenches)  # arms are those of the undeformed link
    np.testing.assert_allclose(moment, 0.0, atol=deflection)
    assert np.linalg.norm(wrenches[1, :3]) > 0.1 * np.linalg.norm(weight)


def test_static_start_that_no_link_can_carry(tmp_path: Path) -> None:
    """A four-bar of jelly buckles within small displacements: along the load its stiffness falls through zero at a
    limit point, 0.0036 of its weight, and no equilibrium is found under all of it, so that allowing it is no remedy.
    """
    data = _soft(tmp_path, loop_scenes.four_bar(initial={"deformation": "static"}), 1e6, ("coupler", "rocker"))
    with pytest.raises(SimulationError, match=r"'coupler' buckles .* no equilibrium") as caught:
        loop_scenes.chain(tmp_path, data).initial_state()
    assert caught.value.cause == Cause.UNSTABLE_START
    assert "allow_unstable" not in (caught.value.remedy or "")


@pytest.mark.parametrize("name", loop_scenes.FORMULATIONS)
def test_work_on_flexible_loops_is_their_energy(tmp_path: Path, name: str) -> None:
    """Dense: torque of the crank times rate over 20 ms against kinetic, elastic and gravity energy, 1e-7 of it."""
    data = _soft(tmp_path, loop_scenes.four_bar(), 5.0, ("coupler",))
    data["links"][1]["elastic_modes"] = 2
    chain_run = loop_scenes.run(tmp_path, _turn(data), name, integrator="dop853", duration=0.02, rtol=1e-9)
    energy = chain_run.energy(np.linspace(0, 0.02, 9)).total
    assert abs(loop_scenes.work(chain_run, "j0") - (energy[-1] - energy[0])) < 1e-7 * np.ptp(energy)


def test_flexible_links_make_conditions_independent(tmp_path: Path) -> None:
    """Out-of-plane bending takes up what a rigid planar linkage leaves open."""
    data = _soft(tmp_path, loop_scenes.four_bar(), 1.0, ("coupler", "rocker"))
    assert loop_scenes.chain(tmp_path, data).redundant == ()


def test_implicit_methods_know_the_stiff_terms(tmp_path: Path) -> None:
    """Their Jacobian: -M⁻¹ K acts along the loop; against differences of the accelerations, where it is stiff."""
    data = _soft(tmp_path, loop_scenes.four_bar(), 1.0, ("coupler", "rocker"))
    chain: ClosedChain = loop_scenes.chain(tmp_path, data)
    y, v = chain.initial_state()
    stiffness, damping = chain.stiffness_and_damping(0.0, y, v)
    mass = chain.mass_matrix(0.0, y)
    rng = np.random.default_rng(1)
    way = rng.uniform(-1, 1, chain.size) / np.maximum(chain.metres, 1.0)  # torsion moves no node
    h = 1e-7
    moved = (chain.acceleration(0.0, y + h * way, v) - chain.acceleration(0.0, y - h * way, v)) / (2 * h)
    wanted = -np.linalg.solve(mass, stiffness @ way)
    slowed = (chain.acceleration(0.0, y, h * way) - chain.acceleration(0.0, y, -h * way)) / (2 * h)
    assert np.abs((moved - wanted) * chain.metres).max() < 1e-3 * np.abs(wanted * chain.metres).max()
    rates = -np.linalg.solve(mass, damping @ way)
    assert np.abs((slowed - rates) * chain.metres).max() < 1e-6 * np.abs(rates * chain.metres).max()


@pytest.mark.parametrize("path", ["four_bar/flexible.toml", "slider_crank/flexible.toml"])
def test_shipped_flexible_scenes_start(path: str) -> None:
    """They close, run without warnings, and their first milliseconds agree between formulations.

    Links bend by up to 1.2 mm over 0.35 m: a few δ²/L, 1e-5 m.
    """
    from erls import load_scene
    from erls.simulation.simulate import simulate

    changes = ["simulation.duration=0.01", "simulation.step=1e-3"]
    runs = [
        simulate(load_scene(scenes.ROOT / "data" / path, [*changes, f"simulation.formulation={name}"]), verdict=False)
        for name in ("erls", "ffr")
    ]
    assert runs[0].warnings == runs[1].warnings == ()
    for point in runs[0].point_names:
        np.testing.assert_allclose(runs[0].position(point, 0.01), runs[1].position(point, 0.01), atol=1e-5)
