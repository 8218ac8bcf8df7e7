"""What the circuits of motors need, and what they do not go with."""

from __future__ import annotations

from collections.abc import Collection

from erls.mechanism.drives import MotionDrive, PDDrive, VoltageDrive
from erls.scene.chain import SceneRecord
from erls.scene.checks import bad, positive
from erls.scene.joints import Acting, Joint

_FIELDS = ("resistance", "inductance", "torque_constant")


def charge_name(joint: str) -> str:
    """What the coordinate of a motor's charge is called."""
    return f"{joint} charge"


def motor_name(joint: str) -> str:
    """What a motor's circuit is called."""
    return f"{joint} motor"


def circuits(scene: SceneRecord) -> bool:
    """Whether any motor has one."""
    return any(has_circuit(joint) for joint in scene.joints)


def has_circuit(joint: Joint) -> bool:
    """Whether the motor of a joint has one, or is meant to."""
    return bool(_given(joint))


def check_circuits(scene: SceneRecord, file: str, taken: Collection[str]) -> None:
    """Refuse circuits that cannot be meant, and voltages without one; ``taken`` are names of what ties or moves.

    Raises
    ------
    SceneError
        BAD_FIELD: naming file, field, value and remedy.
    """
    for k, joint in enumerate(scene.joints):
        place = f"{file}: joints[{k}]"
        given = _given(joint)
        if given:
            _check_circuit(joint, given, place)
            for name in (charge_name(joint.name), motor_name(joint.name)):
                if name in taken:
                    raise bad(f"{place}.name", f"{name!r} is the name of a part of its motor", joint.name, "rename one")
        else:
            _refuse_voltage(joint, place)
        for name, coordinate in joint.coordinates.items():
            _refuse_voltage(coordinate, f"{place}.coordinates.{name}")
    for k, loop in enumerate(scene.loops):
        _refuse_voltage(loop, f"{file}: loops[{k}]")


def _given(joint: Joint) -> list[str]:
    return [field for field in _FIELDS if getattr(joint.motor, field) is not None]


def _check_circuit(joint: Joint, given: list[str], place: str) -> None:
    motor = f"{place}.motor"
    for field in _FIELDS:
        if field not in given:
            message = f"a circuit has all of {', '.join(_FIELDS)}"
            raise bad(f"{motor}.{field}", message, None, f"give it, or remove {given[0]!r}")
        positive(f"{motor}.{field}", getattr(joint.motor, field))
    if joint.motor.gear_ratio == 0.0:
        raise bad(f"{motor}.gear_ratio", "a motor with a circuit turns", 0.0, "give the gear ratio")
    if isinstance(joint.drive, MotionDrive):
        message, remedy = "a motion that is prescribed asks for no voltage", "use type = 'pd', or remove the circuit"
        raise bad(f"{place}.drive.type", message, "motion", remedy)
    if isinstance(joint.drive, PDDrive) and joint.drive.feed_forward:
        message, remedy = "what is fed forward would have to lead the current", "set it to false"
        raise bad(f"{place}.drive.feed_forward", message, joint.drive.feed_forward, remedy)


def _refuse_voltage(acting: Acting, place: str) -> None:
    if isinstance(acting.drive, VoltageDrive):
        remedy = f"give motor.{', '.join(_FIELDS)} of a joint of one coordinate, or use type = 'torque'"
        raise bad(f"{place}.drive.type", "a voltage needs the circuit of a motor", "voltage", remedy)

