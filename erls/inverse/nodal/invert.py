"""An inversion on nodal elements, from one in modes: a forward run with the drives of modes is the first guess."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from msgspec.structs import replace as changed

from erls.equations.nodal.equations import Nodal
from erls.equations.nodal.nodes import Nodes
from erls.equations.registry import formulate
from erls.errors import Cause, SceneError
from erls.integrate.base import Options
from erls.integrate.nodal_chain import nodal_generalized_alpha
from erls.inverse.inversion import Inversion
from erls.inverse.nodal.servoed import NodalServoed
from erls.inverse.nodal.two_point import NodalStates, solved
from erls.inverse.problem import Problem, refuse_many, with_drives
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.curves import spline
from erls.mechanism.drives import Drive
from erls.scene.chain import Scene

_STILL = 1e-9  # of what is demanded moves at most: it rests


@dataclass(frozen=True, kw_only=True)
class NodalInversion(Inversion):
    """Drives by which nodal elements move as demanded; ``states`` and ``nature`` are those of modes.

    Attributes
    ----------
    nodal : Nodal
    found : NodalStates
        At the knots.
    """

    nodal: Nodal
    found: NodalStates

    @property
    def efforts(self) -> dict[str, Array]:
        """(k,) each, by joint [N m or N]."""
        drives = self.problem.drives
        return dict(zip(drives, self.found.holding[:, -len(drives) :].T, strict=True))

    @property
    def start(self) -> dict[str, float]:
        """Joint coordinates at the start, of joints whose motion is not prescribed."""
        return {name: float(self.angles[name][0]) for name in super().start}

    @cached_property
    def angles(self) -> dict[str, Array]:
        """(k,) joint coordinates by name [rad or m]."""
        joints = self.nodal.mechanism.joints
        found = np.array([q.turned[: len(joints)] for q in self.found.q]).T
        return {joint.name: x for joint, x in zip(joints, found, strict=True) if not joint.fixed}

    @cached_property
    def deflection(self) -> Array:
        """(k,) largest displacement of a node against the axes of the inboard node of its link [m]."""
        built, poses = self.nodal.system.start.poses, np.array([q.poses for q in self.found.q])
        largest = np.zeros(len(poses))
        for number, (link, own) in enumerate(zip(self.nodal.mechanism.links, self.nodal.chain.nodes, strict=True)):
            root = self.nodal.place_of(number, link.inboard.node)
            moved = _seen(poses[:, root], poses[:, own]) - _seen(built[None, root], built[None, own])
            largest = np.maximum(largest, np.linalg.norm(moved, axis=2).max(axis=1))
        return largest


def _seen(root: Array, poses: Array) -> Array:
    """(k, n, 3) places of nodes in the axes of one of them."""
    return np.asarray((poses[..., :3, 3] - root[:, None, :3, 3]) @ root[:, :3, :3])


def on_nodes(
    modal: Inversion, scene: Scene, progress: Callable[[int, float], None] = lambda iteration, change: None
) -> NodalInversion:
    """Go on from an inversion in modes.

    Parameters
    ----------
    modal : Inversion
    scene : Scene
        Of nodal elements.

    Raises
    ------
    SceneError
        BAD_FIELD: more steps than there is memory for, or what is demanded moves at an end.
    SimulationError
        NEWTON_FAILED; what the forward run raises.
    """
    begun, problem = time.perf_counter(), modal.problem
    _refuse_moving(problem)
    settings = scene.record.simulation
    given = problem.scene.record
    problem = replace(problem, scene=Scene(scene.path, changed(given, simulation=settings)))
    drives = np.array([k for k, j in enumerate(problem.mechanism.joints) if j.name in problem.drives], dtype=np.int64)
    placed = _placed(modal, problem.mechanism)
    nodal = _nodes(with_drives(placed, {k: Drive() for k in drives.tolist()}), scene)
    servoed = NodalServoed(nodal, problem.conditions, drives)
    refuse_many(scene, len(problem.t), servoed.size, "fewer elements (elements_per_member)")
    efforts = np.array(list(modal.efforts.values())).T
    loads = (spline(problem.t, effort) for effort in efforts.T)
    driven = with_drives(placed, {k: Drive("torque", load=x) for k, x in zip(drives.tolist(), loads, strict=True)})
    bent = bool(placed.gravity.any() or placed.loads)
    q, multipliers = _run(nodal, _nodes(replace(driven, static_start=bent), scene), problem)
    holding = np.hstack([multipliers, efforts])
    demand = problem.conditions.demand(problem.t)
    found = solved(servoed, demand, problem.step, q, holding, progress)
    known = {f: getattr(modal, f) for f in ("nature", "states", "rigid", "warnings")}
    spent = modal.wall_s + time.perf_counter() - begun
    return NodalInversion(
        problem=problem, method="collocation", iterations=found.iterations, left=0.0, wall_s=spent, **known,
        nodal=nodal, found=found,
    )  # fmt: skip


def _refuse_moving(problem: Problem) -> None:
    """Ends are places of rest."""
    demand = problem.conditions.demand(problem.t[[0, -1]])
    joints = problem.flexible.joints(problem.t[[0, -1]], *np.zeros((2, 2, problem.flexible.tree.size)))
    if max(float(np.abs(x).max(initial=0.0)) for x in (demand.rate, demand.acceleration, *joints[1:3])) > _STILL:
        raise SceneError(
            Cause.BAD_FIELD,
            "what is demanded or prescribed moves at an end of the run, where nodal elements must rest",
            where=f"{problem.scene.path}: servo",
            remedy="start motions later, end them earlier, or invert in modes (simulation.formulation = 'erls')",
        )


def _placed(modal: Inversion, mechanism: Mechanism) -> Mechanism:
    """At rest where the inversion starts."""
    start = modal.start
    joints = (replace(j, position=start.get(j.name, j.position), rate=0.0) for j in mechanism.joints)
    return replace(mechanism, joints=tuple(joints))


def _nodes(mechanism: Mechanism, scene: Scene) -> Nodal:
    nodal = formulate(mechanism, scene.record.simulation)
    assert isinstance(nodal, Nodal)
    return nodal


def _run(nodal: Nodal, driven: Nodal, problem: Problem) -> tuple[list[Nodes], Array]:
    """Configurations and multipliers (k, m) at the knots of a forward run with the drives of modes."""
    options = Options(step=problem.step, spectral_radius=problem.scene.record.simulation.spectral_radius)
    ran = nodal_generalized_alpha(driven, (0.0, float(problem.t[-1])), *driven.initial_state(), options)
    if ran.failure is not None:
        raise ran.failure
    at = np.searchsorted(ran.t, problem.t - problem.step / 4)
    q = [nodal.configuration(*stored)[0] for stored in zip(ran.y[at], ran.v[at], strict=True)]
    return q, np.array([nodal.multipliers(y) for y in ran.y[at]])
