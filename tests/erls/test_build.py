"""From a scene to its mechanism: frames, payloads, shared models, warnings, against closed forms."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scenes
from scipy.spatial.transform import Rotation

from erls.errors import Cause, SceneError
from erls.maths.so3 import skew
from erls.mechanism.chain import Mechanism, poses
from erls.mechanism.links import link_mass_properties
from erls.scene.build import Built, build_mechanism
from erls.scene.read import load_scene
from fe_import.errors import Cause as FECause
from fe_import.errors import FEImportError
from fe_import.modal.file import write_modal_file
from fe_import.reduce import reduce_link

ROBOT = scenes.ROOT / "data/robot/two_link.toml"
UP = np.array([0.0, 0.0, 1.0])
ANGLES = [(0.0, 0.0), (0.3, -0.7), (-2.0, 1.1), (np.pi / 2, np.pi / 2)]


def built(path: Path, *changes: str) -> Built:
    return build_mechanism(load_scene(path, changes))


def robot(folder: Path, **changes: Any) -> Path:
    """The two-link robot on links of three elements, changed."""
    scenes.arm_link(
        folder,
        frame={**scenes.ARM_LINK["frame"], "nodes": {"root": [0.0, 0.0, 0.0], "tip": [0.5, 0.0, 0.0]}},
    )
    data = scenes.read_toml(ROBOT)
    for link in data["links"]:
        link["model"] = "arm.toml"
    for joint in data["joints"]:
        del joint["drive"]
    return scenes.write_toml(folder / "robot.toml", scenes.merged(data, changes))


def points(mechanism: Mechanism, theta: Any) -> np.ndarray:
    """(points, 3) undeformed world positions."""
    frames = poses(mechanism, np.asarray(theta, dtype=float))
    return np.array(
        [
            frames[p.link][:3, :3] @ mechanism.links[p.link].model.nodes[p.node] + frames[p.link][:3, 3]
            for p in mechanism.points
        ]
    )


def closed_form(theta: Any) -> np.ndarray:
    """(2, 3) ends of the links: the first turns about z, the second about the horizontal across it."""
    a, b = theta
    out, up = np.array([np.cos(a), np.sin(a), 0.0]), np.array([0.0, 0.0, 1.0])
    return np.array([0.5 * out, 0.5 * out + 0.5 * (np.cos(b) * out + np.sin(b) * up)])


def _dh_frames(data: dict[str, Any]) -> None:
    """Mesh poses in the Denavit-Hartenberg frames at the far ends, instead of in the joint frames."""
    far = {"frame": "dh", "position": [-0.5, 0.0, 0.0]}
    data["links"][0]["mesh_pose"] = {**far, "rotation_deg": [-90.0, 0.0, 0.0]}
    data["links"][1]["mesh_pose"] = far


def _modified(data: dict[str, Any]) -> None:
    """Craig's rows: each frame sits at its joint."""
    data["joints"][0]["dh"] = {"convention": "modified"}
    data["joints"][1]["dh"] = {"convention": "modified", "a": 0.5, "alpha_deg": 90.0}
    for link in data["links"]:
        link["mesh_pose"] = {"frame": "dh"}


def _modified_joint_frames(data: dict[str, Any]) -> None:
    _modified(data)
    for link in data["links"]:
        link["mesh_pose"] = {"frame": "joint"}


def _radians(data: dict[str, Any]) -> None:
    data["joints"][0]["dh"] = {"convention": "standard", "a": 0.5, "alpha": np.pi / 2}


VARIANTS = [lambda data: None, _dh_frames, _modified, _modified_joint_frames, _radians]


@pytest.mark.parametrize("variant", VARIANTS, ids=["standard", "dh frames", "modified", "modified joint", "radians"])
@pytest.mark.parametrize("theta", ANGLES)
def test_two_link_robot(tmp_path: Path, variant: Any, theta: tuple[float, float]) -> None:
    """Both conventions and both frames of a mesh pose describe one robot, 1e-12 m."""
    data = scenes.read_toml(robot(tmp_path))
    variant(data)
    result = built(scenes.write_toml(tmp_path / "robot.toml", data))
    np.testing.assert_allclose(points(result.mechanism, theta), closed_form(theta), atol=1e-12)
    assert result.warnings == ()


def test_offsets_of_dh_rows(tmp_path: Path) -> None:
    """theta adds to the joint coordinate, d shifts along its axis; prismatic joints slide along z."""
    path = robot(tmp_path)
    turned = built(path, "joints.0.dh.theta_deg=40", "joints.1.dh.theta=-0.3", "joints.0.dh.d=0.2").mechanism
    expected = closed_form((0.1 + np.radians(40), 0.2 - 0.3)) + 0.2 * UP
    np.testing.assert_allclose(points(turned, (0.1, 0.2))[1], expected[1], atol=1e-12)
    sliding = built(path, "joints.0.type=prismatic").mechanism
    np.testing.assert_allclose(points(sliding, (0.1, 0.2)), closed_form((0.0, 0.2)) + 0.1 * UP, atol=1e-12)


def test_base_pose(tmp_path: Path) -> None:
    """Turns about fixed x, then y, then z, then the shift."""
    base = {"position": [0.1, -0.2, 0.3], "rotation_deg": [20.0, -50.0, 130.0]}
    mechanism = built(robot(tmp_path, base=base)).mechanism
    turn = Rotation.from_euler("xyz", base["rotation_deg"], degrees=True)  # lower case: fixed axes
    expected = turn.apply(closed_form((0.4, -0.9))) + base["position"]
    np.testing.assert_allclose(points(mechanism, (0.4, -0.9)), expected, atol=1e-12)
    np.testing.assert_array_equal(mechanism.gravity, [0.0, 0.0, -9.81])  # stays in world axes


def test_mesh_poses_in_both_frames_are_the_same_mechanism(tmp_path: Path) -> None:
    """Any pose P in the joint frame is (Tx(a) Rx(α))⁻¹ P in the Denavit-Hartenberg frame: joints agree to 1e-12."""
    shift, turn = np.array([0.03, -0.02, 0.05]), Rotation.from_euler("xyz", [10.0, 20.0, -30.0], degrees=True)
    back = Rotation.from_euler("x", -90.0, degrees=True)
    data = scenes.read_toml(robot(tmp_path))
    joint, dh = (
        {"frame": frame, "position": p.tolist(), "rotation_deg": r.as_euler("xyz", degrees=True).tolist()}
        for frame, p, r in (("joint", shift, turn), ("dh", back.apply(shift - [0.5, 0, 0]), back * turn))
    )
    found = []
    for pose in (joint, dh):
        data["links"][0]["mesh_pose"] = pose
        found.append(built(scenes.write_toml(tmp_path / "robot.toml", data)).mechanism)
    for k in range(2):
        np.testing.assert_allclose(found[0].joints[k].before, found[1].joints[k].before, atol=1e-12)
        np.testing.assert_allclose(found[0].joints[k].after, found[1].joints[k].after, atol=1e-12)


def test_payload_lands_on_its_point(tmp_path: Path) -> None:
    """Mass, centre and inertia of link + payload by the parallel-axis theorem, 1e-9 relative.

    The link is a thin rod; the payload sits on its end, its centre off the node.
    """
    mass, offset = 0.7, np.array([0.01, 0.02, -0.03])
    inertia = np.array([[2e-3, 1e-4, 0.0], [1e-4, 3e-3, 2e-4], [0.0, 2e-4, 4e-3]])
    payload = {"point": "end2", "mass": mass, "inertia": inertia.tolist(), "offset": offset.tolist()}
    path = robot(tmp_path, payloads=[payload])
    bare = built(path, "payloads=[]").mechanism
    loaded = built(path).mechanism
    one, rod, both = (link_mass_properties(m.links[1]) for m in (bare, bare, loaded))
    rod_mass = 2700 * 0.01 * 0.02 * 0.5
    assert one.mass == pytest.approx(rod_mass, rel=1e-12)
    centre = np.array([0.5, 0.0, 0.0]) + offset
    expected = (rod_mass * rod.centre_of_mass + mass * centre) / (rod_mass + mass)
    assert both.mass == pytest.approx(rod_mass + mass, rel=1e-12)
    np.testing.assert_allclose(both.centre_of_mass, expected, atol=1e-12)
    total = inertia + rod.inertia
    for m, c in ((rod_mass, rod.centre_of_mass), (mass, centre)):
        total = total - m * skew(c - expected) @ skew(c - expected)
    np.testing.assert_allclose(both.inertia, total, atol=1e-9 * total.max())
    np.testing.assert_array_equal(loaded.links[0].invariants.m, bare.links[0].invariants.m)
    assert loaded.links[0].model is loaded.links[1].model  # shared, although only one carries the payload


def test_two_payloads_add_up(tmp_path: Path) -> None:
    """In any order, on one point or on two."""
    path = robot(tmp_path, payloads=[{"point": "end1", "mass": 0.1}, {"point": "end1", "mass": 0.3}])
    once = built(path, "payloads=[{point='end1', mass=0.4}]").mechanism.links[0]
    np.testing.assert_allclose(built(path).mechanism.links[0].invariants.m, once.invariants.m, atol=1e-12)


def test_motors_sit_at_the_end_of_the_link_before(tmp_path: Path) -> None:
    """Mass and inertia of the second motor load the first link; rotors count with the gear ratio squared."""
    path = robot(tmp_path)
    motor = "joints.1.motor={mass=0.4, inertia=[1e-4, 2e-4, 3e-4], rotor_inertia=2e-6, gear_ratio=50}"
    bare, loaded = built(path).mechanism, built(path, motor, "joints.0.motor={mass=9, rotor_inertia=1e-3}").mechanism
    before, after = (link_mass_properties(m.links[0]) for m in (bare, loaded))
    assert after.mass == pytest.approx(before.mass + 0.4, rel=1e-12)  # the first motor stands on the ground
    tip = np.array([0.5, 0.0, 0.0])
    np.testing.assert_allclose(
        after.mass * after.centre_of_mass, before.mass * before.centre_of_mass + 0.4 * tip, atol=1e-12
    )
    shift = after.centre_of_mass
    expected = before.inertia + np.diag([1e-4, 2e-4, 3e-4])
    for m, c in ((before.mass, before.centre_of_mass), (0.4, tip)):
        expected = expected - m * skew(c - shift) @ skew(c - shift)
    np.testing.assert_allclose(after.inertia, expected, atol=1e-9 * expected.max())
    assert link_mass_properties(loaded.links[1]).mass == pytest.approx(before.mass, rel=1e-12)
    assert [j.rotor_inertia for j in loaded.joints] == pytest.approx([1e-3, 2e-6 * 2500])


def test_links_of_one_source_share_one_model(tmp_path: Path) -> None:
    """Reduced once; other modes, or another source, are another model."""
    path = robot(tmp_path)
    told: list[str] = []
    first, second = build_mechanism(load_scene(path), told.append).mechanism.links
    assert first.model is second.model
    assert len(told) == 1
    first, second = built(path, "links.1.elastic_modes=3").mechanism.links
    assert (first.model.elastic_modes, second.model.elastic_modes) == (7, 3)
    first, second = built(path, "links.1.damping={ratio=0.1}").mechanism.links
    assert first.model is second.model
    assert not first.damping.any()
    assert second.damping.all()
    body = "rigid={mass=1, points={root=[0,0,0], tip=[0.5,0,0]}}"
    first, second = built(path, f"links=[{{name='a', {body}}}, {{name='b', {body}}}]", "points=[]").mechanism.links
    assert first.model is not second.model
    assert [first.elastic_modes, second.elastic_modes] == [0, 0]


def test_elastic_modes_keeps_the_lowest(tmp_path: Path) -> None:
    """Frequencies, shapes, matrices and invariants of the first modes; none when the link is not flexible."""
    path = robot(tmp_path)
    full = built(path).mechanism.links[0]
    for setting, count in (("elastic_modes=4", 4), ("elastic_modes=0", 0), ("flexible=false", 0)):
        link = built(path, f"links.0.{setting}").mechanism.links[0]
        assert link.elastic_modes == count
        keep = slice(0, 6 + count)
        np.testing.assert_array_equal(link.model.frequencies_hz, full.model.frequencies_hz[keep])
        np.testing.assert_array_equal(link.model.translation_shapes, full.model.translation_shapes[:, :, keep])
        np.testing.assert_array_equal(link.model.rotation_shapes, full.model.rotation_shapes[:, :, keep])
        np.testing.assert_array_equal(link.invariants.m, full.invariants.m[keep, keep])
        np.testing.assert_array_equal(link.invariants.Z, full.invariants.Z[:, :, keep, keep])
        np.testing.assert_array_equal(link.stiffness, full.stiffness[:count])
        assert link_mass_properties(link).mass == pytest.approx(link_mass_properties(full).mass, rel=1e-12)
        assert len(link.model.kinds) == 6 + count
    np.testing.assert_allclose(full.stiffness, (2 * np.pi * full.model.frequencies_hz[6:]) ** 2, rtol=1e-9)


def test_damping_of_the_scene_goes_before_that_of_the_link(tmp_path: Path) -> None:
    """c = 2 ζ ω; Rayleigh: α + β ω²; from the link description unless the scene says otherwise."""
    path = robot(tmp_path)
    scenes.write_toml(tmp_path / "arm.toml", {**scenes.read_toml(tmp_path / "arm.toml"), "damping": {"ratio": 0.02}})
    first, second = built(path, "links.1.damping.rayleigh={alpha=3, beta=1e-4}").mechanism.links
    omega = np.sqrt(first.stiffness)
    np.testing.assert_allclose(first.damping, 2 * 0.02 * omega, rtol=1e-9)
    np.testing.assert_allclose(second.damping, 3 + 1e-4 * omega**2, rtol=1e-9)
    (link, _) = built(path, "links.0.damping.ratios=[0.1, 0.2]").mechanism.links
    np.testing.assert_allclose(link.damping, 2 * np.array([0.1, 0.2, 0, 0, 0, 0, 0]) * omega, rtol=1e-9)


def test_interfaces_by_name(tmp_path: Path) -> None:
    """The first and the second one unless named; the first joint stands on the ground."""

    def seats(*changes: str) -> list[tuple[str, str | None]]:
        found = built(robot(tmp_path), *changes).mechanism
        ends = [None if joint.seat is None else joint.seat.name for joint in found.joints]
        return list(zip([link.inboard.name for link in found.links], ends, strict=True))

    assert seats() == [("root", None), ("root", "tip")]
    assert seats("links.0.inboard=tip", "links.1.outboard=tip") == [("tip", None), ("root", "root")]
    assert seats("joints.1.at=root") == [("root", None), ("root", "root")]


def test_points_by_name_and_place(tmp_path: Path) -> None:
    """A named node, an inner node, an interface, or the mesh node nearest to a position."""
    places = "points=[{name='a', link='forearm', node='root-tip/1'}, {name='b', link='forearm', position=[0.34,0,0]}]"
    mechanism = built(robot(tmp_path), places).mechanism
    nodes = mechanism.links[1].model.nodes
    np.testing.assert_allclose([nodes[p.node][0] for p in mechanism.points], [0.5 / 3, 1.0 / 3], atol=1e-12)


def test_modal_files_are_links_too(tmp_path: Path) -> None:
    """The same mechanism from a modal file as from the model it was made of."""
    path = robot(tmp_path)
    write_modal_file(tmp_path / "arm.modal.h5", reduce_link(tmp_path / "arm.toml"))
    changes = [f"links.{k}={{name='{n}', modal_file='arm.modal.h5', mesh_pose={{frame='joint'}}}}" for k, n in
               enumerate(("upper_arm", "forearm"))]  # fmt: skip
    direct, stored = built(path).mechanism, built(path, *changes).mechanism
    np.testing.assert_array_equal(direct.links[1].stiffness, stored.links[1].stiffness)
    np.testing.assert_array_equal(direct.links[0].invariants.X, stored.links[0].invariants.X)


def test_a_folder_as_link_file_is_named_by_its_field(tmp_path: Path) -> None:
    """Errors of `fe_import` say which field of the scene led there."""
    path = robot(tmp_path)
    for value, cause in (("nix.toml", FECause.FILE_NOT_FOUND), (".", FECause.NOT_READABLE)):
        with pytest.raises(FEImportError, match=r"robot.toml: links\[1\].model") as caught:
            built(path, f"links.1.model='{value}'")
        assert caught.value.cause == cause


def test_unknown_interface(tmp_path: Path) -> None:
    """Names those there are."""
    with pytest.raises(SceneError, match="did you mean 'root'") as caught:
        built(robot(tmp_path), "links.0.inboard=rooot")
    assert caught.value.cause == Cause.BAD_REFERENCE


def test_modes_of_equal_frequency_stay_together(tmp_path: Path) -> None:
    """A count of a scene that would part a pair takes one more, and the run says so."""
    square = {"width": 0.01, "height": 0.01}
    scenes.arm_link(tmp_path, sections={"s": square}, reduction={"fixed_interface_modes": 4, "elastic_modes": 8})
    data = {
        "simulation": {"duration": 1.0},
        "joints": [{"name": "j", "dh": {"convention": "standard"}}],
        "links": [{"name": "arm", "model": "arm.toml", "mesh_pose": {"frame": "joint"}, "elastic_modes": 3}],
    }
    built = build_mechanism(load_scene(scenes.write_toml(tmp_path / "pair.toml", data)))
    assert built.mechanism.links[0].elastic_modes == 4
    (told,) = built.warnings
    assert told.startswith("link 'arm': links.arm.elastic_modes = 3 would part modes of equal frequency (")
    assert told.endswith("4 are kept")
