"""ERLS-CMS in the joint-angle gauge as a `TreeFormulation`: what runs ask of it, from its compiled functions.

Independent coordinates y = (free joint coordinates θ_f, elastic coordinates q_d of all links). The rigid-body modal
coordinates follow from compatibility, q_r = D(θ) q_d; prescribed joint coordinates follow from time. The dense form of
the same equations, in the notation of the paper, is `erls.equations.erls.paper`.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from erls.equations.compiled_system import CompiledSystem, function_in
from erls.equations.erls.pack import pack_chain, shapes, with_numbers
from erls.equations.erls.records import LINK_STATE, Chain, LinkState
from erls.equations.formulation import Energy, State
from erls.equations.serial.formulation import SerialFormulation, contiguous
from erls.equations.serial.modal_inertia import stiffened
from erls.equations.serial.motion_series import MotionSeries
from erls.equations.serial.node_reach import reach_of_nodes
from erls.equations.serial.records import JOINT_STATE, JointState, Serial
from erls.equations.serial.state_series import StateSeries, single_energy
from erls.equations.series import places_within, residuals_leaving
from erls.maths.records import python_reader
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.shared_links import differ_in_numbers

_see_serial, _see_chain = python_reader(Serial), python_reader(Chain)
_see_link, _see_joint = python_reader(LinkState), python_reader(JointState)

_MOST_STARTS = 1000  # whose scales are remembered


class Erls(SerialFormulation):
    """Equations of motion of a tree of links in the joint-angle gauge; a `TreeFormulation`.

    Parameters
    ----------
    mechanism : Mechanism
    """

    gauge = "joint-angle"

    def __init__(self, mechanism: Mechanism) -> None:
        super().__init__(mechanism)
        self.stiffened = stiffened(mechanism)
        self._scales: dict[bytes, Array] = {}  # by where joints start

    def share(self, other: Erls) -> None:
        """Take over what the equations of a mechanism hold that differs in nothing but where joints start and how large
        loads are (`erls.mechanism.shared_links.differ_in_numbers`); of others, nothing.
        """
        if differ_in_numbers(self.mechanism, other.mechanism):
            self._scales = other._scales
            vars(self)["compiled"] = with_numbers(other._packed, self.mechanism)

    @cached_property
    def _packed(self) -> CompiledSystem:
        """The equations, which nobody uses, so that their working memory is as it was made."""
        return pack_chain(self.mechanism)

    @cached_property
    def compiled(self) -> CompiledSystem:
        """The equations."""
        return pack_chain(self.mechanism)

    @cached_property
    def complete(self) -> CompiledSystem:
        """The same with complete wrenches."""
        return pack_chain(self.mechanism, dense=self.size, complete=True)

    @cached_property
    def _shapes(self) -> list[Array]:
        """(m, n) modal coordinates of each link per (u, q_d)."""
        return [shape.modes for shape in shapes(self.mechanism)]

    def _module(self, name: str) -> str:
        """Where a function on states is: they are compiled apart for links with second-order displacements."""
        return f"erls.equations.erls.{'stiffened_states' if self.stiffened else name}"

    @property
    def kernels(self) -> tuple[str, ...]:
        """See `erls.equations.formulation.Modular`."""
        own = f"erls.equations.erls.{'stiffened_' if self.stiffened else ''}"
        seen = self._module("energy"), self._module("states")
        loads = ("erls.equations.erls.loads",) if self.mechanism.acted_on else ()
        every = f"{own}residual", f"{own}mass_matrix", *seen, *loads, "erls.equations.serial.stiffness"
        return tuple(dict.fromkeys(every))

    @cached_property
    def length_scales(self) -> Array:
        """(n,) largest displacement of any node per unit of each coordinate, from the initial configuration."""
        start = np.array([joint.position for joint in self.mechanism.joints]).tobytes()
        if (found := self._scales.get(start)) is not None:
            return found
        while len(self._scales) >= _MOST_STARTS:
            self._scales.pop(next(iter(self._scales)), None)
        return self._scales.setdefault(start, self._found_scales())

    def _found_scales(self) -> Array:
        system, (y, _) = self.compiled, self.undeformed_start()
        rates = [view for state in self._links(system) for view in (state.w, state.q_rate[6:]) if view.size]
        places = places_within(system.scratch, rates)
        assert places is not None
        v = np.vstack([np.zeros(self.size), np.eye(self.size)[len(self.free_joints) :]])
        memory = system.reals, system.integers, system.scratch
        left = residuals_leaving(system.residual, *memory, np.zeros(len(v)), np.tile(y, (len(v), 1)), v, places)
        moved, first = [], 0  # rates of the rigid-body modal coordinates of all links, those of ν included
        for shape in self._shapes:
            moved.append(left[:, first : first + shape.shape[1]] @ shape[:6].T)
            first += shape.shape[1]
        d = np.hstack(moved).T
        # the first: where a prescribed motion begins with a rate
        return np.asarray(reach_of_nodes(self.mechanism, d[:, 1:] - d[:, :1])[self.free])

    def _links(self, system: CompiledSystem) -> list[LinkState]:
        """Motion of the links and the forces on them, as the last evaluation left them."""
        serial = _see_serial(system.reals, system.integers, int(system.integers[0]))
        first = _see_chain(system.reals, system.integers, serial.own).states
        return [_see_link(system.scratch, system.integers, first + k * LINK_STATE) for k in range(self.joints)]

    def series(self, t: Array, y: Array, v: Array) -> StateSeries:
        """States at (k,) times."""
        system, links = self.compiled, self.mechanism.links
        sizes = [6 + link.elastic_modes for link in links]
        out = np.empty((len(t), sum(14 + 2 * n for n in sizes)))
        states = function_in(self._module("states"), "states")()
        states(system.reals, system.integers, system.scratch, contiguous(t), contiguous(y), contiguous(v), out)
        poses = np.zeros((len(t), len(links), 4, 4))
        flat = out[:, : 12 * len(links)].reshape(len(t), len(links), 12)
        poses[..., :3, :3] = flat[..., :9].reshape(*flat.shape[:2], 3, 3)
        poses[..., :3, 3], poses[..., 3, 3] = flat[..., 9:], 1.0
        modal, theta, at = [], np.empty((2, len(t), len(links))), 12 * len(links)
        for k, n in enumerate(sizes):
            modal.append(out[:, at : at + n] @ self._shapes[k].T)
            theta[:, :, k] = out[:, at + 2 * n : at + 2 * n + 2].T
            at += 2 * n + 2
        return StateSeries(np.asarray(t), [poses[:, k] for k in range(len(links))], modal, theta[0], *theta)

    def state(self, t: float, y: Array, v: Array) -> State:
        """Poses, modal coordinates and joint angles at a state."""
        return self.series(np.array([t]), np.array([y]), np.array([v])).states()[0]

    def energy_series(self, t: Array, y: Array, v: Array) -> Array:
        """(k, 4) energies at (k,) times."""
        system, out, y, v = self.compiled, np.empty((len(t), 4)), contiguous(y), contiguous(v)
        energy = function_in(self._module("energy"), "energy")()
        for i, at in enumerate(t.tolist()):
            energy(system.reals, system.integers, system.scratch, at, y[i], v[i], out[i])
        out[:, 3] += self.contact_energy(t, y, v)
        return out

    def energy(self, t: float, y: Array, v: Array) -> Energy:
        """Energies of a state."""
        return single_energy(self.energy_series(np.array([t]), np.array([y]), np.array([v])))

    def borne(self) -> list[tuple[Array, Array, Array]]:
        """What a residual leaves; see `SerialFormulation.borne`."""
        system, result = self.complete, []
        first = _see_serial(system.reals, system.integers, int(system.integers[0])).joint_states
        for k, link in enumerate(self._links(system)):
            forces = _see_joint(system.scratch, system.integers, first + k * JOINT_STATE).forces
            result.append((link.wrench, forces[:1], forces[1:]))
        return result

    @cached_property
    def _moving(self) -> list[Array]:
        """Views of what a residual leaves: six of each link, and the acceleration of each joint."""
        views: list[Array] = []
        for s in self._links(self.complete):
            views += [s.twist, s.twist_rate, s.u_rate, s.q_rate[6:], s.u_acceleration, s.q_acceleration[6:]]
        return views + self.joint_accelerations()

    def motion_series(self, t: Array, y: Array, v: Array, a: Array) -> MotionSeries:
        """Motion at (k,) times: twists of the frames that the poses are of, and what the links do in them."""
        left = self.left_by_residuals(self._moving, t, y, v, a)
        links, angles = left[: 6 * self.joints], left[6 * self.joints :]
        pairs = [list(zip(links[i::6], links[i + 1 :: 6], strict=True)) for i in (2, 4)]  # u̇ and q̇_d, ü and q̈_d
        rates, accelerations = (
            [np.hstack(both) @ shape.T for both, shape in zip(every, self._shapes, strict=True)] for every in pairs
        )
        return MotionSeries(
            self.series(t, y, v), links[::6], links[1::6], rates, accelerations, np.hstack(angles).reshape(len(t), -1)
        )

    @property
    def kind(self) -> dict[str, Any]:
        """Name of the formulation and of its gauge."""
        return {"formulation": "erls", "gauge": self.gauge}
