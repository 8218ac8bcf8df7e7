"""What the circuits of motors (`erls.mechanism.circuits`) give along joints and charges."""

from __future__ import annotations

from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism


def add_motors(mechanism: Mechanism, rates: Array, effort: Array) -> None:
    """Add torques of motors and back-EMF to the efforts (k, joints) at rates (k, joints)."""
    names = [joint.name for joint in mechanism.joints]
    for circuit in (loop.circuit for loop in mechanism.loops if loop.circuit is not None):
        joint, charge = names.index(circuit.joint), names.index(circuit.charge)
        effort[:, joint] += circuit.gyration * rates[:, charge]
        effort[:, charge] -= circuit.gyration * rates[:, joint]
