"""Rigid motions: group identities on random members."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.linalg as la

from erls.maths.se3 import inverse, pose, twist_cross, twist_transform
from erls.maths.so3 import cross, fixed_axes, skew
from erls.mechanism.joint_types import JOINT_TYPES

RNG = np.random.default_rng(11)


def _pose() -> np.ndarray:
    return pose(fixed_axes(*RNG.uniform(-3, 3, 3)), RNG.standard_normal(3))


def _hat(twist: np.ndarray) -> np.ndarray:
    result = np.zeros((4, 4))
    result[:3, :3], result[:3, 3] = skew(twist[3:]), twist[:3]
    return result


def test_poses_are_a_group() -> None:
    """Inverse and products, to rounding; rotations stay orthogonal and right-handed."""
    for _ in range(20):
        t = _pose()
        np.testing.assert_allclose(t @ inverse(t), np.eye(4), atol=1e-14)
        assert np.linalg.det(t[:3, :3]) > 0.999


def test_fixed_axes_order() -> None:
    """x first, then y, then z, each about a fixed axis."""
    found = fixed_axes(np.pi / 2, 0, np.pi / 2) @ np.array([0, 1.0, 0])
    np.testing.assert_allclose(found, [0, 0, 1], atol=1e-15)  # y -> z by x; z stays under z


def test_twist_transform_is_a_homomorphism() -> None:
    """X(T1 T2) = X(T2) X(T1), and it is the adjoint: hat(X ν) = T⁻¹ hat(ν) T."""
    for _ in range(20):
        a, b, twist = _pose(), _pose(), RNG.standard_normal(6)
        np.testing.assert_allclose(twist_transform(a @ b), twist_transform(b) @ twist_transform(a), atol=1e-13)
        moved = inverse(a) @ _hat(twist) @ a
        np.testing.assert_allclose(_hat(twist_transform(a) @ twist), moved, atol=1e-13)


def test_bracket() -> None:
    """ad ν is the commutator of hats."""
    for _ in range(20):
        a, b = RNG.standard_normal((2, 6))
        commutator = _hat(a) @ _hat(b) - _hat(b) @ _hat(a)
        np.testing.assert_allclose(_hat(twist_cross(a) @ b), commutator, atol=1e-13)


def test_joint_motion_is_the_exponential_of_its_screw() -> None:
    """All motions of the table of joints against the matrix exponential, and X(θ) = exp(-θ ad ξ)."""
    every = {freedom for kind in JOINT_TYPES.values() for freedom in kind.freedoms or ()}
    freedoms = {replace(freedom, pitch=0.3 * freedom.turns) for freedom in every if not freedom.vector}
    assert {(freedom.axis, freedom.turns) for freedom in freedoms} >= {(0, True), (1, True), (2, True), (2, False)}
    for freedom in freedoms:
        t = freedom.pose(0.7)
        np.testing.assert_allclose(t, la.expm(0.7 * _hat(freedom.screw)), atol=1e-14)
        np.testing.assert_allclose(twist_transform(t), la.expm(-0.7 * twist_cross(freedom.screw)), atol=1e-14)


def test_cross_equals_numpy() -> None:
    """The plain cross product, bit for bit."""
    a, b = RNG.standard_normal((2, 3))
    assert (cross(a, b) == np.cross(a, b)).all()
    np.testing.assert_allclose(skew(a) @ b, np.cross(a, b), atol=1e-15)
