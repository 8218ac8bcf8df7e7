"""Closed loops over any formulation of a chain: its independent coordinates y, tied by the conditions of the loops.

    M(y) a + Φ_yᵀ λ = f(t, y, v),    Φ(t, y) = 0

The conditions hold between physical, displaced frames. Rows that follow from the others (three of a planar four-bar
in space) are found by rank at the start and left out; forces are then those of the smallest multipliers. The second
derivative of Φ keeps its errors decaying (J. Baumgarte, Comput. Methods Appl. Mech. Eng. 1 (1972) 1-16), and whoever
asks for a state gets the nearest one that closes the loops.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.linalg as la

from erls.equations.formulation import Energy, LoopForce, Reaction, State, TreeFormulation
from erls.equations.loops.efforts import ActuatedTree, LoopEfforts
from erls.equations.loops.failures import comes_apart, locks, warnings_of
from erls.equations.loops.rows import Closure, LoopRows, about, applied
from erls.equations.loops.start import Start, find_start, start_velocity
from erls.equations.loops.static import closed_equilibrium
from erls.equations.system import metre_scales
from erls.errors import Cause, SimulationError
from erls.maths.so3 import Array
from fe_import.model import IntArray

if TYPE_CHECKING:
    from erls.equations.loops.compiled import CompiledLoops

DECAY = 100.0  # 1/s, of what closing conditions are violated by
DEPENDENT = 1e-8  # metres per metre, of a row beside those before it: redundant below
OPEN = 1e-4  # of the size of the mechanism: a loop that has come apart
_SINGULAR = 1e-13  # ratio of extreme eigenvalues: nothing is left of sixteen digits
_POLISH = 4


class ClosedChain:
    """Equations of motion of a chain with loops; a `Formulation`.

    Parameters
    ----------
    tree : TreeFormulation
        Of the chain; its mechanism holds the loops.
    """

    def __init__(self, tree: TreeFormulation) -> None:
        self.bare, self.mechanism = tree, tree.mechanism
        self.rows = LoopRows(tree, tree.mechanism.loops)
        self.efforts = LoopEfforts(tree, self.rows)
        self.tree: TreeFormulation = ActuatedTree(tree, self.efforts) if self.efforts.any else tree
        self.metres = metre_scales(tree)
        self.reach = self.mechanism.reach
        self.row_metres = np.where(self.rows.turns, self.reach, 1.0)

    @property
    def size(self) -> int:
        """Number of coordinates of the chain."""
        return self.tree.size

    @property
    def length_scales(self) -> Array:
        """(n,) those of the chain."""
        return self.tree.length_scales

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Breakpoints of all drives."""
        own = (loop.freedom.drive.breakpoints for loop in self.mechanism.loops if loop.freedom is not None)
        return tuple(sorted({*self.tree.breakpoints, *(t for times in own for t in times)}))

    @cached_property
    def start(self) -> Start:
        """The undeformed chain with its loops closed."""
        return find_start(self)

    @cached_property
    def kept(self) -> IntArray:
        """(r,) rows that do not follow from others, at the start."""
        matrix = self.scaled_rows(self.closure(0.0, self.start.y, np.zeros(self.size)), np.arange(len(self.rows.names)))
        _, factor, order = la.qr(matrix.T, mode="economic", pivoting=True)
        sizes = np.abs(np.diag(factor))
        return np.sort(order[: np.count_nonzero(sizes > DEPENDENT)])

    @cached_property
    def compiled(self) -> CompiledLoops | None:
        """The same equations in compiled form; None where the tree has none, or does not move frames in it."""
        tree = self.bare.compiled if self.size else None
        if tree is None or tree.frames is None:
            return None
        from erls.equations.loops.compiled import compile_loops  # here: it imports the compiler

        return compile_loops(self, tree, (DECAY, OPEN * self.reach))

    @property
    def redundant(self) -> tuple[str, ...]:
        """Rows that follow from the others, by loop and direction."""
        return tuple(name for k, name in enumerate(self.rows.names) if k not in self.kept)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the user should know about the loops."""
        return warnings_of(self.redundant)

    def closure(self, t: float, y: Array, v: Array) -> Closure:
        """Conditions of the loops at a state."""
        return self.rows.closure(t, y, v)

    def scaled_rows(self, found: Closure, rows: IntArray) -> Array:
        """(r, n) some rows over the independent coordinates, in metres per metre."""
        return np.asarray(self.row_metres[rows, None] * found.rows[rows][:, self.tree.free] / self.metres)

    def openings(self, found: Closure) -> Array:
        """(m,) how far each condition is from holding [m]."""
        return np.asarray(self.row_metres * found.violation)

    def refuse_open(self, t: float, found: Closure) -> None:
        """Raise when a loop has come apart.

        Raises
        ------
        SimulationError
            LOOP_OPEN, naming loop and direction.
        """
        gaps = np.abs(self.openings(found))
        worst = int(np.argmax(gaps))
        if not gaps[worst] > OPEN * self.reach:
            return
        limit = OPEN * self.reach
        raise comes_apart(t, self.rows.names[worst], float(gaps[worst]), limit, worst not in self.kept)

    def accelerations(self, t: float, y: Array, v: Array, decay: float = 0.0) -> tuple[Array, Array, Closure]:
        """Accelerations (n,), multipliers of all rows (m,) and the conditions at a state.

        Raises
        ------
        SimulationError
            SINGULAR_MASS, or LOOP_OPEN where the conditions lock.
        """
        found, kept = self.closure(t, y, v), self.kept
        force = self.tree.residual(t, y, v, np.zeros(self.size))
        rows = self.scaled_rows(found, kept) * self.metres
        wanted = found.bias + 2 * decay * found.rate + decay**2 * found.violation
        try:
            factor = la.cho_factor(self.tree.mass_matrix(t, y), check_finite=False)
        except la.LinAlgError:
            self.tree.acceleration(t, y, v)  # which names the coordinate
            raise
        free, flexibility = np.split(la.cho_solve(factor, np.column_stack([-force, rows.T])), [1], axis=1)
        scaled = _solve(rows @ flexibility, rows @ free[:, 0] + (self.row_metres * wanted)[kept])
        if scaled is None:
            raise self.locked(t, self.stiffest(found))
        along = self.row_metres[:, None] * found.rows[:, self.tree.free]
        every = np.linalg.lstsq(along.T, rows.T @ scaled, rcond=DEPENDENT)[0] if len(kept) < len(along) else scaled
        return np.asarray(free[:, 0] - flexibility @ scaled), np.asarray(self.row_metres * every), found

    def stiffest(self, found: Closure) -> tuple[float, int]:
        """Smallest singular value of the conditions in use, and the loop that it belongs to."""
        left, values, _ = la.svd(self.scaled_rows(found, self.kept), full_matrices=False)
        if not len(values):
            return 1.0, 0
        return float(values[-1]), int(self.rows.owner[self.kept[np.abs(left[:, -1]).argmax()]])

    @cached_property
    def stiffest_at_start(self) -> float:
        """Smallest singular value there."""
        return self.stiffest(self.closure(0.0, self.start.y, np.zeros(self.size)))[0]

    def locked(self, t: float, stiffest: tuple[float, int]) -> SimulationError:
        """The loop cannot move on."""
        return locks(t, self.mechanism.loops[stiffest[1]].name, stiffest[0], self.stiffest_at_start)

    def acceleration(self, t: float, y: Array, v: Array) -> Array:
        """(n,) accelerations, with decay of what loops are open by; NaN where they lock: integrators step around it."""
        try:
            return self.accelerations(t, y, v, DECAY)[0]
        except SimulationError as problem:
            if problem.cause != Cause.LOOP_OPEN:
                raise
            return np.full(self.size, np.nan)

    def mass_matrix(self, t: float, y: Array) -> Array:
        """(n, n) of the chain."""
        return self.tree.mass_matrix(t, y)

    def residual(self, t: float, y: Array, v: Array, a: Array) -> Array:
        """(n,) M a - f, the forces of the loops within f."""
        return np.asarray(self.mass_matrix(t, y) @ (a - self.acceleration(t, y, v)))

    def stiffness_and_damping(self, t: float, y: Array, v: Array) -> tuple[Array, Array]:
        """Those of the chain with what the loops' forces take of them, and the decay; not symmetric."""
        stiffness, damping = self.tree.stiffness_and_damping(t, y, v)
        rows = self.scaled_rows(self.closure(t, y, v), self.kept) * self.metres
        moves = np.linalg.solve(self.mass_matrix(t, y), rows.T)
        loads = np.linalg.solve(rows @ moves, rows)  # multipliers per acceleration across the conditions
        along = np.eye(self.size) - moves @ loads
        across = rows.T @ loads
        return (
            along.T @ stiffness + DECAY**2 * across,
            along.T @ damping + 2 * DECAY * across,
        )

    def initial_state(self) -> tuple[Array, Array]:
        """(y, v) at time 0: loops closed on the undeformed chain, or in static equilibrium; rates that keep to them."""
        y = self.start.y
        if self.mechanism.static_start:
            y = closed_equilibrium(self, y, self.start.held)
        return y, start_velocity(self, y)

    def closed(self, t: float, y: Array, v: Array) -> tuple[Array, Array]:
        """The nearest state, in metres, that closes the loops; the same one where there is none nearby."""
        if self.compiled is not None:
            return self.compiled.closed(t, y, v)
        found = self.closure(t, y, v)
        y = y.copy()
        try:
            for _ in range(_POLISH):
                if np.abs(self.openings(found)[self.kept]).max(initial=0.0) <= 1e-14 * self.reach:
                    break
                y -= self._nearest(found, self.openings(found))
                found = self.closure(t, y, v)
            return y, v - self._nearest(found, self.row_metres * found.rate)
        except np.linalg.LinAlgError:
            return y, v

    def _nearest(self, found: Closure, wrong: Array) -> Array:
        """(n,) smallest change in metres that makes up for ``wrong`` (m,)."""
        rows = self.scaled_rows(found, self.kept)
        return np.asarray(rows.T @ np.linalg.solve(rows @ rows.T, wrong[self.kept]) / self.metres)

    def state(self, t: float, y: Array, v: Array) -> State:
        """Poses, modal coordinates and joint angles."""
        return self.tree.state(t, *self.closed(t, y, v))

    def energy(self, t: float, y: Array, v: Array) -> Energy:
        """Energies."""
        return self.tree.energy(t, *self.closed(t, y, v))

    def loop_forces(self, t: float, y: Array, v: Array) -> list[LoopForce]:
        """What every closing joint does to its link."""
        y, v = self.closed(t, y, v)
        a, multipliers, found = self.accelerations(t, y, v)
        wrenches = self._wrenches(t, y, a, multipliers, found)
        return [applied(outer, wrench) for outer, wrench in zip(found.outer, wrenches, strict=True)]

    def _wrenches(self, t: float, y: Array, a: Array, multipliers: Array, found: Closure) -> list[Array]:
        """(6,) what every closing joint does to its link, in the axes of the outer frame: reactions, drives, rotors."""
        result = self.rows.wrenches(found, multipliers)
        for effort in self.efforts.at(t, y, found):
            turning = float(effort.row[self.tree.free] @ a) + effort.bias
            along = self.efforts.along(effort.number)
            result[effort.number][along] += effort.force - self.efforts.rotor(effort) * turning
        return result

    def loop_motion(self, t: float, y: Array, v: Array, loop: int) -> tuple[float, float]:
        """Coordinate of a revolute or prismatic closing joint, and its rate."""
        y, v = self.closed(t, y, v)
        effort = next(e for e in self.efforts.at(t, y, self.closure(t, y, v)) if e.number == loop)
        return effort.coordinate, effort.rate

    def loop_effort(self, t: float, y: Array, v: Array, loop: int) -> float:
        """Force of drive, spring, damper and friction along it; for a prescribed motion what its motor must give."""
        y, v = self.closed(t, y, v)
        _, multipliers, found = self.accelerations(t, y, v)
        if self.mechanism.loops[loop].prescribed:
            return float(self.rows.wrenches(found, multipliers)[loop][self.efforts.along(loop)])
        return next(e.force for e in self.efforts.at(t, y, found) if e.number == loop)

    def reactions(self, t: float, y: Array, v: Array) -> list[Reaction]:
        """Reactions in the joints of the chain: what the links from there outward need beside what loops give."""
        y, v = self.closed(t, y, v)
        a, multipliers, found = self.accelerations(t, y, v)
        state, links = self.tree.state(t, y, v), self.mechanism.links
        nodes: list[Array] = []
        for link, world, modal in zip(links, state.poses, state.modal, strict=True):
            local = link.inboard.position + link.model.node_shape(link.inboard.node)[0] @ modal
            nodes.append(world[:3, :3] @ local + world[:3, 3])
        result = self.tree.reactions_at(t, y, v, a)
        wrenches = self._wrenches(t, y, a, multipliers, found)
        for loop, outer, wrench in zip(self.mechanism.loops, found.outer, wrenches, strict=True):
            given = applied(outer, wrench)
            for end, sign in ((loop.outer, 1.0), (loop.inner, -1.0)):
                for k in range(0 if end.link is None else end.link + 1):
                    force, moment = about(given, nodes[k])
                    old = result[k]
                    result[k] = replace(old, force=old.force - sign * force, moment=old.moment - sign * moment)
        loads = -np.concatenate(found.moves).T @ np.concatenate(wrenches)
        return [
            replace(r, effort=r.effort + float(loads[k])) if self.mechanism.joints[k].drive.prescribed else r
            for k, r in enumerate(result)
        ]

    def describe(self) -> dict[str, Any]:
        """Names and sizes for reports."""
        names = {loop.name: f"loop {loop.name!r}, " for loop in self.mechanism.loops}
        loops = [
            {"name": name, "redundant": [r.removeprefix(start) for r in self.redundant if r.startswith(start)]}
            for name, start in names.items()
        ]
        return {**self.tree.describe(), "loops": loops, "degrees_of_freedom": self.size - len(self.kept)}


def _solve(matrix: Array, right: Array) -> Array | None:
    """Solution of a symmetric positive definite system; None when it is singular to rounding."""
    if not len(matrix):
        return right
    scale = 1 / np.sqrt(np.diag(matrix))
    values, vectors = np.linalg.eigh(scale[:, None] * matrix * scale)
    if not values[0] > _SINGULAR * values[-1]:
        return None
    return np.asarray(scale * (vectors @ ((vectors.T @ (scale * right)) / values)))
