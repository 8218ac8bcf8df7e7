"""Constraints of a problem on motions: their components in a run, and what small displacements change of them.

Rules for a new constraint: one record in `erls.optimization.records`, one class here, one line in `limit_of`. ``exact``
tells components (n, q) of a motion, ``increments`` what small displacements of its nodes add to them, of many
directions at a time; where a constraint does not follow from where nodes are, ``of_shape`` is false, it asks
the run, and equivalent static loads cannot treat it; with ``of_sections`` components depend on sections at the same
motion, too. ``groups`` numbers the places that rows belong to: each has one value where times are aggregated. Where
components are told in modes of a design, ``basis`` gives these, for whoever compares designs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from erls.equations.nodal.equations import Nodal
from erls.errors import SceneError
from erls.maths import motion_maps as motions
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.sensors.base import Node
from erls.optimization.beams import elements_by_link, outlines_of, sections_of
from erls.optimization.eigenvalues import MODES, Basis, HeldLink, LargestEigenvalue, basis_of, components, held_link
from erls.optimization.frozen import Frozen, of_beams
from erls.optimization.link_numbers import LinkNumbers
from erls.optimization.measures import AbsoluteSum, Length, Measure, RoundSection
from erls.optimization.problem import Problem, driven_joints, links_of, terms_of
from erls.optimization.records import (
    AnyConstraint,
    BucklingLimit,
    DeflectionLimit,
    EffortLimit,
    FrequencyLimit,
    PowerLimit,
    StressLimit,
    Term,
    VibrationLimit,
)
from erls.optimization.vibrations import HeldMechanism, held_mechanism
from erls.run.chain.instants import Instants
from erls.run.chain.run import ChainRun
from fe_import.files.toml import choose
from fe_import.model import IntArray

_NONE = 1e-9  # of the limit: compression that is rounding

Bases = list[Basis]
"""Of the links that a constraint looks at."""


@dataclass(frozen=True)
class Motion:
    """A motion at the times of a problem.

    Attributes
    ----------
    frozen : Frozen
        Of the same mechanism.
    poses : (k, N, 4, 4) array
        Of the nodes in the world.
    run : ChainRun or None
    """

    frozen: Frozen
    poses: Array
    run: ChainRun | None = None

    @cached_property
    def twists(self) -> Array:
        """(k, e, 6) of elements."""
        return self.frozen.twists(self.poses)


class Limit(Protocol):
    """A constraint of a design."""

    name: str
    limit: float | None
    measure: Measure
    at: IntArray
    of_shape: bool
    of_sections: bool
    groups: IntArray

    def exact(self, motion: Motion, basis: Bases | None = None) -> Array:
        """(n, q) components in a motion."""

    def increments(self, frozen: Frozen, r: Array, w: Array, basis: Bases | None = None) -> Array:
        """(n, q) what displacements r (k, 6 L), w (k, 6 N) of all times add."""

    def moved(self, motion: Motion, r: Array, w: Array, basis: Bases | None = None) -> Array:
        """(n, q) components of a motion with displacements added."""
        return self.exact(motion, basis) + self.increments(motion.frozen, r, w, basis)

    def basis(self, motion: Motion, r: Array | None = None, w: Array | None = None) -> Bases | None:
        """In what its components are told, at a motion with displacements added."""
        return None

    def told(self, values: Array) -> Array:
        """Measured values as users know them, beside the limit of the problem."""
        return values


@dataclass(frozen=True)
class _Part:
    """A term of a deflection: node, place of the point from it, axes and components; and the node of a link that is
    known by its modes alone.
    """

    node: int
    offset: Array
    on_link: bool
    components: list[int]
    modal: Node | None = None


class Deflection(Limit):
    """Of named points."""

    measure: Measure = Length()
    of_shape, of_sections = True, False

    def __init__(self, record: DeflectionLimit, at: IntArray, mechanism: Mechanism, nodal: Nodal) -> None:
        self.name, self.limit, self.at = record.name, record.limit, at
        self.groups = np.zeros(len(at), dtype=np.int64)
        self._parts = [_part(term, mechanism, nodal) for term in terms_of(record)]

    def exact(self, motion: Motion, basis: Bases | None = None) -> Array:
        """(k, q)"""
        frozen, found = motion.frozen, []
        for part in self._parts:
            link = frozen.links[part.node]
            rigid = frozen.frames[self.at, link]
            own, root = motion.poses[self.at, part.node], motion.poses[self.at, frozen.roots[link]]
            place = own[:, :3, 3] + own[:, :3, :3] @ part.offset
            if part.modal is not None:
                place = self._seen(motion, part.modal)
            undeformed = frozen.local[part.node, :3, 3] + frozen.local[part.node, :3, :3] @ part.offset
            if part.on_link:
                moved = np.einsum("kji,kj->ki", root[:, :3, :3], place - root[:, :3, 3]) - undeformed
            else:
                moved = place - rigid[:, :3, 3] - rigid[:, :3, :3] @ undeformed
            found.append(moved[:, part.components])
        return np.concatenate(found, axis=1)

    def _seen(self, motion: Motion, node: Node) -> Array:
        """(k, 3) a node of a run."""
        assert motion.run is not None
        times = motion.frozen.times[self.at]
        y, v = motion.run.coordinates(times)
        return Instants(motion.run.formulation, times, y, v, np.zeros_like(y)).node(node).place

    def increments(self, frozen: Frozen, r: Array, w: Array, basis: Bases | None = None) -> Array:
        """(k, q)"""
        found = []
        for part in self._parts:
            own = slice(6 * part.node, 6 * part.node + 6)
            link = frozen.links[part.node]
            u = w[self.at, own]
            if not part.on_link:
                u = u + r[self.at] @ frozen.carried[own].T
            moved = u[:, :3] + np.cross(u[:, 3:], part.offset)
            axes = frozen.local[part.node, :3, :3]
            if part.on_link:
                moved = moved @ axes.T
            else:
                moved = np.einsum("kij,kj->ki", frozen.frames[self.at, link, :3, :3] @ axes, moved)
            found.append(moved[:, part.components])
        return np.concatenate(found, axis=1)


def _part(term: Term, mechanism: Mechanism, nodal: Nodal) -> _Part:
    names = [point.name for point in mechanism.points]
    choose(term.point, names, "point", SceneError)
    point = mechanism.points[names.index(term.point)]
    link = mechanism.links[point.link]
    root = nodal.place_of(point.link, link.inboard.node)
    modal = None if of_beams(link) else Node(point.link, point.node)
    node = root if modal is not None or not link.elastic_modes else nodal.place_of(point.link, point.node)
    start = nodal.chain.system.start.poses
    place = link.inboard.position + (motions.inverse(start[root]) @ start[node])[:3, 3]
    offset = link.model.nodes[point.node] - place
    return _Part(node, offset, term.frame == "link", ["xyz".index(c) for c in term.components], modal)


class Stress(Limit):
    """Largest normal stress at both ends of elements, one row for each time and end."""

    of_shape, of_sections = True, True

    def __init__(
        self, record: StressLimit, at: IntArray, mechanism: Mechanism, problem: Problem, numbers: LinkNumbers, x: Array
    ) -> None:
        self.name, self.limit, self.at = record.name, record.limit, at
        settings, links = problem.scene.record.simulation, links_of(record, problem.scene)
        wanted = [mechanism.bodies[k] for k in links]
        outlines = outlines_of(mechanism, settings, numbers, x, wanted)
        self._elements = np.flatnonzero(np.isin(elements_by_link(mechanism, settings, numbers, x), wanted))
        self.groups = np.tile(np.repeat(np.arange(len(self._elements)), 2), len(at))
        self._factors = outlines.factors
        self._stiffness = sections_of(mechanism, settings, numbers, x)[self._elements]
        self.measure: Measure = RoundSection() if outlines.rounds.all() else AbsoluteSum()  # which is never below it

    def exact(self, motion: Motion, basis: Bases | None = None) -> Array:
        """(k e 2, 3)"""
        return self._stresses(motion.frozen, motion.twists[self.at][:, self._elements])

    def increments(self, frozen: Frozen, r: Array, w: Array, basis: Bases | None = None) -> Array:
        """(k e 2, 3)"""
        places, strains = frozen.places[self._elements], frozen.strains[self._elements]
        return self._stresses(frozen, np.einsum("ejl,kel->kej", strains, w[self.at][:, places]))

    def _stresses(self, frozen: Frozen, twists: Array) -> Array:
        force = np.einsum("eij,kej->kei", self._stiffness, twists)
        half = frozen.lengths[self._elements] / 2
        ends = []
        for side in (-1.0, 1.0):  # m' = -x × n
            bending = force[..., 4] + side * half * force[..., 2], force[..., 5] - side * half * force[..., 1]
            ends.append(np.stack([force[..., 0], *bending], axis=-1) * self._factors)
        return np.stack(ends, axis=2).reshape(-1, 3)


class Effort(Limit):
    """Of a joint's drive."""

    measure: Measure = Length()
    of_shape, of_sections = False, False

    def __init__(self, record: EffortLimit, at: IntArray) -> None:
        self.name, self.limit, self.at, self._joint = record.name, record.limit, at, record.joint
        self.groups = np.zeros(len(at), dtype=np.int64)

    def exact(self, motion: Motion, basis: Bases | None = None) -> Array:
        """(k, 1)"""
        assert motion.run is not None
        return motion.run.joint_effort(self._joint, motion.frozen.times[self.at])[:, None]

    def increments(self, frozen: Frozen, r: Array, w: Array, basis: Bases | None = None) -> Array:
        """(k, 1) loads that are held change nothing."""
        return np.zeros((len(self.at), 1))


class Power(Limit):
    """Of drives, one component for each joint."""

    measure: Measure = AbsoluteSum()
    of_shape, of_sections = False, False

    def __init__(self, record: PowerLimit, at: IntArray, joints: Sequence[str]) -> None:
        self.name, self.limit, self.at, self._joints = record.name, record.limit, at, joints
        self.groups = np.zeros(len(at), dtype=np.int64)

    def exact(self, motion: Motion, basis: Bases | None = None) -> Array:
        """(k, joints)"""
        run, times = motion.run, motion.frozen.times[self.at]
        assert run is not None
        return np.stack([run.joint_effort(one, times) * run.joint_rate(one, times) for one in self._joints], axis=1)

    def increments(self, frozen: Frozen, r: Array, w: Array, basis: Bases | None = None) -> Array:
        """(k, joints) loads that are held change nothing."""
        return np.zeros((len(self.at), len(self._joints)))


class Frequency(Limit):
    """(f₀/f)² of links, one row for each."""

    measure: Measure = LargestEigenvalue()
    of_shape, of_sections = True, True

    def __init__(self, record: FrequencyLimit | VibrationLimit, at: IntArray, held: Sequence[HeldLink]) -> None:
        self.name, self.at, self._asked, self._held = record.name, at, record.limit or 1.0, held
        self.limit = None if record.limit is None else 1.0
        self.groups = np.arange(len(held))

    def basis(self, motion: Motion, r: Array | None = None, w: Array | None = None) -> Bases:
        """Modes of each."""
        return [basis_of(link.stiffness, [link.mass]) for link in self._held]

    def exact(self, motion: Motion, basis: Bases | None = None) -> Array:
        """(n, q²)"""
        pairs = zip(self._held, basis or self.basis(motion), strict=True)
        found = [components(link.stiffness, [link.mass], own) for link, own in pairs]
        return (2 * np.pi * self._asked) ** 2 * np.concatenate(found)

    def increments(self, frozen: Frozen, r: Array, w: Array, basis: Bases | None = None) -> Array:
        """(n, q²) displacements change nothing."""
        return np.zeros((len(self._held), MODES**2))

    def told(self, values: Array) -> Array:
        """[Hz]"""
        return np.asarray(self._asked / np.sqrt(values))


class Vibration(Frequency):
    """The same of the whole mechanism, one row for each time; modes are displacements of all nodes."""

    def __init__(self, record: VibrationLimit, at: IntArray, held: Sequence[HeldMechanism]) -> None:
        super().__init__(record, at, held)
        self._mechanisms, self.groups = held, np.zeros(len(held), dtype=np.int64)

    def basis(self, motion: Motion, r: Array | None = None, w: Array | None = None) -> Bases:
        """Modes of each."""
        found = super().basis(motion, r, w)
        return [b._replace(shapes=own.ways @ b.shapes) for own, b in zip(self._mechanisms, found, strict=True)]

    def exact(self, motion: Motion, basis: Bases | None = None) -> Array:
        """(n, q²), modes of another design brought to what the joints of this one leave free."""
        pairs = zip(self._mechanisms, basis or self.basis(motion), strict=True)
        return super().exact(motion, [b._replace(shapes=own.within @ b.shapes) for own, b in pairs])


class Buckling(Limit):
    """Asked load factors over those that are there, one row for each time and link; 0 in tension."""

    measure: Measure = LargestEigenvalue()
    of_shape, of_sections = True, True

    def __init__(
        self,
        record: BucklingLimit,
        at: IntArray,
        held: list[HeldLink],
        mechanism: Mechanism,
        problem: Problem,
        numbers: LinkNumbers,
        x: Array,
    ) -> None:
        self.name, self.at, self._asked, self._held = record.name, at, record.limit or 1.0, held
        self.limit = None if record.limit is None else 1.0
        self.groups = np.tile(np.arange(len(held)), len(at))
        settings = problem.scene.record.simulation
        outlines = elements_by_link(mechanism, settings, numbers, x)
        self._elements = [np.flatnonzero(outlines == mechanism.bodies[k]) for k in links_of(record, problem.scene)]
        self._stiffness = sections_of(mechanism, settings, numbers, x)

    def basis(self, motion: Motion, r: Array | None = None, w: Array | None = None) -> Bases:
        """Modes of each link at each time."""
        twists = self._twists(motion, w)
        pairs = zip(self._held, self._elements, strict=True)
        return [basis_of(link.stiffness, list(link.softening(self._forces(twists, own)))) for link, own in pairs]

    def exact(self, motion: Motion, basis: Bases | None = None) -> Array:
        """(k links, q²)"""
        return self._components(self._twists(motion, None), basis or self.basis(motion))

    def moved(self, motion: Motion, r: Array, w: Array, basis: Bases | None = None) -> Array:
        """(k links, q²) in modes of their own unless others are given."""
        return self._components(self._twists(motion, w), basis or self.basis(motion, r, w))

    def increments(self, frozen: Frozen, r: Array, w: Array, basis: Bases | None = None) -> Array:
        """(k links, q²) of modes that are given."""
        assert basis is not None
        none = np.zeros_like(self._added(frozen, w))
        return self._components(self._added(frozen, w), basis) - self._components(none, basis)

    def told(self, values: Array) -> Array:
        """Load factors; infinite in tension."""
        return np.asarray(np.where(values > _NONE, self._asked / np.maximum(values, _NONE), np.inf))

    def _twists(self, motion: Motion, w: Array | None) -> Array:
        found = motion.twists[self.at]
        return found if w is None else found + self._added(motion.frozen, w)

    def _added(self, frozen: Frozen, w: Array) -> Array:
        return np.asarray(np.einsum("ejl,kel->kej", frozen.strains, w[self.at][:, frozen.places]))

    def _forces(self, twists: Array, elements: IntArray) -> Array:
        return np.asarray(np.einsum("ej,kej->ke", self._stiffness[elements, 0], twists[:, elements]))

    def _components(self, twists: Array, basis: Bases) -> Array:
        found = [
            components(link.stiffness, list(link.softening(self._forces(twists, own))), modes)
            for link, own, modes in zip(self._held, self._elements, basis, strict=True)
        ]
        return self._asked * np.stack(found, axis=1).reshape(len(twists) * len(found), -1)


def limit_of(
    record: AnyConstraint,
    at: IntArray,
    problem: Problem,
    mechanism: Mechanism,
    nodal: Nodal,
    frozen: Frozen,
    numbers: LinkNumbers,
    x: Array,
) -> Limit:
    """A constraint of a design (v,), whose samples are those times of all that are looked at."""
    if isinstance(record, DeflectionLimit):
        return Deflection(record, at, mechanism, nodal)
    if isinstance(record, StressLimit):
        return Stress(record, at, mechanism, problem, numbers, x)
    if isinstance(record, EffortLimit):
        return Effort(record, at)
    if isinstance(record, PowerLimit):
        return Power(record, at, driven_joints(record, problem.scene))
    if isinstance(record, VibrationLimit):
        return Vibration(record, at, held_mechanism(mechanism, nodal, frozen, numbers, x, at))
    held = [held_link(problem, mechanism, numbers, x, k, record.ends) for k in links_of(record, problem.scene)]
    if isinstance(record, FrequencyLimit):
        return Frequency(record, at, held)
    return Buckling(record, at, held, mechanism, problem, numbers, x)
