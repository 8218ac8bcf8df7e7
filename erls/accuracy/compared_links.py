"""The equations of a run beside those of its mechanism with finer links, and the motion in the coordinates of both."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import msgspec
import numpy as np

from erls.accuracy.finer_links import FinerLinks
from erls.accuracy.judged_places import judged_nodes, judged_places
from erls.auto.outputs import Watched
from erls.equations.compiled_system import CompiledSystem
from erls.equations.formulation import Formulation, TreeFormulation
from erls.equations.loops.tied import Tied
from erls.equations.quasi_static.formulation import QuasiStatic
from erls.equations.registry import TREES
from erls.equations.serial.state_series import state_series
from erls.equations.series import mass_series, residual_series
from erls.integrate.base import hermite
from erls.maths.so3 import Array
from erls.run.chain.run import ChainRun
from fe_import.model import IntArray

if TYPE_CHECKING:
    from erls.equations.loops.compiled import CompiledLoops

_STEP = 1e-5  # s, of differences: 1e-6 rad/s² of rounding, and below 1 kHz 3e-4 of the acceleration


@dataclass(frozen=True)
class Compared:
    """Equations of the mechanism that was run, n coordinates, and of the whole one, N.

    Attributes
    ----------
    lesser, whole : TreeFormulation
    bound, tied : CompiledLoops or None
        Conditions of loops of both; None without any.
    run : (n,) int array
        Places of the coordinates that were run among all.
    kept, rest : (k,), (x,) int arrays
        Places of those that do not count as left out, and of those that do.
    own : (k,) int array
        Places of ``kept`` among those that were run.
    watched : tuple of (link, node)
    exact : bool
        Whether the equations agree on the coordinates kept.
    """

    lesser: TreeFormulation
    whole: TreeFormulation
    bound: CompiledLoops | None
    tied: CompiledLoops | None
    run: IntArray
    kept: IntArray
    rest: IntArray
    own: IntArray
    watched: Watched
    exact: bool

    @property
    def free(self) -> int:
        """Number of joint coordinates."""
        return len(self.whole.free_joints)

    def forces(self, t: Array, y: Array, v: Array, a: Array) -> Array:
        """(k, N) out of balance in the whole mechanism, loops open."""
        return residual_series(_compiled(self.whole), t, y, v, a)

    def lesser_forces(self, t: Array, y: Array, v: Array, a: Array) -> Array:
        """(k, n) the same in the mechanism that was run."""
        return residual_series(_compiled(self.lesser), t, y, v, a)

    def lesser_masses(self, t: Array, y: Array) -> Array:
        """(k, n, n) mass matrices of it."""
        return mass_series(_compiled(self.lesser), t, y)

    def moves(self, t: Array, y: Array, v: Array) -> Array:
        """(k, p, 3) places of the watched nodes at times (k,)."""
        linear = replace(self.whole.mechanism, effects=frozenset())  # differences of places: first order will do
        return judged_places(self.whole, self.watched, t, y, v, linear)


def _compiled(formulation: TreeFormulation) -> CompiledSystem:
    assert formulation.compiled is not None  # in joint angles
    return formulation.compiled


@dataclass(frozen=True)
class Motion:
    """A motion at k times.

    Attributes
    ----------
    t : (k,) array
        [s]
    given : three (k, n) arrays
        Coordinates that were run, rates, accelerations.
    whole : three (k, N) arrays
        The same among all, with zeros for what counts as left out.
    """

    t: Array
    given: tuple[Array, Array, Array]
    whole: tuple[Array, Array, Array]


def in_joint_angles(run: ChainRun) -> bool:
    """Whether the coordinates of a run are joint angles and elastic coordinates."""
    settings = run.scene.record.simulation
    return settings.gauge == "joint-angle" and settings.coordinates == "independent"


def compared_links(run: ChainRun, moving: Formulation, finer: FinerLinks) -> Compared:
    """Equations of a run's mechanism and of the one with finer links, of the same formulation in joint angles.

    Parameters
    ----------
    run : ChainRun
    moving : Formulation
        What was integrated.
    finer : FinerLinks
    """
    settings, direct = run.scene.record.simulation, in_joint_angles(run)
    if not direct:
        settings = msgspec.structs.replace(settings, gauge="joint-angle", coordinates="independent")
    lesser = _tree(moving) if direct else TREES[settings.formulation](moving.mechanism, settings)
    whole = TREES[settings.formulation](finer.mechanism, settings)
    joints = len(lesser.free_joints)
    ran = np.concatenate([np.arange(joints), joints + finer.run])
    kept = np.concatenate([np.arange(joints), joints + finer.kept])
    bound = tied = None
    if isinstance(moving, Tied):
        scales = np.ones(whole.size)  # they weigh solutions that nobody asks for here
        scales[ran] = lesser.length_scales
        vars(whole)["length_scales"] = scales
        tied = Tied(whole).whole
        bound = moving.whole if len(kept) < len(ran) else None
    watched = judged_nodes(run)
    rest = np.setdiff1d(np.arange(whole.size), kept)
    return Compared(lesser, whole, bound, tied, ran, kept, rest, np.searchsorted(ran, kept), watched, finer.exact)


def _tree(moving: Formulation) -> TreeFormulation:
    """The equations of the tree of links beneath."""
    if isinstance(moving, Tied):
        return moving.bare
    return moving.inner if isinstance(moving, QuasiStatic) else moving  # type: ignore[return-value]


def states_of(run: ChainRun, moving: Formulation, compared: Compared, t: Array) -> tuple[Array, list[Array]]:
    """Joint angles and elastic coordinates of a run in other coordinates, rates and accelerations from differences.

    Parameters
    ----------
    run : ChainRun
    moving : Formulation
        What was integrated.
    compared : Compared
    t : (k,) array
        [s]

    Returns
    -------
    t : (k,) array
        The times, where they lie too near to an end moved inwards [s].
    states : three (k, n) arrays
    """
    s = run.solution
    step = min(_STEP, (run.end - float(s.t[0])) / 4)
    t = np.clip(t, s.t[0] + step, run.end - step)
    values = []
    for shift in (-step, 0.0, step):
        at = np.clip(t + shift, s.t[0], run.end)
        found = state_series(moving, at, *hermite(s.t, s.y, s.v, s.a, at))
        elastic = [modal[:, 6:] for modal in found.modal]
        values.append(np.hstack([found.angles[:, compared.whole.free_joints], *elastic]))
    before, middle, after = values
    return t, [middle, (after - before) / (2 * step), (after - 2 * middle + before) / step**2]


def embedded(compared: Compared, t: Array, given: Sequence[Array]) -> Motion:
    """A motion in the coordinates that were run, (k, n) each, among all.

    Parameters
    ----------
    compared : Compared
    t : (k,) array
        [s]
    given : three (k, n) arrays
        Coordinates, rates, accelerations.
    """
    whole = np.zeros((3, len(t), compared.whole.size))
    for row, values in zip(whole, given, strict=True):
        row[:, compared.kept] = values[:, compared.own]
    return Motion(t, (given[0], given[1], given[2]), (whole[0], whole[1], whole[2]))
