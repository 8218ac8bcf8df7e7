"""What exported matrices say of their material: the speed of sound between neighbouring nodes."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from fe_import.model import FEModel

_MOST_NODES = 2000  # that are looked at


def speed_of_sound(model: FEModel) -> float | None:
    """√(E/ρ) to the order of magnitude, from the entries of the matrices.

    A node that moves alone has the frequency √(k/m), with k its largest stiffness and m its mass; waves run from it to
    its nearest neighbour, a distance h away, in about 2/ω: c ≈ h √(k/m) / 2. On elements of any order and on beams it
    is 0.3 to 3 times √(E/ρ); condensed matrices give the same along a straight link and less around corners.

    Returns
    -------
    float or None
        [m/s], the median of the nodes; None where no node has mass and a neighbour.
    """
    rows = model.dof_map[:, :3]
    owner = np.full(model.stiffness.shape[0], -1)
    every = np.flatnonzero((rows >= 0).all(axis=1))
    owner[rows[every].ravel()] = np.repeat(every, 3)
    nodes = every[:: len(every) // _MOST_NODES + 1]
    stiffness, mass = sp.csr_array(model.stiffness), model.mass.diagonal()
    found = []
    for node in nodes:
        own = rows[node]
        weight = float(mass[own].mean())
        near = np.unique(owner[stiffness.indices[stiffness.indptr[own[0]] : stiffness.indptr[own[0] + 1]]])
        distances = np.linalg.norm(model.nodes[near[near >= 0]] - model.nodes[node], axis=1)
        distances = distances[distances > 0]
        if weight <= 0 or not len(distances):
            continue
        largest = float(np.linalg.eigvalsh(stiffness[own][:, own].toarray())[-1])
        found.append(float(distances.min()) * np.sqrt(max(largest, 0.0) / weight) / 2)
    return float(np.median(found)) if found else None
