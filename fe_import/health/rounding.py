"""How far rounding in the stiffness of a slender link reaches: its entries are far larger than what bending it takes.

A rotation of the link as a body moves every node, and the large forces of the entries cancel but for their rounding.
What is left strains nothing and has the energy ε |R|ᵀ|K||R| at most; where that is not small against the squared
frequency of the first elastic mode, neither is the error of that mode. It grows with the fourth power of length over
thickness in solids. Entries that are rounded correctly, and solved for exactly, have lost as much: 3e-5 at 1000, 2e-3
at 3000, and 6 % at 10 000, where rigid-body motions come out at 22 % of ω² (`benchmarks/slender_solids.py`). No solver
mends that; 1000 beams, 10 000 times as long as thick, have 2e-3.
"""

from __future__ import annotations

import numpy as np

from fe_import.errors import FEImportError
from fe_import.model import FEModel, magnitudes
from fe_import.reduction.rigid_modes import rigid_modes

MOST = 0.1  # the bound; frequencies of solids were off by a hundredth of it


def rounding_share(model: FEModel, first: float, where: str) -> float:
    """ε |R|ᵀ|K||R| / ω², the largest of the mass-orthonormal rigid-body modes R.

    Parameters
    ----------
    model : FEModel
    first : float
        First elastic circular frequency ω [rad/s].
    where : str
    """
    try:
        rigid = np.abs(rigid_modes(model.mass, model.rigid_body_modes(), where)[0])
    except FEImportError:
        return 0.0
    energy = np.einsum("dk,dk->k", rigid, magnitudes(model.stiffness) @ rigid)
    return float(np.finfo(float).eps * energy.max() / first**2)
