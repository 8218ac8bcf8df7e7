"""The equations of a run beside those of its mechanism with finer links, and the motion in the coordinates of both."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import msgspec
import numpy as np

from erls.accuracy.finer_links import FinerLinks
from erls.auto.outputs import Watched, watched_nodes
from erls.equations.formulation import Formulation, TreeFormulation
from erls.equations.loops.tied import Tied
from erls.equations.quasi_static.formulation import QuasiStatic
from erls.equations.registry import TREES
from erls.equations.serial.state_series import StateSeries, state_series
from erls.equations.substructures import Substructured
from erls.integrate.base import hermite
from erls.maths.so3 import Array
from erls.run.chain.places import node_positions
from erls.run.chain.run import ChainRun
from fe_import.model import IntArray

if TYPE_CHECKING:
    from erls.equations.loops.compiled import CompiledLoops

SAMPLES, LOOP_SAMPLES = 32, 16  # times at which forces are looked at; fewer where they take longer
_STEP = 1e-5  # s, of differences: 1e-6 rad/s² of rounding, and below 1 kHz 3e-4 of the acceleration
_WINDOWS = 12  # over which a motion is averaged


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

    def moves(self, t: Array, y: Array, v: Array) -> Array:
        """(k, p, 3) places of the watched nodes at times (k,)."""
        found: StateSeries = state_series(self.whole, t, y, v)
        mechanism = replace(self.whole.mechanism, effects=frozenset())  # differences of places: first order will do
        return np.stack(
            [node_positions(mechanism, found, link, np.array([node]))[:, 0] for link, node in self.watched], axis=1
        )


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
    watched = watched_nodes(run.formulation.mechanism)
    if isinstance(run.formulation, Substructured):
        watched = tuple(tuple(run.formulation.parts.places[link][node].tolist()) for link, node in watched)
    rest = np.setdiff1d(np.arange(whole.size), kept)
    return Compared(lesser, whole, bound, tied, ran, kept, rest, np.searchsorted(ran, kept), watched, finer.exact)


def _tree(moving: Formulation) -> TreeFormulation:
    """The equations of the tree of links beneath."""
    if isinstance(moving, Tied):
        return moving.bare
    return moving.inner if isinstance(moving, QuasiStatic) else moving  # type: ignore[return-value]


def sampled(run: ChainRun, moving: Formulation, compared: Compared) -> Motion:
    """Knots of a run, about even in time, none at a jump; states where its coordinates are others."""
    s = run.solution
    if not in_joint_angles(run):
        return _from_states(run, moving, compared)
    beside = np.diff(s.t) > 0
    smooth = np.flatnonzero(np.concatenate([[True], beside]) & np.concatenate([beside, [True]]))
    count = SAMPLES if compared.tied is None else LOOP_SAMPLES
    even = np.searchsorted(s.t[smooth], np.linspace(s.t[0], s.t[-1], count)).clip(0, len(smooth) - 1)
    chosen = smooth[np.unique(even)] if len(smooth) else smooth
    t, given = s.t[chosen], [s.y[chosen], s.v[chosen], s.a[chosen]]
    if isinstance(moving, QuasiStatic) and len(t):
        every = [moving.all_modes(*at) for at in zip(t.tolist(), *given, strict=True)]
        given = [np.array(part).reshape(len(t), -1) for part in zip(*every, strict=True)]
    return _embedded(compared, t, given)


def _from_states(run: ChainRun, moving: Formulation, compared: Compared) -> Motion:
    """States of a run in joint angles and elastic coordinates, rates and accelerations from differences."""
    s = run.solution
    step = min(_STEP, (run.end - float(s.t[0])) / 4)
    t = np.linspace(s.t[0] + step, run.end - step, SAMPLES)
    values = []
    for shift in (-step, 0.0, step):
        at = np.clip(t + shift, s.t[0], run.end)
        found = state_series(moving, at, *hermite(s.t, s.y, s.v, s.a, at))
        elastic = [modal[:, 6:] for modal in found.modal]
        values.append(np.hstack([found.angles[:, compared.whole.free_joints], *elastic]))
    before, middle, after = values
    return _embedded(compared, t, [middle, (after - before) / (2 * step), (after - 2 * middle + before) / step**2])


def averaged(run: ChainRun, moving: Formulation, compared: Compared) -> Motion:
    """The slow part of a motion: its averages over stretches of time."""
    if isinstance(moving, QuasiStatic) or not in_joint_angles(run):
        return sampled(run, moving, compared)  # it has no other
    s = run.solution
    first = np.unique(np.searchsorted(s.t, np.linspace(s.t[0], s.t[-1], _WINDOWS + 1)[:-1], side="right") - 1)
    share = np.gradient(s.t) if len(s.t) > 1 else np.ones(1)
    share = np.maximum(share, np.finfo(float).tiny)
    weight = np.add.reduceat(share, first)

    def mean(values: Array) -> Array:
        return np.asarray((np.add.reduceat(share * values.T, first, axis=-1) / weight).T)

    return _embedded(compared, mean(s.t), [mean(s.y), mean(s.v), mean(s.a)])


def _embedded(compared: Compared, t: Array, given: Sequence[Array]) -> Motion:
    whole = np.zeros((3, len(t), compared.whole.size))
    for row, values in zip(whole, given, strict=True):
        row[:, compared.kept] = values[:, compared.own]
    return Motion(t, (given[0], given[1], given[2]), (whole[0], whole[1], whole[2]))
