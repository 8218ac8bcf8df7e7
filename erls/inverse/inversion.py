"""What an inversion finds."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from erls.inverse.nature import Nature
from erls.inverse.problem import Problem
from erls.inverse.servoed import Servoed, States
from erls.maths.so3 import Array


@dataclass(frozen=True)
class Inversion:
    """Drives that make a mechanism move as demanded, with the motion that they make.

    Attributes
    ----------
    problem : Problem
    method : str
        ``collocation``, ``shooting`` or ``forward``.
    nature : Nature
    states : States
        At the knots, of the mechanism with its unknown drives.
    rigid : States
        The same of rigid links: rigid feed-forward.
    iterations : int
        Of Newton's method over all steps, or of all steps.
    left : float
        Change of the efforts [1, of the largest] by the last pass in which fast motions got their accelerations.
    wall_s : float
    warnings : tuple of str
    """

    problem: Problem
    method: str
    nature: Nature
    states: States
    rigid: States
    iterations: int
    left: float
    wall_s: float
    warnings: tuple[str, ...] = ()

    @property
    def t(self) -> Array:
        """(k,) knots [s]."""
        return self.problem.t[: len(self.states.y)]

    @property
    def efforts(self) -> dict[str, Array]:
        """(k,) each, by joint [N m or N]."""
        return dict(zip(self.problem.drives, self._driving(self.states), strict=True))

    @property
    def rigid_efforts(self) -> dict[str, Array]:
        """The same of rigid links."""
        return dict(zip(self.problem.drives, self._driving(self.rigid), strict=True))

    def _driving(self, states: States) -> Array:
        """(r, k) efforts of the drives alone."""
        return states.efforts[:, : len(self.problem.drives)].T

    @property
    def start(self) -> dict[str, float]:
        """Joint coordinates at the start, of joints whose motion is not prescribed."""
        return self._start_of(self.problem.flexible, self.states)

    @property
    def rigid_start(self) -> dict[str, float]:
        """The same of rigid links, those that were held included."""
        own = {joint.name: joint.position for joint in self.problem.flexible.tree.mechanism.joints}
        return {name: own[name] for name in self.start} | self._start_of(self.problem.rigid, self.rigid)

    def _start_of(self, servoed: Servoed, states: States) -> dict[str, float]:
        joints = servoed.tree.mechanism.joints
        return {joints[k].name: float(states.y[0, i]) for i, k in enumerate(servoed.tree.free_joints.tolist())}

    @cached_property
    def angles(self) -> dict[str, Array]:
        """(k,) joint coordinates by name [rad or m]."""
        servoed = self.problem.flexible
        found = servoed.joints(self.t, self.states.y, self.states.v).angles.T
        return {j.name: x for j, x in zip(servoed.tree.mechanism.joints, found, strict=True) if not j.fixed}

    @cached_property
    def deflection(self) -> Array:
        """(k,) largest displacement by an elastic coordinate against the joints that the links sit on [m]."""
        servoed = self.problem.flexible
        joints = len(servoed.tree.free_joints)
        moved = np.abs(self.states.y[:, joints:] * servoed.metres[joints:])
        return np.asarray(moved.max(axis=1, initial=0.0))

    def pre_actuation(self, threshold: float = 0.01) -> float:
        """How long before what is demanded begins to move drives do, by a share of their largest effort beyond that at
        the start [s].
        """
        begins = self.problem.conditions.breakpoints
        first = max(begins[0], float(self.t[0])) if begins else float(self.t[0])
        return max([0.0, *(first - self._moves(each, threshold) for each in self._driving(self.states))])

    def _moves(self, effort: Array, threshold: float) -> float:
        beyond = np.abs(effort - effort[0])
        moving = np.flatnonzero(beyond > threshold * beyond.max(initial=0.0))
        return float(self.t[moving[0]]) if len(moving) else math.inf
