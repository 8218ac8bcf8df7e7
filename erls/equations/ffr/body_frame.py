"""Where the floating frame of a link rides: its elastic modes with the rigid-body motion of that frame taken out.

``tangent``: on the inboard interface, which rests in it. ``mean-axis``: such that elastic velocities carry no momentum
(Tisserand), with the inertia of the undeformed link (H. F. Buckens, Proc. 5th Int. Symp. Space Techn. (1963)).
"""

from __future__ import annotations

import numpy as np

from erls.maths.so3 import Array
from erls.mechanism.links import Link, node_shape6

BODY_FRAMES = ("tangent", "mean-axis")


def elastic_basis(link: Link, body_frame: str) -> Array:
    """(6 + n, n) modal coordinates, in the modes of the modal file, of the field of each elastic coordinate.

    Parameters
    ----------
    link : Link
        Its payloads count for the mean axes.
    body_frame : str
        Member of `BODY_FRAMES`.
    """
    if body_frame == "tangent":
        rows = np.vstack(node_shape6(link.model, link.inboard.node))
    else:
        rows = link.invariants.rigid.T @ link.invariants.m
    n = link.elastic_modes
    rigid = -np.linalg.solve(rows[:, :6], rows[:, 6:]) if n else np.zeros((6, 0))
    return np.vstack([rigid, np.eye(n)])
