"""One link of the paper's dense form by itself: its compiled formulas, run as plain Python on its records."""

from __future__ import annotations

from collections.abc import Set

import numpy as np

from erls.equations.erls.paper.forces import add_inertia_forces, fill_mass, fill_moments, subtract_weight
from erls.equations.erls.paper.pack import body_record
from erls.equations.erls.paper.records import BodyState, Paper
from erls.equations.serial.pack import effect_flags
from erls.maths.jit import plain
from erls.maths.records import room
from erls.maths.spatial import add_force_cross
from erls.mechanism.effects import ALL
from fe_import.modal.inertia import InertiaInvariants

_EMPTY = Paper(*[0] * len(Paper._fields))


class DenseLink:
    """Inertia and weight of a link in its own frame, with these effects."""

    def __init__(self, invariants: InertiaInvariants, effects: Set[str] = ALL) -> None:
        self.body, self.paper = body_record(invariants), _EMPTY._replace(**effect_flags(effects))
        self.mass = self.body.mass

    def _state(self, q: np.ndarray) -> BodyState:
        state = room(BodyState, n=len(q), z=0)
        state.q[:] = q
        state.world[[0, 4, 8]] = 1.0
        return state

    def forces(
        self, twist: np.ndarray, twist_rate: np.ndarray, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Wrench (6,) on the frame and forces (m,) on the modes."""
        state = self._state(q)
        state.twist[:], state.twist_rate[:] = twist, twist_rate
        state.velocity[:], state.acceleration[:] = np.concatenate([twist, qd]), np.concatenate([twist_rate, qdd])
        plain(fill_moments)(self.paper, self.body, state)
        plain(add_inertia_forces)(self.paper, self.body, state)
        plain(add_force_cross)(state.velocity[:6], state.p, state.force[:6])
        return state.force[:6], state.force[6:]

    def mass_matrix(self, q: np.ndarray) -> np.ndarray:
        """(6 + m, 6 + m) of (ν, q̇)."""
        state = self._state(q)
        plain(fill_moments)(self.paper, self.body, state)
        plain(fill_mass)(self.paper, self.body, state)
        return state.mass

    def kinetic_energy(self, twist: np.ndarray, q: np.ndarray, qd: np.ndarray) -> float:
        """T."""
        velocity = np.concatenate([twist, qd])
        return float(velocity @ self.mass_matrix(q) @ velocity / 2)

    def _weighed(self, g: np.ndarray, world: np.ndarray, q: np.ndarray) -> BodyState:
        state = self._state(q)
        state.gravity[:] = world[:3, :3].T @ g
        state.world[:] = np.concatenate([world[:3, :3].ravel(), world[:3, 3]])
        plain(subtract_weight)(self.body, state)
        return state

    def gravity(self, g: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Wrench and modal forces of a gravity vector in link axes."""
        force = self._weighed(g, np.eye(4), q).force
        return -force[:6], -force[6:]

    def gravity_energy(self, g: np.ndarray, world: np.ndarray, q: np.ndarray) -> float:
        """Potential energy in a gravity vector in world axes, at a world pose (4, 4)."""
        return float(self._weighed(g, world, q).potential[0])
