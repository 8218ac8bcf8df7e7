"""What a family of links promises: frequencies of the link held at its inboard interface, and its flexibility."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from fe_import.health.static_flexibility import flexibility_error
from fe_import.model import Array, FEModel
from fe_import.reduction.base import interface_places
from fe_import.solver.sparse import factorize, lowest_modes

PROMISED = 10
"""Frequencies."""


@dataclass(frozen=True)
class HeldFigures:
    """Lowest circular frequencies (c,) [rad/s] and flexibility (b, b) of the other interfaces of a link that is held.

    ``fields`` (f, c + b): modes and static responses over the independent dofs that they come from.
    """

    omega: Array
    flexibility: Array
    fields: Array

    def errors(self, found: HeldFigures) -> tuple[float, float]:
        """Of other figures: largest relative error of a frequency, and of flexibility."""
        count = min(len(self.omega), len(found.omega))
        off = np.abs(found.omega[:count] / self.omega[:count] - 1).max(initial=0.0)
        missing = len(found.omega) < len(self.omega)
        return (np.inf if missing else float(off)), flexibility_error(found.flexibility, self.flexibility)


def exact_figures(model: FEModel, inboard: int) -> HeldFigures:
    """Those of the whole model."""
    mass, stiffness = model.reduced_matrices()
    places = interface_places(model)
    root = np.arange(6 * inboard, 6 * inboard + 6)
    rest = np.setdiff1d(np.arange(mass.shape[0]), places[root])
    positions, what = model.dof_positions()[rest], "stiffness of the link held at its inboard interface"
    clamped = stiffness[rest][:, rest].tocsc()
    solve = factorize(clamped, what, positions)
    omega, modes = lowest_modes(
        clamped, mass[rest][:, rest].tocsc(), PROMISED, model.name, positions=positions, solve=solve
    )
    loaded = np.searchsorted(rest, np.delete(places, root))
    loads = np.zeros((len(rest), len(loaded)))
    loads[loaded, np.arange(len(loaded))] = 1.0
    static = solve(loads)
    fields = np.zeros((mass.shape[0], modes.shape[1] + len(loaded)))
    fields[rest] = np.hstack([modes, static])
    return HeldFigures(omega, static[loaded], fields)


def reduced_figures(mass: Array, stiffness: Array, interfaces: Array, inboard: int) -> HeldFigures:
    """Those of a basis of the six rigid-body motions and elastic fields; ``fields`` are coordinates.

    Parameters
    ----------
    mass : (6 + k, 6 + k) array
    stiffness : (k, k) array
        Of the elastic fields.
    interfaces : (6 n, 6 + k) array
        Displacements and rotations of the interfaces.
    inboard : int
        The one that is held.
    """
    root = slice(6 * inboard, 6 * inboard + 6)
    held = np.vstack([-np.linalg.solve(interfaces[root, :6], interfaces[root, 6:]), np.eye(len(stiffness))])
    last = min(PROMISED, len(stiffness)) - 1
    squared, modes = la.eigh(stiffness, held.T @ mass @ held, subset_by_index=[0, last])
    others = np.delete(interfaces, np.arange(root.start, root.stop), axis=0) @ held
    static = la.solve(stiffness, others.T, assume_a="pos")
    return HeldFigures(np.sqrt(squared), others @ static, held @ np.hstack([modes, static]))
