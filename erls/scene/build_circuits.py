"""Circuits of the motors of a scene: charges beside its joints, and what couples both."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from erls.mechanism.chain import Mechanism
from erls.mechanism.circuits import CIRCUIT, Circuit, charge_of, in_volts
from erls.mechanism.drives import Drive
from erls.mechanism.joint_types import ElectricFreedom, Z
from erls.mechanism.joints import JointForces
from erls.mechanism.loops import Loop, LoopEnd, LoopFreedom
from erls.scene.chain import Scene
from erls.scene.check_circuits import charge_name, motor_name


def with_circuits(scene: Scene, chain: Mechanism) -> tuple[Mechanism, tuple[Loop, ...]]:
    """A chain with the charges of its motors, whose drives are voltages; and what couples them to their joints."""
    joints, links = list(chain.joints), list(chain.links)
    names, ground = [joint.name for joint in joints], LoopEnd(None, 0, np.eye(4))
    found = list[Loop]()
    for record in scene.record.joints:
        motor = record.motor
        if motor.resistance is None or motor.inductance is None or motor.torque_constant is None:
            continue
        k, gyration = names.index(record.name), motor.gear_ratio * motor.torque_constant
        joint, link = charge_of(charge_name(record.name), motor.inductance, motor.resistance)
        volts = 1.0 if joints[k].drive.kind == "voltage" else motor.resistance / gyration
        free = LoopFreedom(ElectricFreedom(Z, False), 0.0, JointForces(), 0.0, in_volts(joints[k].drive, volts))
        circuit = Circuit(record.name, joint.name, gyration)
        found.append(Loop(motor_name(record.name), CIRCUIT, ground, ground, free, circuit=circuit))
        joints[k] = replace(joints[k], drive=Drive())
        joints.append(joint)
        links.append(link)
    return replace(chain, joints=tuple(joints), links=tuple(links)), tuple(found)
