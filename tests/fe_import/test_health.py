"""The health report: what it says of sound links, and each fault it must find."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg as la
import scipy.sparse as sp
from link_files import FRAME, dense, frame_link, solid_link, straight_link

from fe_import.description.link import LinkFile
from fe_import.description.reduction import Reduction
from fe_import.errors import Cause, FEImportError
from fe_import.health.report import check_basis, check_completeness, check_model
from fe_import.health.rigid_motion import rigid_motion_as_eigenmodes, rigid_motion_by_stiffness
from fe_import.model import FEModel
from fe_import.models.model import build_model
from fe_import.reduce import reduce_link
from fe_import.reduction import REDUCTIONS
from fe_import.reduction.free_body import free_body
from fe_import.reduction.modes import orthonormal_modes, reduced_matrices
from fe_import.solver.sparse import modes_below


def value(model_health: object, start: str) -> float:
    """Value of the one check whose name begins so."""
    (found,) = [c.value for c in model_health if c.name.startswith(start)]  # type: ignore[attr-defined]
    return float(found)


@pytest.mark.parametrize("make", [frame_link, solid_link], ids=["frame", "solid"])
@pytest.mark.parametrize("method", ["craig-bampton", "none"])
def test_sound_links_pass(tmp_path: Path, make: Callable[..., LinkFile], method: str) -> None:
    """Every check is named once and passed; no free-free mode is missing; rigid motions agree in all three ways."""
    modal = reduce_link(make(tmp_path, reduction={"method": method}))
    names = [c.name for c in modal.health]
    assert len(names) == len(set(names)) >= 15
    assert all(c.ok and c.value >= 0 for c in modal.health), modal.health
    assert value(modal.health, "free-free modes below") == 0
    assert value(modal.health, "rigid-body motion by stiffness") < 1e-7
    assert value(modal.health, "rigid-body eigenmodes") < 1e-8


def test_effective_mass_is_reported(tmp_path: Path) -> None:
    """The share of the least direction, equal to the table's column sums."""
    modal = reduce_link(frame_link(tmp_path))
    shares = modal.fixed_interface.effective_mass.sum(axis=0)[:3]
    assert value(modal.health, "share of mass") == pytest.approx(shares.min(), rel=1e-12)


def ground(model: FEModel) -> FEModel:
    spring = sp.coo_array(([1e-3 * model.stiffness.max()], ([1], [1])), shape=model.stiffness.shape)
    return replace(model, stiffness=(model.stiffness + spring).tocsc())


def one_triangle(model: FEModel) -> FEModel:
    return replace(model, stiffness=sp.triu(model.stiffness).tocsc())


def negative_mass(model: FEModel) -> FEModel:
    """Indefinite though its diagonal is positive: an off-diagonal pair too large."""
    mass = model.mass.tolil()
    size = 3 * np.sqrt(mass[0, 0] * mass[6, 6])
    mass[0, 6] += size
    mass[6, 0] += size
    return replace(model, mass=mass.tocsc())


def negative_diagonal(model: FEModel) -> FEModel:
    point = sp.coo_array(([-10 * model.mass.max()], ([0], [0])), shape=model.mass.shape)
    return replace(model, mass=(model.mass + point).tocsc())


FAULTS = [
    (ground, Cause.GROUNDED, "grounding force"),
    (one_triangle, Cause.NOT_DEFINITE, "stiffness matrix: asymmetry"),
    (negative_mass, Cause.NOT_DEFINITE, "motions of negative kinetic energy"),
    (negative_diagonal, Cause.NOT_DEFINITE, "mass matrix: negative diagonal"),
    (lambda m: replace(m, stiffness=-m.stiffness), Cause.NOT_DEFINITE, "stiffness matrix: negative diagonal"),
    (lambda m: replace(m, nodes=m.nodes[::-1].copy()), Cause.GROUNDED, "grounding force"),
]


@pytest.mark.parametrize(("spoil", "cause", "message"), FAULTS)
def test_faulty_matrices_are_refused(
    tmp_path: Path, spoil: Callable[[FEModel], FEModel], cause: Cause, message: str
) -> None:
    model = replace(build_model(frame_link(tmp_path)), kind="matrices")
    check_model(model, "sound")
    with pytest.raises(FEImportError, match=message) as caught:
        check_model(spoil(model), "link.toml")
    assert caught.value.cause is cause
    assert caught.value.remedy


def test_singular_mass_is_legal(tmp_path: Path) -> None:
    """Lumped translational masses: the rotations have none."""
    model = build_model(frame_link(tmp_path, frame={"mass": "lumped", "rotary_inertia": False}))
    assert la.eigvalsh(model.mass.toarray())[0] == 0
    assert all(c.ok for c in check_model(replace(model, kind="matrices"), "x"))


def basis_of(model: FEModel, **options: object) -> tuple:
    basis = REDUCTIONS["craig-bampton"](model, Reduction(**options), "x")  # type: ignore[arg-type]
    return basis, *reduced_matrices(model, basis)


def test_rigid_motions_tell_faults_apart(tmp_path: Path) -> None:
    """A spring to ground spoils stiffness and eigenmodes; stiffness of a hinged link is caught by both too."""
    model = build_model(frame_link(tmp_path))
    basis, mass, stiffness = basis_of(model)
    first = orthonormal_modes(mass, stiffness, basis, Reduction(), None, "x").omega[6]
    assert rigid_motion_by_stiffness(model, basis, stiffness) < 1e-8
    assert max(rigid_motion_as_eigenmodes(mass, stiffness, basis.rigid, first)) < 1e-8

    grounded = stiffness.copy()
    grounded[6, 6] *= 2  # of the second interface
    assert rigid_motion_by_stiffness(model, basis, grounded) > 0.01
    frequency, departure = rigid_motion_as_eigenmodes(mass, grounded, basis.rigid, first)
    assert frequency > 0.01
    assert departure > 0.01

    loose = stiffness.copy()
    loose[:, -1] = loose[-1, :] = 0.0  # the last fixed-interface mode costs no energy: a seventh motion
    with pytest.raises(FEImportError, match="rigid-body motion by stiffness") as caught:
        check_basis(model, basis, mass, grounded, np.concatenate([np.zeros(6), [first, 2 * first]]), "x")
    assert caught.value.cause is Cause.NOT_DEFINITE
    assert max(rigid_motion_as_eigenmodes(mass, loose, basis.rigid, first)) > 0.01 or not np.isfinite(
        rigid_motion_by_stiffness(model, basis, loose)
    )


def test_rigid_motions_in_any_unit(tmp_path: Path) -> None:
    """The same frame a thousand times smaller, held by a spring as much softer, departs as much."""
    found = []
    for size in (1.0, 1e-3):
        nodes = {name: [size * x for x in place] for name, place in FRAME["frame"]["nodes"].items()}
        section = {"shape": "rectangular", "width": 0.01 * size, "height": 0.02 * size}
        model = build_model(frame_link(tmp_path, frame={"nodes": nodes}, sections={"s": section}))
        basis, _, stiffness = basis_of(model)
        stiffness[8, 8] += 1e3 * size  # N/m, to ground at the second interface: E L
        found.append(rigid_motion_by_stiffness(model, basis, stiffness))
    assert found[0] > 1e-3
    assert found[1] == pytest.approx(found[0], rel=1e-9)  # rounding of a solution with a condition of 1e5


def test_interface_that_does_not_hold(tmp_path: Path) -> None:
    """An interface whose rows the basis leaves at rest cannot move the link."""
    model = build_model(frame_link(tmp_path))
    basis, _, stiffness = basis_of(model)
    vectors = basis.vectors.copy()
    vectors[model.dof_map[model.interface_nodes[0].node]] = 0
    assert rigid_motion_by_stiffness(model, replace(basis, vectors=vectors), stiffness) == np.inf


def test_missing_modes_are_counted(tmp_path: Path) -> None:
    """A basis without one free-free mode of the full model says that one is missing; the full basis none."""
    model = build_model(frame_link(tmp_path))
    basis = REDUCTIONS["none"](model, Reduction(method="none"), "x")
    mass, stiffness = reduced_matrices(model, basis)
    omega = orthonormal_modes(mass, stiffness, basis, Reduction(method="none"), None, "x").omega
    assert value(check_completeness(model, omega), "free-free modes below") == 0
    fewer = np.delete(omega, 6)
    assert value(check_completeness(model, fewer), "free-free modes below") == 1


def test_repeated_pairs_are_counted(tmp_path: Path) -> None:
    """Sylvester's count sees both members of each pair of a square bar."""
    link = straight_link(tmp_path, 0.5, 12, sections={"s": {"width": 0.02}}, reduction={"method": "none"})
    mass, stiffness, _ = dense(build_model(link))
    model = build_model(link)
    squared = la.eigh(stiffness, mass, eigvals_only=True)
    for k in (8, 10):
        limit = np.sqrt(squared[k - 1] * squared[k]) if squared[k] > 1.1 * squared[k - 1] else 1.05 * squared[k]
        expected = int((squared < limit).sum())
        assert modes_below(model.stiffness, model.mass, float(limit)) == expected


@pytest.mark.parametrize("method", ["craig-bampton", "guyan", "craig-chang", "mode-displacement", "none"])
def test_residuals_predict_the_error(tmp_path: Path, method: str) -> None:
    """Beside the frequencies of the full model: within a tenth below 2 percent, a factor of two below 10."""
    link = frame_link(tmp_path, reduction={"method": method})
    found, model = reduce_link(link), build_model(link)
    exact = free_body(model, "link").modes(12)[0] / (2 * np.pi)
    count = min(12, len(exact), found.elastic_modes)
    true, told = found.frequencies_hz[6 : 6 + count] / exact[:count] - 1, found.residuals[6 : 6 + count]
    assert not found.residuals[:6].any()
    small = true < 0.02
    np.testing.assert_allclose(told[small], true[small], rtol=0.1, atol=1e-8)
    mean = (true >= 0.02) & (true < 0.1)
    assert ((told > true / 2) & (told < 2 * true))[mean].all()
    assert small.any() or mean.any() or method == "guyan"


def test_residuals_fall_with_modes(tmp_path: Path) -> None:
    few, many = (
        reduce_link(frame_link(tmp_path, reduction={"fixed_interface_modes": count})).residuals[6] for count in (4, 16)
    )
    assert 1e-8 < many < few / 20
