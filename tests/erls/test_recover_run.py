"""Section forces and stress during a run: equilibrium with the joints' reactions and with what the link carries."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scenes
from numpy.typing import NDArray

import erls
from erls.errors import Cause, ReportedError
from erls.run.chain.run import ChainRun
from erls.run.recovery import export_recovery, recovery_places

Array = NDArray[np.float64]
ENDS = {"recovery": {"nodes": ["root", "tip"]}}


def in_link_axes(run: ChainRun, link: int, joint: str, t: Array) -> Array:
    """(k, 6) reaction of a joint in the mesh axes of a link."""
    turns = np.array([s.poses[link][:3, :3] for s in run.states(t)])
    return np.concatenate([np.einsum("kji,kj->ki", turns, part) for part in run.reaction(joint, t)], axis=1)


def relative(found: Array, expected: Array) -> tuple[float, float]:
    """Largest error of the forces and of the moments, each by the largest of its kind."""
    off = np.abs(found - expected)
    return tuple(float(off[:, part].max() / np.abs(expected[:, part]).max()) for part in (slice(3), slice(3, 6)))  # type: ignore[return-value]


def at_node(run: ChainRun, link: str, t: Array, name: str, **options: Any) -> Array:
    """(k, 6) section forces of a link at the one element end on a node."""
    maps = recovery_places(run, link)
    model = run.formulation.mechanism.links[run.link_names.index(link)].model
    (place,) = np.flatnonzero(maps.nodes == model.node_names[name])
    return np.asarray(erls.section_forces(run, link, t, **options)[:, place])


@pytest.mark.parametrize("formulation", ["erls", "ffr"])
def test_section_forces_balance_the_reaction(tmp_path: Path, formulation: str) -> None:
    """At the root of the L pendulum with 6 elastic modes, whatever formulation made the run.

    Exact but for the inertia and weight of half an element there: 1/80 of the link's 23 N, and of the moment w h² / 12.
    Its modes alone, free at the root, miss the shear and the moment altogether.
    """
    scenes.l_link(tmp_path, 20, **ENDS)
    link = {"name": "l", "model": "link.toml", "elastic_modes": 6}
    simulation = {"duration": 0.2, "formulation": formulation}
    run = erls.simulate(scenes.l_scene(tmp_path, simulation=simulation, links=[link]), verdict=False)
    t = np.linspace(0.01, 0.2, 41)
    reaction = -in_link_axes(run, 0, "shoulder", t)  # what the link does to the ground
    force, moment = relative(at_node(run, "l", t, "root"), reaction)
    assert force < 1.2 / 80
    assert moment < 1e-3
    plain_force, plain_moment = relative(at_node(run, "l", t, "root", static_correction=False), reaction)
    assert plain_force > 10 * force
    assert plain_moment > 100 * moment
    assert plain_moment > 0.5


def test_a_run_file_recovers_the_same(tmp_path: Path) -> None:
    """Maps travel with the run; scalars and arrays of times agree; the CSV holds the numbers."""
    scenes.l_link(tmp_path, 4, **ENDS)
    run = erls.simulate(scenes.l_scene(tmp_path, simulation={"duration": 0.02}), verdict=False)
    erls.save_run(tmp_path / "l.run.h5", run)
    again = erls.load_run(tmp_path / "l.run.h5")
    values = erls.section_forces(run, "l", [0.0, 0.01])
    assert values.shape == (2, 2, 6)
    scale = np.abs(values[1]).max()
    np.testing.assert_allclose(erls.section_forces(again, "l", 0.01), values[1], atol=1e-6 * scale)
    export_recovery(run, "l", tmp_path / "l.csv", [0.0, 0.01])
    with (tmp_path / "l.csv").open(encoding="utf-8", newline="") as file:
        head, *rows = csv.reader(file)
    assert head[:6] == ["t [s]", "node", "element", "x [m]", "y [m]", "z [m]"]
    assert head[6:] == ["N [N]", "Vy [N]", "Vz [N]", "T [N m]", "My [N m]", "Mz [N m]"]
    assert len(rows) == 4
    np.testing.assert_array_equal(np.array(rows[2:], dtype=float)[:, 6:], values[1])


def test_the_outer_joint_loads_the_inner_link(tmp_path: Path) -> None:
    """Of three links the second: its tip section balances the third joint's reaction, motor mass included."""
    changes: dict[str, Any] = {"frame": {"members": [{**scenes.ARM_LINK["frame"]["members"][0], "elements": 40}]}}
    path = scenes.three_links(tmp_path)
    scenes.arm_link(tmp_path, **changes, **ENDS)
    run = erls.simulate(erls.load_scene(path, ["simulation.duration=0.1"]), verdict=False)
    t = np.linspace(0.01, 0.1, 11)
    last = run.formulation.mechanism.links[2].inboard.node
    states = run.states(t)
    # moved from the third link's inboard node to the second link's tip, and into its local axes
    reaction = in_link_axes(run, 1, "j3", t)
    for k, state in enumerate(states):
        frames = [state.poses[n] for n in (1, 2)]
        nodes = [run.formulation.mechanism.links[1].model.interface_nodes[1].node, last]
        places = [
            f[:3, :3] @ (m.nodes[n] + m.translation_shapes[n] @ q) + f[:3, 3]
            for f, n, m, q in zip(
                frames, nodes, (run.formulation.mechanism.links[j].model for j in (1, 2)), state.modal[1:], strict=True
            )
        ]
        arm = frames[0][:3, :3].T @ (places[1] - places[0])
        reaction[k, 3:] += np.cross(arm, reaction[k, :3])
    maps = recovery_places(run, "b")
    axes = maps.axes[-1]
    expected = -np.concatenate([reaction[:, :3] @ axes.T, reaction[:, 3:] @ axes.T], axis=1)
    force, moment = relative(at_node(run, "b", t, "tip"), expected)
    assert force < 0.02  # half of an element: 1/40 of the link's own inertia
    assert moment < 2e-3


def turning(folder: Path, rate: float, gravity: float, payload: dict[str, Any], **more: Any) -> ChainRun:
    """A straight arm of 40 elements along x, turned about z at a constant rate, with a payload on its tip.

    Strongly damped: what the sudden centrifugal force stirs up is gone after 10 ms.
    """
    members = [{**scenes.ARM_LINK["frame"]["members"][0], "elements": 40}]
    frame = {"nodes": {"root": [0.0, 0.0, 0.0], "tip": [0.5, 0.0, 0.0]}, "members": members}
    section = {"s": {"width": 0.02, "height": 0.02}}
    scenes.arm_link(folder, frame=frame, sections=section, reduction={"elastic_modes": 6}, **ENDS)
    times = [0.0, 0.1, 0.2, 0.3]
    motion = {"shape": "table", "times": times, "values": [rate * at for at in times], "rates": [rate] * 2}
    data = {
        "gravity": [0.0, 0.0, -gravity],
        "simulation": {"duration": 0.02, "step": 1e-4},
        "initial": {"deformation": "static"},
        "joints": [
            {
                "name": "j",
                "dh": {"convention": "standard", "a": 0.5},
                "drive": {"type": "motion", "motion": motion},
            }
        ],
        "links": [{"name": "a", "model": "arm.toml", "mesh_pose": {"frame": "joint"}, "damping": {"ratio": 0.7}}],
        "points": [{"name": "end", "link": "a", "node": "tip"}],
        "payloads": [{"point": "end", **payload}],
        **more,
    }
    return erls.simulate(scenes.write_toml(folder / "turning.toml", data), verdict=False)


@pytest.mark.parametrize("given", ["gravity", "load"])
def test_a_payload_at_rest_loads_the_tip(tmp_path: Path, given: str) -> None:
    """Shear is its weight, bending and torsion follow from its offset; 1/80 of the arm's own 5.3 N is the element's.

    A load on all mass in place of gravity does the same.
    """
    payload = {"mass": 2.0, "offset": [0.03, 0.02, 0.0], "inertia": [1e-3, 1e-3, 1e-3]}
    if given == "gravity":
        run = turning(tmp_path, 0.0, 9.81, payload)
    else:
        run = turning(tmp_path, 0.0, 0.0, payload, loads=[{"force_per_mass": [0.0, 0.0, -9.81]}])
    weight = 2.0 * 9.81
    found = at_node(run, "a", np.array([0.0, 0.01]), "tip")
    expected = np.array([0.0, 0.0, -weight, -0.02 * weight, 0.03 * weight, 0.0])
    np.testing.assert_allclose(found, np.tile(expected, (2, 1)), atol=1.1 * 5.3 / 80)


@pytest.mark.parametrize("given", [{}, {"axes": "link"}, {"follower": True}])
def test_a_load_at_rest_loads_the_tip(tmp_path: Path, given: dict[str, object]) -> None:
    """Force and moment at the tip of a cantilever, from two modes: what the load is there, and at the clamp its
    reaction, to what the turn of the tip makes of it (0.5 mrad).
    """
    scenes.l_link(tmp_path, 4, **ENDS)
    force, moment = [1.0, -2.0, 3.0], [0.4, 0.3, -0.2]
    joint = {**scenes.L_SCENE["joints"][0], "type": "fixed"}
    path = scenes.l_scene(
        tmp_path,
        joints=[joint],
        links=[{"name": "l", "model": "link.toml", "elastic_modes": 2}],
        loads=[{"point": "tip", "force": force, "moment": moment, **given}],
        gravity=[0.0, 0.0, 0.0],
        initial={"deformation": "static"},
        simulation={"duration": 1e-3, "step": 1e-3},
    )
    run = erls.simulate(path, verdict=False)
    t = np.zeros(1)
    expected = np.array([[-2.0, -1.0, 3.0, 0.3, -0.4, -0.2]])  # the last leg lies along y
    assert max(relative(at_node(run, "l", t, "tip"), expected)) < 2e-3
    reaction = -in_link_axes(run, 0, "shoulder", t)
    assert max(relative(at_node(run, "l", t, "root"), reaction)) < 2e-3


def test_a_turning_payload_pulls(tmp_path: Path) -> None:
    """N at the tip is m ω² r, at the root that and the arm's own; the six lowest modes alone have no axial force."""
    rate, mass = 6.0, 1.0
    run = turning(tmp_path, rate, 0.0, {"mass": mass})
    t = np.array([0.015, 0.02])
    at_tip, own = mass * rate**2 * 0.5, 2700 * 4e-4 * rate**2 * 0.5**2 / 2
    np.testing.assert_allclose(at_node(run, "a", t, "tip")[:, 0], at_tip, rtol=0.02)  # the tip's half element: 1.4 %
    np.testing.assert_allclose(at_node(run, "a", t, "root")[:, 0], at_tip + own, rtol=0.002)
    alone = at_node(run, "a", t, "root", static_correction=False)[:, 0]
    assert np.abs(alone).max() < 0.05 * (at_tip + own)


def test_what_cannot_be_recovered_is_said(tmp_path: Path) -> None:
    """A link without maps, the other quantity, an unknown link, a time outside the run."""
    scenes.l_link(tmp_path, 2, **ENDS)
    run = erls.simulate(scenes.l_scene(tmp_path, simulation={"duration": 0.01}), verdict=False)
    for ask, cause, said in (
        (lambda: erls.stress(run, "l", 0.0), Cause.BAD_FIELD, "section_forces"),
        (lambda: erls.section_forces(run, "arm", 0.0), Cause.BAD_REFERENCE, "arm"),
        (lambda: erls.section_forces(run, "l", 1.0), Cause.TIME_OUT_OF_RANGE, "cover"),
        (lambda: export_recovery(run, "l", tmp_path / "no" / "l.csv", 0.0), Cause.NOT_WRITABLE, "l.csv"),
    ):
        with pytest.raises(ReportedError) as caught:
            ask()
        assert str(caught.value.cause) == str(cause)
        assert said in str(caught.value)
    scenes.l_link(tmp_path, 2)
    bare = erls.simulate(scenes.l_scene(tmp_path, simulation={"duration": 0.01}), verdict=False)
    with pytest.raises(ReportedError, match=r"\[recovery\]"):
        erls.section_forces(bare, "l", 0.0)


def test_stress_of_a_solid_at_rest(tmp_path: Path) -> None:
    """The held solid L under its weight: bending stress M z / I in the middle of its first leg, within 2 %."""
    source = scenes.ROOT / "data" / "l_shape" / "links"
    data = scenes.read_toml(source / "solid.toml")
    data["solid"]["mesh"] = str(source / data["solid"]["mesh"])
    data["reduction"] = {"fixed_interface_modes": 6, "elastic_modes": 8}
    scenes.write_toml(tmp_path / "solid.toml", {**data, "recovery": {"all": True}})
    held = {"shape": "table", "times": [0.0, 1.0, 2.0, 3.0], "values": [0.0] * 4}
    scene = {
        "simulation": {"duration": 1e-3, "step": 1e-3},
        "initial": {"deformation": "static"},
        "base": {"rotation_deg": [-90.0, 0.0, 0.0]},
        "joints": [
            {
                "name": "j",
                "dh": {"convention": "standard", "alpha_deg": 90.0},
                "drive": {"type": "motion", "motion": held},
            }
        ],
        "links": [{"name": "l", "model": "solid.toml"}],
    }
    run = erls.simulate(scenes.write_toml(tmp_path / "scene.toml", scene), verdict=False)
    maps = recovery_places(run, "l")
    at = run.formulation.mechanism.links[0].model.nodes[maps.nodes]
    x = at[np.abs(at[:, 0] - 0.25).argmin(), 0]
    surface = np.flatnonzero((np.abs(at[:, 0] - x) < 1e-9) & (np.abs(np.abs(at[:, 2]) - 0.005) < 1e-9))
    assert len(surface) >= 6
    found = erls.stress(run, "l", 0.0)[surface]
    # legs of 0.03 m x 0.01 m; the second one on the outer end of the first, which reaches to the corner at 0.515 m
    moment = 7800 * 9.81 * 0.01 * (0.03 * (0.515 - x) ** 2 / 2 + 0.03 * 0.485 * (0.5 - x))
    expected = moment * at[surface, 2] / (0.03 * 0.01**3 / 12)
    np.testing.assert_allclose(found[:, 0], expected, atol=0.02 * np.abs(expected).max())
    assert np.abs(found[:, 1:3]).max() < 0.02 * np.abs(expected).max()
