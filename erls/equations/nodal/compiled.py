"""Memory of compiled steps of a nodal system, and how its configurations lie in them."""

from __future__ import annotations

from typing import Any, Protocol

from erls.equations.constrained_system import ConstrainedState
from erls.equations.nodal.contract import Model, State, Work
from erls.equations.nodal.model import room
from erls.equations.nodal.nodes import Nodes, poses_of, rows_of
from erls.maths.so3 import Array


class _System(Protocol):
    """What is asked of a system."""

    count: int
    width: int
    model: Model

    def samples(self, times: Array) -> Array:
        """What depends on time alone."""


class CompiledSteps:
    """What steps ask for; see `erls.integrate.nodal_steps.Compiled`."""

    def __init__(self, system: _System) -> None:
        self.model, self.width, self.samples = system.model, system.width, system.samples
        self.stored = 12 * system.count + len(system.model.actuators)

    def state(self, known: ConstrainedState, algorithmic: Array) -> State:
        """A copy as arrays."""
        q: Nodes = known.q
        motion = known.v.copy(), known.a.copy(), algorithmic.copy(), known.multipliers.copy()
        return State(rows_of(q.poses), q.bent.copy(), q.turned.copy(), q.wound.copy(), *motion)

    def configuration(self, state: Any) -> Nodes:
        """Nodes of a state."""
        return Nodes(poses_of(state.poses), state.bent.copy(), state.turned.copy(), state.wound.copy())

    def work(self) -> Work:
        """Memory for steps."""
        return room(self.model, self.width)
