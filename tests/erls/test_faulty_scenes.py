"""Faulty scenes through the command line: one message with file, field and remedy; exit code 2; nothing written."""

from __future__ import annotations

import copy
import json
import math
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import scenes

from erls.cli.main import main
from erls.errors import Cause
from fe_import.description.link import load_link
from fe_import.errors import Cause as FECause
from fe_import.modal.file import write_modal_file
from fe_import.reduce import reduce_link

NAN, INF = math.nan, math.inf
GONE = None
MOVE = {"shape": "polynomial", "from": 0.0, "to": 1.0, "duration": 1.0}
TABLE = {"shape": "table", "file": "load.csv"}
BLOCK = {"name": "b", "rigid": {"mass": 1.0, "points": {"root": [0, 0, 0]}}}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The files that the scenes name: a frame link, a solid one, modal files in both forms, tables."""
    folder = tmp_path_factory.mktemp("faulty")
    link = scenes.l_link(folder)
    write_modal_file(folder / "good.modal.h5", reduce_link(load_link(link)))
    write_modal_file(folder / "physical.modal.h5", reduce_link(load_link(link, {"form": "physical"})))
    solid = scenes.read_toml(scenes.ROOT / "data/l_shape/links/solid.toml")
    solid["solid"]["mesh"] = str(scenes.ROOT / "data/l_shape/meshes/l_hex20.msh")
    solid["reduction"] = {"fixed_interface_modes": 1, "elastic_modes": 2}
    write_modal_file(folder / "solid.modal.h5", reduce_link(scenes.write_toml(folder / "solid.toml", solid)))
    single = {**scenes.L_LINK, "interfaces": scenes.L_LINK["interfaces"][:1]}
    scenes.write_toml(folder / "single.toml", single)
    for name, text in {
        "load.csv": "t, x\n0, 1\n1, 2\n2, nan\n",
        "unsorted.csv": "0, 1\n1, 2\n0.5, 3\n",
        "short.csv": "0, 1\n",
        "words.csv": "0, 1\n1, one\n",
        "ragged.csv": "0, 1\n1, 2, 3\n",
        "empty.csv": "# nothing\n",
        "text.h5": "not HDF5",
        "bad_link.toml": "interfaces = []\nframes = 1\n",
    }.items():
        (folder / name).write_text(text, encoding="utf-8")
    (folder / "cut.modal.h5").write_bytes((folder / "good.modal.h5").read_bytes()[:3000])
    (folder / "subfolder").mkdir()
    return folder


def edit(data: Any, path: str, value: Any) -> None:
    """Set a field, or remove it."""
    *before, last = [int(s) if s.isdigit() else s for s in path.split(".")]
    for step in before:
        data = data.setdefault(step, {}) if isinstance(data, dict) else data[step]
    if value is GONE:
        del data[last]
    elif isinstance(data, list) and last == len(data):
        data.append(value)
    else:
        data[last] = value


def base() -> dict[str, Any]:
    """A sound scene."""
    data: dict[str, Any] = json.loads(json.dumps(scenes.L_SCENE))
    data["simulation"] = {"duration": 0.001, "step": 5e-4}
    return data


def drive(record: dict[str, Any]) -> tuple[str, Any]:
    return "joints.0.drive", record


def torque(*profiles: dict[str, Any]) -> tuple[str, Any]:
    return drive({"type": "torque", "profiles": list(profiles)})


SLIDER = ("joints.0", {"name": "s", "type": "prismatic", "dh": {"convention": "standard"}})
SECOND_JOINT = ("joints.1", {"name": "j", "dh": {"convention": "standard"}})
SECOND_LINK = ("links.1", {"name": "m", "model": "link.toml"})
PAYLOAD = ("payloads", [{"point": "tip", "mass": 1.0}])

# edits of the sound scene, place of the error, words in it
FAULTS: dict[str, tuple[list[tuple[str, Any]], str, str]] = {
    # keys and types
    "unknown key": ([("gravty", 1.0)], "gravty", "did you mean 'gravity'?"),
    "unknown key deep inside": ([("joints.0.dh.alhpa", 1.0)], "joints[0].dh.alhpa", "alpha"),
    "no simulation": ([("simulation", GONE)], "scene.toml", "add simulation"),
    "no duration": ([("simulation.duration", GONE)], "simulation", "add duration"),
    "no joints": ([("joints", GONE)], "scene.toml", "add joints"),
    "no links": ([("links", GONE)], "scene.toml", "add links"),
    "no name": ([("joints.0.name", GONE)], "joints[0]", "add name"),
    "text for a number": ([("simulation.duration", "1 s")], "simulation.duration", "give a number"),
    "number for a text": ([("links.0.model", 3)], "links[0].model", "text in quotes"),
    "two numbers for a vector": ([("gravity", [0.0, -9.81])], "gravity", "3"),
    "number beyond floating point": ([("simulation.step", 10**400)], "simulation.step", "out of range"),
    # lists that must match
    "empty joints": ([("joints", []), ("links", [])], "joints", "at least one joint"),
    "joints and links differ": ([SECOND_JOINT], "links", "as many links as joints"),
    "joints of one name": ([SECOND_JOINT, SECOND_LINK, ("joints.1.name", "shoulder")], "joints[1].name", "differ"),
    "links of one name": (
        [SECOND_JOINT, SECOND_LINK, ("links.1.name", "l"), ("joints.1.name", "k")],
        "links[1].name",
        "differ",
    ),
    "points of one name": ([("points.1.name", "elbow")], "points[1].name", "differ"),
    "nameless joint": ([("joints.0.name", "")], "joints[0].name", "printable"),
    "name with a slash": ([("points.0.name", "a/b")], "points[0].name", "'/'"),
    "name of two lines": ([("points.0.name", "a\nb")], "points[0].name", "one line"),
    "scene name with a control character": ([("name", "a\x1b[2J")], "name", "printable"),
    # simulation
    "negative duration": ([("simulation.duration", -1.0)], "simulation.duration", "positive"),
    "endless duration": ([("simulation.duration", INF)], "simulation.duration", "finite"),
    "duration of an age": ([("simulation.duration", 1e12)], "simulation.duration", "longer"),
    "zero step": ([("simulation.step", 0.0)], "simulation.step", "positive"),
    "negative step": ([("simulation.step", -1e-3)], "simulation.step", "positive"),
    "step NaN": ([("simulation.step", NAN)], "simulation.step", "finite"),
    "too many steps": ([("simulation.step", 1e-320)], "simulation.step", "larger step"),
    "rho_inf 2": ([("simulation.spectral_radius", 2.0)], "simulation.spectral_radius", "0 to 1"),
    "rtol below rounding": ([("simulation.rtol", 1e-17)], "simulation.rtol", "3e-14"),
    "rtol 1": ([("simulation.rtol", 1.0)], "simulation.rtol", "relative"),
    "atol 0": ([("simulation.atol", 0.0)], "simulation.atol", "above 0"),
    "unknown integrator": ([("simulation.integrator", "rk54")], "simulation.integrator", "did you mean 'rk45'?"),
    "unknown formulation": ([("simulation.formulation", "erl")], "simulation.formulation", "'erls'"),
    "unknown gauge": ([("simulation.gauge", "joint_angle")], "simulation.gauge", "'joint-angle'"),
    # vectors
    "gravity NaN": ([("gravity", [0.0, NAN, 0.0])], "gravity[1]", "finite"),
    "base position inf": ([("base.position", [INF, 0.0, 0.0])], "base.position[0]", "finite"),
    "base rotation NaN": ([("base.rotation_deg", [0.0, 0.0, NAN])], "base.rotation_deg[2]", "finite"),
    "base rotation beyond reason": ([("base.rotation_deg", [1e300, 0, 0])], "base.rotation_deg[0]", "plausible"),
    "mesh position NaN": ([("links.0.mesh_pose.position", [NAN, 0, 0])], "links[0].mesh_pose.position[0]", "finite"),
    "mesh rotation inf": ([("links.0.mesh_pose.rotation_deg", [0, 0, -INF])], "mesh_pose.rotation_deg[2]", "finite"),
    "unknown mesh frame": ([("links.0.mesh_pose.frame", "world")], "links[0].mesh_pose.frame", "dh, joint"),
    "point position NaN": (
        [("points.0", {"name": "p", "link": "l", "position": [0, 0, NAN]})],
        "points[0].position[2]",
        "finite",
    ),
    "payload offset inf": ([PAYLOAD, ("payloads.0.offset", [0, INF, 0])], "payloads[0].offset[1]", "finite"),
    # joints
    "unknown joint type": ([("joints.0.type", "revolut")], "joints[0].type", "'revolute'"),
    "no convention": ([("joints.0.dh", {"a": 1.0})], "joints[0].dh", "add convention"),
    "unknown convention": ([("joints.0.dh.convention", "craig")], "joints[0].dh.convention", "standard, modified"),
    "alpha twice": ([("joints.0.dh.alpha", 1.0)], "joints[0].dh.alpha", "keep one"),
    "theta twice": ([("joints.0.dh", {"convention": "standard", "theta": 1.0, "theta_deg": 1.0})], "theta", "keep one"),
    "a NaN": ([("joints.0.dh.a", NAN)], "joints[0].dh.a", "finite"),
    "start in degrees at a prismatic joint": (
        [SLIDER, ("joints.0.initial", {"position_deg": 30.0})],
        "joints[0].initial.position_deg",
        "in metres",
    ),
    "rest in degrees at a prismatic joint": ([SLIDER, ("joints.0.rest_deg", 30.0)], "joints[0].rest_deg", "in metres"),
    "negative damping": ([("joints.0.damping", -1.0)], "joints[0].damping", "negative"),
    "negative stiffness": ([("joints.0.stiffness", -1.0)], "joints[0].stiffness", "negative"),
    "negative friction": ([("joints.0.friction", {"force": -1.0})], "joints[0].friction.force", "negative"),
    "friction without transition": (
        [("joints.0.friction", {"force": 1.0, "transition_rate": 0.0})],
        "joints[0].friction.transition_rate",
        "above 0",
    ),
    "negative rotor": ([("joints.0.motor", {"rotor_inertia": -1.0})], "joints[0].motor.rotor_inertia", "negative"),
    "negative motor mass": ([("joints.0.motor", {"mass": -1.0})], "joints[0].motor.mass", "negative"),
    "motor with indefinite inertia": (
        [("joints.0.motor", {"inertia": [1, 1, -1]})],
        "joints[0].motor.inertia",
        "negative",
    ),
    "start position twice": (
        [("joints.0.initial", {"position": 0.1, "position_deg": 1.0})],
        "joints[0].initial.position",
        "keep one",
    ),
    "prescribed motion with a start": (
        [drive({"type": "motion", "motion": MOVE}), ("joints.0.initial", {"rate": 1.0})],
        "joints[0].initial",
        "own start",
    ),
    # drives
    "unknown drive": ([drive({"type": "motor"})], "joints[0].drive.type", "'torque'"),
    "drive without type": ([drive({"profiles": []})], "joints[0].drive", "add type = 'free'"),
    "no profiles": ([torque()], "joints[0].drive.profiles", "empty"),
    "unknown shape": ([torque({"shape": "stp", "value": 1.0})], "profiles[0].shape", "'step'"),
    "profile NaN": ([torque({"shape": "constant", "value": NAN})], "joints[0].drive.profiles[0].value", "finite"),
    "profile that ends before it starts": (
        [torque({"shape": "step", "start": 1.0, "end": 0.5, "value": 1.0})],
        "joints[0].drive.profiles[0].end",
        "after",
    ),
    "motion without duration": (
        [drive({"type": "motion", "motion": {**MOVE, "duration": 0.0}})],
        "joints[0].drive.motion.duration",
        "time",
    ),
    "motion in degrees at a prismatic joint": (
        [SLIDER, drive({"type": "motion", "motion": {"shape": "polynomial", "from_deg": 0, "to": 1, "duration": 1}})],
        "joints[0].drive.motion.from_deg",
        "in metres",
    ),
    "negative gain": (
        [drive({"type": "pd", "motion": MOVE, "proportional_gain": -1.0, "derivative_gain": 0.0})],
        "joints[0].drive.proportional_gain",
        "negative",
    ),
    # tables
    "table missing": ([torque({**TABLE, "file": "nix.csv"})], "joints[0].drive.profiles[0].file", "nix.csv"),
    "table is a folder": ([torque({**TABLE, "file": "subfolder"})], "joints[0].drive.profiles[0].file", "not a file"),
    "table with NaN": ([torque(TABLE)], "load.csv: line 4, column 1", "finite"),
    "table unsorted": ([torque({**TABLE, "file": "unsorted.csv"})], "unsorted.csv: line 3, column 0", "rise"),
    "table of one row": ([torque({**TABLE, "file": "short.csv"})], "short.csv", "at least 2 rows"),
    "table with words": ([torque({**TABLE, "file": "words.csv"})], "words.csv: line 2, column 1", "finite"),
    "ragged table": ([torque({**TABLE, "file": "ragged.csv"})], "ragged.csv: line 2", "columns"),
    "empty table": ([torque({**TABLE, "file": "empty.csv"})], "empty.csv", "no numbers"),
    "table without the column": ([torque({**TABLE, "file": "unsorted.csv", "column": 7})], "unsorted.csv", "rise"),
    "motion table too short": (
        [drive({"type": "motion", "motion": {"shape": "table", "times": [0.0, 1.0], "values": [0.0, 1.0]}})],
        "joints[0].drive.motion.times",
        "at least 4",
    ),
    # links
    "no source": ([("links.0.model", GONE)], "links[0]", "exactly one"),
    "two sources": ([("links.0.modal_file", "good.modal.h5")], "links[0]", "exactly one"),
    "three sources": ([("links.0.modal_file", "x"), ("links.0.rigid", BLOCK["rigid"])], "links[0]", "exactly one"),
    "link file missing": ([("links.0.model", "nix.toml")], "links[0].model", "no such file"),
    "link file is a folder": ([("links.0.model", "subfolder")], "links[0].model", "cannot be read"),
    "link file faulty": ([("links.0.model", "bad_link.toml")], "bad_link.toml: frames", "'frame'"),
    "modal file missing": ([("links.0", {"name": "l", "modal_file": "nix.h5"})], "links[0].modal_file", "no such file"),
    "modal file not HDF5": ([("links.0", {"name": "l", "modal_file": "text.h5"})], "links[0].modal_file", "HDF5"),
    "modal file cut": (
        [("links.0", {"name": "l", "modal_file": "cut.modal.h5"})],
        "cut.modal.h5",
        "make the file again",
    ),
    "modal file in physical form": (
        [("links.0", {"name": "l", "modal_file": "physical.modal.h5"})],
        "links[0].modal_file",
        "orthonormal",
    ),
    "too many elastic modes": ([("links.0.elastic_modes", 99)], "links[0].elastic_modes", "fewer elastic modes"),
    "negative elastic modes": ([("links.0.elastic_modes", -1)], "links[0].elastic_modes", "0 or more"),
    "half a mode": ([("links.0.elastic_modes", 1.5)], "links[0].elastic_modes", "whole number"),
    "unknown inboard interface": ([("links.0.inboard", "rot")], "links[0].inboard", "'root'"),
    "unknown outboard interface": ([("links.0.outboard", "top")], "links[0].outboard", "root, tip"),
    "no second interface": (
        [SECOND_JOINT, SECOND_LINK, ("links.0.model", "single.toml")],
        "links[0].outboard",
        "second interface",
    ),
    "negative link damping": ([("links.0.damping", {"ratio": -0.01})], "links[0].damping.ratio", "negative"),
    "link damping NaN": (
        [("links.0.damping", {"rayleigh": {"beta": NAN}})],
        "links[0].damping.rayleigh.beta",
        "finite",
    ),
    "two kinds of link damping": (
        [("links.0.damping", {"ratio": 0.1, "ratios": [0.1]})],
        "links[0].damping",
        "keep one",
    ),
    "too many damping ratios": ([("links.0.damping", {"ratios": [0.1] * 30})], "links[0]", "more damping ratios"),
    "negative rigid mass": ([("links.0", BLOCK), ("links.0.rigid.mass", -1.0)], "links[0].rigid.mass", "negative"),
    "rigid mass beyond reason": (
        [("links.0", BLOCK), ("links.0.rigid.mass", 1e300)],
        "links[0].rigid.mass",
        "plausible",
    ),
    "rigid link without points": (
        [("links.0", BLOCK), ("links.0.rigid.points", {})],
        "links[0].rigid.points",
        "points",
    ),
    "rigid centre NaN": (
        [("links.0", BLOCK), ("links.0.rigid.centre_of_mass", [0, 0, NAN])],
        "links[0].rigid.centre_of_mass[2]",
        "finite",
    ),
    "rigid point inf": ([("links.0", BLOCK), ("links.0.rigid.points.a", [INF, 0, 0])], "rigid.points.a[0]", "finite"),
    "rigid inertia asymmetric": (
        [("links.0", {**BLOCK, "name": "l"}), ("links.0.rigid.inertia", [[1, 0.5, 0], [0, 1, 0], [0, 0, 1]])],
        "links[0].rigid.inertia",
        "symmetric",
    ),
    "rigid link with modes": ([("links.0", BLOCK), ("links.0.elastic_modes", 3)], "links[0].elastic_modes", "remove"),
    "rigid link with damping": (
        [("links.0", BLOCK), ("links.0.damping", {"ratio": 0.1})],
        "links[0].damping",
        "remove",
    ),
    # points
    "point on an unknown link": ([("points.0.link", "m")], "points[0].link", "known: l"),
    "point on an unknown node": ([("points.0.node", "tipp")], "points[0].node", "'tip'"),
    "point nowhere": ([("points.0", {"name": "p", "link": "l"})], "points[0]", "exactly one"),
    "point twice": ([("points.0.position", [0, 0, 0])], "points[0]", "exactly one"),
    "point far from the mesh": (
        [("points.0", {"name": "p", "link": "l", "position": [3, 0, 0]})],
        "points[0].position",
        "no mesh node near",
    ),
    # payloads
    "payload on an unknown point": ([PAYLOAD, ("payloads.0.point", "hand")], "payloads[0].point", "elbow, tip"),
    "negative payload": ([PAYLOAD, ("payloads.0.mass", -1.0)], "payloads[0].mass", "negative"),
    "payload inertia asymmetric": (
        [PAYLOAD, ("payloads.0.inertia", [[1, 0.1, 0], [0, 1, 0], [0, 0, 1]])],
        "payloads[0].inertia",
        "symmetric",
    ),
    "payload inertia negative": ([PAYLOAD, ("payloads.0.inertia", [1, 1, -1])], "payloads[0].inertia", "negative"),
    "payload inertia off the diagonal": (
        [PAYLOAD, ("payloads.0.inertia", [[1, 3, 0], [3, 1, 0], [0, 0, 1]])],
        "payloads[0].inertia",
        "negative",
    ),
    "payload inertia NaN": ([PAYLOAD, ("payloads.0.inertia", [1, NAN, 1])], "payloads[0].inertia[1]", "finite"),
    "payload inertia on a node without rotation": (
        [
            ("links.0", {"name": "l", "modal_file": "solid.modal.h5"}),
            PAYLOAD,
            ("payloads.0.point", "elbow"),
            ("payloads.0.inertia", [1, 1, 1]),
        ],
        "payloads[0]",
        "no rotation",
    ),
    "unknown deformation": ([("initial.deformation", "relaxed")], "initial.deformation", "zero, static"),
}


def refused(
    arguments: list[str], folder: Path, capsys: pytest.CaptureFixture[str], code: int = 2
) -> dict[str, str | None]:
    """Run a command twice, as text and as JSON; check what every refusal has in common; the JSON error."""
    before = {p: p.stat().st_mtime_ns for p in folder.rglob("*")}
    assert main(arguments) == code
    out, text = capsys.readouterr()
    told = [line for line in text.splitlines() if "reduc" not in line or line.startswith("error: ")]
    assert out == ""
    assert len(told) == 1, text
    assert told[0].startswith("error: ")
    assert main([*arguments, "--json"]) == code
    out, text = capsys.readouterr()
    assert "error" not in text
    assert out.count("\n") == 1
    found = json.loads(out)
    assert list(found) == ["error"]
    error = found["error"]
    assert list(error) == ["cause", "message", "where", "value", "limit", "remedy"]
    assert error["cause"] in {*map(str, Cause), *map(str, FECause)}
    assert error["remedy"]
    for part in (error["message"], error["where"], error["remedy"]):
        assert part.replace("\n", "\\n") in told[0]
    assert {p: p.stat().st_mtime_ns for p in folder.rglob("*")} == before
    return error


@pytest.mark.parametrize("fault", FAULTS)
def test_faulty_scene(fault: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Named with file and field, by text and by JSON; no reduction, run or temporary file appears."""
    edits, where, words = FAULTS[fault]
    data = base()
    for path, value in edits:
        edit(data, path, copy.deepcopy(value))
    scene = scenes.write_toml(folder / "scene.toml", data)
    error = refused(["simulate", str(scene), "-o", str(folder / "out.h5")], folder, capsys)
    told = " ".join(str(v) for v in error.values())
    assert words in told
    assert str(folder) in error["where"]
    assert where in error["where"] or (where in error["remedy"] and "scene.toml" in error["remedy"])


def test_the_sound_scene_runs(folder: Path) -> None:
    """So that the faults above are what is refused."""
    scene = scenes.write_toml(folder / "scene.toml", base())
    assert main(["simulate", str(scene), "-o", str(folder / "sound.h5")]) == 0


def _file(text: bytes) -> Callable[[Path], None]:
    return lambda path: path.write_bytes(text) and None


FILES = {
    "missing": (lambda path: None, Cause.FILE_NOT_FOUND, "no such file"),
    "folder": (Path.mkdir, Cause.NOT_READABLE, "cannot be read"),
    "empty": (_file(b"\n"), Cause.BAD_FIELD, "simulation"),
    "not TOML": (_file(b"simulation = {"), Cause.SYNTAX, "not valid TOML"),
    "not UTF-8": (_file(b"name = '\xff\xfe'"), Cause.NOT_READABLE, "UTF-8"),
    "HDF5": (_file(b"\x89HDF\r\n\x1a\n" + bytes(99)), Cause.NOT_READABLE, "UTF-8"),
    "key twice": (_file(b"name = 'a'\nname = 'b'"), Cause.SYNTAX, "not valid TOML"),
    "nested without end": (_file(b"name = " + b"[" * 5000), Cause.SYNTAX, "not valid TOML"),
    "digits without end": (_file(b"name = " + b"9" * 5000), Cause.SYNTAX, "not valid TOML"),
}


@pytest.mark.parametrize("kind", FILES)
def test_what_is_no_scene_file(kind: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Missing, empty, a folder, or not TOML."""
    make, cause, words = FILES[kind]
    path = folder / "strange.toml"
    make(path)
    try:
        error = refused(["simulate", str(path), "-o", str(folder / "out.h5")], folder, capsys)
    finally:
        shutil.rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)
    assert error["cause"] == str(cause)
    assert str(path) in str(error["where"])
    assert words in " ".join(str(v) for v in error.values())


ARGUMENTS = {
    "time after the end": (["--at", "0,0.5"], "--at", "within the run"),
    "negative time": (["--at=-0.001"], "--at", "within the run"),
    "time NaN": (["--at", "nan"], "--at", "within the run"),
    "time in words": (["--at", "end"], "--at", "seconds"),
    "set without value": (["--set", "simulation.step"], "--set simulation.step", "KEY=VALUE"),
    "set a member that is not": (["--set", "links.arm.flexible=false"], "--set", "known: 0, l"),
    "set an unknown key": (["--set", "simulation.stp=1"], "simulation.stp", "'step'"),
    "set of two lines": (["--set", "a\nb.c=1"], "a\nb", "known fields"),
    "unknown formulation": (["--formulation", "nodel"], "simulation.formulation", "known: erls"),
    "quoted formulation": (["--formulation", 'a"b'], "simulation.formulation", "known: erls"),
    "unknown option": (["--ad", "1"], "command line", "--at"),
    "option without value": (["--at"], "command line", "--at"),
    "one scene too many": (["other.toml"], "command line", "other.toml"),
}


@pytest.mark.parametrize("kind", ARGUMENTS)
def test_faulty_arguments(kind: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What the options of ``erls simulate`` refuse."""
    arguments, where, words = ARGUMENTS[kind]
    scene = scenes.write_toml(folder / "scene.toml", base())
    error = refused(["simulate", str(scene), "-o", str(folder / "out.h5"), *arguments], folder, capsys)
    assert where in str(error["where"])
    assert words in " ".join(str(v) for v in error.values())


@pytest.mark.parametrize(
    ("output", "words"),
    [("nix/out.h5", "make the folder first"), ("subfolder", "name of a file"), ("scene.toml", "another name")],
)
def test_outputs_that_cannot_be(output: str, words: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A folder that does not exist, a folder, and the scene itself."""
    scene = scenes.write_toml(folder / "scene.toml", base())
    error = refused(["simulate", str(scene), "-o", str(folder / output)], folder, capsys)
    assert error["cause"] == str(Cause.NOT_WRITABLE)
    assert words in str(error["remedy"])


def test_a_faulty_joint_is_found_before_links_are_reduced(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A reduction may take minutes; what does not depend on it is checked first."""
    monkeypatch.setattr("erls.scene.build.reduce_cached", lambda *_: pytest.fail("reduced too early"))
    for fault in ("table with NaN", "alpha twice", "point on an unknown link", "payload on an unknown point"):
        test_faulty_scene(fault, folder, capsys)
