"""Displacements beyond the range in which a modal model holds, after a run."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from erls.equations.serial.state_series import StateSeries
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.links import Link
from erls.mechanism.second_order import LinkSecondOrder
from erls.run.chain.run import ChainRun
from erls.run.watches.base import NOTHING, Ended, Finding, Watch

_LARGE_DEFLECTION = 0.1  # of the link's size; the second-order error of a small-displacement model is then about 1 %
_LARGE_ROTATION = 0.2  # rad
_AT_ONCE = 1_000_000  # displacements in memory while states are looked at


class SmallDisplacements(Watch):
    """Looks at the nodes of links."""

    def after(self, ended: Ended) -> Finding:
        """Links that left the range."""
        return NOTHING if ended.meaningless else Finding(range_warnings(ended.run, ended.seen))


class _Reach(NamedTuple):
    """Most that a unit of each modal coordinate moves [m] and turns [rad] a node against the inboard interface, (m,)
    each.
    """

    moves: Array
    turns: Array


def _reach(link: Link) -> _Reach:
    model = link.model
    moves = model.translation_shapes - model.translation_shapes[link.inboard.node]
    sizes = [np.linalg.norm(shapes, axis=1).max(axis=0, initial=0.0) for shapes in (moves, model.rotation_shapes)]
    return _Reach(*sizes)


def _within(link: Link, q: Array, second_order: LinkSecondOrder | None, limit: float) -> bool:
    """Whether a bound on what modal coordinates (k, m) do shows that a link cannot have left the range, which costs
    next to nothing.
    """
    reach = link.once("reach", lambda: _reach(link))
    moved, turned = np.abs(q) @ reach.moves, np.abs(q) @ reach.turns
    if second_order is not None:
        moved = moved + second_order.bound(q, moved)
    return bool((moved <= limit).all() and (turned <= _LARGE_ROTATION).all())


def range_warnings(run: ChainRun, seen: StateSeries) -> list[str]:
    """Links whose displacement left the range of small displacements, in which a modal model holds."""
    if seen.nodes is not None:
        return []  # the links may deflect as they like
    mechanism: Mechanism = run.formulation.mechanism
    largest = np.zeros(len(mechanism.links))
    turned = np.zeros(len(mechanism.links))
    for k, link in enumerate(mechanism.links):
        model, q = link.model, seen.modal[k]
        second_order = link.second_order if "foreshortening" in mechanism.effects else None
        if _within(link, q, second_order, _LARGE_DEFLECTION * link.size):
            continue
        per_pass = max(1, _AT_ONCE // model.translation_shapes[..., 0].size)
        for some in np.split(q, range(per_pass, len(q), per_pass)):
            moved = np.tensordot(some, model.translation_shapes, ([1], [2]))
            if second_order is not None:
                moved += second_order.displacements(np.arange(len(model.nodes)), some)
            moved -= moved[:, link.inboard.node, None]
            largest[k] = np.fmax(largest[k], np.linalg.norm(moved, axis=2).max())
            if len(model.rotation_shapes):
                rotations = np.tensordot(some, model.rotation_shapes, ([1], [2]))
                turned[k] = np.fmax(turned[k], np.linalg.norm(rotations, axis=2).max())
    result = []
    for k, link in enumerate(mechanism.links):
        if largest[k] > _LARGE_DEFLECTION * link.size or turned[k] > _LARGE_ROTATION:
            result.append(
                f"link {link.name!r} moves by up to {largest[k]:.3g} m and turns by up to "
                f"{np.degrees(turned[k]):.2g} deg against its rigid shape: beyond small displacements, expect errors "
                "of second order in the deflection"
            )
    return result
