"""Kinds of sensors that a scene file can name, told apart by ``type``: one line each."""

from __future__ import annotations

from erls.mechanism.sensors.accelerometer import Accelerometer
from erls.mechanism.sensors.effort import Effort
from erls.mechanism.sensors.gyroscope import Gyroscope
from erls.mechanism.sensors.joint_angle import JointAngle
from erls.mechanism.sensors.joint_rate import JointRate
from erls.mechanism.sensors.position import Position
from erls.mechanism.sensors.section_force import SectionForce
from erls.mechanism.sensors.strain_gauge import StrainGauge
from erls.mechanism.sensors.stress import Stress
from erls.mechanism.sensors.velocity import Velocity

AnySensor = (
    Position
    | Velocity
    | Accelerometer
    | Gyroscope
    | StrainGauge
    | SectionForce
    | Stress
    | JointAngle
    | JointRate
    | Effort
)
