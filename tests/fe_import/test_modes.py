"""Orthonormal modes: six rigid ones, rising elastic ones, kinds, damping; the solvers beneath and the health report."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.linalg as la
import scipy.sparse as sp
from link_files import Array, dense, frame_link, free_frequencies, merged, solid_link, straight_link

import fe_import.solver.sparse
from fe_import.description.records import Damping, Rayleigh
from fe_import.errors import Cause, FEImportError
from fe_import.modal.damping import damping_ratios
from fe_import.models.model import build_model
from fe_import.reduce import reduce_link, reduce_model
from fe_import.solver.lanczos import NotConverged
from fe_import.solver.sparse import dense_modes, factorize, lowest_modes, polishing

OPTIONS: list[dict[str, Any]] = [
    {},
    {"method": "none"},
    {"elastic_modes": 5},
    {"elastic_modes": 5, "truncation": "clamped"},
    {"elastic_modes": 0},
]


@pytest.mark.parametrize("kind", ["frame", "solid"])
@pytest.mark.parametrize("options", OPTIONS, ids=str)
def test_six_rigid_modes_and_orthonormal_elastic_ones(tmp_path: Path, kind: str, options: dict[str, Any]) -> None:
    """UᵀMU = 1 and UᵀKU = ω² of the fields themselves, to 1e-10; frequencies rise; six are exactly zero."""
    link = (frame_link if kind == "frame" else solid_link)(tmp_path, reduction=options)
    model = build_model(link)
    modal = reduce_model(model, link)
    shapes = np.zeros((model.mass.shape[0], modal.modes))
    shapes[model.dof_map[:, :3].ravel()] = modal.translation_shapes.reshape(-1, modal.modes)
    shapes[model.dof_map[modal.rotation_nodes, 3:].ravel()] = modal.rotation_shapes.reshape(-1, modal.modes)
    np.testing.assert_allclose(shapes.T @ (model.mass @ shapes), np.eye(modal.modes), atol=1e-10)
    omega = 2 * np.pi * modal.frequencies_hz
    strain = shapes.T @ (model.stiffness @ shapes)
    scale = np.where(omega > 0, omega, omega[6] if modal.elastic_modes else 1e3)
    np.testing.assert_allclose(strain / np.outer(scale, scale), np.diag((omega / scale) ** 2), atol=1e-6)
    np.testing.assert_array_equal(modal.frequencies_hz[:6], 0.0)
    assert (np.diff(modal.frequencies_hz[6:]) >= 0).all()
    assert (modal.frequencies_hz[6:] > 1).all()
    assert modal.kinds[:6] == ("rigid-body",) * 6
    assert "rigid-body" not in modal.kinds[6:]
    np.testing.assert_allclose(modal.stiffness, np.diag(omega**2), rtol=1e-14)
    np.testing.assert_array_equal(modal.invariants.rigid[6:], 0.0)


def test_free_free_beam(tmp_path: Path) -> None:
    """Free-free Euler-Bernoulli beam, βL = 4.73004 and 7.85320, torsion n/2L √(GJ/ρI_p), axial n/2L √(E/ρ); kinds.

    1e-4 in bending (order 4), 3e-3 in torsion and axial with 24 elements: order 2, (nπ/24)²/24.
    """
    changes = {"frame": {"theory": "euler-bernoulli", "rotary_inertia": False}}
    modal = reduce_link(straight_link(tmp_path, 1.0, 24, **changes, reduction={"method": "none", "elastic_modes": 30}))
    g, j, polar = 7e10 / 2.66, 0.2286816 * 0.02 * 0.01**3, 2e-4 * (0.01**2 + 0.02**2) / 12

    def bending(inertia: float) -> Array:
        roots = np.array([4.73004074, 7.85320462])
        return roots**2 * math.sqrt(7e10 * inertia / (2700 * 2e-4)) / (2 * np.pi)

    n = np.array([1, 2])
    for kind, expected, tolerance in (
        ("bending about y", bending(0.01 * 0.02**3 / 12), 1e-4),
        ("bending about z", bending(0.02 * 0.01**3 / 12), 1e-4),
        ("torsion", n / 2 * math.sqrt(g * j / (2700 * polar)), 3e-3),
        ("axial", n / 2 * math.sqrt(7e10 / 2700), 3e-3),
    ):
        found = modal.frequencies_hz[[k == kind for k in modal.kinds]][:2]
        np.testing.assert_allclose(found[: len(expected)], expected[: len(found)], rtol=tolerance, err_msg=kind)
        assert len(found) >= 1


def test_kinds_of_a_solid(tmp_path: Path) -> None:
    """Interface or interior by strain energy: without fixed-interface modes all are of the interfaces."""
    only = reduce_link(solid_link(tmp_path, reduction={"fixed_interface_modes": 0}))
    assert only.kinds[6:] == ("interface",) * 6
    more = reduce_link(solid_link(tmp_path, reduction={"fixed_interface_modes": 20}))
    assert set(more.kinds[6:]) == {"interface", "interior"}
    whole = reduce_link(solid_link(tmp_path, reduction={"method": "none", "elastic_modes": 2}))
    assert whole.kinds[6:] == ("elastic",) * 2


def test_a_distant_origin_costs_no_digits(tmp_path: Path) -> None:
    """A link modelled 1 km from the origin: same frequencies (1e-9) and inertia about its centre of mass (1e-9).

    1 km of 0.7 m costs 3 digits in positions, twice as many where squares of distances from the origin are taken.
    """
    near = reduce_link(frame_link(tmp_path))
    shift = np.array([600.0, -500.0, 700.0])
    nodes = {"root": [0.1, 0.0, 0.0], "elbow": [0.5, 0.1, 0.05], "tip": [0.6, 0.5, -0.1]}
    far = reduce_link(
        frame_link(tmp_path, frame={"nodes": {k: (np.array(v) + shift).tolist() for k, v in nodes.items()}})
    )
    np.testing.assert_allclose(far.frequencies_hz[6:], near.frequencies_hz[6:], rtol=1e-9)
    np.testing.assert_allclose(far.mass_properties.centre_of_mass, near.mass_properties.centre_of_mass + shift)
    np.testing.assert_allclose(np.abs(far.translation_shapes[:, :, 6:]), np.abs(near.translation_shapes[:, :, 6:]),
                               atol=1e-6 * np.abs(near.translation_shapes).max())  # fmt: skip


def test_repeated_frequencies(tmp_path: Path) -> None:
    """A straight bar of square section bends alike both ways: pairs to 1e-9, orthonormal, none lost."""
    modal = reduce_link(straight_link(tmp_path, 0.5, 12, sections={"s": {"width": 0.02}}, reduction={"method": "none"}))
    bending = modal.frequencies_hz[[k.startswith("bending") for k in modal.kinds]][:8]
    np.testing.assert_allclose(bending[::2], bending[1::2], rtol=1e-9)
    assert (np.diff(bending[::2]) > 1).all()
    assert all(c.ok for c in modal.health)


# ----- a link must resist and must weigh


@pytest.mark.parametrize("direction", [[1.0, 0.0, 0.0], [0.3, -0.5, 0.7]])
@pytest.mark.parametrize("method", ["craig-bampton", "craig-chang", "guyan", "none"])
def test_mass_on_one_line(tmp_path: Path, direction: list[float], method: str) -> None:
    """A straight link of point masses has no inertia about its own line, however it lies; a body off it is enough."""
    end = (0.5 * np.array(direction)).tolist()
    frame = {
        "mass": "lumped",
        "rotary_inertia": False,
        "nodes": {"root": [0.0, 0.0, 0.0], "tip": end},
        "members": [{"from": "root", "to": "tip", "elements": 4, "material": "m", "section": "s"}],
    }
    base = straight_link(tmp_path, 1.0, 1, frame=frame, reduction={"method": method})
    with pytest.raises(FEImportError, match="no inertia about some axis") as caught:
        reduce_link(base)
    assert caught.value.cause is Cause.NOT_DEFINITE
    assert caught.value.where == str(base.path)
    assert caught.value.remedy
    masses = [{"node": "tip", "inertia": [1e-5, 1e-5, 1e-5]}]
    loaded = reduce_link(straight_link(tmp_path, 1.0, 1, frame=frame, masses=masses, reduction={"method": method}))
    assert all(c.ok for c in loaded.health), loaded.health


def test_thin_wire_is_not_taken_for_a_line(tmp_path: Path) -> None:
    """Length 1 m, diameter 0.1 mm: inertia about the line is 4e-9 of that across; a legal link."""
    section = {"shape": "circular", "diameter": 1e-4}
    data = merged({"sections": {"w": section}}, {})
    member = {"from": "root", "to": "tip", "elements": 4, "material": "m", "section": "w"}
    modal = reduce_link(straight_link(tmp_path, 1.0, 1, **data, frame={"members": [member]}))
    assert all(c.ok for c in modal.health), modal.health
    along = modal.mass_properties.inertia[0, 0]
    area = math.pi * 1e-8 / 4
    assert along == pytest.approx(2700 * area * 1e-8 / 8, rel=1e-6)


def test_loose_inner_part_is_refused(tmp_path: Path) -> None:
    """A hinge inside the link, made by deleting stiffness: the inner stiffness is singular."""
    link = frame_link(tmp_path)
    model = build_model(link)
    node = model.node_names["elbow"]
    keep = np.ones(model.mass.shape[0])
    keep[model.dof_map[node]] = 0.0
    d = sp.diags_array(keep)
    loose = replace(model, stiffness=(d @ model.stiffness @ d).tocsc(), stiffness_parts={})
    with pytest.raises(FEImportError) as caught:
        reduce_model(loose, link)
    assert caught.value.cause in (Cause.GROUNDED, Cause.NOT_DEFINITE)
    assert caught.value.remedy


# ----- solvers


def chain(count: int, seed: int = 0) -> tuple[sp.csc_array, sp.csc_array]:
    """Stiffness and mass of two equal spring chains side by side (every frequency twice), fixed at one end."""
    one = sp.diags_array([[-1.0] * (count - 1), [2.0] * count, [-1.0] * (count - 1)], offsets=[-1, 0, 1])
    return sp.block_diag([one, one], format="csc"), sp.eye_array(2 * count, format="csc")


def chain_frequencies(count: int) -> Array:
    """2 sin(kπ / 2(n + 1)), k = 1 ... n."""
    return 2 * np.sin(np.arange(1, count + 1) * np.pi / (2 * (count + 1)))


@pytest.mark.parametrize("count", [50, 400])  # LAPACK, Lanczos
def test_lowest_modes_find_both_of_a_pair(count: int) -> None:
    stiffness, mass = chain(count)
    omega, modes = lowest_modes(stiffness, mass, 20, "chain")
    np.testing.assert_allclose(omega, np.repeat(chain_frequencies(count)[:10], 2), rtol=1e-9)
    np.testing.assert_allclose(modes.T @ (mass @ modes), np.eye(20), atol=1e-12)
    again = lowest_modes(stiffness, mass, 20, "chain")
    np.testing.assert_array_equal(again[1], modes)


def test_a_missed_mode_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lanczos that returns one member of the second pair only: Sylvester's count tells."""
    stiffness, mass = chain(400)
    true = fe_import.solver.sparse.lowest_eigenpairs

    def lazy(solve: Any, mass: sp.csc_array, count: int) -> tuple[Array, Array]:
        mu, modes = true(solve, mass, count + 1)
        return np.delete(mu, 2), np.delete(modes, 2, axis=1)

    monkeypatch.setattr(fe_import.solver.sparse, "lowest_eigenpairs", lazy)
    with pytest.raises(FEImportError, match="were missed") as caught:
        lowest_modes(stiffness, mass, 9, "chain")
    assert caught.value.cause is Cause.EIGENSOLVER
    assert caught.value.exit_code == 3
    assert caught.value.remedy


def test_a_wrong_mode_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Eigenpairs that do not satisfy the equation, and a solver that gives up."""
    stiffness, mass = chain(400)
    true = fe_import.solver.sparse.lowest_eigenpairs

    def sloppy(*arguments: Any) -> tuple[Array, Array]:
        mu, modes = true(*arguments)
        return mu * (1 + 1e-4), modes

    def failing(*arguments: Any) -> tuple[Array, Array]:
        raise NotConverged

    for broken, words in ((sloppy, "did not converge"), (failing, "modes of the chain")):
        monkeypatch.setattr(fe_import.solver.sparse, "lowest_eigenpairs", broken)
        with pytest.raises(FEImportError, match=words) as caught:
            lowest_modes(stiffness, mass, 9, "chain")
        assert caught.value.cause is Cause.EIGENSOLVER
        assert caught.value.remedy


def test_no_modes_to_find() -> None:
    stiffness, mass = chain(5)
    assert lowest_modes(stiffness, mass, 0, "chain")[1].shape == (10, 0)
    assert lowest_modes(stiffness, 0 * mass, 3, "chain")[1].shape == (10, 0)
    empty = sp.csc_array((0, 0))
    assert lowest_modes(empty, empty, 3, "chain")[0].shape == (0,)
    omega, modes = dense_modes(np.eye(3), np.zeros((3, 3)), None, "x")
    assert (omega.shape, modes.shape) == ((0,), (3, 0))


def test_massless_directions_have_no_mode() -> None:
    """Of ten masses two without mass: eight modes, the others condensed; against K - K K⁻¹ K condensed by hand."""
    stiffness, _ = chain(5)
    weights = np.array([1.0, 0.0, 2.0, 3.0, 0.0, 1.0, 1.0, 1.0, 1.0, 1.0])
    omega, _ = dense_modes(stiffness.toarray(), np.diag(weights), None, "chain")
    massive = weights > 0
    flexibility = la.inv(stiffness.toarray())[np.ix_(massive, massive)]
    expected = 1 / np.sqrt(la.eigvals(flexibility @ np.diag(weights[massive])).real)
    np.testing.assert_allclose(omega, np.sort(expected), rtol=1e-12)


SINGULAR = [
    np.zeros((4, 4)),
    np.ones((4, 4)),
    np.diag([1.0, 2.0, 0.0, 3.0]),
    np.eye(4) - 1 / 4,
    np.diag([1.0, 2.0, -1e-3, 3.0]),
    np.eye(4) - 1 / 3,
]


@pytest.mark.parametrize("solver", ["dense", "sparse"])
@pytest.mark.parametrize("matrix", SINGULAR)
def test_singular_and_indefinite_matrices_are_named(solver: str, matrix: Array) -> None:
    def solve() -> None:
        if solver == "dense":
            dense_modes(matrix, np.eye(4), None, "x")
        else:
            factorize(sp.csc_array(matrix), "x")

    with pytest.raises(FEImportError, match="x is singular or unstable") as caught:
        solve()
    assert caught.value.cause is Cause.NOT_DEFINITE
    assert caught.value.remedy


def test_factorization_solves() -> None:
    rng = np.random.default_rng(0)
    a = rng.standard_normal((30, 30))
    matrix = a @ a.T + np.eye(30)
    right = rng.standard_normal((30, 4))
    np.testing.assert_allclose(factorize(sp.csc_array(matrix), "x")(right), la.solve(matrix, right), rtol=1e-9)


def test_polishing_of_disturbed_modes() -> None:
    """Modes over 5 decades of ω², disturbed like rounding does: orthonormal to 1e-13, diagonal to 1e-9 again."""
    rng = np.random.default_rng(1)
    size, omega = 40, np.geomspace(1.0, 10**2.5, 40)
    modes = la.qr(rng.standard_normal((size, size)))[0]
    stiffness = modes * omega**2 @ modes.T
    rough = modes + 1e-7 * modes @ np.triu(rng.standard_normal((size, size)), 1)
    frequencies, change = polishing(stiffness, np.eye(size), omega, rough)
    better = rough @ change
    np.testing.assert_allclose(better.T @ better, np.eye(size), atol=1e-13)
    assert (np.diff(frequencies) >= 0).all()
    np.testing.assert_allclose(frequencies, omega, rtol=1e-10)
    assert np.abs(change - np.eye(size)).max() < 1e-4
    strain = better.T @ stiffness @ better / np.outer(omega, omega)
    np.testing.assert_allclose(np.diag(strain), 1, atol=1e-9)


def test_polishing_keeps_a_pair_in_order() -> None:
    """Two close frequencies on both sides of the spectrum's middle (10), the upper one found to be the lower one."""
    true = np.array([1.0, 9.99999995, 9.9999999, 100.0])
    found = np.array([1.0, 9.99999995, 10.0000001, 100.0])
    frequencies, change = polishing(np.diag(true**2), np.eye(4), found, np.eye(4))
    np.testing.assert_allclose(frequencies, np.sort(true), rtol=1e-14)
    np.testing.assert_allclose(change, np.eye(4)[:, [0, 2, 1, 3]], atol=1e-14)


# ----- damping


def test_damping_formulas() -> None:
    """None, one ratio, ratios from the lowest on, Rayleigh's α/2ω + βω/2; rigid modes are free of it."""
    omega = np.array([0.0] * 6 + [10.0, 40.0, 100.0])
    for damping, expected in (
        (Damping(), [0, 0, 0]),
        (Damping(ratio=0.02), [0.02] * 3),
        (Damping(ratios=[0.01, 0.03]), [0.01, 0.03, 0]),
        (Damping(ratios=[]), [0, 0, 0]),
        (Damping(rayleigh=Rayleigh(alpha=2.0, beta=1e-3)), [0.1 + 0.005, 0.025 + 0.02, 0.01 + 0.05]),
        (Damping(rayleigh=Rayleigh(beta=2e-3)), [0.01, 0.04, 0.1]),
    ):
        found = damping_ratios(damping, omega, "l.toml")
        np.testing.assert_allclose(found, [0] * 6 + expected, rtol=1e-14)


def test_rayleigh_damping_is_a_damping_matrix(tmp_path: Path) -> None:
    """2ζω on the diagonal equals Uᵀ(αM + βK)U."""
    modal = reduce_link(frame_link(tmp_path, damping={"rayleigh": {"alpha": 3.0, "beta": 1e-4}}))
    omega = 2 * np.pi * modal.frequencies_hz
    matrix = 3.0 * modal.invariants.m + 1e-4 * modal.stiffness
    np.testing.assert_allclose(2 * (modal.damping_ratios * omega)[6:], np.diag(matrix)[6:], rtol=1e-10)


# ----- the reference of these tests


def test_reference_of_these_tests(tmp_path: Path) -> None:
    """The extended-precision frequencies agree with LAPACK's to what LAPACK can give here, 1e-8."""
    model = build_model(frame_link(tmp_path))
    mass, stiffness, _ = dense(model)
    plain = np.sqrt(la.eigh(stiffness, mass, eigvals_only=True)[6:12]) / (2 * np.pi)
    np.testing.assert_allclose(free_frequencies(model, 6), plain, rtol=1e-8)
