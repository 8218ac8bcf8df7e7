"""How links of nodes move: nodes of the system as their equations have it, what lies between by differences in time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from erls.equations.formulation import Formulation
from erls.equations.nodal.link_state import LinkView
from erls.equations.serial.motion_series import MotionSeries, Moving, differenced, twist_of
from erls.maths.so3 import Array
from fe_import.model import IntArray


def nodal_motion(
    formulation: Formulation, views: Sequence[LinkView], count: int, t: Array, y: Array, v: Array, a: Array
) -> MotionSeries:
    """Motion at times (k,): places and turns of ``count`` nodes stand in y, their derivatives in v and a."""
    found = differenced(formulation, t, y, v, a)
    assert found.nodes is not None
    assert found.turns is not None
    numbers = [x[:, : 12 * count].reshape(len(t), count, 12) for x in (y, v, a)]
    nodes, turns, twists = [], [], []
    for view, moved, turned in zip(views, found.nodes, found.turns, strict=True):
        (frame, own, place, turn), *derivatives = (view.motion_at(x) for x in numbers)
        twists.append(twist_of(Moving(frame, *(x[0] for x in derivatives))))
        nodes.append(_with(moved, own, place, *(x[2] for x in derivatives)))
        turns.append(_with(turned, own, turn, *(x[3] for x in derivatives)))
    return replace(
        found, twists=[twist for twist, _ in twists], twist_rates=[rate for _, rate in twists], nodes=nodes, turns=turns
    )


def _with(moving: Moving, own: IntArray, *exact: Array) -> Moving:
    """With what is known exactly of some."""
    every = moving.place, moving.rate, moving.acceleration
    parts = [x.copy() for x in every]
    for part, values in zip(parts, exact, strict=True):
        part[:, own] = values
    return Moving(*(np.asarray(part) for part in parts))
