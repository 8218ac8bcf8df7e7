"""Rigid coupling (RBE2): a coupled node at x follows the interface node at x_c, u = u_c + φ_c × (x - x_c).

Rotations of coupled nodes that have some, those of beams and shells, equal φ_c.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from fe_import.interfaces.dependence import Dependence, arm
from fe_import.model import Array, IntArray


def follow_rigidly(state: Dependence, rows: IntArray, offsets: Array, interface: IntArray) -> Dependence:
    """Let nodes follow an interface node.

    Parameters
    ----------
    state : Dependence
    rows : (k, 6) int array
        Rows of the coupled nodes' components, -1 where they lack one.
    offsets : (k, 3) array
        Of the coupled nodes from the interface node [m].
    interface : (6,) int array
        Rows of the interface node.
    """
    motion = np.zeros((len(rows), 6, 6))
    motion[:, :3] = arm(offsets)
    motion[:, 3:, 3:] = np.eye(3)
    present = rows.ravel() >= 0
    followers = rows.ravel()[present]
    values = motion.reshape(-1, 6)[present]
    columns = np.tile(state.columns(interface), (len(values), 1))
    count = np.repeat(np.arange(len(values)), 6)
    expression = sp.csr_array((values.ravel(), (count, columns.ravel())), shape=(len(values), len(state.independent)))
    return state.following(state.columns(followers), expression)
