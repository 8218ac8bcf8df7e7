"""Joints of several coordinates, or none, as joints of one coordinate each, which is what equations of motion know.

Between its one-parameter motions a joint of several coordinates carries massless rigid links without extent (R.
Featherstone, Rigid Body Dynamics Algorithms, 4.4): the motion subspace of the joint, its derivatives and the forces
along its coordinates follow from the recursions. A fixed joint is a turn held at 0: where a motion is prescribed every
formulation keeps all six conditions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from erls.maths.so3 import Array
from erls.mechanism.curves import piecewise
from erls.mechanism.drives import Drive
from erls.mechanism.joint_types import REVOLUTE
from erls.mechanism.joints import Joint, JointForces
from erls.mechanism.links import Link, rigid_model
from fe_import.model import IntArray, InterfaceNode


def fixed_joint(name: str, before: Array, after: Array, parent: int = -1, seat: InterfaceNode | None = None) -> Joint:
    """A joint that leaves nothing free; for its fields see `erls.mechanism.joints.Joint`."""
    held = Drive("motion", motion=piecewise([], [0.0]))
    return Joint(name, REVOLUTE, before, after, JointForces(), 0.0, held, 0.0, 0.0, parent, seat, fixed=True)


@dataclass(frozen=True)
class Expanded:
    """Joints of one coordinate, with the links that they carry.

    Attributes
    ----------
    joints : tuple of Joint
    links : tuple of Link
    numbers : (n,) int array
        Of the given links among these.
    """

    joints: tuple[Joint, ...]
    links: tuple[Link, ...]
    numbers: IntArray


def expand(rows: Sequence[Sequence[Joint]], links: Sequence[Link]) -> Expanded:
    """Joints with massless links between the motions of each.

    Parameters
    ----------
    rows : sequence of sequences of Joint
        The motions of each joint from the inner frame outward; where the first one stands is given among ``links``.
    links : sequence of Link
        What each joint carries.
    """
    numbers: IntArray = np.cumsum([len(row) for row in rows]) - 1
    joints: list[Joint] = []
    carried: list[Link] = []
    for row, link in zip(rows, links, strict=True):
        seat, below = row[0].seat, row[0].parent
        parent = int(numbers[below]) if below >= 0 else -1
        for joint in row:
            joints.append(replace(joint, parent=parent, seat=seat))
            carried.append(link if joint is row[-1] else intermediate_link(joint.name))
            parent, seat = len(carried) - 1, carried[-1].inboard
    return Expanded(tuple(joints), tuple(carried), numbers)


def intermediate_link(name: str) -> Link:
    """A massless rigid link without extent, on whose origin both of its joints sit."""
    model = rigid_model(name, 0.0, np.zeros(3), np.zeros((3, 3)), {"origin": np.zeros(3)})
    origin = model.interface_nodes[0]
    return Link(name, model, model.invariants, origin, np.zeros(0), np.zeros(0), intermediate=True)
