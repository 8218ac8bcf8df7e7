"""What is minimized: mass, and what constraints measure over time, added up."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from erls.maths.so3 import Array
from erls.optimization.design import scene_at
from erls.optimization.link_numbers import LinkNumbers
from erls.optimization.measures import Measure
from erls.optimization.problem import Problem
from erls.optimization.records import Goal
from erls.scene.build import link_description, link_model
from erls.scene.chain import Scene
from fe_import.description.records import LinkDescription
from fe_import.models.frame_parts import frame_parts
from fe_import.models.model import build_model

_STEP = 1e-3  # of the variables: masses are polynomials of low order in dimensions
_SHARP = 60.0  # of a largest value over time: the mean of so high powers


@dataclass(frozen=True)
class Quadratic:
    """f + g · δ + ½ δ H δ at changes δ of a design."""

    f: float
    g: Array
    h: Array

    def value(self, change: Array) -> float:
        """At a change (v,)."""
        return float(self.f + self.g @ change + change @ self.h @ change / 2)

    def slope(self, change: Array) -> Array:
        """(v,)"""
        return self.g + self.h @ change


class Masses:
    """Masses of links over the design, each weighed once for every set of its values."""

    def __init__(self, problem: Problem, numbers: LinkNumbers) -> None:
        self._problem, self._numbers = problem, numbers
        self._rigid = any(p.key.startswith("links.") and not p.within for p in problem.parameters)

    def at(self, x: Array) -> Array:
        """(links,) without payloads [kg]."""
        scene = scene_at(self._problem, x) if self._rigid else self._problem.scene
        return np.array([self._link(scene, k, x) for k in range(len(scene.record.links))])

    def _link(self, scene: Scene, k: int, x: Array) -> float:
        link = scene.record.links[k]
        if link.rigid is not None:
            return link.rigid.mass
        description = self._numbers.at(k, x)
        return self._numbers.kept("mass", k, x, lambda: _mass(scene, k, description))


def _mass(scene: Scene, k: int, description: LinkDescription | None) -> float:
    """Of a link, of its beams and point masses where it is made of them, else of its reduction."""
    if description is not None and description.frame is not None:
        parts = frame_parts(description, description.frame, scene.record.links[k].name)
        lines = sum(e.density * e.section.area * e.length for e in parts.mesh.elements)
        return float(lines + sum(m.mass for m in parts.masses))
    file = None
    if description is not None:
        file = replace(link_description(scene, scene.record.links[k]), description=description)
        if description.matrices is None:  # by its mesh, without a reduction
            model = build_model(file)
            along = np.zeros(model.mass.shape[0])
            along[model.dof_map[:, 0]] = 1.0
            return float(along @ (model.mass @ along))
    return float(link_model(scene, k, lambda text: None, file).mass_properties.mass)


class Objective:
    """Of a problem."""

    def __init__(self, problem: Problem, numbers: LinkNumbers) -> None:
        self.goals, self._masses = problem.record.objective or [Goal()], Masses(problem, numbers)
        self._names = [c.name for c in problem.record.constraints]
        links = [link.name for link in problem.scene.record.links]
        self._weights = np.zeros(len(links))
        for goal in self.goals:
            if goal.quantity == "mass":
                chosen = [not goal.links or name in goal.links for name in links]
                self._weights += goal.weight * np.array(chosen, dtype=float)
        self._over_time = [goal for goal in self.goals if goal.quantity != "mass"]
        self._spans = {c.name: _spans(problem.times(c)) for c in problem.record.constraints}

    def mass(self, x: Array) -> float:
        """Of all links [kg]."""
        return float(self._masses.at(x).sum())

    def weighed(self, x: Array) -> float:
        """The part of masses."""
        return float(self._weights @ self._masses.at(x)) if self._weights.any() else 0.0

    def quadratic(self, x: Array) -> Quadratic:
        """The part of masses about a design: exact where sections have similar shapes."""
        n = len(x)
        f, g, h = self.weighed(x), np.zeros(n), np.zeros((n, n))
        if not self._weights.any():
            return Quadratic(f, g, h)
        steps = _STEP * np.maximum(np.abs(x), 1e-6)
        above, below = (np.array([self.weighed(x + sign * s * e) for s, e in zip(steps, np.eye(n), strict=True)])
                        for sign in (1.0, -1.0))  # fmt: skip
        g, h = (above - below) / (2 * steps), np.diag((above - 2 * f + below) / steps**2)
        for i in range(n):
            for j in range(i):
                both = self.weighed(x + steps * (np.eye(n)[i] + np.eye(n)[j]))
                h[i, j] = h[j, i] = (both - above[i] - above[j] + f) / (steps[i] * steps[j])
        return Quadratic(f, g, h)

    def timed(self, components: Sequence[Array], measures: Sequence[Measure]) -> tuple[float, list[Array]]:
        """The parts of constraints, and their slopes by components (n, q) of every constraint."""
        total, slopes = 0.0, [np.zeros_like(c) for c in components]
        for goal in self._over_time:
            k = self._names.index(goal.of)
            values = measures[k].value(components[k])
            if goal.quantity == "energy":
                span = self._spans[goal.of]
                total += goal.weight * float(span @ values)
                slopes[k] += goal.weight * span[:, None] * measures[k].slope(components[k])
                continue
            power = 2.0 if goal.over_time == "rms" else _SHARP
            largest = max(float(values.max(initial=0.0)), 1e-300)
            mean = float(np.mean((values / largest) ** power))
            total += goal.weight * largest * mean ** (1 / power)
            factor = goal.weight * mean ** (1 / power - 1) * (values / largest) ** (power - 1) / len(values)
            slopes[k] += factor[:, None] * measures[k].slope(components[k])
        return total, slopes


def _spans(times: Array) -> Array:
    """(k,) time that each sample stands for in an integral [s]: half of what lies between it and its neighbours."""
    apart = np.diff(times)
    return np.asarray((np.append(apart, 0.0) + np.append(0.0, apart)) / 2)
