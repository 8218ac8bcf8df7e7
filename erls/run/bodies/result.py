"""What a scene of bodies gives: places of its nodes and forces in its connections, over time or load."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from erls.equations.nodal.redundant import smallest_multipliers
from erls.equations.nodal.scenes.build import Assembly
from erls.equations.nodal.statics import Statics
from erls.errors import Cause, SceneError, SimulationError
from erls.integrate.base import hermite
from erls.integrate.constrained import ConstrainedSolution
from erls.maths import motion_maps as motions
from erls.maths.so3 import Array
from erls.scene.bodies.schema import BodyScene
from fe_import.files.toml import choose

_MOST_ENERGIES = 2001


@dataclass(frozen=True)
class Result:
    """What all analyses share.

    Attributes
    ----------
    scene : BodyScene
    assembly : Assembly
    wall_s : float
    warnings : tuple of str
    """

    scene: BodyScene
    assembly: Assembly
    wall_s: float
    warnings: tuple[str, ...]

    def facts(self) -> dict[str, Any]:
        """Names and sizes."""
        system = self.assembly.system
        return {
            "scene": self.scene.name,
            "analysis": type(self.scene.record.simulation).__struct_config__.tag,
            "group": "SE(3)" if system.local else "R3xSO(3)",
            "bodies": len(self.scene.record.bodies),
            "elements": self.assembly.elements,
            "nodes": system.count,
            "velocities": system.size,
            "conditions": system.constraints,
        }

    def sample(self, t: float, poses: Array, multipliers: Array) -> dict[str, Any]:
        """Places [m] of the reported nodes, and what each connection does to its node there, in the world's axes."""
        places = {name: poses[self.assembly.numbers[name], :3, 3].tolist() for name in self.assembly.reported}
        forces = connection_forces(self.assembly, t, poses, multipliers)
        connections = {name: {"force": f.tolist(), "moment": m.tolist()} for name, (f, m) in forces.items()}
        return {"t": float(t), "points": places, "connections": connections}


@dataclass(frozen=True)
class Motion(Result):
    """A motion with dense output.

    Attributes
    ----------
    solution : ConstrainedSolution
        Places and rotation matrices of the nodes at the knots, multipliers of the connections.
    """

    solution: ConstrainedSolution

    @property
    def failure(self) -> SimulationError | None:
        """Why the run ended early."""
        return self.solution.failure

    @property
    def end(self) -> float:
        """Last time that was computed [s]."""
        return float(self.solution.t[-1])

    def position(self, name: str, t: ArrayLike) -> Array:
        """(..., 3) place of a node or body [m]."""
        choose(name, self.assembly.numbers, "node", SceneError)
        poses = self._poses(np.ravel(np.asarray(t, dtype=float)))
        result: Array = poses[:, self.assembly.numbers[name], :3, 3].reshape(*np.shape(t), 3)
        return result

    def some_poses(self, count: int = 21) -> tuple[list[float], Array]:
        """Even times, and poses (count, nodes, 4, 4) there."""
        times = np.linspace(float(self.solution.t[0]), self.end, count)
        return times.tolist(), self._poses(times)

    def samples(self, times: Sequence[float]) -> list[dict[str, Any]]:
        """Nodes and connections at given times."""
        at, s = np.asarray(times, dtype=float), self.solution
        multipliers = np.empty((len(at), s.multipliers.shape[1]))
        for k, values in enumerate(s.multipliers.T):
            multipliers[:, k] = np.interp(at, s.t, values)
        return [self.sample(t, p, m) for t, p, m in zip(at.tolist(), self._poses(at), multipliers, strict=True)]

    def energies(self) -> tuple[Array, Array]:
        """Times (k,) of knots, and total energy (k,) there [J]."""
        s, system = self.solution, self.assembly.system
        pick = np.unique(np.linspace(0, len(s.t) - 1, min(len(s.t), _MOST_ENERGIES)).astype(np.int64))
        poses, twists = frames_and_twists(s.y[pick], s.v[pick], system.count)
        if not system.local:
            twists[..., :3] = (poses[..., :3, :3] @ twists[..., :3, None])[..., 0]
        q, totals = system.start, []
        for t, pose, twist in zip(s.t[pick], poses, twists, strict=True):
            q = system.at(pose, q)
            totals.append(sum(system.energy(float(t), q, twist.ravel())))
        return s.t[pick], np.array(totals)

    @property
    def conservative(self) -> bool:
        """Whether total energy should stay constant."""
        record = self.scene.record
        damped = any(s.damping for s in record.springs)
        return not record.loads and not damped and all(c.motion is None for c in record.connections)

    def summary(self, times: Sequence[float] = ()) -> dict[str, Any]:
        """The JSON of ``erls simulate``."""
        _, totals = self.energies()
        work = self.solution.work
        return {
            **self.facts(),
            "integrator": "lie_generalized_alpha",
            "duration": self.end,
            "steps": work.steps,
            "rhs_calls": work.rhs_calls,
            "newton_iterations": work.newton_iterations,
            "iterations_per_step": work.newton_iterations / max(work.steps, 1),
            "factorizations": work.factorizations,
            "wall_s": self.wall_s,
            "energy": {
                "initial": float(totals[0]),
                "final": float(totals[-1]),
                "max_drift": float(np.ptp(totals)) if self.conservative else None,
            },
            "samples": self.samples(times),
            "warnings": list(self.warnings),
        }

    def _poses(self, times: Array) -> Array:
        """(k, nodes, 4, 4)"""
        s = self.solution
        hair = 1e-9 * max(self.end, 1e-300)
        bad = ~((times >= s.t[0] - hair) & (times <= self.end + hair))
        if bad.any():
            raise SceneError(
                Cause.TIME_OUT_OF_RANGE,
                "the run does not cover this time",
                where="t",
                value=float(times[bad][0]),
                limit=f"{s.t[0]:.6g} to {self.end:.6g} s",
                remedy="ask within the run, or simulate longer",
            )
        y, v = hermite(s.t, s.y, s.v, s.a, np.clip(times, s.t[0], self.end))
        return frames_and_twists(y, v, self.assembly.system.count)[0]


@dataclass(frozen=True)
class Rest(Result):
    """Equilibria at rising load, and what was found about the last one.

    Attributes
    ----------
    statics : Statics
    modes : tuple of dict
        Of a buckling or frequency analysis: ``load`` or ``frequency_hz``, and ``points``, how reported nodes move.
    tangents : dict
        Work of each tangent, if asked for.
    """

    statics: Statics
    modes: tuple[dict[str, Any], ...] = ()
    tangents: dict[str, dict[str, Any]] = field(default_factory=dict)

    @property
    def failure(self) -> SimulationError | None:
        """Why there are no more equilibria."""
        return self.statics.failure

    def position(self, name: str, step: int = -1) -> Array:
        """(3,) place of a node or body after a load step [m]."""
        choose(name, self.assembly.numbers, "node", SceneError)
        result: Array = self.statics.path[step].q.poses[self.assembly.numbers[name], :3, 3]
        return result

    def summary(self) -> dict[str, Any]:
        """The JSON of ``erls simulate``; ``t`` is the load parameter."""
        path = self.statics.path
        samples = [{**self.sample(e.t, e.q.poses, e.multipliers), "iterations": e.iterations} for e in path]
        tangent = self.scene.record.simulation.tangent  # type: ignore[union-attr]
        found = {**self.facts(), "tangent": tangent, **work(self.statics), "wall_s": self.wall_s}
        if self.tangents:
            found["tangents"] = self.tangents
        if self.modes:
            found["modes"] = list(self.modes)
        return {**found, "samples": samples, "warnings": list(self.warnings)}


def work(statics: Statics) -> dict[str, Any]:
    """What equilibria took."""
    iterations = [e.iterations for e in statics.path]
    return {
        "load_steps": len(iterations),
        "iterations": sum(iterations),
        "iterations_per_load_step": iterations,
        "factorizations": statics.factorizations,
        "cut_steps": statics.cut_steps,
        "converged": statics.failure is None,
    }


def frames_and_twists(y: Array, v: Array, nodes: int) -> tuple[Array, Array]:
    """Poses (k, nodes, 4, 4) and twists (k, nodes, 6) in node axes, from stored knots (k, 12 nodes) and their rates;
    rotations made orthogonal."""
    place, rate = (x[:, : 12 * nodes].reshape(len(x), nodes, 12) for x in (y, v))
    left, _, right = np.linalg.svd(place[..., 3:].reshape(len(y), nodes, 3, 3))
    turn = left @ right
    back = np.swapaxes(turn, -1, -2)
    spin = back @ rate[..., 3:].reshape(len(y), nodes, 3, 3)
    twist = np.empty((len(y), nodes, 6))
    twist[..., :3] = (back @ rate[..., :3, None])[..., 0]
    twist[..., 3:] = (spin - np.swapaxes(spin, -1, -2))[..., [2, 0, 1], [1, 2, 0]] / 2
    return motions.poses(turn, place[..., :3]), twist


def connection_forces(assembly: Assembly, t: float, poses: Array, multipliers: Array) -> dict[str, tuple[Array, Array]]:
    """Force [N] and moment [N m] of each connection on its node, at the node, in the world's axes; the smallest where
    connections are redundant.
    """
    system, q = assembly.full, replace(assembly.full.start, poses=poses)
    if assembly.left_out:
        force = np.asarray(assembly.system.constraint_matrix(t, q).T @ multipliers).ravel()
        multipliers = smallest_multipliers(system, t, q, force)
    rows = system.constraint_matrix(t, q)
    found = {}
    for k, joint in enumerate(system.rows.joints):
        own = np.flatnonzero(system.rows.joint_of_row == k)
        block = rows[own][:, 6 * joint.outer : 6 * joint.outer + 6]
        wrench = -np.asarray(block.T @ multipliers[own]).ravel()
        turn = poses[joint.outer, :3, :3]
        found[joint.name] = (turn @ wrench[:3] if system.local else wrench[:3], turn @ wrench[3:])
    return found
