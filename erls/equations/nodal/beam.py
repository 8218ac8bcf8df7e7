"""Two-node geometrically exact beams with helicoidal interpolation on SE(3).

V. Sonneville, A. Cardona, O. Brüls, Comput. Methods Appl. Mech. Eng. 268 (2014) 451–474. Between the section frames at
its ends an element follows H(s) = H_A exp(s d / L), d = log(H_A⁻¹ H_B): the strain (d − d₀)/L is constant, exact for
every helix, and free of locking. With the twists ν of the end sections, ḋ = P ν, P = [−T⁻¹(−d), T⁻¹(d)], so that

    f = Pᵀ σ,  σ = K (d − d₀)/L,    K_t = Pᵀ K P / L + (∂Pᵀ/∂d σ) P,

all functions of d alone. Inertia is that of the same interpolation: ν(s) = Q(s, d) ν at three Gauss points, and forces
∫ Qᵀ (M ν̇ − ad(ν)ᵀ M ν) ds with ν̇ = Q a + Q̇ ν, which follow from the kinetic energy ½ ∫ νᵀ M ν ds.

Section frames are fixed to the node frames, so that members may meet at a node under any angle; d₀ follows from the
frames as built, straight or curved. The elements remember d, which goes on past a turn of π, and what follows from it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from erls.equations.nodal.rigid_body import RigidBody
from erls.equations.nodal.scatter import IntArray
from erls.equations.nodal.section import BeamSection
from erls.errors import Cause, SceneError
from erls.maths import motion_maps as motions
from erls.maths.rotation_maps import skews
from erls.maths.so3 import Array

_GAUSS = np.polynomial.legendre.leggauss(3)
_POINTS, _WEIGHTS = (_GAUSS[0][:, None, None] + 1) / 2, _GAUSS[1][:, None, None] / 2  # (3, 1, 1)
_UNITS = np.eye(6)[:, None, :]  # (6, 1, 6)


@dataclass(frozen=True)
class Beam:
    """One element.

    Attributes
    ----------
    nodes : (int, int)
    frames : (2, 4, 4) array
        Sections at the ends as built, in the world; x runs along the beam.
    section : BeamSection
    """

    nodes: tuple[int, int]
    frames: Array
    section: BeamSection


def straight(nodes: tuple[int, int], start: Array, end: Array, section: BeamSection, up: Array) -> Beam:
    """Beam between two points [m]; its z axis lies as near ``up`` as possible.

    Raises
    ------
    SceneError
        With cause BAD_FIELD when the points coincide, or ``up`` lies along the beam.
    """
    along = np.asarray(end, dtype=float) - start
    side = np.cross(up, along)
    if np.linalg.norm(side) <= 1e-9 * np.linalg.norm(up) * np.linalg.norm(along):
        raise SceneError(
            Cause.BAD_FIELD,
            "the beam has no length, or its z axis lies along it",
            where=f"beam between nodes {nodes[0]} and {nodes[1]}: up",
            value=list(up),
            remedy="give two points apart, and a direction across the beam",
        )
    x, y = along / np.linalg.norm(along), side / np.linalg.norm(side)
    axes = np.stack([x, y, np.cross(x, y)], axis=1)
    return Beam(nodes, motions.poses(np.array([axes, axes]), np.array([start, end], dtype=float)), section)


@dataclass(frozen=True)
class Bent:
    """What all terms start from: d (e, 6), P (e, 6, 12), and at the Gauss points s = x L those of the interpolation.

    Attributes
    ----------
    turn : (3, e, 4, 4) array
        exp(x d): the section relative to the first one.
    tangent : (3, e, 6, 6) array
        x T(x d).
    shape : (3, e, 6, 12) array
        Q.
    """

    d: Array
    rows: Array
    turn: Array
    tangent: Array
    shape: Array


class Beams:
    """All beams of a system, as `erls.equations.nodal.elements.Elements`.

    Parameters
    ----------
    beams : sequence of Beam
    poses : (k, 4, 4) array
        All nodes as built.
    gravity : (3,) array
        [m/s²]
    """

    breakpoints: tuple[float, ...] = ()

    def __init__(self, beams: Sequence[Beam], poses: Array, gravity: Array) -> None:
        self.nodes: IntArray = np.array([b.nodes for b in beams], dtype=np.int64).reshape(-1, 2)
        self.frames = motions.inverse(poses[self.nodes]) @ np.array([b.frames for b in beams]).reshape(-1, 2, 4, 4)
        carried = motions.adjoint_inverse(self.frames)
        self._carry = carried[:, 0], carried[:, 1]  # node twists to section twists
        self.built = self.remember(poses[self.nodes], None).d
        self.length: Array = np.linalg.norm(self.built[:, :3], axis=1)
        self.stiffness = np.array([b.section.stiffness for b in beams]).reshape(-1, 6, 6) / self.length[:, None, None]
        self.inertia = np.array([b.section.inertia for b in beams]).reshape(-1, 6, 6) * self.length[:, None, None]
        self._gravity = np.asarray(gravity, dtype=float)
        self._moving = bool(self.inertia.any())

    @property
    def gravity(self) -> Array:
        """(3,) [m/s²]"""
        return self._gravity

    def remember(self, poses: Array, before: Bent | None) -> Bent:
        """Interpolation at node poses (e, 2, 4, 4)."""
        sections = poses @ self.frames
        relative = motions.inverse(sections[:, 0]) @ sections[:, 1]
        d = motions.log(relative) if before is None else motions.log_near(relative, before.d)
        second = motions.tangent_inverse(d)
        first = motions.bracket(d) - second  # -T⁻¹(-d)
        rows = np.concatenate([first @ self._carry[0], second @ self._carry[1]], axis=2)
        turn, tangent = motions.exp(_POINTS * d), _POINTS[..., None] * motions.tangent(_POINTS * d)
        shape = tangent @ rows
        shape[..., :6] += motions.adjoint_inverse(turn) @ self._carry[0]
        return Bent(d, rows, turn, tangent, shape)

    def strains(self, memory: Bent) -> Array:
        """(e, 6) [γ; κ]."""
        result: Array = (memory.d - self.built) / self.length[:, None]
        return result

    def section_forces(self, memory: Bent) -> Array:
        """(e, 6) forces [N] and moments [N m] in the section's axes."""
        return _times(self.stiffness, memory.d - self.built)

    def elastic_energy(self, memory: Bent) -> float:
        """Of all elements [J]."""
        return float((self.section_forces(memory) * (memory.d - self.built)).sum()) / 2

    def sections_at(self, poses: Array, memory: Bent, elements: IntArray, fractions: Array) -> Array:
        """(p, 4, 4) sections of elements (p,), at these fractions (p,) of their lengths, at node poses (e, 2, 4, 4)."""
        ahead = motions.exp(fractions[:, None] * memory.d[elements])
        result: Array = poses[elements, 0] @ self.frames[elements, 0] @ ahead
        return result

    def mass(self, poses: Array, memory: Bent) -> Array:
        """(e, 12, 12) Σ w Qᵀ M Q."""
        return _summed(_turned(memory.shape) @ self.inertia @ memory.shape)

    def forces(self, t: float, poses: Array, memory: Bent, v: Array, a: Array) -> Array:
        """(e, 12) internal forces and inertia less weight."""
        internal = _times(_turned(memory.rows), self.section_forces(memory))
        if not self._moving:
            return internal
        twist = _times(memory.shape, v)
        push = _times(memory.shape, a)
        if v.any():
            push += self._bias(memory, v)
        push[..., :3] -= self._weight(poses, memory)
        turning = _times(_turned(motions.bracket(twist)), _times(self.inertia, twist))
        inertia = _times(self.inertia, push) - turning
        result: Array = internal + (_WEIGHTS * _times(_turned(memory.shape), inertia)).sum(axis=0)
        return result

    def derivatives(
        self, t: float, poses: Array, memory: Bent, v: Array, a: Array, material: bool = False
    ) -> tuple[Array, Array]:
        """(e, 12, 12) twice: internal forces, turning weight; gyroscopic forces."""
        stiffness = _turned(memory.rows) @ self.stiffness @ memory.rows
        if not material:
            stiffness += self._geometric(memory) @ memory.rows
        if not self._moving:
            return stiffness, np.zeros_like(stiffness)
        shape = memory.shape
        twist = _times(shape, v)
        tilt = np.zeros((*twist.shape, 6))
        tilt[..., :3, 3:] = -skews(self._weight(poses, memory))
        stiffness += _summed(_turned(shape) @ self.inertia @ tilt @ shape)
        spin = _turned(motions.bracket(twist)) @ self.inertia + motions.cobracket(_times(self.inertia, twist))
        return stiffness, -_summed(_turned(shape) @ spin @ shape)

    def energy(self, t: float, poses: Array, memory: Bent, v: Array) -> tuple[float, float]:
        """Kinetic; elastic and that of gravity."""
        elastic = self.elastic_energy(memory)
        twist = _times(memory.shape, v)
        kinetic = float((_WEIGHTS * twist * _times(self.inertia, twist)).sum()) / 2
        places = (poses[:, 0] @ self.frames[:, 0] @ memory.turn)[..., :3, 3]
        gravity = -float((_WEIGHTS[..., 0] * self.inertia[:, 0, 0] * (places @ self._gravity)).sum())
        return kinetic, elastic + gravity

    def _geometric(self, memory: Bent) -> Array:
        """(e, 12, 6) derivative of Pᵀ σ by d at fixed σ."""
        force, ends = self.section_forces(memory), []
        units = np.broadcast_to(_UNITS, (6, *memory.d.shape))
        change = motions.tangent_inverse_derivative(memory.d, units)
        for carry, of_block in ((self._carry[0], motions.bracket(units) - change), (self._carry[1], change)):
            ends.append(_turned(carry) @ np.einsum("keij,ei->ejk", of_block, force))
        return np.concatenate(ends, axis=1)

    def _bias(self, memory: Bent, v: Array) -> Array:
        """(3, e, 6) Q̇ ν."""
        d, rate = memory.d, _times(memory.rows, v)
        first, second = _times(self._carry[0], v[:, :6]), _times(self._carry[1], v[:, 6:])
        change = motions.tangent_inverse_derivative(d, rate)
        bend = _times(change, second - first) + _times(motions.bracket(rate), first)  # d̈ without accelerations
        carried = _times(motions.adjoint_inverse(memory.turn), first)
        curve = _POINTS * _times(motions.tangent_derivative(_POINTS * d, _POINTS * rate), rate)
        swing = _times(motions.bracket(_times(memory.tangent, rate)), carried)
        return curve + _times(memory.tangent, bend) - swing

    def _weight(self, poses: Array, memory: Bent) -> Array:
        """(3, e, 3) gravity in the axes of the sections."""
        axes = poses[:, 0, :3, :3] @ self.frames[:, 0, :3, :3] @ memory.turn[..., :3, :3]
        result: Array = _turned(axes) @ self._gravity
        return result


def lumped(beams: Sequence[Beam], poses: Array) -> list[RigidBody]:
    """Half of each beam's mass and rotary inertia as rigid bodies at its nodes; give `Beams` sections without then."""
    bodies = []
    for beam in beams:
        section = beam.section.inertia
        d = motions.log(motions.inverse(beam.frames[0]) @ beam.frames[1])
        half = float(np.linalg.norm(d[:3])) / 2
        for node, frame in zip(beam.nodes, beam.frames, strict=True):
            local = motions.inverse(poses[node]) @ frame
            turn = local[:3, :3]
            inertia = half * turn @ section[3:, 3:] @ turn.T
            bodies.append(RigidBody(node, half * float(section[0, 0]), (inertia + inertia.T) / 2, local[:3, 3]))
    return bodies


def _times(matrix: Array, vector: Array) -> Array:
    product: Array = (matrix @ vector[..., None])[..., 0]
    return product


def _turned(matrix: Array) -> Array:
    return np.swapaxes(matrix, -1, -2)


def _summed(blocks: Array) -> Array:
    """Over the Gauss points (3, e, ...)."""
    total: Array = np.einsum("g,g...->...", _WEIGHTS[:, 0, 0], blocks)
    return total
