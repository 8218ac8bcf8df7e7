"""Compatibility C(θ) q = 0, the pseudo-inverse, D, G and n, each alone and against finite differences."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import chain_cases
import frozen_values
import numpy as np
import pytest
import scenes
import stiffened_cases
from scipy.linalg import null_space

from erls.equations.erls.paper.compatibility_records import Elimination
from erls.equations.erls.paper.dense_chain import DenseChain
from erls.equations.erls.paper.pack import GAUGES
from erls.errors import SceneError
from erls.maths.se3 import inverse
from erls.mechanism.chain import Mechanism, poses
from erls.mechanism.joint_types import Freedom, X, Y, Z

STEP = 1e-5  # central differences: truncation ~ STEP² = 1e-10, rounding ~ 1e-16 / STEP = 1e-11, both relative
TIME = 0.3


SEVERAL = "joints of several coordinates"


@pytest.fixture(scope="module", params=["revolute", "mixed", "prescribed", "driven screw", "branches", SEVERAL])
def chain(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Mechanism:
    """Three flexible links; all revolute, or with a prismatic joint and both conventions, or one joint driven, or with
    joints that turn and slide at once or along x; a tree of links; cylindrical, universal, planar and fixed joints.
    """
    folder, kind = tmp_path_factory.mktemp("chain"), request.param
    if kind in chain_cases.CASES:
        return chain_cases.mechanism(folder, kind)
    found = scenes.mechanism(scenes.three_links(folder, "prescribed" if kind == "driven screw" else kind))
    if kind == "driven screw":
        freedoms = Freedom(X, True), Freedom(Y, True, pitch=0.1), Freedom(X, False)
        joints = zip(found.joints, freedoms, strict=True)
        return replace(found, joints=tuple(replace(joint, freedom=freedom) for joint, freedom in joints))
    return found


def _random(dense: DenseChain, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates and rates of some metres, radians and centimetres."""
    rng, joints = np.random.default_rng(seed), len(dense.free_joints)
    y = np.concatenate([rng.uniform(-1, 1, joints), 1e-2 * rng.standard_normal(dense.elastic)])
    return y, np.concatenate([rng.uniform(-2, 2, joints), rng.standard_normal(dense.elastic)])


def _at(dense: DenseChain, t: float, y: np.ndarray, v: np.ndarray) -> Elimination:
    """A copy of what follows from compatibility there."""
    found = dense.elimination_at(t, y, v)
    return Elimination(*(values.copy() for values in found))


@pytest.mark.parametrize("gauge", GAUGES)
def test_displacements_satisfy_the_condition(chain: Mechanism, gauge: str) -> None:
    """C(θ) q = 0 to rounding, and the dropped row is the only freedom left."""
    dense = DenseChain(chain, gauge)
    y, v = _random(dense)
    found = _at(dense, TIME, y, v)
    c = np.hstack([found.c_r, found.c_d])
    q = np.concatenate([found.q_r, y[len(dense.free_joints) :]])
    assert np.abs(c @ q).max() <= 1e-13 * np.abs(c).max() * np.abs(q).max() * len(q)
    driven = sum(j.drive.prescribed for j in chain.joints)
    assert c.shape[0] == (6 if gauge == "joint-angle" else 5) * dense.joints + (gauge != "joint-angle") * driven


def test_links_stay_together(chain: Mechanism) -> None:
    """Independently of C: both sides of each joint are displaced alike, from node positions and rotations."""
    dense = DenseChain(chain, "joint-angle")
    theta = _at(dense, TIME, *_random(dense)).place[: dense.joints]
    frames, pairs = poses(chain, theta), []
    for k, below in enumerate(chain.parents):
        if below < 0:
            continue
        inner, outer = chain.links[below], chain.links[k]
        joint = frames[k] @ inverse(chain.joints[k].after)
        moved = []
        for link, node, number in ((inner, chain.joints[k].seat, below), (outer, outer.inboard, k)):
            frame, q = frames[number], dense.links[number].q
            shift, turn = (frame[:3, :3] @ (s @ q) for s in link.model.node_shape(node.node))
            arm = joint[:3, 3] - (frame[:3, :3] @ node.position + frame[:3, 3])
            moved.append(np.concatenate([shift + np.cross(turn, arm), turn]))
        pairs.append(moved)
    inner_moved, outer_moved = np.array(pairs).transpose(1, 0, 2)
    np.testing.assert_allclose(inner_moved, outer_moved, atol=1e-13 * 100 * np.abs(outer_moved).max())


@pytest.mark.parametrize("gauge", GAUGES)
def test_right_inverse_against_numpy(chain: Mechanism, gauge: str) -> None:
    """C_r⁺, its null space and so the smallest q_r, against NumPy's pseudo-inverse by singular values: rounding times
    the condition.
    """
    dense = DenseChain(chain, gauge)
    y, v = _random(dense)
    found = _at(dense, TIME, y, v)
    if not found.counts.all():  # of the norm of the others alone
        return
    plus = np.linalg.pinv(found.c_r)
    rounding = 1e-15 * np.linalg.cond(found.c_r)
    np.testing.assert_allclose(found.plus, plus, atol=100 * rounding * np.abs(plus).max())
    np.testing.assert_allclose(found.null, np.eye(len(plus)) - plus @ found.c_r, atol=100 * rounding)
    assert np.linalg.matrix_rank(found.null, tol=1e-6) == len(plus) - len(found.c_r)
    q_r = -plus @ found.c_d @ y[len(dense.free_joints) :]
    np.testing.assert_allclose(found.q_r, q_r, atol=100 * rounding * np.abs(q_r).max())


def test_places_between_motions_do_not_count(tmp_path: Path) -> None:
    """Of all displacements that meet at the joints that with the smallest of the links is taken, not of what lies
    between the motions of a joint: against NumPy; to 1e-10, by the condition of the norm.
    """
    chain = chain_cases.mechanism(tmp_path, SEVERAL)
    dense = DenseChain(chain, "minimum-norm")
    y, v = _random(dense)
    found = _at(dense, TIME, y, v)
    counts = np.repeat([not link.intermediate for link in chain.links], 6)
    assert 0 < counts.sum() < len(counts)
    along = null_space(found.c_r[:, ~counts].T).T
    free = sum(not joint.drive.prescribed for joint in chain.joints)
    assert len(along) == counts.sum() - free  # six conditions a joint, less its freedoms
    smallest = -np.linalg.pinv(along @ found.c_r[:, counts]) @ along @ found.c_d @ y[len(dense.free_joints) :]
    np.testing.assert_allclose(found.q_r[counts], smallest, atol=1e-10 * np.abs(smallest).max())


def test_joints_without_a_row_are_refused(tmp_path: Path) -> None:
    """No row of compatibility is along a free screw, and three coordinates together move a rotation vector."""
    turning = chain_cases.mechanism(tmp_path, "rotation vectors")
    with pytest.raises(SceneError, match="turns by a rotation vector"):
        _ = DenseChain(turning, "joint-angle").compiled
    chain = scenes.mechanism(scenes.three_links(tmp_path))
    screw = replace(chain.joints[1], freedom=Freedom(Z, True, pitch=0.1))
    with pytest.raises(SceneError, match="turns and slides at once"):
        _ = DenseChain(replace(chain, joints=(chain.joints[0], screw, chain.joints[2])), "minimum-norm").compiled


@pytest.mark.parametrize("order", [1, 2])
def test_derivatives_of_c(chain: Mechanism, order: int) -> None:
    """∂C/∂θ_k and ∂²C/∂θ_k²; mixed derivatives vanish."""
    dense = DenseChain(chain, "joint-angle")
    y, v = _random(dense)

    def matrix(y: np.ndarray, order: int) -> np.ndarray:
        found = _at(dense, TIME, y, v)
        names = ("c", "first", "second")
        return np.hstack([getattr(found, f"{names[order]}_{part}") for part in "rd"])

    exact = matrix(y, order)
    for place, k in enumerate(dense.free_joints):
        step = STEP * np.eye(dense.size)[place]
        difference = (matrix(y + step, order - 1) - matrix(y - step, order - 1)) / (2 * STEP)
        own = slice(6 * k, 6 * k + 6)
        np.testing.assert_allclose(difference[own], exact[own], atol=1e-8 * max(1, np.abs(exact).max()))
        assert np.abs(np.delete(difference, own, axis=0)).max() < 1e-9


@pytest.mark.parametrize("gauge", GAUGES)
def test_g_is_the_derivative_of_d_times_elastic(chain: Mechanism, gauge: str) -> None:
    """G = ∂(D q_d)/∂θ; the published G = -C_r⁺E is not, for the minimum-norm gauge of several links."""
    dense = DenseChain(chain, gauge)
    y, v = _random(dense)
    g = _at(dense, TIME, y, v).g
    for place, k in enumerate(dense.free_joints):
        step = STEP * np.eye(dense.size)[place]
        forward, back = (_at(dense, TIME, y + s, v).q_r for s in (step, -step))
        np.testing.assert_allclose((forward - back) / (2 * STEP), g[:, k], atol=1e-8 * np.abs(g).max())


@pytest.mark.parametrize("gauge", GAUGES)
def test_n_is_the_quadratic_term(chain: Mechanism, gauge: str) -> None:
    """q_r along a curve with θ̈_f = 0, q̈_d = 0: first derivative D q̇_d + G θ̇, second derivative G θ̈ + n."""
    dense = DenseChain(chain, gauge)
    y, v = _random(dense)
    found = _at(dense, TIME, y, v)
    ahead, behind = (_at(dense, TIME + s, y + s * v, v) for s in (STEP, -STEP))
    velocity = found.d @ v[len(dense.free_joints) :] + found.g @ found.rate[: dense.joints]
    np.testing.assert_allclose(velocity, found.qd_r, atol=1e-13 * np.abs(found.qd_r).max())
    np.testing.assert_allclose((ahead.q_r - behind.q_r) / (2 * STEP), velocity, atol=1e-8 * np.abs(velocity).max())
    bending = found.n + found.g @ found.acceleration[: dense.joints]
    np.testing.assert_allclose((ahead.qd_r - behind.qd_r) / (2 * STEP), bending, atol=1e-8 * np.abs(bending).max())


def test_one_link_on_ground_is_constant(tmp_path: Path) -> None:
    """D does not depend on θ, G and n vanish; in the joint-angle gauge the inboard interface is clamped."""
    scenes.l_link(tmp_path)
    chain = scenes.mechanism(scenes.l_scene(tmp_path))
    dense = DenseChain(chain, "joint-angle")
    q_d = np.random.default_rng(0).standard_normal(dense.elastic)
    for theta in (0.0, 1.3):
        found = _at(dense, 0.0, np.array([theta, *q_d]), np.ones(dense.size))
        q = np.concatenate([found.q_r, q_d])
        shift, turn = chain.links[0].model.node_shape(chain.links[0].inboard.node)
        assert np.abs(shift @ q).max() < 1e-12 * np.abs(q).max()
        assert np.abs(turn @ q).max() < 1e-12 * np.abs(q).max() * np.abs(turn).max()
        assert not found.g.any()
        assert not found.n.any()


def _frozen() -> dict[str, np.ndarray]:
    with np.load(frozen_values.FOLDER / "compatibility.npz") as file:
        return dict(file)


FROZEN = _frozen()


@pytest.mark.parametrize("entry", sorted({name.rpartition("/")[0] for name in FROZEN}))
def test_elimination_is_that_of_the_table(entry: str, tmp_path: Path) -> None:
    """q_r, its rate, D, G and n, of second order too, as NumPy's QR factors and sums over Taylor jets gave them: to
    1e-12 of the largest entry, of G and n of what they are sums of.
    """
    kind, case, gauge = entry.split("/")
    cases = {"chains": chain_cases, "stiffened": stiffened_cases}[kind]
    dense = DenseChain(cases.mechanism(tmp_path, case, frozen_values.SOURCE), gauge)
    table = kind if gauge == "joint-angle" else f"{kind}_minimum_norm"
    at, _ = frozen_values.read(table)[case][-1]
    found = dense.elimination_at(at.t, at.y, at.v)
    sizes = {name: np.abs(FROZEN[f"{entry}/{name}"]).max() for name in ("q_r", "qd_r", "d", "g", "n")}
    rate, plus, first = np.abs(found.rate[: dense.joints]).max(), np.abs(found.plus), np.abs(found.first_r)
    sizes["g"] += (plus @ first @ np.abs(found.q_r)).max() + np.abs(found.turned).max()
    bending = np.abs(found.second_r) @ np.abs(found.q_r) * rate + 2 * first @ np.abs(found.qd_r)
    sizes["n"] += (plus @ bending).max() * rate
    for name, size in sizes.items():
        np.testing.assert_allclose(getattr(found, name), FROZEN[f"{entry}/{name}"], rtol=0, atol=1e-12 * size)
