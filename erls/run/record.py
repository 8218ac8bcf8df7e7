"""A run: the computed motion and the questions that can be asked of it, at any time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from erls.equations.formulation import Energy, Formulation, State
from erls.equations.loops.closed_chain import ClosedChain
from erls.equations.serial.state_series import StateSeries, state_series
from erls.equations.substructures import solved
from erls.errors import Cause, SceneError, SimulationError
from erls.integrate.base import Solution, hermite
from erls.maths.so3 import Array
from erls.mechanism.effects import Certificate, conserves_energy, in_order
from erls.mechanism.joints import Joint
from erls.mechanism.loops import LoopFreedom
from erls.run.events import Happening, happenings
from erls.scene.chain import Scene
from fe_import.files.toml import choose


@dataclass(frozen=True)
class Run:
    """A motion with dense output; times are scalars or arrays [s], results have their shape in front.

    Attributes
    ----------
    scene : Scene
    formulation : Formulation
        The equations of motion, with the mechanism.
    solution : Solution
        Knots of the motion and the work done.
    wall_s : float
        Time that the integration took.
    warnings : tuple of str
        What the user should know before trusting the run.
    certificate : Certificate or None
        Of a run with ``effects = "auto"``.
    second_order_error : float or None
        Estimate of `erls.run.watches.deflection_range`, of all links [m]; None where it was not made.

    Examples
    --------
    >>> import erls
    >>> scene = erls.load_scene("data/l_shape/steel_tall.toml", ["simulation.duration=0.01"])
    >>> run = erls.simulate(scene)
    >>> run.position("tip", 0.0).tolist()
    [0.5, 0.5, 0.0]
    >>> run.position("tip", [0.0, 0.005, 0.01]).shape
    (3, 3)
    >>> bool(run.joint_angle("shoulder", 0.01) > 0)
    True
    >>> run.elastic_coordinates("l", 0.01).shape
    (18,)
    >>> force, moment = run.reaction("shoulder", 0.0)
    >>> force.shape, moment.shape
    ((3,), (3,))
    """

    scene: Scene
    formulation: Formulation
    solution: Solution
    wall_s: float = 0.0
    warnings: tuple[str, ...] = field(default=())
    certificate: Certificate | None = None
    second_order_error: float | None = None

    @property
    def failure(self) -> SimulationError | None:
        """Why the run ended early; None for a complete one."""
        return self.solution.failure

    @property
    def end(self) -> float:
        """Last time that was computed [s]."""
        return float(self.solution.t[-1])

    @cached_property
    def times(self) -> Array:
        """(k,) times of the integrator's steps, or of the states that ``output_step`` keeps, each once."""
        return np.unique(self.solution.t)

    @cached_property
    def events(self) -> tuple[Happening, ...]:
        """Events of the scene that happened, in the order of time."""
        return happenings(self)

    def looks(self, count: int, margin: float = 0.0) -> Array:
        """(k,) times, up to ``count``, to look along the run at, ``margin`` [s] away from its ends: even ones; or,
        where ``output_step`` left out steps, those of the stored states nearest to them.
        """
        t = self.solution.t
        times = np.linspace(float(t[0]) + margin, self.end - margin, count)
        if self.scene.record.simulation.output_step is None:
            return times
        stored = np.unique(t[(t >= times[0]) & (t <= times[-1])])
        if not len(stored):
            return times
        return np.asarray(np.unique(stored[np.searchsorted((stored[1:] + stored[:-1]) / 2, times)]))

    @property
    def point_names(self) -> tuple[str, ...]:
        """Named points of the scene."""
        return tuple(p.name for p in self.formulation.mechanism.points)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Joints, from the ground outward."""
        return tuple(j.name for j in self.formulation.mechanism.joints)

    @property
    def link_names(self) -> tuple[str, ...]:
        """Links, from the ground outward."""
        return tuple(link.name for link in self.formulation.mechanism.links)

    def _interpolated(self, t: ArrayLike) -> tuple[tuple[int, ...], Array, Array, Array]:
        """Shape of ``t``; flat times, y and v."""
        times = np.asarray(t, dtype=float)
        flat = times.ravel()
        hair = 1e-9 * max(self.end, 1e-300)
        bad = ~((flat >= self.solution.t[0] - hair) & (flat <= self.end + hair))
        if bad.any():
            raise SceneError(
                Cause.TIME_OUT_OF_RANGE,
                "the run does not cover this time",
                where="t",
                value=float(flat[bad][0]),
                limit=f"{self.solution.t[0]:.6g} to {self.end:.6g} s",
                remedy="ask within the run, or simulate longer",
            )
        s = self.solution
        y, v = hermite(s.t, s.y, s.v, s.a, np.clip(flat, s.t[0], self.end))
        return times.shape, flat, y, v

    def states(self, t: ArrayLike) -> list[State]:
        """The mechanism at each time."""
        return self.series(t).states()

    def series(self, t: ArrayLike) -> StateSeries:
        """The same as arrays, of all times together."""
        _, flat, y, v = self._interpolated(t)
        return state_series(self.formulation, flat, y, v)

    def position(self, point: str, t: ArrayLike) -> Array:
        """(..., 3) world position of a named point [m]."""
        choose(point, self.point_names, "point", SceneError)
        number = self.point_names.index(point)
        shape = np.shape(t)
        return np.array([self.point_position(s, number) for s in self.states(t)]).reshape(*shape, 3)

    def point_position(self, state: State, number: int) -> Array:
        """(3,) world position of point ``number`` in a state."""
        point = self.formulation.mechanism.points[number]
        return np.asarray(node_positions(self, state, point.link, np.array([point.node]))[0])

    def joint_angle(self, joint: str, t: ArrayLike) -> Array:
        """(...) physical joint angle, what an encoder reads [rad or m]."""
        return self._of_joint(joint, t, "angles")

    def joint_coordinate(self, joint: str, t: ArrayLike) -> Array:
        """(...) coordinate θ of the Equivalent Rigid Link System [rad or m]; gauge-dependent."""
        return self._of_joint(joint, t, "coordinates")

    def joint_rate(self, joint: str, t: ArrayLike) -> Array:
        """(...) rate of the physical joint angle [rad/s or m/s]."""
        return self._of_joint(joint, t, "rates")

    def _of_joint(self, joint: str, t: ArrayLike, what: str) -> Array:
        choose(joint, self.joint_names, "joint", SceneError)
        number = self.joint_names.index(joint)
        return np.array([getattr(s, what)[number] for s in self.states(t)]).reshape(np.shape(t))

    def elastic_coordinates(self, link: str, t: ArrayLike) -> Array:
        """(..., n) elastic modal coordinates of a link [m √kg]."""
        return np.asarray(self.modal_coordinates(link, t)[..., 6:])

    def modal_coordinates(self, link: str, t: ArrayLike) -> Array:
        """(..., 6 + n) modal coordinates of a link, rigid-body ones first [m √kg]."""
        choose(link, self.link_names, "link", SceneError)
        number = self.link_names.index(link)
        modes = self.formulation.mechanism.links[number].model.modes
        return np.array([s.modal[number] for s in self.states(t)]).reshape(*np.shape(t), modes)

    def energy(self, t: ArrayLike) -> Energy:
        """Kinetic, elastic, gravity and spring energy [J], each of the shape of ``t``."""
        shape, flat, y, v = self._interpolated(t)
        found = [self.formulation.energy(*at) for at in zip(flat.tolist(), y, v, strict=True)]
        kinds = ("kinetic", "elastic", "gravity", "springs")
        return Energy(*(np.array([getattr(e, kind) for e in found]).reshape(shape) for kind in kinds))  # type: ignore[arg-type]

    def reaction(self, joint: str, t: ArrayLike) -> tuple[Array, Array]:
        """(..., 3) force [N] and (..., 3) moment [N m] on the joint's outer link, at its displaced interface node,
        world axes.
        """
        found = self._reactions(joint, t)
        shape = (*np.shape(t), 3)
        return np.array([r.force for r in found]).reshape(shape), np.array([r.moment for r in found]).reshape(
            shape
        )

    def joint_effort(self, joint: str, t: ArrayLike) -> Array:
        """(...) torque [N m] or force [N] of drive, spring, damper and friction; for a prescribed motion, what its
        motor must give.
        """
        return np.array([r.effort for r in self._reactions(joint, t)]).reshape(np.shape(t))

    def _reactions(self, joint: str, t: ArrayLike) -> list[Any]:
        choose(joint, self.joint_names, "joint", SceneError)
        number = self.joint_names.index(joint)
        _, flat, y, v = self._interpolated(t)
        return [self.formulation.reactions(*at)[number] for at in zip(flat.tolist(), y, v, strict=True)]

    @property
    def loop_names(self) -> tuple[str, ...]:
        """Closing joints."""
        return tuple(loop.name for loop in self.formulation.mechanism.loops)

    def loop_reaction(self, loop: str, t: ArrayLike) -> tuple[Array, Array]:
        """(..., 3) force [N] and (..., 3) moment [N m] of a closing joint on its ``link``, at its displaced node, world
        axes.
        """
        choose(loop, self.loop_names, "loop", SceneError)
        number = self.loop_names.index(loop)
        _, flat, y, v = self._interpolated(t)
        chain = solved(self.formulation)
        assert isinstance(chain, ClosedChain)
        found = [chain.loop_forces(*at)[number] for at in zip(flat.tolist(), y, v, strict=True)]
        shape = (*np.shape(t), 3)
        return np.array([f.force for f in found]).reshape(shape), np.array([f.moment for f in found]).reshape(shape)

    def loop_coordinate(self, loop: str, t: ArrayLike) -> Array:
        """(...) coordinate of a revolute or prismatic closing joint [rad or m]."""
        return self._of_loop(loop, t, lambda chain, *at: chain.loop_motion(*at)[0])

    def loop_rate(self, loop: str, t: ArrayLike) -> Array:
        """(...) its rate [rad/s or m/s]."""
        return self._of_loop(loop, t, lambda chain, *at: chain.loop_motion(*at)[1])

    def loop_effort(self, loop: str, t: ArrayLike) -> Array:
        """(...) torque [N m] or force [N] of drive, spring, damper and friction along it; for a prescribed motion, what
        its motor must give.
        """
        return self._of_loop(loop, t, lambda chain, *at: chain.loop_effort(*at))

    def _of_loop(self, loop: str, t: ArrayLike, what: Callable[..., float]) -> Array:
        names = [x.name for x in self.formulation.mechanism.loops if x.freedom is not None]
        choose(loop, names, "loop", SceneError)
        number, chain = self.loop_names.index(loop), solved(self.formulation)
        _, flat, y, v = self._interpolated(t)
        found = [what(chain, *at, number) for at in zip(flat.tolist(), y, v, strict=True)]
        return np.array(found).reshape(np.shape(t))

    @property
    def conservative(self) -> bool:
        """Whether total energy should stay constant: no drives, damping or friction."""
        mechanism = self.formulation.mechanism
        joints: list[Joint | LoopFreedom] = [*mechanism.joints]
        joints += [x.freedom for x in mechanism.loops if x.freedom is not None]
        passive = all(j.drive.kind == "free" and not j.forces.damping and not j.forces.friction for j in joints)
        damped = any(link.damping.any() for link in mechanism.links)
        return passive and not damped and conserves_energy(mechanism.effects)

    def samples(self, times: Sequence[float]) -> list[dict[str, Any]]:
        """Joints and points at given times, as in the JSON of ``erls simulate``."""
        result = []
        for t, s in zip(times, self.states(times), strict=True):
            joints = {
                name: {"coordinate": float(s.coordinates[k]), "angle": float(s.angles[k])}
                for k, name in enumerate(self.joint_names)
            }
            points = {name: self.point_position(s, k).tolist() for k, name in enumerate(self.point_names)}
            result.append({"t": float(t), "joints": joints, "points": points})
        return result

    def summary(self, times: Sequence[float] = ()) -> dict[str, Any]:
        """The JSON of ``erls simulate``; ``max_drift`` is None where energy is not conserved."""
        totals = self.energy(self.looks(201)).total
        work = self.solution.work
        return {
            "scene": self.scene.name,
            **self.formulation.describe(),
            "effects": in_order(self.formulation.mechanism.effects),
            **({} if self.certificate is None else self.certificate.summary()),
            "integrator": self.solution.choice or self.scene.record.simulation.integrator,
            "duration": self.end,
            "steps": work.steps,
            "rhs_calls": work.rhs_calls,
            "newton_iterations": work.newton_iterations,
            "factorizations": work.factorizations,
            "wall_s": self.wall_s,
            "energy": {
                "initial": float(np.asarray(totals)[0]),
                "final": float(np.asarray(totals)[-1]),
                "max_drift": float(np.ptp(totals)) if self.conservative else None,
            },
            "samples": self.samples(times),
            **({"events": [asdict(happening) for happening in self.events]} if self.scene.record.events else {}),
            "warnings": list(self.warnings),
        }


def node_positions(
    run: Run, state: State, link: int, nodes: Any = slice(None), magnification: float = 1.0
) -> Array:
    """(n, 3) world positions of nodes of a link.

    Parameters
    ----------
    run : Run
    state : State
    link : int
    nodes : index array or slice
    magnification : float
        Of the elastic and rigid-body displacement against the Equivalent Rigid Link System; 1 is true.
    """
    mechanism = run.formulation.mechanism
    model, frame = mechanism.links[link].model, state.poses[link]
    if state.nodes is not None:
        undeformed = model.nodes[nodes] @ frame[:3, :3].T + frame[:3, 3]
        return np.asarray(undeformed + magnification * (state.nodes[link][nodes] - undeformed))
    moved = model.translation_shapes[nodes] @ state.modal[link]
    second_order = mechanism.links[link].second_order if "foreshortening" in mechanism.effects else None
    if second_order is not None:
        moved = moved + second_order.displacements(np.arange(len(model.nodes))[nodes], state.modal[link])
    local = model.nodes[nodes] + magnification * moved
    return np.asarray(local @ frame[:3, :3].T + frame[:3, 3])
