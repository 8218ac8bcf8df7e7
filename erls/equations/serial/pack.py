"""The records that all formulations share, from a mechanism."""

from __future__ import annotations

from collections.abc import Set
from typing import Any

import numpy as np

from erls.equations.serial.decoupled_modes import DecoupledModes
from erls.equations.serial.ends import End
from erls.equations.serial.records import (
    Joint,
    JointState,
    Modes,
    RigidLink,
    RigidState,
    call_feed_forward,
    call_turn_by_vector,
)
from erls.equations.serial.time_curves import put_curve
from erls.maths.calls import address_for
from erls.maths.records import Memory, laid
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.curves import Curve
from erls.mechanism.drives import Drive
from erls.mechanism.joint_types import Freedom
from erls.mechanism.joints import Joint as MechanismJoint
from erls.mechanism.joints import JointForces
from erls.mechanism.links import Link, node_shape6
from erls.mechanism.loops import LoopEnd
from erls.mechanism.thermal import elastic_rest


def step_parts(before: Array, freedom: Freedom, after: Array) -> Array:
    """(4, 12) parts of the pose before · joint · after: constant, with cosine and sine of the coordinate, and with the
    coordinate itself.
    """
    parts = before @ freedom.parts @ after
    return np.concatenate([parts[:, :3, :3].reshape(4, 9), parts[:, :3, 3]], axis=1)


def pose_numbers(pose: Array) -> Array:
    """(12,) numbers of a pose (4, 4), see `erls.maths.spatial`."""
    return np.concatenate([pose[:3, :3].ravel(), pose[:3, 3]])


def joint_acts(joint: MechanismJoint) -> bool:
    """Whether drive, spring, damper, friction or rotor act in a joint."""
    return bool(joint.forces.active or joint.rotor_inertia or joint.drive.kind not in ("free", "motion"))


def force_record(
    memory: Memory, forces: JointForces, drive: Drive, rotor_inertia: float, motion: Curve | None
) -> Joint:
    """What acts along a coordinate, of a joint that moves nothing; its curves, ``motion`` that of the coordinate, are
    put into memory.
    """
    gain, rate_gain = drive.gains
    friction, transition = forces.smooth_friction(drive.prescribed)
    return Joint(
        place=-1,
        component=-1,
        motion=put_curve(memory, motion),
        load=put_curve(memory, drive.load),
        feeds=0,
        acts=1,
        stiffness=forces.stiffness,
        rest=forces.rest,
        damping=forces.damping,
        friction=friction,
        transition=transition,
        stops=np.zeros(0) if forces.stops is None else forces.stops.numbers,
        rotor=rotor_inertia,
        gain=gain,
        rate_gain=rate_gain,
        least=-drive.torque_limit,
        most=drive.torque_limit,
        rubbing=0.0,
        held=0.0,
        step=np.zeros((4, 12)),
        screw=np.zeros(6),
    )


def joint_record(memory: Memory, joint: MechanismJoint, place: int, step: Array, screw: Array) -> Joint:
    """A joint whose coordinate stands at ``place``; its curves are put into memory."""
    drive = joint.drive
    return force_record(memory, joint.forces, drive, joint.rotor_inertia, drive.motion)._replace(
        place=place,
        component=joint.freedom.axis if joint.freedom.vector else -1,
        feeds=int(drive.feed_forward),
        acts=int(joint_acts(joint)),
        held=joint.position,
        step=step,
        screw=screw,
    )


def modes_record(first: int, mass: Array, link: Link, decoupled: DecoupledModes) -> Modes:
    """Elastic coordinates of a link that begin at ``first``; ``mass`` (e, e)."""
    own = link.stiffness, link.damping, elastic_rest(link)
    return Modes(first, mass, *own, decoupled.vectors, decoupled.stiffness, decoupled.damping)


def effect_flags(effects: Set[str]) -> dict[str, int]:
    """Which parts of the inertia forces act (`erls.mechanism.effects`), 0 or 1, by the names of fields of records."""
    names = {
        "first_order": "inertia_first_order",
        "second_order": "inertia_second_order",
        "coriolis": "coriolis",
        "centrifugal": "centrifugal_load",
        "softening": "spin_softening",
    }
    return {field: int(name in effects) for field, name in names.items()}


def joint_states(scratch: Memory, count: int) -> int:
    """Memory for the motion of joints."""
    sizes = {"coordinate": 3, "pose": 12, "screw": 6, "twist": 6, "twist_rate": 6, "feed": 1, "forces": 2}
    room = laid(JointState(**{name: np.zeros(size) for name, size in sizes.items()}))
    return scratch.put_all([room] * count)


def end_record(link: Link, modes: Array | None, curved: bool, end: LoopEnd) -> End:
    """A frame that a loop holds; coordinates of its link move it by ``modes`` (m, n), or are modal coordinates."""
    n = len(link.invariants.m) if modes is None else modes.shape[1]
    turned = np.eye(n) if modes is None else modes
    bows = np.zeros((0, n, n))
    if curved and link.second_order is not None:
        bows = turned.T @ link.second_order.node(end.node) @ turned
    return End(
        link=end.link or 0,
        position=link.model.nodes[end.node],
        shapes=np.vstack(node_shape6(link.model, end.node)) @ turned,
        bows=bows,
        offset=pose_numbers(end.frame),
    )


def addresses(mechanism: Mechanism, call_loads: Any) -> dict[str, int]:
    """Of the functions that `Serial` names, which are compiled now, where the mechanism needs them.

    ``call_loads`` calls that of the formulation for loads.
    """
    feeds = any(joint.drive.feed_forward for joint in mechanism.joints)
    return {
        "feeds": address_for(call_feed_forward, feeds),
        "vectors": address_for(call_turn_by_vector, bool(mechanism.rotation_vectors)),
        "loads": address_for(call_loads, mechanism.acted_on),
    }


def rigid_links(mechanism: Mechanism, constants: Memory, scratch: Memory) -> tuple[int, int]:
    """Places of the rigid links and their states, for feed-forward; -1 where no drive asks for it."""
    if not any(joint.drive.feed_forward for joint in mechanism.joints):
        return -1, -1
    links = [
        RigidLink(
            joint.parent,
            step_parts(joint.before, joint.freedom, joint.after),
            joint.screw,
            link.invariants.rigid_mass_matrix,
        )
        for joint, link in zip(mechanism.joints, mechanism.links, strict=True)
    ]
    states = [RigidState(np.zeros(12), *(np.zeros(6) for _ in range(4))) for _ in links]
    return constants.put_all(links), scratch.put_all(states)
