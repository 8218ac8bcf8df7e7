"""Static equilibrium of nodal systems: load steps, Newton's method under trust control, three tangents.

At a load parameter t, which loads and prescribed motions read as the time, forces balance: g(t, q) + Bᵀ λ = 0, Φ = 0.
A load step that does not converge is halved. The tangent is

- ``full``: the exact derivative, under trust control. Beams that turn far in one correction stretch as well, and the
  forces of that stretch would spoil the next derivative by their change of direction. Where the next correction with
  the same matrix would not be half as long (the natural monotonicity test of P. Deuflhard, Newton Methods for
  Nonlinear Problems, 2004, sec. 3.3), one with the material tangent takes the stretch out; the last ones are Newton's;
- ``material``: without the change of the directions of internal forces. It converges linearly, from farther away;
- ``frozen``: the material tangent at the start of each load step, factored once for it. Slender beams in coarse meshes
  need many small load steps.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from erls.equations.nodal.assembly import NodalSystem
from erls.equations.nodal.nodes import Nodes
from erls.equations.nodal.shell_turns import widest_turn
from erls.equations.system import metre_scales
from erls.errors import Cause, SceneError, SimulationError
from erls.maths.saddle import Saddle, Scales
from erls.maths.so3 import Array
from erls.scene.bodies.analyses import TANGENTS

MAX_ITERATIONS = 60
SHRINK = 0.5  # of a correction: what the next one may be for the exact tangent to be trusted
SHARES = (1.0, 0.5, 0.25, 0.125)  # of a correction, in a line search
SMALLEST_STEP = 1e-4  # of the load parameter
WIDE = np.radians(175.0)  # a turn from corner to corner of a shell that explains why nothing is found beyond


@dataclass(frozen=True)
class Equilibrium:
    """One configuration at rest: load parameter, multipliers (m,) of the joints, iterations since the one before.

    Of a path that `erls.equations.nodal.path` followed, also its length up to here, and the number of ways in which
    the equilibrium is unstable.
    """

    t: float
    q: Nodes
    multipliers: Array
    iterations: int
    arc: float = 0.0
    unstable: int = 0


@dataclass(frozen=True)
class Turn:
    """Where a path changes its stability: a ``limit`` of the load parameter or a ``bifurcation``, how far along the
    path, and in how many ways at once.
    """

    kind: str
    t: float
    arc: float
    ways: int


@dataclass(frozen=True)
class Statics:
    """Equilibria in the order of load parameters, what they took, and why there are no more; ``cut_steps`` counts load
    steps that had to be halved, ``turns`` are those of a path.
    """

    path: tuple[Equilibrium, ...]
    factorizations: int
    cut_steps: int
    failure: SimulationError | None = None
    turns: tuple[Turn, ...] = ()


def solve_statics(
    system: NodalSystem,
    start: Nodes,
    steps: int = 1,
    tangent: str = "full",
    tolerance: float = 1e-12,
    end: float = 1.0,
    line_search: bool = False,
) -> Statics:
    """Equilibria at load parameters from ``end / steps`` to ``end`` in equal steps.

    Parameters
    ----------
    system : NodalSystem
        On SE(3); the tangent is that of its elements.
    start : Nodes
        Where iteration starts.
    steps : int
        Load steps.
    tangent : str
        A member of `TANGENTS`.
    tolerance : float
        Last correction, of the size of the mechanism.
    end : float
        Last load parameter; 0 for the equilibrium without loads that grow.
    line_search : bool
        Shorten corrections until the next one with the same matrix is shorter, too.

    Returns
    -------
    Statics
        With ``failure`` of cause NO_EQUILIBRIUM where even small load steps fail; what was found is kept.

    Raises
    ------
    SceneError
        With cause BAD_FIELD when there is no such tangent.
    """
    if tangent not in TANGENTS:
        remedy = f"must be one of {', '.join(TANGENTS)}"
        raise SceneError(Cause.BAD_FIELD, "there is no such tangent", where="tangent", value=tangent, remedy=remedy)
    solver = LoadSteps(system, tangent, tolerance, line_search)
    at, q, multipliers = 0.0, start, np.zeros(system.constraints)
    found: list[Equilibrium] = []
    step, used = end / steps, 0
    failure = None
    if end == 0:
        result = solver.balance(0.0, q, multipliers)
        if result is not None:
            return Statics((Equilibrium(0.0, *result, solver.iterations),), solver.factorizations, solver.cuts)
        failure = solver.failure(0.0)
    while failure is None and at < end * (1 - 1e-12):
        target = min(at + step, end)
        with np.errstate(over="ignore", invalid="ignore"):  # of a step too far, which is found and cut
            result = solver.balance(target, q, multipliers)
        used += solver.iterations
        if result is None:
            step, solver.cuts = step / 2, solver.cuts + 1
            if step < SMALLEST_STEP * end:
                failure = solver.failure(target)
                break
            continue
        q, multipliers = result
        at = target
        if abs(at * steps / end - round(at * steps / end)) < 1e-9:
            found.append(Equilibrium(at, q, multipliers, used))
            step, used = end / steps, 0
        else:
            step = min(step, (np.floor(at * steps / end + 1e-9) + 1) * end / steps - at)
    return Statics(tuple(found), solver.factorizations, solver.cuts, failure)


def imbalance(system: NodalSystem, t: float, q: Nodes, multipliers: Array) -> tuple[Array, Array]:
    """Forces (n,) and joints (m,) out of balance."""
    rest = np.zeros(system.size)
    forces = system.residual(t, q, rest, rest)
    return forces + system.constraint_matrix(t, q).T @ multipliers, system.constraint(t, q)


class LoadSteps:
    """Newton's method at one load parameter after another.

    Parameters
    ----------
    system, tangent, tolerance, line_search
        As of `solve_statics`.
    """

    def __init__(self, system: NodalSystem, tangent: str, tolerance: float, line_search: bool = False) -> None:
        self.line_search = line_search
        self.system, self.tangent, self.metres = system, tangent, metre_scales(system)
        extent = float(np.linalg.norm(np.ptp(system.start.poses[:, :3, 3], axis=0)))
        levers = self.metres.reshape(-1, 6)[:, 3:]
        self.goal = tolerance * (extent or float(levers.max(initial=1e-300)))  # one node alone has no extent
        self.rest = np.zeros(system.size)
        self.iterations = self.factorizations = self.cuts = 0
        self.size = 0.0
        self.reached = system.start

    def balance(self, t: float, q: Nodes, multipliers: Array) -> tuple[Nodes, Array] | None:
        """Equilibrium at ``t``, or None."""
        saddle: Saddle | None = None
        self.iterations = 0
        exact = self.tangent == "full"
        right = imbalance(self.system, t, q, multipliers)
        while self.iterations < MAX_ITERATIONS:
            if saddle is None or self.tangent != "frozen":
                saddle = self.factor(t, q, multipliers, exact)
            if saddle.singular is not None:
                return None
            self.iterations += 1
            correction = saddle.solve(saddle.scaled(*right))
            self.size = float(np.linalg.norm(correction))
            if not np.isfinite(self.size):
                return None
            move, change = saddle.unscaled(correction)
            small = float(np.abs(correction[: self.system.size]).max(initial=0.0)) <= self.goal
            for share in SHARES if self.line_search and not small else SHARES[:1]:
                ahead = self.system.compose(q, -share * move), multipliers - share * change
                right = imbalance(self.system, t, *ahead)
                if small or (self.tangent != "full" and not self.line_search):
                    break
                left = float(np.linalg.norm(saddle.solve(saddle.scaled(*right)))) / self.size
                if left <= 1 - share / 4:
                    break
            q, multipliers = ahead
            if small:
                self.reached = q
                return q, multipliers
            if self.tangent == "full":  # and a correction that was not small: ``left`` is its own
                exact = left <= (SHRINK if exact and share == 1.0 else 1.0)
        return None

    def factor(self, t: float, q: Nodes, multipliers: Array, exact: bool) -> Saddle:
        """The exact or the material tangent, in metres and units of its own stiffness."""
        stiffness, _ = self.system.stiffness_and_damping(t, q, self.rest, self.rest, multipliers, material=not exact)
        rows = self.system.constraint_matrix(t, q)
        self.factorizations += 1
        return Saddle(stiffness, rows.T, rows, Scales(self.metres, abs(stiffness), rows), 1.0)

    def failure(self, t: float) -> SimulationError:
        """Small load steps failed too."""
        return turned_too_far(self.system, self.reached, t) or SimulationError(
            Cause.NO_EQUILIBRIUM,
            f"no equilibrium beyond load parameter {t:.4g}: corrections of {self.size:.3g} m do not shrink",
            where=f"load parameter {t:.9g}",
            value=f"step {SMALLEST_STEP:g}",
            limit=f"{MAX_ITERATIONS} iterations",
            remedy="check the supports; look for buckling there; or let the motion be computed in time",
        )


def turned_too_far(system: NodalSystem, q: Nodes, t: float) -> SimulationError | None:
    """Why nothing is found beyond a configuration whose shells have turned as far as they can; None otherwise."""
    shells = system.kinds.shells
    angle, element = widest_turn(shells, q.poses)
    if angle < WIDE:
        return None
    middle = system.start.poses[shells.corners[element], :3, 3].mean(axis=0)
    return SimulationError(
        Cause.NO_EQUILIBRIUM,
        "an element of a shell turns by half a circle from one of its corners to the next, and follows no farther",
        where=f"load parameter {t:.9g}, the element built about {np.round(middle, 6).tolist()}",
        value=f"{np.degrees(angle):.2f} deg",
        limit="180 deg",
        remedy="more elements there, so that each turns less",
    )
