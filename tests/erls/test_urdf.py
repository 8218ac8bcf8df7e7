"""Robots in URDF: five of different makers against pinocchio, flexible links, faults.

The files hold joints and masses of public robots (who made them and under which licence: their first lines); the
frames and accelerations beside them come from pinocchio 4.1, at 20 configurations drawn with seed 7.
"""

from __future__ import annotations

import json
import re
import shutil
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import ROOT

import erls
from erls.cli.main import main
from erls.equations.registry import formulate
from erls.errors import Cause, SceneError
from erls.importers.bodies import bodies_of
from erls.importers.robot_scene import imported
from erls.importers.urdf import angles_of, read_urdf
from erls.maths.so3 import fixed_axes
from erls.scene.build import build_mechanism

FOLDER = ROOT / "tests/data/urdf"
SHIPPED = ROOT / "data/robot/ur5e.urdf"
ROBOTS = ("baxter", "kinova", "panda", "solo12", "ur5e")


@pytest.fixture(scope="module")
def reference() -> dict[str, Any]:
    """What pinocchio says."""
    with np.load(FOLDER / "pinocchio.npz") as stored:
        return dict(stored)


def described(name: str) -> Path:
    """The file of a robot."""
    return SHIPPED if name == "ur5e" else FOLDER / f"{name}.urdf"


def written(name: str, folder: Path, content: str = "", **more: Any) -> Path:
    """The scene of a robot."""
    robot = described(name)
    if content:
        robot = folder / f"{name}.urdf"
        robot.write_text(content, encoding="utf-8")
    path = folder / f"{name}.toml"
    made = imported(read_urdf(robot), robot, folder, {}, **more)
    path.write_text(made.scene, encoding="utf-8")
    return path


def uncoupled(name: str) -> str:
    """The text of a robot whose joints all move alone, as those of the reference do."""
    return re.sub(r"<mimic[^>]*/>", "", described(name).read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", ROBOTS)
def test_poses_are_those_of_an_independent_program(name: str, reference: dict[str, Any], tmp_path: Path) -> None:
    """Frames of outermost links at 20 configurations to 1e-12: rounding of products of ten poses of some metres."""
    scene = erls.load_chain(written(name, tmp_path, uncoupled(name)))
    formulation = formulate(build_mechanism(scene).mechanism, scene.record.simulation)
    joints = [joint.name for joint in formulation.mechanism.joints]
    order = [list(reference[f"{name}_joints"]).index(joint) for joint in joints]
    bodies, _ = bodies_of(read_urdf(described(name)))
    numbers = {formulation.mechanism.links[k].name: k for k in formulation.mechanism.bodies}
    for q, poses in zip(reference[f"{name}_q"], reference[f"{name}_poses"], strict=True):
        state = formulation.state(0.0, q[order], np.zeros(len(q)))
        for frame, pose in zip(reference[f"{name}_frames"], poses, strict=True):
            body = next(body for body in bodies if frame in body.frames)
            at = body.frames[frame] if body is bodies[0] else state.poses[numbers[body.name]] @ body.frames[frame]
            np.testing.assert_allclose(at[:3], pose, rtol=0, atol=1e-12, err_msg=frame)


@pytest.mark.parametrize("name", ROBOTS)
def test_accelerations_are_those_of_an_independent_program(
    name: str, reference: dict[str, Any], tmp_path: Path
) -> None:
    """Under gravity, with rates, without damping: masses, centres and inertias, merged links included, to 1e-9 of the
    largest, which the condition of mass matrices of fingers on arms (1e5) makes of rounding.
    """
    text = re.sub(r"<dynamics[^>]*/>", "", uncoupled(name))
    path = written(name, tmp_path, text)
    for q, v, a in zip(*(reference[f"{name}_{what}"] for what in "qva"), strict=False):
        starts = [
            f"joints.{k}.initial={{position={float(q[n])!r}, rate={float(v[n])!r}}}"
            for k, n in enumerate(_order(path, reference[f"{name}_joints"]))
        ]
        scene = erls.load_chain(path, ["simulation.duration=1e-6", *starts])
        run = erls.simulate(scene, verdict=False)
        found = dict(zip(run.joint_names, run.solution.a[0], strict=True))
        expected = dict(zip(reference[f"{name}_joints"], a, strict=True))
        for joint, value in found.items():
            assert value == pytest.approx(expected[joint], abs=1e-9 * np.abs(a).max()), joint


def _order(path: Path, names: Any) -> list[int]:
    """Number in the reference of each joint of a scene."""
    return [list(names).index(joint["name"]) for joint in tomllib.loads(path.read_text(encoding="utf-8"))["joints"]]


@pytest.mark.parametrize(
    "angles", [(0.1, 0.2, 0.3), (1.0, np.pi / 2, -2.0), (0.5, -np.pi / 2 + 1e-9, 3.0), (3, 1.5, 2)]
)
def test_angles_are_those_of_a_turn(angles: tuple[float, float, float]) -> None:
    """Where two axes fall together, too."""
    turn = fixed_axes(*angles)
    np.testing.assert_allclose(fixed_axes(*angles_of(turn)), turn, atol=1e-15)


@pytest.mark.parametrize(
    ("name", "flexible"),
    [("ur5e", ["upper_arm_link=tube:0.12", "forearm_link=tube"]), ("kinova", ["j2s6s200_link_2=tube"])],
)
def test_flexible_robots_are_simulated(
    name: str, flexible: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """By two commands; links bend under the weight, and what was guessed is said in the files."""
    scene, run = tmp_path / "robot.toml", tmp_path / "r.run.h5"
    asked = [part for text in flexible for part in ("--flexible", text)]
    assert main(["import", str(described(name)), "-o", str(scene), "--hold", *asked, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    links = [text.partition("=")[0] for text in flexible]
    assert [Path(path).stem for path in told["links"]] == links
    assert sum("is guessed" in text for text in told["told"]) == len(links)
    assert all("is guessed" in Path(path).read_text(encoding="utf-8") for path in told["links"])
    still = ["--set", "initial.deformation=static", "--set", "simulation.duration=0.01"]
    assert main(["simulate", str(scene), "-o", str(run), *still]) == 0
    bent, rigid = erls.load_run(run), written(name, tmp_path, hold=True)
    stiff = erls.simulate(erls.load_chain(rigid, ["simulation.duration=0.01"]), verdict=False)
    end = bent.point_names[-1]
    assert 1e-7 < np.linalg.norm(stiff.position(end, 0.0) - bent.position(end, 0.0)) < 1e-2


def test_a_description_of_ones_own_serves(tmp_path: Path) -> None:
    """The mass of the tube that was guessed is that of the link."""
    scene = tmp_path / "robot.toml"
    assert main(["import", str(SHIPPED), "-o", str(scene), "--flexible", "forearm_link=tube"]) == 0
    shutil.copy(tmp_path / "links/forearm_link.toml", tmp_path / "mine.toml")
    again = tmp_path / "again.toml"
    assert main(["import", str(SHIPPED), "-o", str(again), "--flexible", "forearm_link=mine.toml"]) == 0
    scenes = [build_mechanism(erls.load_chain(path)).mechanism for path in (scene, again)]
    masses = [next(link for link in m.links if link.name == "forearm_link").model.mass_properties.mass for m in scenes]
    assert masses == pytest.approx([2.275, 2.275], rel=1e-9)


def test_a_base_that_floats_falls(tmp_path: Path) -> None:
    """As a whole: its centre of mass by g t² / 2, whatever its legs do."""
    path = written("solo12", tmp_path, floating=True)
    run = erls.simulate(erls.load_chain(path, ["simulation.duration=0.1"]), verdict=False)
    t, energy = 0.1, run.energy([0.0, 0.1])
    mass = sum(link.mass for link in read_urdf(FOLDER / "solo12.urdf").links.values())
    fallen = (energy.gravity[1] - energy.gravity[0]) / (mass * 9.81)
    assert fallen == pytest.approx(-9.81 * t**2 / 2, rel=1e-6)


def test_limits_push_back_where_asked(tmp_path: Path) -> None:
    """Otherwise they are remarks."""
    plain, stopped = (written("ur5e", tmp_path / name, stops=name == "b") for name in _folders(tmp_path, "a", "b"))
    assert "stops" not in tomllib.loads(plain.read_text(encoding="utf-8"))["joints"][0]
    assert tomllib.loads(stopped.read_text(encoding="utf-8"))["joints"][0]["stops"]["lower"] == -6.283185307179586
    assert "# limits: effort 150 N m" in plain.read_text(encoding="utf-8")
    erls.load_chain(stopped)


def _folders(folder: Path, *names: str) -> tuple[str, ...]:
    for name in names:
        (folder / name).mkdir()
    return names


def test_mimic_joints_are_couplings(tmp_path: Path) -> None:
    """Fingers of the same robot move alike, by multiplier and offset; one whose leader is held moves alone."""
    robot = read_urdf(FOLDER / "panda.urdf")
    (coupling,) = tomllib.loads(imported(robot, FOLDER / "panda.urdf", tmp_path, {}, hold=True).scene)["couplings"]
    assert (coupling["joint"], coupling["follows"]) == ("panda_finger_joint2", {"panda_finger_joint1": 1.0})
    joints = [replace(joint, multiplier=-2.0, offset=0.1) if joint.mimics else joint for joint in robot.joints]
    changed = imported(replace(robot, joints=tuple(joints)), FOLDER / "panda.urdf", tmp_path, {})
    (coupling,) = tomllib.loads(changed.scene)["couplings"]
    assert (coupling["follows"], coupling["offset"]) == ({"panda_finger_joint1": -2.0}, 0.1)
    fixed = [replace(joint, type="fixed") if joint.name == "panda_finger_joint1" else joint for joint in robot.joints]
    alone = imported(replace(robot, joints=tuple(fixed)), FOLDER / "panda.urdf", tmp_path, {})
    assert any("'panda_finger_joint2'" in text and "moves alone" in text for text in alone.told)


def test_what_is_not_used_is_told(tmp_path: Path) -> None:
    """Contact shapes by count, drawings without a shape, joints that carry nothing."""
    text = """<robot name="r"><link name="a"/>
    <link name="b"><visual/><collision/><collision/><inertial><mass value="1"/></inertial></link>
    <link name="c"/><joint name="j" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 2"/></joint>
    <joint name="k" type="continuous"><parent link="b"/><child link="c"/></joint></robot>"""
    file = tmp_path / "r.urdf"
    file.write_text(text, encoding="utf-8")
    robot = read_urdf(file)
    assert robot.told == (
        "2 × <collision> not used: nothing that moves depends on it",
        "link 'b': a <visual> is not drawn: no geometry of mesh, box, cylinder, sphere",
    )
    assert bodies_of(robot)[1] == ["joint 'k' carries no mass: it is held"]
    assert robot.joints[0].axis.tolist() == [0, 0, 1]


GOOD = """<robot name="r"><link name="a"/><link name="b"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0"
 iyy="1" iyz="0" izz="1"/></inertial></link><joint name="j" type="revolute"><origin xyz="0 0 1"/><parent link="a"/>
<child link="b"/><axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>"""
FAULTS = {
    "not xml": ("<robot", Cause.SYNTAX, "not XML"),
    "another root": ("<sdf/>", Cause.SYNTAX, "<sdf>"),
    "document type": ('<!DOCTYPE r [<!ENTITY a "b">]>' + GOOD, Cause.SYNTAX, "document type"),
    "macros": (GOOD.replace("</robot>", "<xacro:include/></robot>"), Cause.SYNTAX, "xacro"),
    "no number": (GOOD.replace('mass value="1"', 'mass value="heavy"'), Cause.BAD_FIELD, "link 'b': mass: value"),
    "not finite": (GOOD.replace('mass value="1"', 'mass value="nan"'), Cause.BAD_FIELD, "finite"),
    "negative mass": (GOOD.replace('mass value="1"', 'mass value="-1"'), Cause.BAD_FIELD, "negative"),
    "two numbers": (GOOD.replace("0 0 1", "0 1", 1), Cause.BAD_FIELD, "three numbers"),
    "no axis": (GOOD.replace('axis xyz="0 0 1"', 'axis xyz="0 0 0"'), Cause.BAD_FIELD, "no direction"),
    "unknown type": (GOOD.replace("revolute", "ball"), Cause.BAD_FIELD, "revolute, continuous"),
    "unknown link": (GOOD.replace('child link="b"', 'child link="c"'), Cause.BAD_REFERENCE, "known: a, b"),
    "a loop": (GOOD.replace('parent link="a"', 'parent link="b"'), Cause.BAD_FIELD, "hangs on itself"),
    "twice": (GOOD.replace('<link name="a"/>', '<link name="a"/><link name="a"/>'), Cause.BAD_FIELD, "stands twice"),
    "two roots": (GOOD.replace('<link name="a"/>', '<link name="a"/><link name="c"/>'), Cause.BAD_FIELD, "a, c"),
    "no inertia entry": (GOOD.replace('ixy="0"', ""), Cause.BAD_FIELD, "'ixy' is missing"),
    "negative moment": (GOOD.replace('izz="1"', 'izz="-1"'), Cause.BAD_FIELD, "negative principal moment"),
    "nothing moves": (GOOD.replace("revolute", "fixed"), Cause.BAD_FIELD, "nothing in it moves"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_are_named_and_nothing_is_written(
    fault: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """With file, element and remedy."""
    text, cause, words = FAULTS[fault]
    file = tmp_path / "r.urdf"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(SceneError, match=re.escape(words)) as refused:
        imported(read_urdf(file), file, tmp_path, {})
    assert refused.value.cause == cause
    assert main(["import", str(file), "-o", str(tmp_path / "s.toml")]) == 2
    assert "r.urdf" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["r.urdf"]


@pytest.mark.parametrize(
    ("flexible", "words"),
    [
        ("nix=tube", "no moving link"),
        ("b", "LINK=DESCRIPTION"),
        ("b=tube", "no beam"),
        ("b=tube:x", "no tube"),
        ("b=none.toml", "no such file: none.toml"),
    ],
)
def test_links_that_cannot_be_flexible(
    flexible: str, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Said before anything is written."""
    file = tmp_path / "r.urdf"
    file.write_text(GOOD, encoding="utf-8")
    assert main(["import", str(file), "-o", str(tmp_path / "s.toml"), "--flexible", flexible]) == 2
    assert words in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["r.urdf"]


def test_tubes_of_links_whose_names_differ_in_signs_alone(tmp_path: Path) -> None:
    """Each has its own file."""
    inertial = '<inertial><mass value="1"/></inertial>'
    joints = "".join(
        f'<joint name="{a}{b}" type="revolute"><origin xyz="1 0 0"/><parent link="{a}"/><child link="{b}"/></joint>'
        for a, b in (("a", "b.1"), ("b.1", "b:1"), ("b:1", "c"))
    )
    links = "".join(f'<link name="{name}">{inertial}</link>' for name in ("a", "b.1", "b:1", "c"))
    file = tmp_path / "r.urdf"
    file.write_text(f'<robot name="r">{links}{joints}</robot>', encoding="utf-8")
    made = imported(read_urdf(file), file, tmp_path, {"b.1": "tube", "b:1": "tube"})
    assert list(made.links) == ["b_1.toml", "b_1_.toml"]
    assert [tomllib.loads(text)["name"] for text in made.links.values()] == ["b.1", "b:1"]
    assert [link.get("model") for link in tomllib.loads(made.scene)["links"]] == [
        "links/b_1.toml",
        "links/b_1_.toml",
        None,
    ]


def test_the_good_file_is_good(tmp_path: Path) -> None:
    """So that faults are what they are called."""
    assert written("r", tmp_path, GOOD).exists()
