"""Whether links that are linear in their own frame bear the speed at which they turn.

The centrifugal force on a deformed link grows with its deformation and works against its stiffness, K - ω_a ω_b Z_ab.
What holds a link that spins, its own tension, is geometric stiffening; without it the sum loses definiteness at some
speed, and the computed motion grows without bound.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism, kinematics
from erls.mechanism.links import Link, node_shape6
from erls.mechanism.substructures import is_split, split
from erls.run.watches.base import NOTHING, Ended, Finding, Plan, Watch
from erls.run.watches.second_order_data import reason_without

_NOTABLE = 0.2  # share of the stiffness that is lost; the deflection is then wrong by more than a tenth
_SAMPLES = 401
UNSTABLE = "the linear model loses stability"  # in warnings of links whose motion is then meaningless


class SpinStability(Watch):
    """Looks at speeds: planned ones before a run, else those of the run."""

    def __init__(self) -> None:
        self._planned = False

    @staticmethod
    def concerns(plan: Plan) -> bool:
        """Links that are linear in their own frames."""
        return plan.modal

    def before(self, plan: Plan) -> Finding:
        """Speeds that drives prescribe or want."""
        found = planned_spin_warnings(plan.mechanism, plan.settings.duration)
        self._planned = bool(found)
        return Finding(found)

    def after(self, ended: Ended) -> Finding:
        """Speeds of joints that are free to take any; unless those of the others said enough."""
        mechanism, seen = ended.run.formulation.mechanism, ended.seen
        if self._planned or all(joint.drive.reference(0.0) is not None for joint in mechanism.joints):
            return NOTHING
        motion = zip(seen.times.tolist(), seen.coordinates, seen.rates, strict=True)
        return Finding(spin_warnings(mechanism, motion))


def planned_spin_warnings(mechanism: Mechanism, duration: float, samples: int = _SAMPLES) -> list[str]:
    """Of the motions that drives prescribe or follow, before anything is computed; other joints are taken at rest."""
    if all(joint.drive.reference(0.0) is None for joint in mechanism.joints):
        return []
    breaks = [b for joint in mechanism.joints for b in joint.drive.breakpoints if 0 < b < duration]
    times = np.unique(np.concatenate([np.linspace(0.0, duration, samples), breaks]))

    def planned(t: float) -> tuple[float, Array, Array]:
        found = [j.drive.reference(t) or (j.position, 0.0, 0.0) for j in mechanism.joints]
        values = np.array(found, dtype=float)
        return t, values[:, 0], values[:, 1]

    return spin_warnings(mechanism, map(planned, times.tolist()))


def spin_warnings(mechanism: Mechanism, motion: Iterable[tuple[float, Array, Array]]) -> list[str]:
    """Links whose spin takes away much of their stiffness, or all of it.

    Parameters
    ----------
    mechanism : Mechanism
    motion : iterable of (float, (n,) array, (n,) array)
        Times in rising order, joint coordinates and rates.
    """
    if "spin_softening" not in mechanism.effects:
        return []
    if is_split(mechanism):
        pieces = split(mechanism)
        return spin_warnings(pieces.pieces, ((t, pieces.expanded(q), pieces.expanded(qd)) for t, q, qd in motion))
    stiffened = "geometric_stiffening" in mechanism.effects
    softened = {
        k: _softening(link)
        for k, link in enumerate(mechanism.links)
        if link.elastic_modes and not (stiffened and link.second_order is not None)
    }
    bounds = {k: float(np.linalg.eigvalsh(np.einsum("aaij->ij", parts))[-1]) for k, parts in softened.items()}
    worst: dict[int, tuple[float, float]] = {}  # largest share lost, and its speed
    lost: dict[int, tuple[float, float]] = {}  # time and speed at which all of it is
    turning = np.array([joint.freedom.turns for joint in mechanism.joints])
    largest = max(bounds.values(), default=0.0)
    for t, theta, rates in motion if softened else ():
        with np.errstate(over="ignore", invalid="ignore"):  # a run that failed may hold anything
            bound = np.abs(rates[turning]).sum() ** 2 * largest
        if not _NOTABLE < bound < np.inf:
            continue
        twists = kinematics(mechanism, theta, rates).twists
        for k, parts in softened.items():
            omega = twists[k][3:]
            if omega @ omega * bounds[k] <= _NOTABLE:  # about any axis
                continue
            share = float(np.linalg.eigvalsh(np.einsum("a,b,abij->ij", omega, omega, parts))[-1])
            speed = float(np.linalg.norm(omega))
            if share > worst.get(k, (0.0, 0.0))[0]:
                worst[k] = share, speed
            if share >= 1:
                lost.setdefault(k, (t, speed / np.sqrt(share)))
    return [_warning(mechanism.links[k], *found, lost.get(k)) for k, found in worst.items() if found[0] > _NOTABLE]


def critical_speed(link: Link, axis: Array) -> float:
    """Speed of turning about ``axis`` (3,), mesh axes, from which on a linear link is unstable [rad/s]."""
    along = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    share = np.linalg.eigvalsh(np.einsum("a,b,abij->ij", along, along, _softening(link)))[-1]
    return float(1 / np.sqrt(share)) if share > 0 else np.inf


def _softening(link: Link) -> Array:
    """(3, 3, n, n) K^(-1/2) Z_ab K^(-1/2) of the link held at its inboard interface."""
    shape = np.vstack(node_shape6(link.model, link.inboard.node))
    basis = np.vstack([-np.linalg.solve(shape[:, :6], shape[:, 6:]), np.eye(link.elastic_modes)])
    scaled = basis / np.sqrt(link.stiffness)
    z = scaled.T @ link.invariants.Z @ scaled
    return np.asarray((z + z.swapaxes(-1, -2)) / 2)


def _warning(link: Link, share: float, speed: float, lost: tuple[float, float] | None) -> str:
    remedy = (
        "turn on the effect 'geometric_stiffening'"
        if link.second_order is not None
        else f"geometric stiffening is {reason_without(link)}"
    )
    if lost is None:
        return (
            f"link {link.name!r}: at {speed:.4g} rad/s the centrifugal force on its deformation takes away "
            f"{100 * share:.0f} % of its stiffness, since its tension is left out; {remedy}"
        )
    return (
        f"link {link.name!r}: {UNSTABLE} at {lost[1]:.4g} rad/s (reached at t = {lost[0]:.4g} s, "
        f"top speed {speed:.4g} rad/s): the centrifugal force on its deformation outgrows its stiffness, since its "
        f"tension is left out; what is computed from there on is meaningless; {remedy}"
    )
