"""Shell elements: quadrangles between four nodes, flat, curved or twisted, and their arrays.

Frames of the surface at the corners are fixed to the node frames, so that surfaces may meet at a node under any angle;
strains are those from the slopes of the surface as built. Forces are in `erls.equations.nodal.shell_forces`. Mass is
lumped, `lumped_shells`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from erls.equations.nodal.rigid_body import RigidBody, joined
from erls.equations.nodal.scatter import IntArray
from erls.maths import motion_maps as motions
from erls.maths.so3 import Array

PAIRS = ((0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3))
"""Which two corners, in the order in which a shell stands in the pairs of a system."""
POINTS = (0.5 - 12**-0.5, 0.5 + 12**-0.5)


@dataclass(frozen=True)
class Shell:
    """One element.

    Attributes
    ----------
    nodes : (int, int, int, int)
        Around it.
    frames : (4, 4, 4) array
        Of the surface at its corners as built, in the world; z is the normal.
    stiffness : (8, 8) array
        Of the section, about the nodes, in the axes of the frames, see `fe_import.elements.shell_strains`.
    moments : (3,) array
        ∫ρ dz, ∫ρ z dz, ∫ρ z² dz over the thickness [kg/m², kg/m, kg].
    drilling : float
        Stiffness against drilling, in shares of the membrane's shear stiffness.
    surfaces : (3, 5, 8) array or None
        Stress by strains, see `fe_import.elements.laminates.Laminate.surfaces`.
    """

    nodes: tuple[int, int, int, int]
    frames: Array
    stiffness: Array
    moments: Array
    drilling: float = 1.0
    surfaces: Array | None = None


class Shells:
    """All shells of a system as arrays, for `erls.equations.nodal.shell_forces`.

    Parameters
    ----------
    shells : sequence of Shell
    poses : (k, 4, 4) array
        All nodes as built.
    """

    breakpoints: tuple[float, ...] = ()

    def __init__(self, shells: Sequence[Shell], poses: Array) -> None:
        count = len(shells)
        self.corners: IntArray = np.array([s.nodes for s in shells], dtype=np.int64).reshape(-1, 4)
        frames = np.array([s.frames for s in shells]).reshape(-1, 4, 4, 4)
        own = motions.inverse(poses[self.corners]) @ frames
        self.frames = np.ascontiguousarray(
            np.concatenate([own[..., :3, 3], own[..., :3, :3].reshape(count, 4, 9)], axis=-1).reshape(count, 48)
        )
        built = slopes(frames)  # (q, 4, 2, 6)
        self.built = np.ascontiguousarray(built.reshape(count, 48))
        rises = np.linalg.inv(built[..., :2])
        self.rises = np.ascontiguousarray(rises.reshape(count, 16))
        across = np.cross(built[:, :, 0, :3], built[:, :, 1, :3])
        self.areas = np.linalg.norm(across, axis=-1) / len(POINTS) ** 2
        self.stiffness = np.zeros((count, 9, 9))
        for k, shell in enumerate(shells):
            self.stiffness[k, :8, :8] = shell.stiffness
            self.stiffness[k, 8, 8] = shell.drilling * shell.stiffness[2, 2]

    @property
    def nodes(self) -> IntArray:
        """(6 q, 2) each two corners."""
        return self.corners[:, PAIRS].reshape(-1, 2)


def slopes(frames: Array) -> Array:
    """(q, 4, 2, 6) slopes H⁻¹ ∂H of the surface along both reference coordinates at the points of the quadrature.

    ``frames`` (q, 4, 4, 4) at the corners; see `erls.equations.nodal.shell_forces`.
    """
    if not len(frames):  # scenes without shells pay nothing for them
        return np.zeros((0, 4, 2, 6))
    a, b, c, d = (frames[:, k] for k in range(4))
    first, second = motions.log(motions.inverse(a) @ b), motions.log(motions.inverse(d) @ c)
    found = []
    for r in POINTS:
        lower, upper = a @ motions.exp(r * first), d @ motions.exp(r * second)
        across = motions.log(motions.inverse(lower) @ upper)
        turned = motions.tangent_inverse(-across) @ first[..., None]
        gain = motions.tangent_inverse(across) @ second[..., None] - turned
        for s in POINTS:
            along = motions.adjoint_inverse(motions.exp(s * across)) @ first[..., None]
            along = along + s * motions.tangent(s * across) @ gain
            found.append(np.stack([along[..., 0], across], axis=-2))
    return np.stack(found, axis=-3)


def lumped_shells(shells: Sequence[Shell], poses: Array) -> list[RigidBody]:
    """Mass of all shells, with the inertia of the thickness, as one rigid body at each of their nodes.

    Elements give the shares of linear shape functions, which leave flat ones their centre of mass.
    """
    if not shells:
        return []
    r, s = np.repeat(POINTS, len(POINTS)), np.tile(POINTS, len(POINTS))
    shapes = np.stack([(1 - r) * (1 - s), r * (1 - s), r * s, (1 - r) * s])
    shares = Shells(shells, poses).areas @ shapes.T
    bodies = []
    for shell, areas in zip(shells, shares.tolist(), strict=True):
        mass, first, second = shell.moments.tolist()
        if not mass > 0:
            continue
        inertia = (second - first**2 / mass) * np.eye(3)
        for node, frame, area in zip(shell.nodes, shell.frames, areas, strict=True):
            local = motions.inverse(poses[node]) @ frame
            centre = local[:3, 3] + local[:3, 2] * (first / mass)
            bodies.append(RigidBody(node, area * mass, area * inertia, centre))
    return joined(bodies)
