"""ERLS-CMS in the dense form of the paper, with either gauge; it serves the minimum-norm gauge.

Independent coordinates y = (free joint coordinates θ_f, elastic coordinates q_d of all links). The rigid-body modal
coordinates follow from compatibility, q_r = D(θ) q_d; prescribed joint coordinates follow from time. The equations
are the projection of every link's inertia forces, weights and elastic forces on the virtual displacements

    δν_k = J_k δθ,   δq = (D δq_d + G δθ, δq_d)

(ERLS-CMS paper, eq. 69-75, with the inertia forces from the kinetic energy).

Under the minimum-norm gauge the row along a joint's freedom is missing, and θ is no joint angle: torque, springs,
friction and rotor act on the physical angle, θ plus what the links' displacement adds. Prescribed joints keep six rows.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from erls.equations.compiled_system import CompiledSystem
from erls.equations.erls.paper.compatibility_records import ROW_STATE, Elimination, RowState
from erls.equations.erls.paper.pack import pack_chain
from erls.equations.erls.paper.records import BODY_STATE, Balance, BodyState, Paper
from erls.equations.formulation import Energy, State
from erls.equations.serial.formulation import SerialFormulation
from erls.equations.serial.modal_inertia import stiffened
from erls.equations.serial.motion_series import MotionSeries
from erls.equations.serial.node_reach import reach_of_nodes
from erls.equations.serial.records import Serial
from erls.equations.serial.state_series import StateSeries
from erls.maths.records import python_reader
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism

_see_serial, _see_paper, _see_balance = python_reader(Serial), python_reader(Paper), python_reader(Balance)
_see_elimination, _see_link, _see_joint = python_reader(Elimination), python_reader(BodyState), python_reader(RowState)


class DenseChain(SerialFormulation):
    """Equations of motion of a tree of links; a `Formulation`.

    Parameters
    ----------
    mechanism : Mechanism
    gauge : str
        ``"minimum-norm"`` or ``"joint-angle"``.
    """

    along_coordinates = False

    def __init__(self, mechanism: Mechanism, gauge: str = "minimum-norm") -> None:
        super().__init__(mechanism)
        self.gauge, self.stiffened = gauge, stiffened(mechanism)

    @cached_property
    def compiled(self) -> CompiledSystem:
        """The equations."""
        return pack_chain(self.mechanism, self.gauge)

    @property
    def length_scales(self) -> Array:
        """(n,) largest displacement of any node per unit of each coordinate, from the initial configuration."""
        found = self.elimination_at(0.0, *self.undeformed_start())
        return np.asarray(reach_of_nodes(self.mechanism, found.d)[self.free])

    @property
    def _memory(self) -> tuple[Array, Any, Array]:
        return self.compiled.reals, self.compiled.integers, self.compiled.scratch

    @cached_property
    def _places(self) -> Paper:
        """Where the records are."""
        reals, integers, _ = self._memory
        return _see_paper(reals, integers, _see_serial(reals, integers, integers[0]).own)

    @property
    def elimination(self) -> Elimination:
        """Views of C, C_r⁺, D, G and n of the last evaluation."""
        _, integers, scratch = self._memory
        return _see_elimination(scratch, integers, self._places.elimination)

    def elimination_at(self, t: float, y: Array, v: Array) -> Elimination:
        """The same at a state, until the next evaluation."""
        self.residual(t, y, v, np.zeros(0))
        return self.elimination

    @property
    def links(self) -> list[BodyState]:
        """Views of motion and forces of each link, of the last evaluation."""
        _, integers, scratch = self._memory
        first = self._places.body_states
        return [_see_link(scratch, integers, first + k * BODY_STATE) for k in range(self.joints)]

    @property
    def turns(self) -> list[RowState]:
        """Views of compatibility and physical angle of each joint, of the last evaluation."""
        _, integers, scratch = self._memory
        first = self._places.row_states
        return [_see_joint(scratch, integers, first + k * ROW_STATE) for k in range(self.joints)]

    def full_mass_matrix(self, t: float, y: Array) -> Array:
        """(joints + elastic)² mass matrix over (θ, q_d), prescribed joints included."""
        self.mass_matrix(t, y)
        _, integers, scratch = self._memory
        return np.array(_see_balance(scratch, integers, self._places.balance).mass)

    def state(self, t: float, y: Array, v: Array) -> State:
        """Poses, modal coordinates and joint angles at a state."""
        return self.series(np.array([t]), y[None], v[None]).states()[0]

    def series(self, t: Array, y: Array, v: Array) -> StateSeries:
        """States at times (k,)."""
        links, turns, place = self.links, self.turns, self.elimination.place
        poses = [np.tile(np.eye(4), (len(t), 1, 1)) for _ in links]
        modal = [np.empty((len(t), len(link.q))) for link in links]
        coordinates = np.empty((3, len(t), self.joints))
        for i, at in enumerate(t.tolist()):
            self.residual(at, y[i], v[i], np.zeros(0))
            coordinates[0, i] = place[: self.joints]
            for k, (link, joint) in enumerate(zip(links, turns, strict=True)):
                poses[k][i, :3, :3], poses[k][i, :3, 3] = link.world[:9].reshape(3, 3), link.world[9:]
                modal[k][i], coordinates[1:, i, k] = link.q, joint.turn[:2]
        return StateSeries(np.asarray(t), poses, modal, *coordinates)

    def energy(self, t: float, y: Array, v: Array) -> Energy:
        """Energies of a state; the mass matrix is that of the kinetic energy."""
        mass = self.full_mass_matrix(t, y)
        self.residual(t, y, v, np.zeros(0))
        place, rate = self.elimination.place[self.joints :], self.elimination.rate
        springs = float(self.contact_energy(np.array([t]), y[None], v[None])[0])
        for joint, turns in zip(self.mechanism.joints, self.turns, strict=True):
            springs += joint.forces.energy(float(turns.turn[0]))
        return Energy(
            kinetic=float(rate @ mass @ rate / 2),
            elastic=self.elastic_energy(place),
            gravity=float(sum(link.potential[0] for link in self.links)),
            springs=float(springs),
        )

    def borne(self) -> list[tuple[Array, Array, Array]]:
        """What a residual leaves; see `SerialFormulation.borne`."""
        _, integers, scratch = self._memory
        force = _see_balance(scratch, integers, self._places.balance).force
        joints = enumerate(zip(self.links, self.turns, strict=True))
        return [(link.borne, force[k : k + 1], joint.turn[3:]) for k, (link, joint) in joints]

    def motion_series(self, t: Array, y: Array, v: Array, a: Array) -> MotionSeries:
        """Motion at times (k,)."""
        views = [x for link in self.links for x in (link.velocity, link.acceleration)]
        views += [x for joint in self.turns for x in (joint.turn[2:3], joint.gradient)]
        left = self.left_by_residuals([*views, self.elimination.acceleration], t, y, v, a)
        links, joints, whole = left[: 2 * self.joints], left[2 * self.joints : -1], left[-1]
        angles = [bias[:, 0] + (row * whole).sum(axis=1) for bias, row in zip(joints[::2], joints[1::2], strict=True)]
        rates, accelerations = links[::2], links[1::2]
        return MotionSeries(
            self.series(t, y, v),
            [x[:, :6] for x in rates],
            [x[:, :6] for x in accelerations],
            [x[:, 6:] for x in rates],
            [x[:, 6:] for x in accelerations],
            np.stack(angles, axis=1),
        )

    @property
    def kind(self) -> dict[str, Any]:
        """Name of the formulation and of its gauge."""
        return {"formulation": "erls", "gauge": self.gauge}
