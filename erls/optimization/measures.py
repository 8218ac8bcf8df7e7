"""What is held against a limit: convex functions of a few components that depend nearly linearly on the motion.

Rules for a new measure: it is convex and positively homogeneous, so that approximations of its components make convex
problems; ``slope`` is a subgradient where it has an edge.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from erls.maths.so3 import Array

_TINY = 1e-300


class Measure(Protocol):
    """Of components (n, q)."""

    def value(self, components: Array) -> Array:
        """(n,)"""

    def slope(self, components: Array) -> Array:
        """(n, q) by the components."""


class Itself:
    """A single component as it is."""

    def value(self, components: Array) -> Array:
        """(n,)"""
        return components[:, 0]

    def slope(self, components: Array) -> Array:
        """(n, 1)"""
        return np.ones_like(components)


class Length:
    """Root of the sum of squares."""

    def value(self, components: Array) -> Array:
        """(n,)"""
        return np.asarray(np.linalg.norm(components, axis=1))

    def slope(self, components: Array) -> Array:
        """(n, q)"""
        return np.asarray(components / np.maximum(np.linalg.norm(components, axis=1, keepdims=True), _TINY))


class RoundSection:
    """|N| + √(My² + Mz²): the largest normal stress of a round section, of stresses by axial force and bendings."""

    def value(self, components: Array) -> Array:
        """(n,)"""
        return np.asarray(np.abs(components[:, 0]) + np.linalg.norm(components[:, 1:], axis=1))

    def slope(self, components: Array) -> Array:
        """(n, 3)"""
        bending = components[:, 1:] / np.maximum(np.linalg.norm(components[:, 1:], axis=1, keepdims=True), _TINY)
        return np.concatenate([np.sign(components[:, :1]), bending], axis=1)


class AbsoluteSum:
    """Σ |c|: of powers; of |N| + |My| + |Mz| it is the largest normal stress of a rectangular section."""

    def value(self, components: Array) -> Array:
        """(n,)"""
        return np.asarray(np.abs(components).sum(axis=1))

    def slope(self, components: Array) -> Array:
        """(n, q)"""
        return np.sign(components)
