"""Equations of the whole mechanism at a few configurations of a run, and the vibrations of what links leave out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from erls.accuracy.compared_links import Compared
from erls.accuracy.slow_motion import Parted
from erls.equations.system import metre_scales
from erls.maths.so3 import Array
from fe_import.model import IntArray

CONFIGURATIONS = 3  # if links turn against each other
SMALL_MOVE = 1e-6  # m, of differences


@dataclass(frozen=True)
class Configuration:
    """The mechanism in the middle of a stretch of a run.

    Attributes
    ----------
    stretch : (k,) int array
        Instants that it stands for.
    t : float
        [s]
    y, v : (N,) arrays
        Nothing of what is left out.
    mass, stiffness, damping : (N, N) arrays
    pressed : (N, N) array or None
        What loads add to the stiffness, which need not be symmetric: links that they press are softer.
    rows : (m, N) array
        Conditions of loops.
    squares : (x,) array
        Squared frequencies of what is left out, all else held [1/s²].
    fields : (x, x) array
        Its modes, orthonormal in mass.
    """

    stretch: IntArray
    t: float
    y: Array
    v: Array
    mass: Array
    stiffness: Array
    damping: Array
    pressed: Array | None
    rows: Array
    squares: Array
    fields: Array


def configurations(compared: Compared, motion: Parted) -> list[Configuration]:
    """One for each stretch of the run."""
    turning = sum(link.elastic_modes > 0 for link in compared.whole.mechanism.links) > 1
    parts = np.array_split(np.arange(len(motion.t)), CONFIGURATIONS if turning else 1)
    return [_configuration(compared, motion, stretch) for stretch in parts]


def _configuration(compared: Compared, motion: Parted, stretch: IntArray) -> Configuration:
    middle, whole, tied = int(stretch[len(stretch) // 2]), compared.whole, compared.tied
    t, y, v = float(motion.t[middle]), np.zeros(whole.size), np.zeros(whole.size)
    y[compared.kept], v[compared.kept] = motion.y[middle, compared.own], motion.v[middle, compared.own]
    mass = whole.mass_matrix(t, y) if tied is None else tied.masses(t, y)
    stiffness, damping = whole.stiffness_and_damping(t, y, v)
    stiffness, damping = (stiffness + stiffness.T) / 2, (damping + damping.T) / 2
    pressed = _of_loads(compared, t, y, stiffness) if whole.mechanism.loads else None
    rows = np.zeros((0, whole.size)) if tied is None else tied.closure(t, y, v).rows[:, whole.free]
    block = np.ix_(compared.rest, compared.rest)
    squares, fields = np.zeros(0), np.zeros((0, 0))
    if len(compared.rest):
        squares, fields = la.eigh(stiffness[block], mass[block], check_finite=False)
    return Configuration(stretch, t, y, v, mass, stiffness, damping, pressed, rows, squares, fields)


def _of_loads(compared: Compared, t: float, y: Array, stiffness: Array) -> Array:
    """(N, N) what loads, and the weight of links, add to their stiffness in elastic coordinates, at rest."""
    whole, joints = compared.whole, compared.free
    places = np.arange(joints, whole.size)
    step = SMALL_MOVE / metre_scales(whole)[places]
    moved = np.repeat(y[None], 2 * len(places), axis=0)
    moved[np.arange(len(places)), places] += step
    moved[len(places) + np.arange(len(places)), places] -= step
    rest = np.zeros_like(moved)
    after, before = np.split(compared.forces(np.full(len(moved), t), moved, rest, rest), 2)
    result = np.zeros_like(stiffness)
    block = np.ix_(places, places)
    result[block] = ((after - before) / (2 * step[:, None])).T[places] - stiffness[block]
    return result
