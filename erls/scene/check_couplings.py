"""What couplings of joint coordinates need, and what they do not go with."""

from __future__ import annotations

from erls.errors import SceneError
from erls.mechanism.drives import MotionDrive
from erls.mechanism.joint_types import JOINT_TYPES, Freedom
from erls.scene.build_joints import joint_coordinates
from erls.scene.chain import SceneRecord
from erls.scene.check_circuits import circuits
from erls.scene.checks import bad, not_negative, refuse_settings
from erls.scene.couplings import Coupling
from fe_import.files.toml import choose

LAWS = ("dwell", "spline")  # of cams


def coupled_coordinates(scene: SceneRecord) -> dict[str, Freedom]:
    """Coordinates that couplings may tie, by their names: of the tree, then of closing joints."""
    found = {name: freedom for joint in scene.joints for name, freedom in joint_coordinates(joint).items()}
    closing = ((loop.name, JOINT_TYPES[loop.type].one) for loop in scene.loops)
    return {**found, **{name: freedom for name, freedom in closing if freedom is not None}}


def check_couplings(scene: SceneRecord, file: str) -> None:
    """Refuse couplings that cannot be meant.

    Raises
    ------
    SceneError
        BAD_FIELD, BAD_REFERENCE: naming file, field, value and remedy.
    """
    for k, coupling in enumerate(scene.couplings):
        _check_coupling(coupling, scene, f"{file}: couplings[{k}]")
    for given, what in ((bool(scene.couplings), "[[couplings]]"), (circuits(scene), "circuits of motors")):
        if given:
            refuse_settings(scene.simulation, file, what, ("gauge", "coordinates", "formulation"))


def _check_coupling(coupling: Coupling, scene: SceneRecord, place: str) -> None:
    known = coupled_coordinates(scene)
    choose(coupling.joint, known, f"{place}.joint", SceneError)
    if not coupling.follows and coupling.cam is None:
        remedy = "name one with its ratio, { shoulder = 2.0 }, or give a cam"
        raise bad(f"{place}.follows", "no joint to follow", None, remedy)
    if coupling.cam is not None:
        choose(coupling.cam.joint, known, f"{place}.cam.joint", SceneError)
        choose(coupling.cam.law, LAWS, f"{place}.cam.law", SceneError)
        if coupling.cam.joint == coupling.joint:
            raise bad(f"{place}.cam.joint", "a joint does not follow itself", coupling.joint, "name another one")
    for name, ratio in coupling.follows.items():
        where = f"{place}.follows.{name}"
        choose(name, known, f"{place}.follows", SceneError)
        if name == coupling.joint:
            raise bad(where, "a joint does not follow itself", name, "name another one")
        if ratio == 0.0:
            remedy = "give how far the joint that follows goes per unit, or remove it"
            raise bad(where, "a ratio is not 0", ratio, remedy)
    names = (coupling.joint, *coupling.follows, *([coupling.cam.joint] if coupling.cam else []))
    for name in names:
        if known[name].vector:
            message = "a component of a rotation vector turns about no axis of its own"
            raise bad(place, message, name, "couple joints of one turn each")
    if not coupling.elastic:
        if coupling.damping:
            message = "an ideal coupling does not move against itself"
            raise bad(f"{place}.damping", message, coupling.damping, "give 'stiffness', too, or remove it")
        led = _prescribed(scene)
        if all(name in led for name in names):
            message = "the motions of all its joints are prescribed"
            raise bad(f"{place}.joint", message, coupling.joint, "let the joint that follows be free")
    not_negative(f"{place}.stiffness", coupling.stiffness or 0.0)
    not_negative(f"{place}.damping", coupling.damping)


def _prescribed(scene: SceneRecord) -> set[str]:
    """Coordinates whose motion is prescribed."""
    found = {joint.name for joint in scene.joints if isinstance(joint.drive, MotionDrive)}
    found |= {loop.name for loop in scene.loops if isinstance(loop.drive, MotionDrive)}
    parts = ((joint.name, name, own) for joint in scene.joints for name, own in joint.coordinates.items())
    return found | {f"{joint}/{name}" for joint, name, own in parts if isinstance(own.drive, MotionDrive)}
