"""Values of nodal systems at random states, frozen in ``tests/data/frozen/nodal.npz``.

They were computed by NumPy classes beside the kernels, before the kernels took their place, but for those of screws,
whose derivatives `test_nodal_system` checks. Entries are called
``CASE/QUANTITY``; of a matrix the values are stored as they are.

``PYTHONPATH=. python tests/erls/nodal_tables.py`` freezes the values of the present code.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import nodal_cases
import numpy as np

from erls.equations.nodal.actuators import Actuator, Actuators
from erls.equations.nodal.assembly import NodalSystem
from erls.equations.nodal.beam import Beam, Beams
from erls.equations.nodal.chain import ChainSystem
from erls.equations.nodal.joints import GROUND, Joint
from erls.equations.nodal.loads import NodalLoad, NodalLoads
from erls.equations.nodal.rigid_body import RigidBodies, RigidBody
from erls.equations.nodal.springs import Spring, Springs
from erls.equations.nodal.turning_springs import TurningSpring, TurningSprings
from erls.maths import motion_maps as motions
from erls.maths import rotation_maps as rotations
from erls.maths.saddle import dense
from erls.maths.so3 import Array
from erls.mechanism.curves import Curve
from erls.mechanism.drives import Drive
from erls.mechanism.joint_types import JOINT_TYPES
from erls.mechanism.joints import Joint as ChainJoint
from erls.mechanism.joints import JointForces

FILE = Path(__file__).parents[1] / "data" / "frozen" / "nodal.npz"
TIME = 0.7


def swing(t: float) -> tuple[float, float, float]:
    """A prescribed motion that does not rest."""
    return float(np.sin(t)), float(np.cos(t)), -float(np.sin(t))


def tied(kind: str, group: str) -> NodalSystem:
    """Two bodies off their nodes, joined to each other and to the ground at random frames, not closed."""
    rng = np.random.default_rng(4)
    poses, frames = motions.exp(rng.standard_normal((2, 6))), motions.exp(rng.standard_normal((4, 6)))
    bodies = [RigidBody(k, 2.0 + k, np.diag([0.2, 0.3, 0.4]), rng.standard_normal(3)) for k in (0, 1)]
    drive = swing if kind in ("revolute", "prismatic") else None
    joints = [
        Joint("root", kind, GROUND, 0, frames[0], frames[1], drive, pitch=0.3),
        Joint("elbow", kind, 1, 0, frames[2], frames[3], drive, pitch=-0.7),
    ]
    return NodalSystem(poses, [RigidBodies(bodies, nodal_cases.WEIGHT)], joints, nodal_cases.GROUPS[group])


def sprung(group: str) -> NodalSystem:
    """A body and a massless beam on springs of both kinds, to the ground and between nodes, and on loads."""
    rng = np.random.default_rng(9)
    poses = motions.exp(0.6 * rng.standard_normal((3, 6)))
    section = nodal_cases.section(rng, massless=True)
    beams = [Beam((0, 2), poses[[0, 2]] @ motions.exp(0.4 * rng.standard_normal((2, 6))), section)]
    lines, turning = {}, {}
    for nodes in ((1,), (0, 1)):
        count = len(nodes)
        lines[count] = [Spring(nodes, *rng.standard_normal((2, 3)), 3.0, 0.7, 0.4) for _ in range(2)]
        axis = rng.standard_normal(3)
        frames = rotations.exp(rng.standard_normal((2, 3)))
        turning[count] = [TurningSpring(nodes, *frames, axis / np.linalg.norm(axis), 3.0, 0.7, 0.4)]
    elements = [
        Beams(beams, poses, nodal_cases.WEIGHT),
        RigidBodies([RigidBody(k, 1.0 + k, np.eye(3), rng.standard_normal(3)) for k in range(3)], nodal_cases.WEIGHT),
        *(Springs(group_) for group_ in lines.values()),
        *(TurningSprings(group_) for group_ in turning.values()),
        NodalLoads([NodalLoad(1, *rng.standard_normal((2, 3)), follower=True)]),
    ]
    joint = Joint("pin", "spherical", GROUND, 2, *motions.exp(rng.standard_normal((2, 6))))
    return NodalSystem(poses, elements, [joint], nodal_cases.GROUPS[group])


class _Rising(Curve):
    """A motion that does not rest."""

    breakpoints = ()

    def value(self, t: float, left: bool = False) -> float:
        return 0.3 + 0.2 * t * t

    def derivatives(self, t: float, left: bool = False) -> tuple[float, float, float]:
        return self.value(t), 0.4 * t, 0.4


def acting(limit: float) -> ChainSystem:
    """Joints with controllers, torques, springs, dampers, friction and rotors, free and prescribed, in a chain."""
    rng = np.random.default_rng(11)
    poses = motions.exp(0.6 * rng.standard_normal((4, 6)))
    forces = JointForces(stiffness=3.0, rest=0.2, damping=0.4, friction=0.3, transition_rate=0.05)
    drives = [
        Drive("pd", motion=_Rising(), gains=(5.0, 0.7), torque_limit=limit),
        Drive("torque", load=_Rising()),
        Drive("motion", motion=_Rising()),
        Drive(),
    ]
    kinds = ["revolute", "prismatic", "revolute", "revolute"]
    rotors = [0.4, 0.2, 0.3, 0.0]
    acting, joints = [], []
    for k, (drive, kind, rotor) in enumerate(zip(drives, kinds, rotors, strict=True)):
        own = forces if k != 3 else JointForces()
        ends = motions.exp(0.5 * rng.standard_normal((2, 6)))
        one = ChainJoint(f"j{k}", JOINT_TYPES[kind].freedoms[0], np.eye(4), np.eye(4), own, rotor, drive, 0.1, 0.0)
        nodes = (0,) if k == 0 else (k - 1, k)
        acting.append(Actuator(one, nodes, *ends, lambda t, k=k: 0.1 * k * t))
        motion = drive.reference if drive.prescribed else None
        joints.append(Joint(f"j{k}", kind, k - 1 if k else GROUND, k, *ends, motion))
    bodies = [RigidBody(k, 1.0 + k, np.eye(3), rng.standard_normal(3)) for k in range(4)]
    groups = [Actuators(acting[:1]), Actuators(acting[1:])]
    return ChainSystem(poses, [RigidBodies(bodies, nodal_cases.WEIGHT)], groups, joints)


KINDS = ("fixed", "revolute", "prismatic", "screw", "cylindrical", "universal", "spherical")
"""Joints whose values are frozen."""

CASES: dict[str, Callable[[], NodalSystem]] = {
    **{f"everything {g}": partial(nodal_cases.system, g) for g in nodal_cases.GROUPS},
    **{f"{kind} {g}": partial(tied, kind, g) for kind in KINDS for g in nodal_cases.GROUPS},
    **{f"springs {g}": partial(sprung, g) for g in nodal_cases.GROUPS},
    "actuators": partial(acting, np.inf),
    "actuators at their limit": partial(acting, 0.5),
}


def evaluate(system: NodalSystem) -> dict[str, Array]:
    """All that a system offers, at `nodal_cases.state`."""
    increment, v, a, multipliers = nodal_cases.state(system)
    t, q = TIME, system.compose(system.start, increment)
    stiffness, damping = system.stiffness_and_damping(t, q, v, a, multipliers)
    material = system.stiffness_and_damping(t, q, v, a, multipliers, material=True)
    stored = system.stored(t, q, v, a)
    found: dict[str, Any] = {
        "poses": q.poses,
        "tangent": system.tangent(increment),
        "residual": system.residual(t, q, v, a),
        "mass": system.mass_matrix(t, q),
        "stiffness": stiffness,
        "damping": damping,
        "material stiffness": material[0],
        "material damping": material[1],
        "violation": system.constraint(t, q),
        "gradient": system.constraint_matrix(t, q),
        "constraint rate": system.constraint_rate(t, q),
        "constraint bias": system.constraint_bias(t, q, v),
        "energy": np.array(system.energy(t, q, v)),
        **{f"stored {k}": values for k, values in enumerate(stored)},
    }
    if isinstance(system, ChainSystem):
        found["joint motion"] = np.array(system.joint_motion(q, v, a))
    return {name: dense(values) for name, values in found.items()}


def read() -> dict[str, dict[str, Array]]:
    """Quantities of every case."""
    with np.load(FILE) as file:
        return {
            case: {name.partition("/")[2]: file[name] for name in file.files if name.startswith(f"{case}/")}
            for case in CASES
        }


if __name__ == "__main__":
    found = {case: evaluate(make()) for case, make in CASES.items()}
    np.savez_compressed(FILE, **{f"{case}/{name}": x for case, of in found.items() for name, x in of.items()})
