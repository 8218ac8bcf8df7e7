"""Arrays of a modal model in the coordinates of another one, whose shapes are held as far as both allow.

Modes of a link turn with its parameters, all the faster the nearer their frequencies lie, and any way where these meet.
The space that they span does not: the shapes Φ(p) T(p) in it that come nearest to Φ(p₀), up to rigid-body motion, are
smooth in p, and in their coordinates so is every array. T holds what a parameter does to the scale of modes, too, and
need not be orthogonal.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg as la

from fe_import.modal.model import ModalModel
from fe_import.modal.second_order import pair_numbers
from fe_import.model import Array


def nearest_shapes(model: ModalModel, base: ModalModel) -> Array:
    """(m, m) T: modal coordinates of a model per modal coordinate of another one, rigid-body and elastic ones apart.

    By least squares over the displacements of all nodes and, times the size of the link, their rotations.

    Parameters
    ----------
    model, base : ModalModel
        In orthonormal form, of the same nodes and number of modes.
    """
    size = max(float(np.linalg.norm(np.ptp(base.nodes, axis=0))), 1e-300)

    def shapes(of: ModalModel) -> Array:
        turns = size * of.rotation_shapes
        return np.concatenate([of.translation_shapes.reshape(-1, of.modes), turns.reshape(-1, of.modes)])

    whole = np.linalg.lstsq(shapes(model), shapes(base), rcond=None)[0]
    return np.asarray(la.block_diag(whole[:6, :6], whole[6:, 6:]))


def arrays_in(model: ModalModel, turn: Array) -> dict[str, Array]:
    """Arrays of a modal model in other coordinates, by the names of its fields.

    Parameters
    ----------
    model : ModalModel
        In orthonormal form.
    turn : (m, m) array
        T, as of `nearest_shapes`.

    Returns
    -------
    dict of str to array
        ``stiffness`` and ``damping`` (m, m), ``invariants.m`` and the like, shapes, and ``second_order``,
        ``recovery`` and ``thermal`` where the model has them.
    """
    one, inner = model.invariants, turn[6:, 6:]
    omega = 2 * np.pi * model.frequencies_hz

    def both(array: Array) -> Array:
        return np.asarray(turn.T @ array @ turn)

    found: dict[str, Array] = {
        "stiffness": both(model.stiffness),
        "damping": both(np.diag(2 * model.damping_ratios * omega)),
        "invariants.m": both(one.m),
        "invariants.X": both(one.X),
        "invariants.Z": both(one.Z),
        "invariants.rigid": np.asarray(np.linalg.solve(turn, one.rigid)),
        "translation_shapes": model.translation_shapes @ turn,
        "rotation_shapes": model.rotation_shapes @ turn,
    }
    if (second := model.second_order) is not None:
        found["second_order.momentum"] = both(second.momentum)
        found["second_order.spin"] = both(second.spin)
        found["second_order.modal"] = np.einsum("dc,dab->cab", inner, both(second.modal))
        for name in ("translation", "rotation"):
            found[f"second_order.{name}"] = _pairs(getattr(second, name), inner)
    if (maps := model.recovery) is not None:
        found |= {"recovery.modes": maps.modes @ turn, "recovery.inertia": maps.inertia @ turn}
        found |= {"recovery.loads": maps.loads, "recovery.spin": maps.spin}
    if (warm := model.thermal) is not None:
        found |= {"thermal.force": turn.T @ warm.force}
        found |= {"thermal.restrained": warm.restrained, "thermal.relaxed": warm.relaxed}
    return found


def _pairs(field: Array, inner: Array) -> Array:
    """(k, 3, p) second-order displacements, stored by pairs of elastic coordinates, in other ones."""
    count = len(inner)
    whole = field[..., pair_numbers(count)]
    first, second = np.triu_indices(count)
    return np.ascontiguousarray((inner.T @ whole @ inner)[..., first, second])
