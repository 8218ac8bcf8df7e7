"""The momentum that a chain keeps along its first joint, where nothing acts along that.

Its coordinate then moves the whole mechanism as it is, which changes neither kinetic nor potential energy, so that
p = ∂T/∂θ̇₁, a row of the mass matrix times the rates, stays as it was (Noether): angular momentum about a revolute
joint's axis, linear momentum along a prismatic one's.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from erls.accuracy.looked_at import LookedAt
from erls.accuracy.panels import within_legs
from erls.accuracy.power import in_angles, moved
from erls.mechanism.chain import Mechanism

_PARALLEL = 1e-12


class Momentum(NamedTuple):
    """Of a run.

    Attributes
    ----------
    change : float
        Farthest from its first value [kg m²/s or kg m/s].
    size : float
        The most that the same kinetic energy could hold of it: √(2 T M₁₁).
    joint : str
    """

    change: float
    size: float
    joint: str


def free_momentum(look: LookedAt) -> Momentum | None:
    """Along the first joint of a chain; None where it need not stay, or is not known."""
    tree, mechanism = in_angles(look.formulation), look.mechanism
    if tree is None or tree is not look.formulation or not _free(mechanism):
        return None
    s, t = look.solution, within_legs(look.solution.t)
    chosen = look.panels.picked(look.even)
    knots = np.unique(np.concatenate([[0], chosen.first, [len(t) - 1]]))
    momenta, most = np.empty((2, len(knots)))
    for i, k in enumerate(knots.tolist()):
        mass, rate = tree.mass_matrix(float(t[k]), s.y[k]), s.v[k]
        momenta[i], most[i] = mass[0] @ rate, np.sqrt(mass[0, 0] * (rate @ mass @ rate))
    return Momentum(float(np.abs(momenta - momenta[0]).max()), float(most.max()), mechanism.joints[0].name)


def _free(mechanism: Mechanism) -> bool:
    """Whether neither a joint's force, a load nor the ground acts along the first joint, and no other one stands on the
    ground or brings a motion along.
    """
    first = mechanism.joints[0]
    acts = first.drive.kind != "free" or first.forces.active or first.freedom.vector or first.freedom.pitch
    acts = acts or bool(mechanism.loads) or any(contact.base is None for contact in mechanism.contacts)
    if acts or mechanism.parents.count(-1) != 1 or moved(mechanism):
        return False
    axis = first.before[:3, first.freedom.axis]
    along = np.cross(mechanism.gravity, axis) if first.freedom.turns else mechanism.gravity @ axis
    return bool(np.linalg.norm(along) <= _PARALLEL * max(float(np.linalg.norm(mechanism.gravity)), 1.0))
