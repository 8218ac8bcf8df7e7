"""Faults of scenes, one at a time: edits of a sound scene, the place that the error names, words in it."""

from __future__ import annotations

import math
from typing import Any

NAN, INF = math.nan, math.inf
GONE = None
MOVE = {"shape": "polynomial", "from": 0.0, "to": 1.0, "duration": 1.0}
TABLE = {"shape": "table", "file": "load.csv"}
BLOCK = {"name": "b", "rigid": {"mass": 1.0, "points": {"root": [0, 0, 0]}}}


def drive(record: dict[str, Any]) -> tuple[str, Any]:
    return "joints.0.drive", record


def torque(*profiles: dict[str, Any]) -> tuple[str, Any]:
    return drive({"type": "torque", "profiles": list(profiles)})


SLIDER = ("joints.0", {"name": "s", "type": "prismatic", "dh": {"convention": "standard"}})
SECOND_JOINT = ("joints.1", {"name": "j", "dh": {"convention": "standard"}})
SECOND_LINK = ("links.1", {"name": "m", "model": "link.toml"})
LOAD = ("loads", [{"point": "tip", "force": [0.0, 0.0, 1.0]}])
PLANE = {"normal": [0.0, 0.0, 1.0]}
STICKS = {"coefficient": 0.1, "law": "stick"}
CONTACT = ("contacts", [{"name": "c", "point": "tip", "plane": PLANE, "stiffness": 1e6, "restitution": 0.5}])
STOPS = ("joints.0.stops", {"lower_deg": -10.0, "upper_deg": 10.0, "stiffness": 1e3, "restitution": 0.5})
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
    # contacts and stops
    "contact of an unknown point": ([CONTACT, ("contacts.0.point", "hand")], "contacts[0].point", "elbow, tip"),
    "contacts of one name": ([(CONTACT[0], 2 * CONTACT[1])], "contacts[1].name", "differ"),
    "contact without a plane": ([CONTACT, ("contacts.0.plane", GONE)], "contacts[0]", "add plane"),
    "contact without restitution": ([CONTACT, ("contacts.0.restitution", GONE)], "contacts[0]", "add restitution"),
    "contact that pushes itself up": ([CONTACT, ("contacts.0.restitution", 1.1)], "contacts[0].restitution", "0 to 1"),
    "contact restitution NaN": ([CONTACT, ("contacts.0.restitution", NAN)], "contacts[0].restitution", "finite"),
    "contact that pulls": ([CONTACT, ("contacts.0.stiffness", -1.0)], "contacts[0].stiffness", "positive"),
    "contact exponent": ([CONTACT, ("contacts.0.exponent", 0.5)], "contacts[0].exponent", "1 to 5"),
    "contact without transition": ([CONTACT, ("contacts.0.transition_rate", 0.0)], "transition_rate", "positive"),
    "contact friction": (
        [CONTACT, ("contacts.0.friction", {"coefficient": -0.1})],
        "contacts[0].friction.coefficient",
        "negative",
    ),
    "contact that knows no law": (
        [CONTACT, ("contacts.0.friction", {"coefficient": 0.1, "law": "sticky"})],
        "contacts[0].friction.law",
        "smooth, stick",
    ),
    "contact that sticks slowly": (
        [CONTACT, ("contacts.0.friction", {**STICKS, "transition_rate": 0.1})],
        "contacts[0].friction.transition_rate",
        "smooth",
    ),
    "contact that sticks less": (
        [CONTACT, ("contacts.0.friction", {**STICKS, "static_coefficient": 0.05})],
        "contacts[0].friction.static_coefficient",
        "at least coefficient",
    ),
    "contact that sticks in absolute coordinates": (
        [
            CONTACT,
            ("contacts.0.friction", STICKS),
            ("simulation.formulation", "ffr"),
            ("simulation.coordinates", "absolute"),
        ],
        "contacts[0].friction.law",
        "smooth",
    ),
    "contact that sticks in the minimum-norm gauge": (
        [CONTACT, ("contacts.0.friction", STICKS), ("simulation.gauge", "minimum-norm")],
        "contacts[0].friction.law",
        "smooth",
    ),
    "plane without direction": ([CONTACT, ("contacts.0.plane.normal", [0, 0, 0])], "plane.normal", "direction"),
    "plane at infinity": ([CONTACT, ("contacts.0.plane.position", [0, 0, INF])], "plane.position", "finite"),
    "plane on an unknown link": ([CONTACT, ("contacts.0.plane.on", "m")], "contacts[0].plane.on", "world, l"),
    "plane on its own point": (
        [CONTACT, ("contacts.0.plane", {**PLANE, "on": "l", "point": "tip"})],
        "contacts[0].plane.point",
        "another point",
    ),
    "plane on a point elsewhere": (
        [CONTACT, ("contacts.0.plane", {**PLANE, "point": "elbow"})],
        "contacts[0].plane.point",
        "on = 'l'",
    ),
    "contacts beside a bandwidth": ([CONTACT, ("simulation.bandwidth", 50.0)], "simulation.bandwidth", "contacts"),
    "stops nowhere": (
        [("joints.0.stops", {"stiffness": 1e3, "restitution": 0.5})],
        "joints[0].stops.lower",
        "neither a lower nor an upper",
    ),
    "stops crossed": ([STOPS, ("joints.0.stops.upper_deg", -20.0)], "joints[0].stops.upper", "above the lower"),
    "stop given twice": ([STOPS, ("joints.0.stops.upper", 0.1)], "joints[0].stops.upper", "twice"),
    "stop in degrees of a slider": ([SLIDER, STOPS], "joints[0].stops.lower_deg", "length"),
    "stops of glue": ([STOPS, ("joints.0.stops.stiffness", 0.0)], "joints[0].stops.stiffness", "positive"),
    # loads
    "load on an unknown point": ([LOAD, ("loads.0.point", "hand")], "loads[0].point", "elbow, tip"),
    "load of nothing": ([LOAD, ("loads.0.force", [0, 0, 0])], "loads[0]", "neither a force nor a moment"),
    "load of nothing on nothing": ([("loads", [{"axes": "world"}])], "loads[0]", "force_per_mass"),
    "load nowhere": ([LOAD, ("loads.0", {"force": [0, 0, 1]})], "loads[0].force", "'point' is missing"),
    "load along nothing": ([("loads", [{"force_per_length": [0, 0, 1]}])], "force_per_length", "'link' is missing"),
    "load on a point and a link": ([LOAD, ("loads.0.link", "l")], "loads[0]", "one of 'point' and 'link'"),
    "two forces along a link": (
        [("loads", [{"link": "l", "force_per_length": [0, 0, 1], "force_per_mass": [0, 0, 1]}])],
        "loads[0].force_per_mass",
        "two loads",
    ),
    "mass that follows": ([("loads", [{"force_per_mass": [0, 0, 1], "follower": True}])], "loads[0].follower", "mass"),
    "load per length on a point": ([LOAD, ("loads.0.force_per_length", [0, 0, 1])], "force_per_length", "point"),
    "force on a link": ([("loads", [{"link": "l", "force": [0, 0, 1]}])], "loads[0].force", "a link bears none"),
    "load along an unknown link": (
        [("loads", [{"link": "m", "force_per_length": [0, 0, 1]}])],
        "loads[0].link",
        "loads[0].link",
    ),
    "no load along a link": ([("loads", [{"link": "l"}])], "loads[0]", "give force_per_length or force_per_mass"),
    "load along a solid link": (
        [
            ("links.0", {"name": "l", "modal_file": "solid.modal.h5"}),
            ("loads", [{"link": "l", "force_per_length": [0, 0, 1]}]),
        ],
        "loads[0].link",
        "made of beams",
    ),
    "load in unknown axes": ([LOAD, ("loads.0.axes", "body")], "loads[0].axes", "world, link"),
    "follower in axes of the link": (
        [LOAD, ("loads.0.axes", "link"), ("loads.0.follower", True)],
        "loads[0].axes",
        "axes of its node",
    ),
    "load inf": ([LOAD, ("loads.0.force", [0, INF, 0])], "loads[0].force[1]", "finite"),
    "load moment NaN": ([LOAD, ("loads.0.moment", [0, 0, NAN])], "loads[0].moment[2]", "finite"),
    "load of two numbers": ([LOAD, ("loads.0.force", [0, 1])], "loads[0].force", "3"),
    "load on a node": ([LOAD, ("loads.0.node", "tip")], "loads[0].node", "node"),
    "load of unknown shape": ([LOAD, ("loads.0.factor", [{"shape": "sine"}])], "loads[0].factor[0]", "sine_burst"),
    "load that ends before it starts": (
        [LOAD, ("loads.0.factor", [{"shape": "step", "start": 0.0, "value": 1.0, "end": -1.0}])],
        "loads[0].factor[0].end",
        "not after the start",
    ),
    "load from a faulty table": ([LOAD, ("loads.0.factor", [TABLE])], "load.csv", "number"),
    "moment on a node without rotation": (
        [
            ("links.0", {"name": "l", "modal_file": "solid.modal.h5"}),
            LOAD,
            ("loads.0", {"point": "elbow", "moment": [0, 0, 1]}),
        ],
        "loads[0].moment",
        "no rotation",
    ),
    "follower on a node without rotation": (
        [
            ("links.0", {"name": "l", "modal_file": "solid.modal.h5"}),
            LOAD,
            ("loads.0", {"point": "elbow", "force": [0, 0, 1], "follower": True}),
        ],
        "loads[0].follower",
        "no rotation",
    ),
    "unknown deformation": ([("initial.deformation", "relaxed")], "initial.deformation", "zero, static"),
}
