"""What all runs of bodies and beams answer: places of nodes, coordinates and forces of connections, energy."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from erls.equations.formulation import ContactSeries
from erls.equations.nodal.joints import Joint
from erls.equations.nodal.nodes import Nodes
from erls.equations.nodal.scenes.build import Assembly
from erls.errors import SceneError
from erls.maths.so3 import Array
from erls.run.accuracy import Accuracy, Trust
from erls.run.bodies.connections import ONE_COORDINATE, connection_forces, joint_coordinate
from erls.run.record import Curve, Run, plain, vector
from erls.scene.bodies.schema import BodyScene
from fe_import.files.toml import choose

_WALK = 201  # looks along a run, so that elements are wound up as far as they are


@dataclass(frozen=True, repr=False)
class BodyRun(Run):
    """What motions and equilibria share.

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
    accuracy: Accuracy | None = field(default=None, kw_only=True)
    trust: Trust | None = field(default=None, kw_only=True)

    @abstractmethod
    def poses(self, t: ArrayLike, nodes: Sequence[int] | None = None) -> Array:
        """(k, n, 4, 4) poses of nodes, all unless given."""

    @abstractmethod
    def velocities(self, t: Array) -> Array:
        """(k, 6 n) velocities of all nodes, as the system's group has them."""

    @abstractmethod
    def multipliers(self, t: Array) -> Array:
        """(k, m) of the conditions of connections."""

    def loads(self, t: Array) -> Array:
        """(k,) what loads and prescribed motions read as the time."""
        return t

    @property
    def origin(self) -> Nodes:
        """What displacements count from: where all is built."""
        return self.assembly.system.start

    @property
    def worth_a_file(self) -> bool:
        """Always: the file says what failed."""
        return True

    @property
    def point_names(self) -> tuple[str, ...]:
        """Named nodes, bodies, and what ``report`` adds; `position` knows the others too."""
        return self.assembly.reported

    @cached_property
    def joints(self) -> dict[str, Joint]:
        """Connections with one coordinate."""
        return {j.name: j for j in self.assembly.full.rows.joints if j.type in ONE_COORDINATE}

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Their names."""
        return tuple(self.joints)

    def position(self, point: str, t: ArrayLike) -> Array:
        """(..., 3) place of a node or body [m]."""
        choose(point, self.assembly.numbers, "node", SceneError)
        poses = self.poses(t, [self.assembly.numbers[point]])
        return np.asarray(poses[:, 0, :3, 3].reshape(*np.shape(t), 3))

    def joint_angle(self, joint: str, t: ArrayLike) -> Array:
        """(...) coordinate of a connection that has one [rad or m], 0 as built; turns are counted."""
        choose(joint, self.joints, "connection", SceneError)
        found = self._coordinate(self.joints[joint], t)
        if joint in self._turned and len(found):
            known = np.interp(self.within(t), self.times, self._turned[joint])
            found = found + 2 * np.pi * np.round((known - found) / (2 * np.pi))
        return found.reshape(np.shape(t))

    @cached_property
    def _turned(self) -> dict[str, Array]:
        """Angles at all known times, without jumps."""
        return {
            name: np.unwrap(self._coordinate(joint, self.times))
            for name, joint in self.joints.items()
            if ONE_COORDINATE[joint.type] == "rad"
        }

    def _coordinate(self, joint: Joint, t: ArrayLike) -> Array:
        poses = self.poses(t, [max(joint.inner, 0), joint.outer])
        return joint_coordinate(joint, poses[:, 0], poses[:, 1])

    def configurations(self, t: Array) -> list[Nodes]:
        """At each time, elements wound up as they are on the way there."""
        system = self.assembly.system
        way = np.unique(np.concatenate([self.spread(_WALK), t]))
        wanted, q, found = set(t.tolist()), system.start, {}
        for at in way[way <= t.max(initial=self.start)].tolist():
            q = system.at(self.poses([at])[0], q)
            if at in wanted:
                found[at] = q
        return [found[at] for at in t.tolist()]

    def energy(self, t: ArrayLike) -> tuple[Array, Array]:
        """(...) kinetic and potential energy [J]."""
        flat = self.within(t)
        nodes, velocities = self.configurations(flat), self.velocities(flat)
        loads = self.loads(flat).tolist()
        pairs = [self.assembly.system.energy(*at) for at in zip(loads, nodes, velocities, strict=True)]
        both = np.array(pairs).reshape(-1, 2).T
        return both[0].reshape(np.shape(t)), both[1].reshape(np.shape(t))

    @property
    def contact_names(self) -> tuple[str, ...]:
        """Contacts of the scene."""
        return tuple(contact.name for contact in self.scene.record.contacts)

    def contact(self, name: str, t: ArrayLike) -> ContactSeries:
        """Gap [m] and its rate, normal force [N], force on the node (..., 3) and where it acts, energy [J]."""
        choose(name, self.contact_names, "contact", SceneError)
        return self._contacts(self.within(t)).one(self.contact_names.index(name), np.shape(t))

    def _contacts(self, t: Array) -> ContactSeries:
        """All of them at times (k,)."""
        system, velocities = self.assembly.system, self.velocities(t)
        found = [system.in_contacts(q, v) for q, v in zip(self.configurations(t), velocities, strict=True)]
        return ContactSeries.of(np.array(found).reshape(len(t), len(self.contact_names), -1))

    def samples(self, times: Sequence[float]) -> list[dict[str, Any]]:
        """Nodes and connections at given times: places [m], coordinates, and what each connection does to its node
        there, in the world's axes.
        """
        at = np.asarray(times, dtype=float)
        angles = {name: self.joint_angle(name, at) for name in self.joints}
        loads = self.loads(at).tolist()
        result = []
        for k, (poses, multipliers) in enumerate(zip(self.poses(at), self.multipliers(at), strict=True)):
            forces = connection_forces(self.assembly, loads[k], poses, multipliers)
            result.append(
                {
                    "t": float(at[k]),
                    "joints": {name: {"coordinate": float(a[k]), "angle": float(a[k])} for name, a in angles.items()},
                    "points": {x: poses[self.assembly.numbers[x], :3, 3].tolist() for x in self.point_names},
                    "connections": {x: {"force": f.tolist(), "moment": m.tolist()} for x, (f, m) in forces.items()},
                }
            )
        return result

    def facts(self) -> dict[str, Any]:
        """Names and sizes."""
        system, analysis = self.assembly.system, self.scene.record.simulation
        return {
            "scene": self.scene.name,
            "formulation": analysis.formulation,
            "analysis": type(analysis).__struct_config__.tag,
            "group": "SE(3)" if system.local else "R3xSO(3)",
            "bodies": len(self.scene.record.bodies),
            "elements": self.assembly.elements,
            "nodes": system.count,
            "velocities": system.size,
            "conditions": system.constraints,
        }

    def columns(self, times: Array) -> dict[str, Array]:
        """Of each reported node x, y, z; of each connection its coordinate, force and moment on its node; of each
        contact gap, normal force and force on its node, in the world; energies.
        """
        samples, axis = self.samples(times.tolist()), self.axis
        columns = {f"{axis.symbol} [{axis.unit or '1'}]": times}
        for name in self.point_names:
            vector(columns, plain(name), "m", [s["points"][name] for s in samples])
        for joint in self.assembly.full.rows.joints:
            name = joint.name
            if name in self.joints:
                values = np.array([s["joints"][name]["coordinate"] for s in samples])
                columns[f"{plain(name)}.coordinate [{ONE_COORDINATE[joint.type]}]"] = values
            for what, unit in (("force", "N"), ("moment", "N m")):
                vector(columns, f"{plain(name)}.{what}", unit, [s["connections"][name][what] for s in samples])
        if self.contact_names:
            columns |= self._contacts(times).columns([plain(name) for name in self.contact_names])
        for kind, energy in zip(("kinetic", "potential"), self.energy(times), strict=True):
            columns[f"energy.{kind} [J]"] = energy
        return columns

    def curves(self, times: Array) -> dict[str, Curve]:
        """Points and coordinates of connections."""
        text = f"world position; {self.axis.name}, axis"
        found = {f"points/{_key(name)}": Curve(self.position(name, times), "m", text) for name in self.point_names}
        for name in self.joints:
            found[f"joints/{_key(name)}/angles"] = Curve(self.joint_angle(name, times), "rad or m", "coordinate")
        return found


def _key(name: str) -> str:
    """An inner node's name as a key of a file, where '/' opens a group."""
    return name.replace("/", ":")
