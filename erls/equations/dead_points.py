"""Dead points of systems in redundant coordinates: why conditions cannot follow a drive.

Conditions ask for velocities, B v = -Φ_t. Where a mechanism nears a dead point, B nears a singular matrix: a
combination u of its rows vanishes, uᵀB → 0, but what drives ask of it does not, uᵀΦ_t ≠ 0. Points would have to move
|uᵀΦ_t| / σ times as fast as the drives do, σ being the smallest singular value; at the dead point without bound. At a
change point uᵀΦ_t vanishes too, and links that bend leave B regular: neither is one.
"""

from __future__ import annotations

import numpy as np

from erls.equations.constrained_system import Configuration, ConstrainedSystem
from erls.equations.system import metre_scales
from erls.errors import Cause, SimulationError
from erls.maths.saddle import dense

_FASTER = 100.0  # times as fast as the drives: far from dead points it is some ten times
_ASKED = 1e-6  # of what drives ask of all conditions: less is none, as at a change point
_TAKES_PART = 0.1  # of u, whose size is 1: what a joint has to do with it
_LARGEST = 3000  # conditions: the singular values of more take minutes


def dead_point(system: ConstrainedSystem, t: float, q: Configuration) -> SimulationError | None:
    """What to say of a step that failed at ``t`` because a drive leads beyond a dead point; None where it did not.

    Parameters
    ----------
    system : ConstrainedSystem
    t : float
        Of the last state that was reached [s].
    q : Configuration
        There.

    Returns
    -------
    SimulationError or None
        LOOP_OPEN, with the driven joint, and those that cannot follow.
    """
    asked = np.asarray(system.constraint_rate(t, q), dtype=float)
    if not asked.any() or len(asked) > _LARGEST:
        return None
    rows = dense(system.constraint_matrix(t, q)) / metre_scales(system)
    sizes = np.linalg.norm(rows, axis=1)
    if not (np.isfinite(rows).all() and sizes.all()):
        return None
    asked = asked / sizes  # each row measured as the metres that it moves
    combined, values, _ = np.linalg.svd(rows / sizes[:, None], full_matrices=False)
    smallest, u = float(values[-1]), combined[:, len(values) - 1]
    share = abs(float(u @ asked)) / float(np.linalg.norm(asked))
    if share < max(_ASKED, _FASTER * smallest):
        return None
    driving = _joints(system, (asked != 0) & (np.abs(u) > _TAKES_PART))
    following = [name for name in _joints(system, np.abs(u) > _TAKES_PART) if name not in driving]
    return SimulationError(
        Cause.LOOP_OPEN,
        f"the mechanism locks: in this singular position (a dead point, links in line) {', '.join(following)} cannot "
        f"follow {', '.join(driving) or 'the drives'}",
        where=f"t = {t:.9g} s",
        value=f"points {share / max(smallest, 1e-300):.3g} times as fast as the drive",
        limit="some ten times, far from such a position",
        remedy="keep the drive within what the lengths of the links allow, or end the run before",
    )


def _joints(system: ConstrainedSystem, chosen: np.ndarray) -> list[str]:
    """Of some conditions, each once."""
    names = (system.constraint_names[k].partition(":")[0] for k in np.flatnonzero(chosen))
    return list(dict.fromkeys(names))
