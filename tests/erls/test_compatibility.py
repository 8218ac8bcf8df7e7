"""Compatibility C(θ) q = 0, the pseudo-inverse, D, G and n, each alone and against finite differences."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scenes

from erls.equations.erls.paper.compatibility import (
    GAUGES,
    Compatibility,
    compatibility_matrix,
    joint_rows,
    layout,
    right_inverse,
)
from erls.maths.se3 import inverse
from erls.mechanism.chain import Mechanism, poses

STEP = 1e-5  # central differences: truncation ~ STEP² = 1e-10, rounding ~ 1e-16 / STEP = 1e-11, both relative


@pytest.fixture(scope="module", params=["revolute", "mixed", "prescribed"])
def chain(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Mechanism:
    """Three flexible links; all revolute, or with a prismatic joint and both conventions, or one joint driven."""
    folder = tmp_path_factory.mktemp("chain")
    return scenes.mechanism(scenes.three_links(folder, request.param))


def _random(mechanism: Mechanism, seed: int = 0) -> tuple[np.ndarray, ...]:
    rng = np.random.default_rng(seed)
    elastic = sum(link.elastic_modes for link in mechanism.links)
    theta = rng.uniform(-1, 1, 3)
    return theta, rng.uniform(-2, 2, 3), 1e-2 * rng.standard_normal(elastic), rng.standard_normal(elastic)


@pytest.mark.parametrize("gauge", GAUGES)
def test_displacements_satisfy_the_condition(chain: Mechanism, gauge: str) -> None:
    """C(θ) q = 0 to rounding, and the dropped row is the only freedom left."""
    theta, _, q_d, _ = _random(chain)
    compatibility = Compatibility(chain, gauge)
    q, _ = compatibility.displacement(theta, q_d)
    c = compatibility_matrix(compatibility.rows, compatibility.layout, theta)
    assert np.abs(c @ q).max() <= 1e-13 * np.abs(c).max() * np.abs(q).max() * len(q)
    driven = sum(j.drive.prescribed for j in chain.joints)
    assert c.shape[0] == (18 if gauge == "joint-angle" else 15 + driven)


def test_links_stay_together(chain: Mechanism) -> None:
    """Independently of C: both sides of each joint are displaced alike, from node positions and rotations."""
    theta, _, q_d, _ = _random(chain)
    compatibility = Compatibility(chain, "joint-angle")
    q, _ = compatibility.displacement(theta, q_d)
    frames = poses(chain, theta)
    for k in range(1, 3):
        inner, outer = chain.links[k - 1], chain.links[k]
        joint = frames[k] @ inverse(chain.joints[k].after)
        moved = []
        for link, node, frame, modes in (
            (inner, chain.joints[k].seat, frames[k - 1], compatibility.layout.modes[k - 1]),
            (outer, outer.inboard, frames[k], compatibility.layout.modes[k]),
        ):
            shift, turn = (frame[:3, :3] @ (s @ q[modes]) for s in link.model.node_shape(node.node))
            arm = joint[:3, 3] - (frame[:3, :3] @ node.position + frame[:3, 3])
            moved.append(np.concatenate([shift + np.cross(turn, arm), turn]))
        np.testing.assert_allclose(moved[0], moved[1], atol=1e-13 * 100 * np.abs(moved[0]).max())


def test_minimum_norm_is_smallest(chain: Mechanism) -> None:
    """No other rigid displacement with the same elastic one is smaller (right pseudo-inverse)."""
    theta, _, q_d, _ = _random(chain)
    free = Compatibility(chain, "minimum-norm")
    q, _ = free.displacement(theta, q_d)
    c_r = compatibility_matrix(free.rows, free.layout, theta)[:, free.layout.rigid]
    null = right_inverse(c_r).null_projector
    assert null is not None
    q_r = q[free.layout.rigid]
    assert np.abs(null @ q_r).max() <= 1e-12 * np.abs(q_r).max()


def test_right_inverse_against_numpy() -> None:
    """C C⁺ = 1 and C⁺ equals numpy's SVD-based pseudo-inverse; tolerance: rounding times the condition (< 1e3)."""
    c = np.random.default_rng(3).standard_normal((11, 14))
    found = right_inverse(c)
    np.testing.assert_allclose(found.pseudo_inverse, np.linalg.pinv(c), atol=1e-12)
    np.testing.assert_allclose(found.null_projector, np.eye(14) - np.linalg.pinv(c) @ c, atol=1e-12)
    assert right_inverse(c[:, :11]).null_projector is None


@pytest.mark.parametrize("order", [1, 2])
def test_derivatives_of_c(chain: Mechanism, order: int) -> None:
    """∂C/∂θ_k and ∂²C/∂θ_k²; mixed derivatives vanish."""
    theta = _random(chain)[0]
    rows, places = joint_rows(chain, "joint-angle"), layout(chain)
    exact = compatibility_matrix(rows, places, theta, order)
    for k in range(3):
        step = STEP * np.eye(3)[k]
        difference = (
            compatibility_matrix(rows, places, theta + step, order - 1)
            - compatibility_matrix(rows, places, theta - step, order - 1)
        ) / (2 * STEP)
        own = slice(6 * k, 6 * k + 6)
        np.testing.assert_allclose(difference[own], exact[own], atol=1e-8 * max(1, np.abs(exact).max()))
        assert order == 2 or np.abs(np.delete(difference, own, axis=0)).max() < 1e-9


@pytest.mark.parametrize("gauge", GAUGES)
def test_g_is_the_derivative_of_d_times_elastic(chain: Mechanism, gauge: str) -> None:
    """G = ∂(D q_d)/∂θ; the published G = -C_r⁺E is not, for the minimum-norm gauge of several links."""
    theta, _, q_d, _ = _random(chain)
    compatibility = Compatibility(chain, gauge)
    _, _, g = compatibility.velocity(theta, q_d)
    rigid = compatibility.layout.rigid
    for k in range(3):
        step = STEP * np.eye(3)[k]
        forward, back = (compatibility.displacement(theta + s, q_d)[0][rigid] for s in (step, -step))
        np.testing.assert_allclose((forward - back) / (2 * STEP), g[:, k], atol=1e-8 * np.abs(g).max())


@pytest.mark.parametrize("gauge", GAUGES)
def test_n_is_the_quadratic_term(chain: Mechanism, gauge: str) -> None:
    """q_r along a curve with θ̈ = 0, q̈_d = 0: first derivative D q̇_d + G θ̇, second derivative n."""
    theta, rates, q_d, qd_d = _random(chain)
    compatibility = Compatibility(chain, gauge)
    rigid = compatibility.layout.rigid
    _, qd, _, _, n = compatibility.acceleration(theta, rates, q_d, qd_d)

    def along(t: float) -> np.ndarray:
        _, d, g = compatibility.velocity(theta + t * rates, q_d + t * qd_d)
        return d @ qd_d + g @ rates

    np.testing.assert_allclose(along(0.0), qd[rigid], atol=1e-13 * np.abs(qd).max())
    difference = (along(STEP) - along(-STEP)) / (2 * STEP)
    np.testing.assert_allclose(difference, n, atol=1e-8 * np.abs(n).max())


def test_one_link_on_ground_is_constant(tmp_path: Path) -> None:
    """D does not depend on θ, G and n vanish; in the joint-angle gauge the inboard interface is clamped."""
    scenes.l_link(tmp_path)
    chain = scenes.mechanism(scenes.l_scene(tmp_path))
    compatibility = Compatibility(chain, "joint-angle")
    q_d = np.random.default_rng(0).standard_normal(chain.links[0].elastic_modes)
    for theta in (0.0, 1.3):
        q, _, g = compatibility.velocity(np.array([theta]), q_d)
        shift, turn = chain.links[0].model.node_shape(chain.links[0].inboard.node)
        assert np.abs(shift @ q).max() < 1e-12 * np.abs(q).max()
        assert np.abs(turn @ q).max() < 1e-12 * np.abs(q).max() * np.abs(turn).max()
        assert not g.any()
