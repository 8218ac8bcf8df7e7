"""The mechanism at many times at once, as arrays: what looks along a whole run needs no `State` or `Reaction` of every
instant.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from erls.equations.formulation import Energy, Formulation, Reaction, State
from erls.maths.so3 import Array
from erls.mechanism.links import Link


@dataclass(frozen=True)
class StateSeries:
    """States at k times.

    Attributes
    ----------
    times : (k,) array
    poses : list of (k, 4, 4) arrays
        Link frames in the world, link by link.
    modal : list of (k, m) arrays
        Modal coordinates of each link (6 rigid-body, then elastic).
    coordinates, angles, rates : (k, n) arrays
        Joint coordinates θ, physical joint angles and their rates [rad or m].
    nodes, turns : list of (k, n, 3) and of (k, n, 3, 3) arrays, or None
        As in `State`.
    """

    times: Array
    poses: list[Array]
    modal: list[Array]
    coordinates: Array
    angles: Array
    rates: Array
    nodes: list[Array] | None = None
    turns: list[Array] | None = None

    def states(self) -> list[State]:
        """One by one."""
        parts = self.poses, self.modal, self.nodes or [], self.turns or []
        poses, modal, nodes, turns = ([list(x) for x in zip(*part, strict=True)] for part in parts)
        joints = zip(self.coordinates, self.angles, self.rates, strict=True)
        return [
            State(t, poses[k], modal[k], *joint, nodes[k] if self.nodes else None, turns[k] if self.turns else None)
            for k, (t, joint) in enumerate(zip(self.times.tolist(), joints, strict=True))
        ]


def state_series(formulation: Formulation, t: Array, y: Array, v: Array) -> StateSeries:
    """States of a formulation at k times.

    Parameters
    ----------
    formulation : Formulation
        One with a method ``series`` gives them all at once.
    t : (k,) array
    y, v : (k, n) arrays
    """
    all_at_once: Callable[[Array, Array, Array], StateSeries] | None = getattr(formulation, "series", None)
    if all_at_once is not None:
        return all_at_once(t, y, v)
    states = [formulation.state(*at) for at in zip(t.tolist(), y, v, strict=True)]
    models = [link.model for link in formulation.mechanism.links]
    placed = any(s.nodes is not None for s in states)
    places = [np.array([s.nodes[k] for s in states if s.nodes is not None]) for k in range(len(models))]
    turns = [np.array([s.turns[k] for s in states if s.turns is not None]) for k in range(len(models))]
    joints = len(formulation.mechanism.joints)
    return StateSeries(
        t,
        [np.array([s.poses[k] for s in states]).reshape(-1, 4, 4) for k in range(len(models))],
        [np.array([s.modal[k] for s in states]).reshape(-1, m.modes) for k, m in enumerate(models)],
        np.array([s.coordinates for s in states]).reshape(-1, joints),
        np.array([s.angles for s in states]).reshape(-1, joints),
        np.array([s.rates for s in states]).reshape(-1, joints),
        nodes=places if placed else None,
        turns=turns if placed else None,
    )


@dataclass(frozen=True)
class ReactionSeries:
    """Joint reactions at k times, as in `Reaction`.

    Attributes
    ----------
    force, moment : (k, n, 3) arrays
    effort : (k, n) array
    """

    force: Array
    moment: Array
    effort: Array

    def reactions(self, k: int) -> list[Reaction]:
        """Those at one time."""
        rows = zip(self.force[k], self.moment[k], self.effort[k].tolist(), strict=True)
        return [Reaction(*row) for row in rows]


@runtime_checkable
class _ReactsToAll(Protocol):
    def reaction_series(self, t: Array, y: Array, v: Array, a: Array | None = None) -> ReactionSeries:
        """Reactions that give these accelerations (k, n), or those of the equations of motion."""


def inboard_place(link: Link, modal: Array) -> Array:
    """(k, 3) place of a link's inboard node in the link's frame, at modal coordinates (k, m)."""
    return np.asarray(link.inboard.position + modal @ link.model.node_shape(link.inboard.node)[0].T)


@runtime_checkable
class _AcceleratesAtAll(Protocol):
    def acceleration_series(self, t: Array, y: Array, v: Array) -> Array:
        """(k, n) from the equations of motion."""


def accelerations(formulation: Formulation, t: Array, y: Array, v: Array) -> Array:
    """(k, n) from the equations of motion, at k times; a method ``acceleration_series`` gives them all at once."""
    if isinstance(formulation, _AcceleratesAtAll):
        return formulation.acceleration_series(t, y, v)
    found = [formulation.acceleration(*at) for at in zip(t.tolist(), y, v, strict=True)]
    return np.array(found).reshape(y.shape)


def reaction_series(
    formulation: Formulation, t: Array, y: Array, v: Array, a: Array | None = None
) -> ReactionSeries:
    """Joint reactions of a formulation at k times.

    Parameters
    ----------
    formulation : Formulation
        One with a method ``reaction_series`` gives them all at once.
    t : (k,) array
    y, v : (k, n) arrays
    a : (k, n) array, optional
        What `accelerations` gives, where that is known already.
    """
    if isinstance(formulation, _ReactsToAll):
        return formulation.reaction_series(t, y, v, a)
    found = [formulation.reactions(*at) for at in zip(t.tolist(), y, v, strict=True)]
    joints = len(formulation.mechanism.joints)
    return ReactionSeries(
        force=np.array([[r.force for r in every] for every in found]).reshape(len(t), joints, 3),
        moment=np.array([[r.moment for r in every] for every in found]).reshape(len(t), joints, 3),
        effort=np.array([[r.effort for r in every] for every in found]).reshape(len(t), joints),
    )


@runtime_checkable
class _StoresAtAll(Protocol):
    def energy_series(self, t: Array, y: Array, v: Array) -> Array:
        """(k, 4) kinetic, elastic, gravity and spring energy at times (k,) [J]."""


def energy_series(formulation: Formulation, t: Array, y: Array, v: Array) -> Array:
    """(k, 4) kinetic, elastic, gravity and spring energy at k times [J], in the order of `Energy`.

    Parameters are those of `state_series`; a method ``energy_series`` gives them all at once.
    """
    if isinstance(formulation, _StoresAtAll):
        return formulation.energy_series(t, y, v)
    found = [formulation.energy(*at) for at in zip(t.tolist(), y, v, strict=True)]
    return np.array([(e.kinetic, e.elastic, e.gravity, e.springs) for e in found]).reshape(len(t), 4)


def single_energy(series: Array) -> Energy:
    """That of the only time of a series (1, 4)."""
    return Energy(*series[0].tolist())
