"""A vibration or buckling mode of bodies and beams, as something to look at: over the phase of one period."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from erls.equations.nodal.nodes import Nodes
from erls.errors import Cause, SceneError
from erls.maths import motion_maps as motions
from erls.maths import rotation_maps as rotations
from erls.maths.so3 import Array
from erls.run.bodies.rest import BodyRest, Modes
from erls.run.bodies.run import BodyRun
from erls.run.record import Axis, Run, plain, vector

_LARGEST = 0.1  # displacement, of the size of what is built
_FARTHEST = 0.5  # turn [rad]
_PHASES = 49


@dataclass(frozen=True, repr=False)
class BodyMode(BodyRun):
    """A mode about the last equilibrium; its amplitude, which means nothing, is a tenth of the size, or turns by 0.5.

    Attributes
    ----------
    rest : BodyRest
    number : int
        From 1.
    """

    axis: ClassVar[Axis] = Axis("phase", "phase", "")
    rest: BodyRest
    number: int

    def __reduce__(self) -> tuple[Any, ...]:
        """Of its equilibrium, which files hold."""
        return mode_of, (self.rest, self.number)

    @property
    def failure(self) -> None:
        """It has none."""

    @property
    def title(self) -> str:
        """The scene, the mode, and its load or frequency."""
        value = self.modes.values[self.number - 1]
        what = f"{value:.4g} Hz" if self.modes.quantity == "frequency_hz" else f"buckles at load {value:.4g}"
        return f"{self.scene.name}: mode {self.number}, {what}"

    @property
    def modes(self) -> Modes:
        """All that were found."""
        assert self.rest.modes is not None
        return self.rest.modes

    @property
    def times(self) -> Array:
        """(k,) phases from 0 to 1; the first and the last are farthest out."""
        return np.linspace(0.0, 1.0, _PHASES)

    @property
    def origin(self) -> Nodes:
        """The equilibrium."""
        return self.rest.statics.path[-1].q

    @cached_property
    def _step(self) -> tuple[Array, Array]:
        """(n, 3) displacements [m] and turns [rad] of the nodes, in the world, at phase 0."""
        moved, turned = (values[self.number - 1] for values in (self.modes.moved, self.modes.turned))
        size = float(np.linalg.norm(np.ptp(self.origin.poses[:, :3, 3], axis=0))) or 1.0
        farthest = max(np.linalg.norm(moved, axis=1).max() / (_LARGEST * size),
                       np.linalg.norm(turned, axis=1).max() / _FARTHEST, 1e-300)  # fmt: skip
        return moved / farthest, turned / farthest

    def poses(self, t: ArrayLike, nodes: Sequence[int] | None = None) -> Array:
        """(k, n, 4, 4) poses of nodes at phases, all unless given."""
        pick = slice(None) if nodes is None else list(nodes)
        share = np.cos(2 * np.pi * self.within(t))[:, None, None]
        moved, turned = (x[pick] for x in self._step)
        here = self.origin.poses[pick]
        return motions.poses(rotations.exp(share * turned) @ here[:, :3, :3], here[:, :3, 3] + share * moved)

    def configurations(self, t: Array) -> list[Nodes]:
        """At each phase; elements are wound up as they are at the equilibrium."""
        return [self.assembly.system.at(poses, self.origin) for poses in self.poses(t)]

    def velocities(self, t: Array) -> Array:
        """(k, 6 n) zeros."""
        return np.zeros((len(t), self.assembly.system.size))

    def multipliers(self, t: Array) -> Array:
        """(k, m) of the equilibrium."""
        return np.tile(self.rest.statics.path[-1].multipliers, (len(t), 1))

    def summary(self, times: Sequence[float] = ()) -> dict[str, Any]:
        """That of the equilibria."""
        return self.rest.summary(times)

    def columns(self, times: Array) -> dict[str, Array]:
        """Of each reported node x, y, z."""
        columns = {"phase [1]": times}
        for name in self.point_names:
            vector(columns, plain(name), "m", self.position(name, times))
        return columns


def mode_of(run: Run, number: int) -> BodyMode:
    """A mode that a run found.

    Raises
    ------
    SceneError
        BAD_FIELD: the run has no modes, or not this one.
    """
    modes = run.modes if isinstance(run, BodyRest) else None
    if not isinstance(run, BodyRest) or modes is None:
        message = "this run found no modes"
        remedy = 'simulate a scene of bodies with type = "frequencies" or "buckling"'
        raise SceneError(Cause.BAD_FIELD, message, where="mode", value=number, remedy=remedy)
    if not 1 <= number <= len(modes.values):
        message, remedy = "the run has no such mode", "give one that it has, or raise simulation.count"
        limit = f"1 to {len(modes.values)}"
        raise SceneError(Cause.BAD_FIELD, message, where="mode", value=number, limit=limit, remedy=remedy)
    return BodyMode(run.scene, run.assembly, run.wall_s, run.warnings, run, number)
