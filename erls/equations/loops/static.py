"""Static equilibrium of a chain with loops: links deform, joints follow; those that the loops leave free are held."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from erls.equations.loops.tied import Tied
from erls.equations.serial.equilibrium import Angles, Held, elastic_on_diagonal, equilibrium
from erls.equations.stability import Bearing
from erls.maths.so3 import Array
from fe_import.model import IntArray

if TYPE_CHECKING:
    from erls.equations.loops.compiled import CompiledLoops


def closed_equilibrium(
    chain: Tied, loops: CompiledLoops, y: Array, held: IntArray, gap: float
) -> tuple[Array, Bearing]:
    """(n,) equilibrium under gravity, springs and drives, and what loads leave of the stiffness.

    Parameters
    ----------
    chain : Tied
    loops : CompiledLoops
        With the conditions that do not follow from others.
    y : (n,) array
        Loops closed, links undeformed.
    held : int array
        Free joints, by their place in y, whose physical angles keep their values.
    gap : float
        What undeformed links leave open [m], for messages; 0 where that is nothing to speak of.

    Raises
    ------
    SimulationError
        As `erls.equations.serial.equilibrium.equilibrium`.
    """
    kept, free, still = loops.given.kept, chain.bare.free, np.zeros(chain.size)
    angles = Angles(chain.bare, chain.bare.free_joints[held], y, chain.metres, chain.reach)

    def forces(many: Array, multipliers: Array) -> Array:
        rest, every = np.zeros_like(many), np.tile(multipliers, (len(many), 1))
        return loops.held(np.zeros(len(many)), many, rest, rest, every)

    def conditions(at: Array) -> tuple[Array, Array]:
        found, (turned, rows) = chain.closure(0.0, at, still), angles.conditions(at)
        both = found.violation[kept], turned
        return np.concatenate(both), np.concatenate([found.rows[kept][:, free], rows])

    what = "no static equilibrium of the closed chain"
    what += f", which undeformed links leave {gap:.3g} m open," if gap else ""
    given = chain.mechanism, forces, conditions, len(kept), *elastic_on_diagonal(chain.bare)
    return equilibrium(Held(*given, chain.metres, chain.reach, what), y)
