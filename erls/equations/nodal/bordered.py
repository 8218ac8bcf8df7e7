"""Equilibria beside the load: the linear systems of a path (configuration, multipliers, load parameter) of statics.

Unknown steps are measured in one unit: places by their root mean square over the nodes, in sizes of the mechanism,
turns through their levers likewise, the load parameter in shares of where the path ends. Beside the equations of
equilibrium stands one row: how far the step goes along a given direction. That system is regular at limit points, where
the stiffness is not, and singular at bifurcations (H. B. Keller, in: Applications of Bifurcation Theory, 1977).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from erls.equations.nodal.assembly import NodalSystem
from erls.equations.nodal.nodes import Nodes
from erls.equations.nodal.statics import imbalance
from erls.equations.system import metre_scales
from erls.maths.saddle import Matrix, Saddle, Scales
from erls.maths.so3 import Array

_HELD = 1e4  # of the largest stiffness: what holds conditions while unstable ways are counted
_INVERSE = 60  # steps of inverse iteration
_SETTLED = 1e-8  # of an eigenvalue
_DIFFERENCE = 1e-6  # of the load parameter, for the rate of loads and prescribed motions


@dataclass(frozen=True)
class Point:
    """A configuration under a load parameter, and the multipliers (m,) of its joints."""

    t: float
    q: Nodes
    multipliers: Array


@dataclass(frozen=True)
class Step:
    """Increments (n,) of the nodes, of the multipliers (m,), and of the load parameter."""

    move: Array
    change: Array
    load: float

    def scaled(self, by: float) -> Step:
        """A multiple."""
        return Step(by * self.move, by * self.change, by * self.load)

    def less(self, other: Step, by: float) -> Step:
        """Without a multiple of another one."""
        return Step(self.move - by * other.move, self.change - by * other.change, self.load - by * other.load)


class Measure:
    """How long steps are.

    Parameters
    ----------
    system : NodalSystem
    end : float
        Load parameter at which the path ends.
    """

    def __init__(self, system: NodalSystem, end: float) -> None:
        metres = metre_scales(system)
        extent = float(np.linalg.norm(np.ptp(system.start.poses[:, :3, 3], axis=0)))
        self.size = extent or float(metres.reshape(-1, 6)[:, 3:].max())
        self.metres, self.end = metres, abs(end)
        self.weights = metres**2 / (system.count * self.size**2)

    def product(self, a: Step, b: Step) -> float:
        """Of two steps."""
        return float(a.move @ (self.weights * b.move)) + a.load * b.load / self.end**2

    def length(self, a: Step) -> float:
        """Of a step."""
        return float(np.sqrt(self.product(a, a)))

    def unit(self, a: Step) -> Step:
        """Of length one."""
        return a.scaled(1 / self.length(a))


def load_rate(system: NodalSystem, at: Point) -> tuple[Array, Array]:
    """What a unit of the load parameter adds to the imbalance: forces (n,) and joints (m,)."""
    h = _DIFFERENCE * max(1.0, abs(at.t))
    back, ahead = (imbalance(system, t, at.q, at.multipliers) for t in (at.t - h, at.t + h))
    return (ahead[0] - back[0]) / (2 * h), (ahead[1] - back[1]) / (2 * h)


def stiffness_and_rows(system: NodalSystem, at: Point, material: bool = False) -> tuple[Matrix, Matrix]:
    """K and B."""
    rest = np.zeros(system.size)
    stiffness, _ = system.stiffness_and_damping(at.t, at.q, rest, rest, at.multipliers, material=material)
    return stiffness, system.constraint_matrix(at.t, at.q)


class Bordered:
    """The factored system of a step: equilibrium, and the way that it goes along a direction.

    Parameters
    ----------
    system : NodalSystem
    at : Point
    along : Step
    measure : Measure
    material : bool
        Without the change of the directions of internal forces.
    """

    def __init__(self, system: NodalSystem, at: Point, along: Step, measure: Measure, material: bool = False) -> None:
        self.stiffness, self.rows = stiffness, rows = stiffness_and_rows(system, at, material)
        force, gap = load_rate(system, at)
        reach = measure.size / measure.end  # metres per load parameter
        unit = float((abs(stiffness).diagonal() / measure.metres**2).max(initial=0.0)) or 1.0
        way = np.append(measure.weights * along.move, along.load / measure.end**2)
        self._row = unit * reach / float(np.abs(way / np.append(measure.metres, reach)).max())
        block = _with_border(stiffness, force, self._row * way)
        columns = sp.vstack([sp.csc_array(rows).T, sp.csc_array((1, rows.shape[0]))], format="csc")
        wide = sp.hstack([sp.csc_array(rows), sp.csc_array(gap[:, None])], format="csc")
        metres = np.append(measure.metres, reach)
        self._saddle = Saddle(block, columns, wide, Scales(metres, abs(block), wide), 1.0)
        self.singular = self._saddle.singular is not None

    def solve(self, force: Array, gap: Array, way: float) -> tuple[Step, float]:
        """The step that takes off an imbalance and goes a length along the direction; its largest part [m]."""
        right = self._saddle.scaled(np.append(force, self._row * way), gap)
        found = self._saddle.solve(right)
        move, change = self._saddle.unscaled(found)
        return Step(move[:-1], change, float(move[-1])), float(np.abs(found[: len(move) - 1]).max(initial=0.0))


def _with_border(stiffness: Matrix, column: Array, row: Array) -> Any:
    """[[K, column], [row]], sparse; the row has an entry for the column, too."""
    wide = sp.hstack([sp.csc_array(stiffness), sp.csc_array(column[:, None])])
    return sp.vstack([wide, sp.csc_array(row[None, :])], format="csc")


def unstable_ways(stiffness: Matrix, rows: Matrix, metres: Array) -> int:
    """Number of negative eigenvalues of K on the null space of B, as pivots tell them.

    Without symmetry (loads that follow) the number counts pairs of complex eigenvalues as pivots do, and its parity
    tells the sign of the determinant.
    """
    scale = sp.diags_array(1 / metres)
    own = sp.csc_array(scale @ sp.csc_array(stiffness) @ scale)
    held = sp.csc_array(rows) @ scale
    sizes = np.sqrt(np.asarray(held.multiply(held).sum(axis=1)).ravel())
    held = sp.diags_array(1 / np.where(sizes > 0, sizes, 1.0)) @ held
    whole = own + _HELD * float(abs(own.diagonal()).max(initial=1e-300)) * (held.T @ held)
    try:
        factors = splu(
            sp.csc_matrix(whole), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
        )
    except RuntimeError:
        return 0  # singular to the last digit: a critical point itself
    return int((factors.U.diagonal() < 0).sum())


def lowest_way(system: NodalSystem, at: Point, measure: Measure) -> tuple[float, Step]:
    """The eigenvalue of K on the null space of B next to zero, in units of the scaled stiffness, and the step of its
    eigenvector, of length one, by inverse iteration.
    """
    stiffness, rows = stiffness_and_rows(system, at)
    weights, none, scales = measure.metres**2, np.zeros(rows.shape[0]), Scales(measure.metres, abs(stiffness), rows)
    saddle = Saddle(stiffness, rows.T, rows, scales, 1.0)
    if saddle.singular is not None:  # exactly critical: a little beside it
        beside = stiffness + sp.diags_array(1e-14 * float(abs(stiffness).max()) * weights / weights.max())
        saddle = Saddle(beside, rows.T, rows, scales, 1.0)
    way = Step(np.sin(1.0 + np.arange(system.size)) / measure.metres, none, 0.0)  # no symmetry hides anything from it
    value = 0.0
    for _ in range(_INVERSE):
        way = measure.unit(way)
        move, change = saddle.unscaled(saddle.solve(saddle.scaled(weights * way.move, none)))
        further = float(way.move @ (weights * move)) / float(way.move @ (weights * way.move))
        before, value = value, 1 / further if further else np.inf
        way = Step(move, change, 0.0)
        if abs(value - before) <= _SETTLED * abs(value):
            break
    way = measure.unit(way)
    largest = int(np.abs(way.move * measure.metres).argmax())
    return value, way.scaled(float(np.sign(way.move[largest])))
