"""What acts in a joint, of the chain or closing a loop, from its record in a scene: spring, damper, friction, rotor."""

from __future__ import annotations

import math

from erls.mechanism.joints import JointForces
from erls.mechanism.place import Place
from erls.scene.joints import Joint, Loop


def angle(place: Place, name: str, plain: float | None, degrees: float | None) -> float:
    """A quantity in SI or in degrees; 0 unless given.

    Raises
    ------
    SceneError
        BAD_FIELD: both, degrees where nothing turns, not a finite number.
    """
    if plain is not None and degrees is not None:
        raise place.error(name, f"both {name} and {name}_deg", remedy="keep one")
    if degrees is not None:
        if not place.revolute:
            raise place.error(f"{name}_deg", "degrees at a prismatic joint", degrees, remedy=f"give {name} in metres")
        return math.radians(place.number(f"{name}_deg", degrees))
    return place.number(name, plain or 0.0)


def joint_forces(record: Joint | Loop, place: Place) -> JointForces:
    """Spring, damper and friction of a joint.

    Raises
    ------
    SceneError
        BAD_FIELD.
    """
    friction, within = record.friction, place.at("friction")
    return JointForces(
        stiffness=place.not_negative("stiffness", record.stiffness),
        rest=angle(place, "rest", record.rest, record.rest_deg),
        damping=place.not_negative("damping", record.damping),
        friction=within.not_negative("force", friction.force) if friction else 0.0,
        transition_rate=within.positive("transition_rate", friction.transition_rate) if friction else 1.0,
    )


def reflected_inertia(record: Joint | Loop, place: Place) -> float:
    """Inertia of the rotor on the joint's coordinate [kg m² or kg].

    Raises
    ------
    SceneError
        BAD_FIELD.
    """
    motor = place.at("motor")
    inertia = motor.not_negative("rotor_inertia", record.motor.rotor_inertia)
    return inertia * motor.number("gear_ratio", record.motor.gear_ratio) ** 2
