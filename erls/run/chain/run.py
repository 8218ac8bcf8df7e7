"""The run of a chain: its motion, energies and forces at any time, and its summary."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from erls.equations.formulation import ContactSeries, Energy, LoopFormulation
from erls.equations.serial.state_series import ReactionSeries, energy_series, reaction_series
from erls.equations.stability import Stability, start_stability
from erls.equations.substructures import solved
from erls.errors import SceneError
from erls.maths.so3 import Array
from erls.mechanism.effects import conserves_energy, in_order
from erls.mechanism.joints import Joint
from erls.mechanism.loops import LoopFreedom
from erls.mechanism.sensors.base import Sensor
from erls.run.chain.kinematics import ChainMotion
from erls.run.events import Happening, happenings
from erls.run.readings import reading, reading_columns, reading_curves, reading_samples
from erls.run.record import Curve, plain, vector
from fe_import.files.toml import choose

_MOST_KNOTS = 4000
_ENERGIES = ("kinetic", "elastic", "gravity", "springs")


@dataclass(frozen=True, repr=False)
class ChainRun(ChainMotion):
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
    accuracy, trust : Accuracy, Trust or None
        What the run states of its error; None where that was not asked for.

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

    @cached_property
    def events(self) -> tuple[Happening, ...]:
        """Events of the scene that happened, in the order of time."""
        return happenings(self.scene.record.events, self.formulation, self.solution)

    def energy(self, t: ArrayLike) -> Energy:
        """Kinetic, elastic, gravity and spring energy [J], each of the shape of ``t``."""
        shape, flat, y, v = self._interpolated(t)
        found = energy_series(self.formulation, flat, y, v).T
        return Energy(*(kind.reshape(shape) for kind in found))

    def reaction(self, joint: str, t: ArrayLike) -> tuple[Array, Array]:
        """(..., 3) force [N] and (..., 3) moment [N m] on the joint's outer link, at its displaced interface node,
        world axes.
        """
        number, found = self._joint_number(joint), self._reactions(t)
        shape = (*np.shape(t), 3)
        return found.force[:, number].reshape(shape), found.moment[:, number].reshape(shape)

    def joint_effort(self, joint: str, t: ArrayLike) -> Array:
        """(...) torque [N m] or force [N] of drive, spring, damper and friction; for a prescribed motion, what its
        motor must give.
        """
        number, found = self._joint_number(joint), self._reactions(t)
        return found.effort[:, number].reshape(np.shape(t))

    def _joint_number(self, joint: str) -> int:
        choose(joint, self.joint_names, "joint", SceneError)
        return self.joint_names.index(joint)

    def _reactions(self, t: ArrayLike) -> ReactionSeries:
        """Of all joints at each time: every time is solved once."""
        return reaction_series(self.formulation, *self._interpolated(t)[1:])

    @property
    def loop_names(self) -> tuple[str, ...]:
        """Closing joints."""
        return tuple(loop.name for loop in self.formulation.mechanism.loops if loop.coupling is None)

    @property
    def coupling_names(self) -> tuple[str, ...]:
        """Couplings of joint coordinates."""
        return tuple(loop.name for loop in self.formulation.mechanism.loops if loop.coupling is not None)

    def coupling_effort(self, coupling: str, t: ArrayLike) -> Array:
        """(...) torque [N m] or force [N] of a coupling on the joint that follows; on the others it is -ratio times
        that.
        """
        choose(coupling, self.coupling_names, "coupling", SceneError)
        number = [loop.name for loop in self.formulation.mechanism.loops].index(coupling)
        _, flat, y, v = self._interpolated(t)
        chain = cast(LoopFormulation, solved(self.formulation))
        found = [chain.loop_forces(*at)[number] for at in zip(flat.tolist(), y, v, strict=True)]
        # along z by a condition or an elastic one that slides, about z by one that turns
        return np.array([f.force[2] + f.moment[2] for f in found]).reshape(np.shape(t))

    def loop_reaction(self, loop: str, t: ArrayLike) -> tuple[Array, Array]:
        """(..., 3) force [N] and (..., 3) moment [N m] of a closing joint on its ``link``, at its displaced node, world
        axes.
        """
        choose(loop, self.loop_names, "loop", SceneError)
        number = self.loop_names.index(loop)
        _, flat, y, v = self._interpolated(t)
        chain = cast(LoopFormulation, solved(self.formulation))
        found = [chain.loop_forces(*at)[number] for at in zip(flat.tolist(), y, v, strict=True)]
        shape = (*np.shape(t), 3)
        return np.array([f.force for f in found]).reshape(shape), np.array([f.moment for f in found]).reshape(shape)

    def loop_coordinate(self, loop: str, t: ArrayLike) -> Array:
        """(...) coordinate of a closing joint that has one [rad or m]."""
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
        names = [x.name for x in self.formulation.mechanism.loops if x.freedom is not None and x.coupling is None]
        choose(loop, names, "loop", SceneError)
        number, chain = self.loop_names.index(loop), solved(self.formulation)
        _, flat, y, v = self._interpolated(t)
        found = [what(chain, *at, number) for at in zip(flat.tolist(), y, v, strict=True)]
        return np.array(found).reshape(np.shape(t))

    @property
    def contact_names(self) -> tuple[str, ...]:
        """Contacts of the scene."""
        return tuple(contact.name for contact in self.formulation.mechanism.contacts)

    def contact(self, name: str, t: ArrayLike) -> ContactSeries:
        """Gap [m] and its rate, normal force [N], force on the point (..., 3) and where it acts, energy [J]."""
        choose(name, self.contact_names, "contact", SceneError)
        shape, *at = self._interpolated(t)
        return self.formulation.contact_series(*at).one(self.contact_names.index(name), shape)

    @cached_property
    def sensors(self) -> tuple[Sensor, ...]:
        """Those of the scene."""
        if not self.scene.record.sensors:
            return ()
        from erls.run.chain.sensors import sensors_of  # here: scenes without sensors need none of it

        return sensors_of(self.scene, self.formulation.mechanism)

    def sensor(self, name: str, t: ArrayLike) -> Array:
        """(...) reading of a sensor with one component, (..., c) of others."""
        return reading(self.sensors, name, self.instants(t), np.shape(t))

    @cached_property
    def stability(self) -> Stability | None:
        """Of a static start of links that are linear in their own frames; None of other starts."""
        return start_stability(solved(self.formulation))

    @property
    def conservative(self) -> bool:
        """Whether total energy should stay constant: no drives, loads, damping, friction or inelastic contacts."""
        mechanism = self.formulation.mechanism
        joints: list[Joint | LoopFreedom] = [*mechanism.joints]
        joints += [x.freedom for x in mechanism.loops if x.freedom is not None]
        passive = all(_passive(j) for j in joints)
        damped = any(link.damping.any() for link in mechanism.links)
        lossy = any(c.friction or c.law.loss for c in mechanism.contacts)
        return passive and not (damped or lossy or mechanism.loads) and conserves_energy(mechanism.effects)

    def _pressed(self) -> dict[str, dict[str, float]]:
        """Least gap [m] and largest normal force [N] of each contact, at the knots of the run; of many, at some."""
        s = self.solution
        at = slice(None, None, 1 + len(s.t) // _MOST_KNOTS)
        found = self.formulation.contact_series(s.t[at], s.y[at], s.v[at])
        gaps, forces = found.gap.min(axis=0).tolist(), found.normal_force.max(axis=0).tolist()
        each = zip(self.contact_names, gaps, forces, strict=True)
        return {name: {"least_gap": gap, "largest_normal_force": force} for name, gap, force in each}

    def samples(self, times: Sequence[float]) -> list[dict[str, Any]]:
        """Joints, points and sensors at given times, as in the JSON of ``erls simulate``."""
        result = []
        read = reading_samples(self.sensors, self.instants(times), len(times)) if self.sensors else None
        for t, s in zip(times, self.states(times), strict=True):
            joints: dict[str, Any] = {}
            for k, name in enumerate(self.joint_names):
                joint, _, coordinate = name.partition("/")
                found = {"coordinate": float(s.coordinates[k]), "angle": float(s.angles[k])}
                if coordinate:
                    joints.setdefault(joint, {})[coordinate] = found
                else:
                    joints[joint] = found
            points = {name: self.point_position(s, k).tolist() for k, name in enumerate(self.point_names)}
            result.append({"t": float(t), "joints": joints, "points": points})
            if read is not None:
                result[-1]["sensors"] = read[len(result) - 1]
        return result

    def columns(self, times: Array) -> dict[str, Array]:
        """Of each point x, y, z; of each joint coordinate, physical angle, its rate, effort, reaction force and moment
        on the outer link (world axes); of each contact gap, normal force and force on its point; what sensors read;
        energies.
        """
        seen = self.instants(times)
        states, reactions = self.series(times), seen.reactions
        columns = {"t [s]": times}
        for k, name in enumerate(self.point_names):
            vector(columns, plain(name), "m", self.point_position(states, k))
        for k, joint in enumerate(self.formulation.mechanism.joints):
            name, (unit, effort) = plain(joint.name), joint.freedom.units
            columns[f"{name}.coordinate [{unit}]"] = states.coordinates[:, k]
            columns[f"{name}.angle [{unit}]"] = states.angles[:, k]
            columns[f"{name}.rate [{unit}/s]"] = states.rates[:, k]
            columns[f"{name}.effort [{effort}]"] = reactions.effort[:, k]
            vector(columns, f"{name}.force", "N", reactions.force[:, k])
            vector(columns, f"{name}.moment", "N m", reactions.moment[:, k])
        if self.contact_names:
            found = self.formulation.contact_series(*self._interpolated(times)[1:])
            columns |= found.columns([plain(name) for name in self.contact_names])
        columns.update(reading_columns(self.sensors, seen, len(times)))
        energy = self.energy(times)
        for kind in (*_ENERGIES, "total"):
            columns[f"energy.{kind} [J]"] = np.asarray(getattr(energy, kind))
        return columns

    def curves(self, times: Array) -> dict[str, Curve]:
        """Points, joints, contacts, sensors, energies."""
        states, found = self.series(times), dict[str, Curve]()
        for k, name in enumerate(self.point_names):
            found[f"points/{name}"] = Curve(self.point_position(states, k), "m", "world position; time, axis")
        for k, name in enumerate(self.joint_names):
            for what in ("coordinates", "angles", "rates"):
                values = np.array(getattr(states, what)[:, k])
                found[f"joints/{name}/{what}"] = Curve(values, "rad or m, per s", "joint motion")
        for name in self.contact_names:
            contact = self.contact(name, times)
            found[f"contacts/{name}/gap"] = Curve(contact.gap, "m", "height of the point above the plane")
            found[f"contacts/{name}/force"] = Curve(contact.force, "N", "on the point, world axes; time, axis")
        found.update(reading_curves(self.sensors, self.instants(times), len(times)))
        energy = self.energy(times)
        for kind in (*_ENERGIES, "total"):
            found[f"energy/{kind}"] = Curve(np.asarray(getattr(energy, kind)), "J", f"{kind} energy")
        return found

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
            **({} if self.stability is None else {"stability": self.stability.summary()}),
            **self.stated(),
            **({"contacts": self._pressed()} if self.contact_names else {}),
            "samples": self.samples(times),
            **({"events": [asdict(happening) for happening in self.events]} if self.scene.record.events else {}),
            "warnings": list(self.warnings),
        }


def _passive(joint: Joint | LoopFreedom) -> bool:
    """Whether nothing in a joint does work but springs."""
    still = joint.drive.kind == "free" or (isinstance(joint, Joint) and joint.fixed)
    stops = joint.forces.stops
    return still and not (joint.forces.damping or joint.forces.friction or (stops and stops.law.loss))
