"""Equivalent static loads: the loads on a mechanism at rest that deform it as its motion does, at many times.

At a frozen configuration, small displacements u = Z r + w of a mechanism under loads f that are held obey

    w = C (f - Bᵀ λ),   Zᵀ (f - Bᵀ λ) = 0,   B (Z r + w) = 0

with the flexibility C of links that are clamped at their inboard nodes and the multipliers λ of the joints. The loads
of a run are f = Pᵀ σ, σ the forces in its elements (B.-S. Kang, G.-J. Park, J. S. Arora, AIAA J. 43 (2005) 846–852, for
single links, λ = 0; E. Tromme, O. Brüls and co-workers, Liège, for whole mechanisms on Lie groups). What a design
changes of w and r is added to the run's own components, so that at the design of the run nothing is approximated.
"""

from __future__ import annotations

from functools import cached_property
from typing import Protocol

import numpy as np

from erls.errors import Cause, SceneError
from erls.maths.so3 import Array
from erls.optimization.beams import assembled, clamped_flexibility, scattered, sections_of
from erls.optimization.design import Design, Designs
from erls.optimization.evaluation import Evaluation, Rules
from erls.optimization.frozen import Frozen
from erls.optimization.limits import Bases, Limit, Motion
from erls.optimization.link_numbers import LinkNumbers
from erls.optimization.problem import Problem
from erls.scene.build import link_description
from erls.scene.chain import Scene

_STEP = 1e-4  # of variables: sections are polynomials of low order in them


class Source(Protocol):
    """What frozen loads take from who runs designs."""

    problem: Problem
    rules: Rules
    designs: Designs
    numbers: LinkNumbers
    start: Design

    def limits(self, design: Design) -> list[Limit]:
        """Constraints at a design."""

    def limits_at(self, x: Array) -> list[Limit]:
        """The same where no node moves."""


class FrozenLoads:
    """Static response under the loads of a run; an `erls.optimization.evaluation.Evaluator`.

    Parameters
    ----------
    source : Source
    x : (v,) array
        Design of the run.
    motion : Motion
        Of the run.
    whole : bool
        The mechanism as a whole; otherwise each link alone, joints passing on how it moves, not what it bears.

    Attributes
    ----------
    evaluations : int
        Static analyses of all times so far.
    """

    def __init__(self, source: Source, x: Array, motion: Motion, whole: bool) -> None:
        self.rules: Rules = source.rules
        self._source, self._whole, self.evaluations = source, whole, 0
        self._frozen: Frozen = motion.frozen
        self._motion = motion
        force = np.einsum("eij,kej->kei", self._sections(x), motion.twists)
        self._loads = scattered(self._frozen, np.einsum("eji,kej->kei", self._frozen.strains, force))
        self._base = self._response(x)

    def _sections(self, x: Array) -> Array:
        settings = self._source.problem.scene.record.simulation
        return sections_of(self._source.start.mechanism, settings, self._source.numbers, x)

    @cached_property
    def _turned(self) -> Array:
        """(k, m, 6 L) B Z."""
        return np.asarray(self._frozen.rows @ self._frozen.carried)

    def _response(self, x: Array) -> tuple[Array, Array, Array]:
        """(k, 6 L), (k, 6 N) and (6 N, 6 N): r, w and C at a design."""
        flexibility = clamped_flexibility(self._frozen, self._sections(x))
        w = self._loads @ flexibility
        r, further = self._joined(flexibility, w, self._loads)
        return r, w + further, flexibility

    def _joined(self, flexibility: Array, w: Array, loads: Array | None) -> tuple[Array, Array]:
        """r, and what multipliers add to w, at deformations w of links alone."""
        rows, turned, links = self._frozen.rows, self._turned, self._turned.shape[2]
        gap = -np.einsum("kmn,kn->km", rows, w)
        if not self._whole:
            return np.einsum("klm,km->kl", np.linalg.pinv(turned, rcond=1e-9), gap), np.zeros_like(w)
        passed = rows @ flexibility  # (k, m, 6 N)
        between = passed @ np.swapaxes(rows, 1, 2)
        scale = float(np.abs(between).max(initial=0.0)) or 1.0
        m = rows.shape[1]
        matrix = np.zeros((len(rows), links + m, links + m))
        matrix[:, :links, links:] = np.swapaxes(turned, 1, 2)
        matrix[:, links:, :links], matrix[:, links:, links:] = turned, -between / scale
        right = np.zeros((len(rows), links + m))
        right[:, links:] = gap
        if loads is not None:
            right[:, :links] = loads @ self._frozen.carried
        solved = np.linalg.solve(matrix, right[..., None])[..., 0]
        multipliers = solved[:, links:] / scale
        return solved[:, :links], -np.einsum("kmn,km->kn", passed, multipliers)

    def evaluate(self, x: Array) -> Evaluation:
        """A design by its static response."""
        self.evaluations += 1
        r, w, _ = self._response(x)
        change = r - self._base[0], w - self._base[1]
        return self.rules.evaluation(x, [self._components(limit, *change) for limit in self._source.limits_at(x)])

    def _components(self, limit: Limit, r: Array, w: Array, basis: Bases | None = None) -> Array:
        """Those of the run, which loads that are held hold as well, and what r and w add to them."""
        return limit.moved(self._motion, r, w, basis)

    def differentiate(self, found: Evaluation) -> Evaluation:
        """With derivatives: dC = -C dK C."""
        x = found.x
        r, w, flexibility = self._response(x)
        limits, change = self._source.limits_at(x), (r - self._base[0], w - self._base[1])
        bases = [limit.basis(self._motion, *change) for limit in limits]
        columns: list[list[Array]] = [[] for _ in limits]
        for above, below, step in self.rules.beside(x, _STEP):
            rate = (self._sections(above) - self._sections(below)) / (2 * step)
            alone = -(w @ assembled(self._frozen, rate)) @ flexibility
            moved = self._joined(flexibility, alone, None)
            beside = [self._source.limits_at(side) if limits_vary(limits) else limits for side in (above, below)]
            for k, limit in enumerate(limits):
                column = limit.increments(self._frozen, moved[0], alone + moved[1], bases[k])
                if limit.of_sections:
                    own = [self._components(other[k], *change, bases[k]) for other in beside]
                    column = column + (own[0] - own[1]) / (2 * step)
                columns[k].append(column)
        return self.rules.differentiated(found, [np.stack(column, axis=-1) for column in columns])


def limits_vary(limits: list[Limit]) -> bool:
    """Whether some depend on sections by themselves."""
    return any(limit.of_sections for limit in limits)


def flexible(scene: Scene) -> bool:
    """Whether all links that deform are made of beams."""
    links = [link for link in scene.record.links if link.rigid is None and link.flexible]
    return all(link.model and link_description(scene, link).description.frame is not None for link in links)


def refuse(source: Source, method: str) -> None:
    """Refuse what loads that are held cannot treat.

    Raises
    ------
    SceneError
        BAD_FIELD: variables that move nodes, constraints on forces, links that are not made of beams.
    """
    path, remedy = source.problem.path, 'use methods = ["integrated"], or take it out'
    if source.designs.moving:
        message = f"{method} holds the motion and its loads: what changes lengths or drives is no variable for it"
        where = f"{path}: variables.{source.designs.moving[0]}"
        raise SceneError(Cause.BAD_FIELD, message, where=where, remedy=remedy)
    if not flexible(source.start.scene):
        message = f"{method} knows the stiffness of links that are made of beams alone"
        raise SceneError(Cause.BAD_FIELD, message, where=f"{path}: scene", remedy='use methods = ["integrated"]')
    for limit in source.limits(source.start):
        if not limit.of_shape:
            message = f"{method} holds all loads: it cannot limit them"
            raise SceneError(Cause.BAD_FIELD, message, where=f"{path}: constraints.{limit.name}", remedy=remedy)
