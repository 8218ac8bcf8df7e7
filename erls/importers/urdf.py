"""Unified Robot Description Format: what a file says, as records.

Read by the standard library's parser: the packages for URDF that are kept up load meshes, planners and ROS besides.
What is drawn moves nothing: a fault in it is told and the rest is taken. What is not used is told, too
(`UrdfRobot.told`). Document types are refused, so that no entity can be expanded.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from xml.parsers import expat

import numpy as np

from erls.errors import Cause, SceneError
from erls.files.input import content_of
from erls.maths.so3 import Array, fixed_axes, rotation_x

_MOST_BYTES = 50_000_000
_MOST = 1e6  # m, kg, N: larger numbers are slips
TYPES = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")
_MOMENTS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
_SIZES = {"mesh": (), "box": ("size",), "cylinder": ("radius", "length"), "sphere": ("radius",)}
_LIMITS = ("lower", "upper", "effort", "velocity")
_KNOWN = {
    "robot": {"link", "joint"},
    "link": {"inertial", "visual"},
    "inertial": {"origin", "mass", "inertia"},
    "joint": {"origin", "parent", "child", "axis", "limit", "dynamics", "mimic"},
}


@dataclass(frozen=True)
class UrdfShape:
    """What a link looks like, or what of it touches others.

    Attributes
    ----------
    kind : str
        ``mesh``, ``box``, ``cylinder`` or ``sphere``.
    pose : (4, 4) array
        In the link's frame.
    sizes : tuple of float
        Scales of a mesh along its axes [1], sides of a box, radius and length of a cylinder, radius of a sphere [m].
    file : str
        Of a mesh, as it stands.
    """

    kind: str
    pose: Array
    sizes: tuple[float, ...]
    file: str = ""


@dataclass(frozen=True)
class UrdfLink:
    """A link.

    Attributes
    ----------
    name : str
    mass : float
        [kg]
    centre_of_mass : (3,) array
        In the link's frame [m].
    inertia : (3, 3) array
        About the centre of mass, axes of the link's frame [kg m²].
    visual, collision : tuple of UrdfShape
    """

    name: str
    mass: float
    centre_of_mass: Array
    inertia: Array
    visual: tuple[UrdfShape, ...] = ()
    collision: tuple[UrdfShape, ...] = ()


@dataclass(frozen=True)
class UrdfJoint:
    """A joint.

    Attributes
    ----------
    name, type, parent, child : str
    origin : (4, 4) array
        Pose of the child's frame in the parent's at zero.
    axis : (3,) array
        Unit vector in the child's frame.
    lower, upper, effort, velocity : float or None
        Limits [rad or m; N m or N; rad/s or m/s].
    damping, friction : float
        [N m s/rad or N s/m; N m or N]
    mimics : str
        The joint that it follows; empty for none.
    multiplier, offset : float
        Its coordinate is multiplier · that of the other one + offset [rad or m].
    """

    name: str
    type: str
    parent: str
    child: str
    origin: Array
    axis: Array
    lower: float | None
    upper: float | None
    effort: float | None
    velocity: float | None
    damping: float
    friction: float
    mimics: str
    multiplier: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class UrdfRobot:
    """A tree of links and joints.

    Attributes
    ----------
    name : str
    links : dict of UrdfLink
    joints : tuple of UrdfJoint
        Parents before children.
    root : str
        The link that no joint carries.
    told : tuple of str
        What of the file is not used.
    """

    name: str
    links: dict[str, UrdfLink]
    joints: tuple[UrdfJoint, ...]
    root: str
    told: tuple[str, ...]


def read_urdf(path: Path) -> UrdfRobot:
    """Read and check a file.

    Raises
    ------
    SceneError
        FILE_NOT_FOUND, NOT_READABLE, SYNTAX, BAD_FIELD, BAD_REFERENCE: with element, attribute and value.
    """
    root = _parsed(path)
    ignored: Counter[str] = Counter()
    _count(root, ignored)
    faults = list[str]()
    links = [_link(element, path, faults) for element in root.findall("link")]
    joints = [_joint(element, path) for element in root.findall("joint")]
    for what, names in (("link", [link.name for link in links]), ("joint", [joint.name for joint in joints])):
        twice = [name for name, count in Counter(names).items() if count > 1]
        if twice:
            raise _fault(path, f"{what} {twice[0]!r}", "stands twice", twice[0], "give each its own name")
    if not links:
        raise _fault(path, "robot", "no links", None, "give a robot with links and joints")
    by_name = {link.name: link for link in links}
    ordered, top = _tree(by_name, joints, path)
    told = [f"{count} × <{name}> not used: nothing that moves depends on it" for name, count in sorted(ignored.items())]
    return UrdfRobot(root.get("name") or path.stem, by_name, tuple(ordered), top, (*told, *faults))


def _parsed(path: Path) -> ET.Element:
    content = content_of(path, "a URDF file", _MOST_BYTES)
    try:
        root = _elements(content)
    except (expat.ExpatError, ValueError, LookupError) as problem:
        raise _syntax(path, f"not XML: {problem}", "mend the file") from None
    if root.tag != "robot":
        raise _syntax(path, f"not a robot but <{root.tag}>", "give a URDF file")
    if any(element.tag.startswith("xacro:") for element in root.iter()):
        raise _syntax(path, "macros (xacro) that are not expanded", "expand them first: xacro ROBOT.xacro > ROBOT.urdf")
    return root


def _elements(content: bytes) -> ET.Element:
    """The tree of a file; prefixes of names need not be declared, as simulators write them (drake:, xacro:)."""
    builder = ET.TreeBuilder()
    parser = expat.ParserCreate()

    def refuse(*arguments: object) -> None:
        raise ValueError("a document type, which robots do not have")

    parser.StartDoctypeDeclHandler = refuse
    parser.StartElementHandler = lambda name, attributes: builder.start(name, attributes) and None
    parser.EndElementHandler = lambda name: builder.end(name) and None
    parser.Parse(content, True)
    return builder.close()


def _count(root: ET.Element, ignored: Counter[str]) -> None:
    """Elements that are not used, by name."""
    for element in (root, *root.findall("link"), *root.findall("joint"), *root.findall("link/inertial")):
        ignored.update(child.tag for child in element if child.tag not in _KNOWN[element.tag])


def _link(element: ET.Element, path: Path, faults: list[str]) -> UrdfLink:
    name = _named(element, "name", path, "link")
    where, inertial = f"link {name!r}", element.find("inertial")
    shapes = [_shapes(element, kind, path, where, faults) for kind in ("visual", "collision")]
    if inertial is None:
        return UrdfLink(name, 0.0, np.zeros(3), np.zeros((3, 3)), *shapes)
    pose = _pose(inertial.find("origin"), path, where)
    mass = _number(inertial.find("mass"), "value", path, f"{where}: mass")
    tensor = inertial.find("inertia")
    if tensor is None:
        tensor = ET.Element("inertia", dict.fromkeys(_MOMENTS, "0"))
    entries = {name: _number(tensor, name, path, f"{where}: inertia") for name in _MOMENTS}
    if mass < 0:
        raise _fault(path, f"{where}: mass", "a mass cannot be negative", mass, "mend it")
    xx, xy, xz, yy, yz, zz = entries.values()
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    turn = pose[:3, :3]
    return UrdfLink(name, mass, pose[:3, 3], turn @ inertia @ turn.T, *shapes)


def _shapes(link: ET.Element, tag: str, path: Path, where: str, faults: list[str]) -> tuple[UrdfShape, ...]:
    found = list[UrdfShape]()
    for element in link.findall(tag):
        try:
            found.append(_shape(element, path, f"{where}: {tag}"))
        except SceneError as problem:
            value = "" if problem.value is None else f": {problem.value!r}"
            faults += [f"{where}: a <{tag}> is not drawn: {problem.message}{value}"] if tag == "visual" else []
    return tuple(found)


def _shape(element: ET.Element, path: Path, where: str) -> UrdfShape:
    forms = [form for form in element.findall("geometry/*") if form.tag in _SIZES]
    if len(forms) != 1:
        raise _fault(path, where, f"no geometry of {', '.join(_SIZES)}", None, "give one")
    form, pose = forms[0], _pose(element.find("origin"), path, where)
    if form.tag == "mesh":
        scale = _vector(form, "scale", path, where, np.ones(3))
        return UrdfShape("mesh", pose, tuple(scale.tolist()), _named(form, "filename", path, where))
    if form.tag == "box":
        sizes = _vector(form, "size", path, where, np.zeros(3)).tolist()
    else:
        sizes = [_number(form, name, path, where) for name in _SIZES[form.tag]]
    if min(sizes) <= 0:
        raise _fault(path, where, f"a {form.tag} without size", None, "give positive sizes")
    return UrdfShape(form.tag, pose, tuple(sizes))


def _joint(element: ET.Element, path: Path) -> UrdfJoint:
    name = _named(element, "name", path, "joint")
    where = f"joint {name!r}"
    kind = _named(element, "type", path, where)
    if kind not in TYPES:
        raise _fault(path, f"{where}: type", "unknown type", kind, f"types are {', '.join(TYPES)}")
    axis = np.array([1.0, 0.0, 0.0])
    if (found := element.find("axis")) is not None:
        axis = _vector(found, "xyz", path, f"{where}: axis", axis)
    length = float(np.linalg.norm(axis))
    if length < 1e-9 and kind not in ("fixed", "floating"):
        raise _fault(path, f"{where}: axis", "no direction", axis.tolist(), "give a vector")
    limit, dynamics, mimic = (element.find(tag) for tag in ("limit", "dynamics", "mimic"))
    ends = [_maybe(limit, side, path, f"{where}: limit", unlimited=True) for side in _LIMITS]
    resisting = [_maybe(dynamics, side, path, f"{where}: dynamics") or 0.0 for side in ("damping", "friction")]
    for side, value in zip(("damping", "friction"), resisting, strict=True):
        if value < 0:
            raise _fault(path, f"{where}: {side}", "cannot be negative", value, "mend it")
    multiplier, turns_freely = _maybe(mimic, "multiplier", path, f"{where}: mimic"), kind == "continuous"
    return UrdfJoint(
        name=name,
        type=kind,
        parent=_named(element.find("parent"), "link", path, f"{where}: parent"),
        child=_named(element.find("child"), "link", path, f"{where}: child"),
        origin=_pose(element.find("origin"), path, where),
        axis=axis / (length or 1.0),
        lower=None if turns_freely else ends[0],
        upper=None if turns_freely else ends[1],
        effort=ends[2],
        velocity=ends[3],
        damping=resisting[0],
        friction=resisting[1],
        mimics="" if mimic is None else mimic.get("joint", "?"),
        multiplier=1.0 if multiplier is None else multiplier,
        offset=_maybe(mimic, "offset", path, f"{where}: mimic") or 0.0,
    )


def _tree(links: dict[str, UrdfLink], joints: list[UrdfJoint], path: Path) -> tuple[list[UrdfJoint], str]:
    """Joints with parents before children, and the root."""
    carried: dict[str, UrdfJoint] = {}
    for joint in joints:
        for side, name in (("parent", joint.parent), ("child", joint.child)):
            if name not in links:
                message, remedy = "no link of that name", f"known: {', '.join(links)}"
                raise SceneError(Cause.BAD_REFERENCE, message, where=f"{path}: joint {joint.name!r}: {side}",
                                 value=name, remedy=remedy)  # fmt: skip
        if joint.child in carried:
            raise _fault(path, f"joint {joint.name!r}: child", "two joints carry this link", joint.child,
                         "a robot is a tree; close loops in the scene")  # fmt: skip
        carried[joint.child] = joint
    roots = [name for name in links if name not in carried]
    if len(roots) != 1:
        what = "every link hangs on another" if not roots else "several links hang on nothing: " + ", ".join(roots)
        raise _fault(path, "robot", what, None, "a robot has one root")
    ordered, waiting = list[UrdfJoint](), [roots[0]]
    while waiting:
        parent = waiting.pop(0)
        hanging = [joint for joint in joints if joint.parent == parent]
        ordered += hanging
        waiting += [joint.child for joint in hanging]
    if len(ordered) < len(joints):
        apart = next(joint for joint in joints if joint not in ordered)
        raise _fault(path, f"joint {apart.name!r}", "hangs on itself", apart.child, "a robot is a tree")
    return ordered, roots[0]


def angles_of(turn: Array) -> Array:
    """(3,) angles [rad] of which `fixed_axes` makes a turn, to rounding also where x and z are one axis."""
    level = math.hypot(turn[2, 1], turn[2, 2])
    y = math.atan2(-turn[2, 0], level)
    x = math.atan2(turn[2, 1], turn[2, 2]) if level > 1e-9 else 0.0
    rest = turn @ rotation_x(x).T  # about y, then z
    return np.array([x, y, math.atan2(-rest[0, 1], rest[1, 1])])


def _pose(element: ET.Element | None, path: Path, where: str) -> Array:
    pose = np.eye(4)
    if element is not None:
        pose[:3, 3] = _vector(element, "xyz", path, f"{where}: origin", np.zeros(3))
        pose[:3, :3] = fixed_axes(*_vector(element, "rpy", path, f"{where}: origin", np.zeros(3)))
    return pose


def _vector(element: ET.Element, name: str, path: Path, where: str, default: Array) -> Array:
    text = element.get(name)
    if text is None:
        return default
    parts = text.split()
    if len(parts) != 3:
        raise _fault(path, f"{where}: {name}", "not three numbers", text, "give three numbers")
    return np.array([_value(part, path, f"{where}: {name}") for part in parts])


def _number(element: ET.Element | None, name: str, path: Path, where: str) -> float:
    if element is None or element.get(name) is None:
        raise _fault(path, where, f"{name!r} is missing", None, "give it")
    return _value(str(element.get(name)), path, f"{where}: {name}")


def _maybe(element: ET.Element | None, name: str, path: Path, where: str, unlimited: bool = False) -> float | None:
    """None where it is not given; where a limit is too large to be one, too."""
    text = None if element is None else element.get(name)
    if text is None:
        return None
    value = _value(text, path, f"{where}: {name}", math.inf if unlimited else _MOST)
    return value if abs(value) <= _MOST else None


def _value(text: str, path: Path, where: str, most: float = _MOST) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not abs(value) <= most:
        raise _fault(path, where, "not a finite number of plausible size", text[:40], "give a number")
    return value


def _named(element: ET.Element | None, name: str, path: Path, where: str) -> str:
    found = "" if element is None else " ".join(str(element.get(name) or "").split())
    if not found:
        raise _fault(path, where, f"{name!r} is missing", None, "give it")
    return found


def _fault(path: Path, where: str, message: str, value: object, remedy: str) -> SceneError:
    return SceneError(Cause.BAD_FIELD, message, where=f"{path}: {where}", value=value, remedy=remedy)


def _syntax(path: Path, message: str, remedy: str) -> SceneError:
    return SceneError(Cause.SYNTAX, message, where=str(path), remedy=remedy)
