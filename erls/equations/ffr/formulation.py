"""FFR in independent coordinates as a `TreeFormulation`: what runs ask of it, from its compiled functions.

Independent coordinates y = (free joint coordinates θ_f, elastic coordinates η of all links); prescribed joint
coordinates follow from time.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from erls.equations.compiled_system import CompiledSystem, function_in
from erls.equations.ffr.body_frame import elastic_basis
from erls.equations.ffr.motion_rows import frame_rows
from erls.equations.ffr.pack import Given, pack_frames
from erls.equations.ffr.records import BODY, BODY_STATE, Body, BodyState, Frames
from erls.equations.ffr.standard_data import StandardData
from erls.equations.formulation import Energy, State
from erls.equations.serial.formulation import SerialFormulation, contiguous, residual
from erls.equations.serial.motion_series import MotionSeries
from erls.equations.serial.records import JOINT_STATE, JointState, Serial
from erls.equations.serial.state_series import StateSeries, single_energy
from erls.maths.records import python_reader
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.loops import loop_ends

_read_serial, _read_frames = python_reader(Serial), python_reader(Frames)
_read_body = python_reader(Body)
_read_body_state, _read_joint_state = python_reader(BodyState), python_reader(JointState)


@dataclass(frozen=True)
class Motion:
    """Positions and velocities of all links: joint coordinates and rates, η and η̇, poses and twists of the frames."""

    theta: Array
    rates: Array
    eta: Array
    eta_rates: Array
    poses: list[Array]
    twists: list[Array]


class Ffr(SerialFormulation):
    """Equations of motion of a tree of links; a `TreeFormulation`.

    Parameters
    ----------
    mechanism : Mechanism
    body_frame : str
        ``"tangent"`` or ``"mean-axis"``, see `elastic_basis`.
    """

    def __init__(self, mechanism: Mechanism, body_frame: str = "tangent") -> None:
        super().__init__(mechanism)
        self.body_frame = body_frame
        self.bases = [elastic_basis(link, body_frame) for link in mechanism.links]
        self.stiffened = "geometric_stiffening" in mechanism.effects
        sizes = [link.elastic_modes for link in mechanism.links]
        ends = np.cumsum(sizes)
        self.modes = [slice(int(end) - size, int(end)) for end, size in zip(ends, sizes, strict=True)]  # within η

    @cached_property
    def given(self) -> Given:
        """What is packed."""
        data = [
            StandardData(link.invariants, basis, self.mechanism.effects)
            for link, basis in zip(self.mechanism.links, self.bases, strict=True)
        ]
        ends = loop_ends(self.mechanism.loops)
        return Given(self.mechanism, self.bases, data, self.body_frame != "tangent", self.stiffened, ends)

    @cached_property
    def compiled(self) -> CompiledSystem:
        """The equations."""
        return pack_frames(self.given)

    @cached_property
    def complete(self) -> CompiledSystem:
        """The same with complete wrenches."""
        return pack_frames(replace(self.given, every_axis=True), self.size)

    @property
    def kernels(self) -> tuple[str, ...]:
        """See `erls.equations.formulation.Modular`."""
        own = "erls.equations.ffr"
        loads = (f"{own}.loads",) if self.mechanism.loads else ()
        states = f"{own}.energy", f"{own}.states"
        return f"{own}.residual", f"{own}.mass", *states, *loads, "erls.equations.serial.stiffness"

    @cached_property
    def length_scales(self) -> Array:
        """(n,) largest displacement of any node per unit of each coordinate, from the initial configuration."""
        free = [replace(j, drive=replace(j.drive, kind="free")) for j in self.mechanism.joints]
        start = Ffr(replace(self.mechanism, joints=tuple(free)), self.body_frame)
        theta = np.array([joint.position for joint in self.mechanism.joints])
        place = np.concatenate([theta, np.zeros(self.elastic)])
        start.mass_matrix(0.0, place)
        scales = np.zeros(self.joints + self.elastic)
        for k, rows in enumerate(frame_rows(start.compiled, self.joints, self.modes)):
            model, at = self.mechanism.links[k].model, self.modes[k]
            moved = rows[:3] - np.cross(model.nodes[:, None, :], rows[3:].T).transpose(0, 2, 1)
            moved[:, :, self.joints + at.start : self.joints + at.stop] += model.translation_shapes @ self.bases[k]
            scales = np.maximum(scales, np.linalg.norm(moved, axis=1).max(axis=0))
        smallest = np.full(len(scales), 1e-12)
        smallest[: self.joints] = 1e-3
        return np.asarray(np.maximum(scales, smallest)[self.free])

    def elastic_name(self, place: int) -> str:
        """Of an elastic coordinate within η."""
        number = next(k for k, at in enumerate(self.modes) if place < at.stop)
        return f"the elastic coordinates of link {self.mechanism.links[number].name!r}"

    def series(self, t: Array, y: Array, v: Array) -> StateSeries:
        """States at (k,) times: floating frames, modal coordinates of the fields that deform them, and joint angles.

        The joint coordinate is the angle between the displaced interface frames, so that angle and coordinate agree.
        """
        system, links = self.compiled, len(self.mechanism.links)
        out = np.empty((len(t), 14 * links + 12))
        states = function_in("erls.equations.ffr.states", "states")()
        states(system.reals, system.integers, system.scratch, contiguous(t), contiguous(y), contiguous(v), out)
        flat = out[:, : 12 * links].reshape(len(t), links, 12)
        poses = np.zeros((len(t), links, 4, 4))
        poses[..., :3, :3] = flat[..., :9].reshape(len(t), links, 3, 3)
        poses[..., :3, 3], poses[..., 3, 3] = flat[..., 9:], 1.0
        theta, rates = out[:, 12 * links : 14 * links].reshape(len(t), links, 2).transpose(2, 0, 1).copy()
        eta = np.asarray(y)[:, len(self.free_joints) :]
        modal = [eta[:, at] @ basis.T for basis, at in zip(self.bases, self.modes, strict=True)]
        return StateSeries(np.asarray(t), [poses[:, k] for k in range(links)], modal, theta, theta, rates)

    def state(self, t: float, y: Array, v: Array) -> State:
        """The same at one time."""
        return self.series(np.array([t]), np.array([y]), np.array([v])).states()[0]

    def motion(self, t: float, y: Array, v: Array) -> Motion:
        """Poses and twists of all floating frames at a state."""
        state, f, system = self.state(t, y, v), len(self.free_joints), self.compiled
        residual(system, t, y, v, np.zeros(0))
        twists = [found.twist.copy() for found in self._bodies(system)]
        return Motion(state.coordinates, state.rates, y[f:], v[f:], state.poses, twists)

    def energy_series(self, t: Array, y: Array, v: Array) -> Array:
        """(k, 4) energies at (k,) times."""
        system, out, y, v = self.compiled, np.empty((len(t), 4)), contiguous(y), contiguous(v)
        energy = function_in("erls.equations.ffr.energy", "energy")()
        for i, at in enumerate(t.tolist()):
            energy(system.reals, system.integers, system.scratch, at, y[i], v[i], out[i])
        return out

    def energy(self, t: float, y: Array, v: Array) -> Energy:
        """Energies of a state."""
        return single_energy(self.energy_series(np.array([t]), np.array([y]), np.array([v])))

    def _bodies(self, system: CompiledSystem) -> list[BodyState]:
        """What a residual left."""
        serial = _read_serial(system.reals, system.integers, int(system.integers[0]))
        frames = _read_frames(system.reals, system.integers, serial.own)
        places = [frames.body_states + k * BODY_STATE for k in range(self.joints)]
        return [_read_body_state(system.scratch, system.integers, place) for place in places]

    def borne(self) -> list[tuple[Array, Array, Array]]:
        """What a residual leaves; see `SerialFormulation.borne`."""
        system, result = self.complete, []
        first = _read_serial(system.reals, system.integers, int(system.integers[0])).joint_states
        for k, body in enumerate(self._bodies(system)):
            forces = _read_joint_state(system.scratch, system.integers, first + k * JOINT_STATE).forces
            result.append((body.wrench, forces[:1], forces[1:]))
        return result

    @cached_property
    def _moving(self) -> list[Array]:
        """Views of what a residual leaves: two of each link, and the acceleration of each joint."""
        frames = [x for body in self._bodies(self.complete) for x in (body.twist, body.twist_rate)]
        return frames + self.joint_accelerations()

    def motion_series(self, t: Array, y: Array, v: Array, a: Array) -> MotionSeries:
        """Motion at (k,) times: of the floating frames, and of the fields that deform the links in them."""
        left = self.left_by_residuals(self._moving, t, y, v, a)
        frames, angles = left[: 2 * self.joints], left[2 * self.joints :]
        own = [np.asarray(x)[:, len(self.free_joints) :] for x in (v, a)]
        rates, accelerations = (
            [x[:, at] @ basis.T for basis, at in zip(self.bases, self.modes, strict=True)] for x in own
        )
        return MotionSeries(
            self.series(t, y, v), frames[::2], frames[1::2], rates, accelerations, np.hstack(angles).reshape(len(t), -1)
        )

    @property
    def kind(self) -> dict[str, Any]:
        """Name of the formulation and of its floating frames."""
        return {"formulation": "ffr", "body_frame": self.body_frame}


def body_moments(system: CompiledSystem, links: int) -> list[tuple[float, Array]]:
    """Mass and first moment (3,) of every deformed link in its floating frame, after a residual under gravity."""
    serial = _read_serial(system.reals, system.integers, int(system.integers[0]))
    frames = _read_frames(system.reals, system.integers, serial.own)
    result: list[tuple[float, Array]] = []
    for k in range(links):
        body = _read_body(system.reals, system.integers, frames.bodies + k * BODY)
        state = _read_body_state(system.scratch, system.integers, frames.body_states + k * BODY_STATE)
        result.append((body.mass, state.moment))
    return result
