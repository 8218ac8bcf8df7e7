"""How far the mesh of a solid or of shells is from a fine one, as its stress tells.

Stress of the exact solution is continuous, that of elements is not. What averaging at the nodes changes, in energy,
estimates the error of a mode's energy, and so of its squared frequency (O. C. Zienkiewicz & J. Z. Zhu, Int. J. Numer.
Methods Eng. 24 (1987) 337-357): ω² of the mesh is (1 - η²)⁻¹ times the true one, η² the error's share of the energy.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fe_import.elements.shell_recovery import energy_of_error
from fe_import.elements.shell_stress import ShellStress
from fe_import.elements.solid_stress import SolidStress
from fe_import.errors import Cause, FEImportError
from fe_import.modal.model import MESH_ERROR, HealthCheck
from fe_import.model import Array, FEModel, IntArray

_MODES = 3  # elastic, the lowest: the first may be one of several that are nearly equal
_MOST = 1 - 1e-6  # share of the energy; beyond, the figure would be infinite


def check_mesh_error(
    model: FEModel, sources: Sequence[SolidStress | ShellStress], shapes: Array, omega: Array, limit: float, where: str
) -> tuple[HealthCheck, ...]:
    """Estimated error of the lowest elastic frequencies, the largest as a check.

    Parameters
    ----------
    model : FEModel
    sources : sequence of SolidStress or ShellStress
        Its elements.
    shapes : (d, m) array
        Modes, the six rigid-body ones first.
    omega : (m,) array
        [rad/s]
    limit : float
        Beyond it the check fails.
    where : str

    Raises
    ------
    FEImportError
        ``MESH``: beyond it with linear elements, which lock.
    """
    if len(omega) <= 6:
        return ()
    error, energy = np.zeros((2, min(_MODES, len(omega) - 6)))
    for source in sources:
        found = _energies(source, shapes[:, 6 : 6 + _MODES], model.dof_map)
        error, energy = error + found[0], energy + found[1]
    whole = np.maximum(energy, omega[6 : 6 + _MODES] ** 2 / 2)  # with that of beams and springs
    worst = float(frequency_errors(error, whole).max())
    blocks = [block for source in sources if isinstance(source, SolidStress) for block in source.mesh.blocks]
    locking = [b.type for b in blocks if not b.element.midpoints and not b.element.incompatible]
    if worst > limit and locking:
        raise FEImportError(
            Cause.MESH,
            f"{' and '.join(locking)} elements are too stiff on this mesh: error of the first frequencies, estimated",
            where=f"{where}: solid.mesh_error",
            value=float(f"{worst:.2g}"),
            limit=limit,
            remedy="set raise_order = true in [solid], refine the mesh, or accept the error with a larger mesh_error",
        )
    return (HealthCheck(f"{MESH_ERROR}, as jumps of stress tell", worst, limit),)


def _energies(source: SolidStress | ShellStress, fields: Array, dof_map: IntArray) -> tuple[Array, Array]:
    if isinstance(source, SolidStress):
        return source.energy_of_error(fields, dof_map)
    return energy_of_error(source, fields, dof_map)


def frequency_errors(error: Array, energy: Array) -> Array:
    """(m,) errors of frequencies, as shares, of modes of which ``error`` is the error's part of the energy."""
    return np.asarray(1 / np.sqrt(1 - np.minimum(error / energy, _MOST)) - 1)
