"""A robot of URDF as a scene: bodies on joints, with frames where the file has them.

The mesh frame of each link is the frame of its URDF link. A joint starts from a ``branch``, its origin turned so that z
is its axis, and its modified Denavit-Hartenberg row is zero; the mesh pose turns back. Links that fixed joints connect
are one body; their frames become named points.
"""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from erls.errors import Cause, SceneError
from erls.importers.bodies import Body, bodies_of
from erls.importers.mimic import couplings_of, follows
from erls.importers.urdf import UrdfJoint, UrdfRobot, angles_of
from erls.importers.visuals import Seen
from erls.maths.so3 import Array
from erls.scene.read import checked
from fe_import.model import Surface

TUBE = "tube"
"""In place of a description: an aluminium tube of the link's mass and length; ``tube:D`` of an outer diameter D [m]."""

_KINDS = {
    "revolute": "revolute",
    "continuous": "revolute",
    "prismatic": "prismatic",
    "planar": "planar",
    "floating": "floating",
}
_DENSITY, _WALL = 2700.0, 0.1  # kg/m³; of the outer diameter
_ROUND = 1e-9
_SLENDER = 2.0  # length over diameter of what may be called a beam


@dataclass(frozen=True)
class Imported:
    """A scene and its links as texts.

    Attributes
    ----------
    scene : str
        TOML.
    links : dict of str
        Descriptions that were made, by file name.
    surfaces : dict of Surface
        What rigid links look like, by file name.
    bodies : tuple of Body
        That move.
    told : tuple of str
        What the user should know.
    """

    scene: str
    links: dict[str, str]
    surfaces: dict[str, Surface]
    bodies: tuple[Body, ...]
    told: tuple[str, ...]


def imported(
    robot: UrdfRobot,
    source: Path,
    folder: Path,
    flexible: Mapping[str, str],
    floating: bool = False,
    hold: bool = False,
    stops: bool = False,
    pictures: str = "",
) -> Imported:
    """Make a scene.

    Parameters
    ----------
    robot : UrdfRobot
    source : Path
        Its file, for remarks.
    folder : Path
        Of the scene, where relative paths start.
    flexible : dict of str
        A description, or `TUBE`, by the name of the link that becomes flexible.
    floating : bool
        Whether the base moves freely instead of standing on the ground.
    hold : bool
        Whether drives hold all joints at their start, instead of leaving them free.
    stops : bool
        Whether limits of joints push back.
    pictures : str
        Folder beside the scene for what links look like; left out unless given.

    Raises
    ------
    SceneError
        BAD_REFERENCE, BAD_FIELD: no such link, or none that can be flexible so; or the scene is refused.
    """
    bodies, told = bodies_of(robot)
    base, *moving = bodies
    if floating:
        limits = (None, None, None, None, 0.0, 0.0, "")
        joint = UrdfJoint("base", "floating", "", base.name, np.eye(4), np.array([0.0, 0.0, 1.0]), *limits)
        moving = [replace(base, joint=joint), *moving]
    for body in moving:
        moments = np.linalg.eigvalsh(body.inertia)
        if moments[0] < -_ROUND * abs(moments[2]):
            message, remedy = "not the inertia of a body: a negative principal moment", "mend it in the file"
            where = f"{source}: link {body.name!r}, with what is fixed to it"
            raise SceneError(Cause.BAD_FIELD, message, where=where, value=float(moments[0]), remedy=remedy)
        if moments[2] > (1 + 1e-3) * (moments[0] + moments[1]):
            told.append(
                f"link {body.name!r}: no body has such moments of inertia, one is more than the sum of the others"
            )
    names = [body.name for body in moving]
    for name in flexible:
        if name not in names:
            message = "no moving link of that name"
            raise SceneError(Cause.BAD_REFERENCE, message, where="--flexible", value=name, limit=names,
                             remedy="links that fixed joints connect go by the name of the first")  # fmt: skip
    if not moving:
        message, remedy = "nothing in it moves", "give a robot with joints that are not fixed, or --floating"
        raise SceneError(Cause.BAD_FIELD, message, where=str(source), remedy=remedy)
    if not floating and base.mass:
        told.append(f"the mass of {base.name!r}, {base.mass:.6g} kg, stands on the ground and is left out")
    seats = {body.name: _seats(body, moving) for body in [base, *moving]}
    files: dict[str, str] = {}
    seen, surfaces = Seen(robot, source, len(moving)), dict[str, Surface]()
    links = []
    for body in moving:
        file, drawn = "", seen.surface(body.frames, body.name in flexible) if pictures else None
        if drawn is not None:
            surfaces[name := _file_name(body.name, ".stl", surfaces)] = drawn
            file = f"{pictures}/{name}"
        links.append(_link(body, seats[body.name], flexible.get(body.name, ""), files, told, file))
    if pictures and not floating:
        seen.leave(base.frames, "it stands on the ground")
    own = [body.joint for body in moving if body.joint is not None]
    held = {joint.name for joint in own if hold and not follows(joint, own)}
    joints = [_joint(body, base.name if not floating else "", seats, held, stops) for body in moving]
    couplings, alone = couplings_of(own)
    points = [p for body in moving for p in _points(body, seats[body.name], flexible.get(body.name, ""), told)]
    told = [*robot.told, *told, *alone, *seen.told]
    remarks = [f"# {robot.name}: imported from {source.name}. Mesh frames are the frames of its links."]
    remarks += [f"# - {text}" for text in told]
    head = f"name = {_text(robot.name)}\ngravity = [0.0, 0.0, -9.81]\n\n[simulation]\nduration = 1.0\n"
    scene = "\n".join(["\n".join(remarks), head, *joints, *links, *points, *couplings])
    if not any(flexible.values()):  # those that are must be there first
        checked(tomllib.loads(scene), folder / "scene.toml", str(source))
    return Imported(scene, files, surfaces, tuple(moving), tuple(told))


def _seats(body: Body, moving: list[Body]) -> dict[str, Array]:
    """(4, 4) origins of the joints that stand on a body, by the links that they carry."""
    standing = (other for other in moving if other.joint is not None and other.joint.parent == body.name)
    return {other.name: other.joint.origin for other in standing if other.joint is not None}


def _upright(axis: Array) -> Array:
    """(3, 3) turn that takes z to an axis."""
    across = np.eye(3)[int(np.argmin(np.abs(axis)))]
    x = np.cross(across, axis) if abs(axis[2]) < 1 else np.array([1.0, 0.0, 0.0])
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(axis, x), axis])


def _joint(body: Body, base: str, seats: Mapping[str, Mapping[str, Array]], held: set[str], stops: bool) -> str:
    joint = body.joint
    assert joint is not None
    upright = _upright(joint.axis)
    lines = [f"[[joints]]\nname = {_text(joint.name)}\ntype = {_text(_KINDS[joint.type])}"]
    on_ground = joint.parent in ("", base)
    lines.append(f"on = {_text('ground' if on_ground else joint.parent)}")
    if not on_ground:
        lines.append(f"at = {_text(body.name)}")
    turn = np.degrees(angles_of(joint.origin[:3, :3] @ upright))
    place = _numbers(joint.origin[:3, 3])
    lines.append(f"branch = {{ position = {place}, rotation_deg = {_numbers(turn)} }}")
    lines.append('dh = { convention = "modified" }')
    if joint.type in ("revolute", "continuous", "prismatic"):
        lines += _acting(joint, joint.name in held, stops)
    return "\n".join(lines) + "\n"


def _acting(joint: UrdfJoint, hold: bool, stops: bool) -> list[str]:
    """What acts along a joint, and what the file says of its limits."""
    turns = joint.type != "prismatic"
    low, high = joint.lower, joint.upper
    start = 0.0
    if low is not None and high is not None and low < high and not low <= 0.0 <= high:
        start = (low + high) / 2
    found = []
    if hold:
        found.append(f'drive = {{ type = "motion", motion = {{ shape = "polynomial", from = {start!r}, to = {start!r}, '
                     "duration = 1.0 } }")  # fmt: skip
    elif start:
        found.append(f"initial = {{ position = {start!r} }} # the middle of its range")
    if joint.damping:
        found.append(f"damping = {joint.damping!r}")
    if joint.friction:
        found.append(f"friction = {{ force = {joint.friction!r} }}")
    said = [f"{name} {value:.6g} {unit}" for name, value, unit in (
        ("effort", joint.effort, "N m" if turns else "N"), ("rate", joint.velocity, "rad/s" if turns else "m/s"),
    ) if value]  # fmt: skip
    if low is not None and high is not None and low < high:
        stiffness = 100.0 * (joint.effort or 10.0)
        mark = "" if stops else "# "
        guess = f"stiffness is a guess: full effort at 0.01 {'rad' if turns else 'm'}"
        found.append(f"{mark}stops = {{ lower = {low!r}, upper = {high!r}, stiffness = {stiffness!r}, "
                     f"restitution = 0.0 }} # {guess}")  # fmt: skip
    if said:
        found.append(f"# limits: {', '.join(said)}")
    return found


def _link(
    body: Body, seats: Mapping[str, Array], model: str, files: dict[str, str], told: list[str], surface: str
) -> str:
    assert body.joint is not None
    back = np.degrees(angles_of(_upright(body.joint.axis).T))
    lines = ["[[links]]", f"name = {_text(body.name)}", f"mesh_pose = {{ rotation_deg = {_numbers(back)} }}"]
    if _is_tube(model):
        file = _file_name(body.name, ".toml", files)
        files[file], said = _tube(body, seats, model)
        told.append(said)
        lines.append(f"model = {_text('links/' + file)}")
    elif model:
        lines.append(f"model = {_text(model)}")
    else:
        points = {body.name: np.zeros(3), **{name: pose[:3, 3] for name, pose in seats.items()}}
        points |= {name: pose[:3, 3] for name, pose in body.frames.items()}
        named = ", ".join(f"{_text(name)} = {_numbers(place)}" for name, place in points.items())
        rows = ", ".join(_numbers(row) for row in body.inertia)
        drawn = f", surface = {_text(surface)}" if surface else ""
        lines.append(f"rigid = {{ mass = {body.mass!r}, centre_of_mass = {_numbers(body.centre_of_mass)}, "
                     f"inertia = [{rows}], points = {{ {named} }}{drawn} }}")  # fmt: skip
    return "\n".join(lines) + "\n"


def _file_name(link: str, suffix: str, taken: Mapping[str, object]) -> str:
    """For a link, of characters that all systems take, and unlike those that are taken."""
    stem = "".join(c if c.isalnum() or c in "-_" else "_" for c in link)
    known = {name.casefold() for name in taken}
    while f"{stem}{suffix}".casefold() in known:  # of a name that differs in what a file's cannot have
        stem += "_"
    return f"{stem}{suffix}"


def _is_tube(model: str) -> bool:
    return model.partition(":")[0] == TUBE


def _diameters(model: str, area: float, where: str) -> tuple[float, float]:
    """Outer diameter of a tube of this area, and its wall [m]."""
    _, asked, text = model.partition(":")
    if not asked:
        outer = math.sqrt(4 * area / (math.pi * (1 - (1 - 2 * _WALL) ** 2)))
        return outer, _WALL * outer
    try:
        outer = float(text)
    except ValueError:
        outer = math.nan
    inner = outer**2 - 4 * area / math.pi
    if not (0 < outer < math.inf and inner > 0):
        least = 2 * math.sqrt(area / math.pi)
        message = f"no tube: solid, it needs {least:.4g} m for the mass of the link"
        raise SceneError(Cause.BAD_FIELD, message, where=where, value=text, remedy="give a larger diameter [m]")
    return outer, (outer - math.sqrt(inner)) / 2


def _tube(body: Body, seats: Mapping[str, Array], model: str) -> tuple[str, str]:
    """A description of a tube from a body's frame to the joint that stands on it, or to its last frame."""
    ends = {**{name: pose[:3, 3] for name, pose in body.frames.items()}, **{n: p[:3, 3] for n, p in seats.items()}}
    name, tip = max(ends.items(), key=lambda end: float(np.linalg.norm(end[1])))
    length = float(np.linalg.norm(tip))
    where = f"--flexible {body.name}={model}"
    if len(seats) > 1:
        message = f"{len(seats)} joints stand on this link, which is no tube from one to the next"
        raise SceneError(Cause.BAD_FIELD, message, where=where, remedy="give a description of it")
    if seats:
        ((name, pose),) = seats.items()
        tip, length = pose[:3, 3], float(np.linalg.norm(pose[:3, 3]))
    area = body.mass / (_DENSITY * length) if length else math.inf
    outer, wall = _diameters(model, area, where)
    if not outer * _SLENDER < length:
        message = f"no beam: {length:.4g} m long, {outer:.4g} m thick as an aluminium tube of its {body.mass:.4g} kg"
        raise SceneError(Cause.BAD_FIELD, message, where=where, remedy="give a description of it")
    said = (
        f"{body.name!r} is guessed: an aluminium tube of its mass and length, {outer * 1e3:.4g} mm wide, walls "
        f"{wall * 1e3:.3g} mm; its centre of mass and inertia are those of the tube"
    )
    text = f"""# {said}.
name = {_text(body.name)}

[materials.aluminium]
youngs_modulus = 7e10
poissons_ratio = 0.33
density = {_DENSITY!r}

[sections.tube]
shape = "tubular"
outer_diameter = {outer!r}
thickness = {wall!r}

[frame.nodes]
{_text(body.name)} = [0.0, 0.0, 0.0]
{_text(name)} = {_numbers(tip)}

[[frame.members]]
from = {_text(body.name)}
to = {_text(name)}
elements = 10
material = "aluminium"
section = "tube"

[[interfaces]]
name = {_text(body.name)}
node = {_text(body.name)}

[[interfaces]]
name = {_text(name)}
node = {_text(name)}

[reduction]
method = "craig-bampton"
fixed_interface_modes = 6
elastic_modes = 12
"""
    return text, said


def _points(body: Body, seats: Mapping[str, Array], model: str, told: list[str]) -> list[str]:
    """A point at the frame of each link, and where the next joints sit."""
    found = []
    last = not seats
    for name in body.frames:
        on_tube = _is_tube(model) and name != body.name
        if model and name != body.name and not (on_tube and last and name == _last(body)):
            told.append(f"point {name!r} is left out: the flexible link {body.name!r} has no node there")
            continue
        if model and not _is_tube(model):
            found.append(f"[[points]]\nname = {_text(name)}\nlink = {_text(body.name)}\nposition = [0.0, 0.0, 0.0]\n")
            continue
        found.append(f"[[points]]\nname = {_text(name)}\nlink = {_text(body.name)}\nnode = {_text(name)}\n")
    return found


def _last(body: Body) -> str:
    """The frame that lies farthest from the first."""
    return max(body.frames, key=lambda name: float(np.linalg.norm(body.frames[name][:3, 3])))


def _numbers(values: Any) -> str:
    return "[" + ", ".join(repr(float(value) + 0.0) for value in values) + "]"


def _text(text: str) -> str:
    """As TOML has it."""
    return json.dumps(text)
