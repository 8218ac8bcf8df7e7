"""Lie groups as one interface: rotations, rigid motions, translations beside rotations, vectors, and their products.

Elements of a product are tuples; poses (..., 4, 4) hold the members of SE(3) and of R³×SO(3) alike, so that a node may
belong to either. On SE(3) an increment [u; ψ] is a twist in the moved axes; on R³×SO(3) u lies in the fixed axes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from erls.maths import motion_maps, rotation_maps
from erls.maths.so3 import Array

Element = Any  # an array, or a tuple of elements of the factors


@dataclass(frozen=True)
class Group:
    """A Lie group with left-invariant velocities: q̇ = q ν̃.

    Attributes
    ----------
    dimension : int
        n of increments and velocities (..., n).
    compose, inverse : callable
        Product and inverse of elements.
    exp, log : callable
        Increment to element and back; ``exp(log(q)) = q`` everywhere.
    adjoint : callable
        (..., n, n) Ad of an element: hat(Ad ξ) = q hat(ξ) q⁻¹.
    bracket : callable
        (..., n, n) ad of an increment.
    tangent, tangent_inverse : callable
        (..., n, n) T of an increment: ν = T ξ̇ where q = exp ξ; the inverse is infinite where a turn reaches 2π.
    """

    name: str
    dimension: int
    compose: Callable[[Element, Element], Element]
    inverse: Callable[[Element], Element]
    exp: Callable[[Array], Element]
    log: Callable[[Element], Array]
    adjoint: Callable[[Element], Array]
    bracket: Callable[[Array], Array]
    tangent: Callable[[Array], Array]
    tangent_inverse: Callable[[Array], Array]

    def move(self, q: Element, increment: Array) -> Element:
        """q ∘ exp(increment)."""
        return self.compose(q, self.exp(increment))


def vectors(size: int) -> Group:
    """Rⁿ with addition."""

    def eye(x: Array) -> Array:
        return np.broadcast_to(np.eye(size), (*np.shape(x)[:-1], size, size))

    def zero(x: Array) -> Array:
        return np.zeros((*np.shape(x)[:-1], size, size))

    return Group(f"R^{size}", size, np.add, np.negative, np.array, np.array, eye, zero, eye, eye)


def product(*factors: Group) -> Group:
    """Direct product; increments are concatenated."""
    ends = np.cumsum([f.dimension for f in factors])
    parts = [slice(int(e) - f.dimension, int(e)) for e, f in zip(ends, factors, strict=True)]

    def each(name: str) -> Callable[..., Element]:
        maps = [getattr(f, name) for f in factors]
        return lambda *q: tuple(m(*of) for m, *of in zip(maps, *q, strict=True))

    def diagonal(blocks: list[Array]) -> Array:
        result = np.zeros((*np.broadcast_shapes(*(b.shape[:-2] for b in blocks)), ends[-1], ends[-1]))
        for at, block in zip(parts, blocks, strict=True):
            result[..., at, at] = block
        return result

    def on_elements(name: str) -> Callable[[Element], Array]:
        maps = [getattr(f, name) for f in factors]
        return lambda q: diagonal([m(of) for m, of in zip(maps, q, strict=True)])

    def on_increments(name: str) -> Callable[[Array], Array]:
        maps = [getattr(f, name) for f in factors]
        return lambda x: diagonal([m(x[..., at]) for m, at in zip(maps, parts, strict=True)])

    def exp(x: Array) -> Element:
        return tuple(f.exp(x[..., at]) for f, at in zip(factors, parts, strict=True))

    def log(q: Element) -> Array:
        return np.concatenate([f.log(of) for f, of in zip(factors, q, strict=True)], axis=-1)

    name = "×".join(f.name for f in factors)
    tangents = on_increments("tangent"), on_increments("tangent_inverse")
    maps = each("compose"), each("inverse"), exp, log, on_elements("adjoint"), on_increments("bracket")
    return Group(name, int(ends[-1]), *maps, *tangents)


def _over_poses(group: Group) -> Group:
    """The product R³×SO(3) with its members stored as poses."""

    def split(h: Array) -> tuple[Array, Array]:
        return h[..., :3, 3], h[..., :3, :3]

    def join(q: Element) -> Array:
        return motion_maps.poses(q[1], q[0])

    return Group(
        group.name,
        group.dimension,
        lambda a, b: join(group.compose(split(a), split(b))),
        lambda a: join(group.inverse(split(a))),
        lambda x: join(group.exp(x)),
        lambda a: group.log(split(a)),
        lambda a: group.adjoint(split(a)),
        group.bracket,
        group.tangent,
        group.tangent_inverse,
    )


def _transpose(r: Array) -> Array:
    return np.swapaxes(r, -1, -2)


SO3 = Group(
    "SO(3)",
    3,
    np.matmul,
    _transpose,
    rotation_maps.exp,
    rotation_maps.log,
    np.array,
    rotation_maps.skews,
    rotation_maps.tangent,
    rotation_maps.tangent_inverse,
)
SE3 = Group(
    "SE(3)",
    6,
    np.matmul,
    motion_maps.inverse,
    motion_maps.exp,
    motion_maps.log,
    motion_maps.adjoint,
    motion_maps.bracket,
    motion_maps.tangent,
    motion_maps.tangent_inverse,
)
R3_SO3 = _over_poses(product(vectors(3), SO3))
