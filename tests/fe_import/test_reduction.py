"""Craig-Bampton and no reduction against the full model, and the constant inertia invariants."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.linalg as la
from link_files import (
    SOLID,
    Array,
    both,
    boundary,
    clamped_flexibility,
    clamped_frequencies,
    dense,
    frame_link,
    free_frequencies,
    frequencies,
    held,
    interface_shapes,
    solid_link,
    straight_link,
    whole,
)

from fe_import.description.link import load_link
from fe_import.errors import Cause, FEImportError
from fe_import.modal.file import read_modal_file, write_modal_file
from fe_import.modal.model import ModalModel
from fe_import.model import FEModel
from fe_import.models.model import build_model
from fe_import.reduce import reduce_link, reduce_model
from fe_import.reduction import REDUCTIONS
from fe_import.reduction.modes import reduced_matrices

MASSES = pytest.mark.parametrize("mass", ["consistent", "lumped"])
COMPLETE = set(REDUCTIONS) - {"guyan"}  # keeps no inner motion of its own
THIRD = {"name": "middle", "node": "elbow"}
FOURTH = {"name": "4", "node": "elbow-tip/1"}
HUB, HAND = {"name": "hub", "node": "root"}, {"name": "hand", "node": "tip"}


def all_modes(folder: Path, method: str, mass: str = "consistent", **changes: Any) -> tuple[FEModel, ModalModel]:
    """The frame with every mode that it has, and its full model."""
    dofs = len(build_model(frame_link(folder, frame={"mass": mass}, **changes)).independent)
    return both(frame_link(folder, frame={"mass": mass}, reduction=whole(method, dofs), **changes))


def receptance(model: FEModel, frequency: float) -> Array:
    """Harmonic displacement of the interfaces per load there, (K - ω²M)⁻¹, scaled to unit stiffness before solving."""
    mass, stiffness, _ = dense(model)
    scale = 1 / np.sqrt(np.diag(stiffness))
    matrix = (stiffness - (2 * np.pi * frequency) ** 2 * mass) * np.outer(scale, scale)
    b = boundary(model)
    unit = np.zeros((len(mass), len(b)))
    unit[b, np.arange(len(b))] = scale[b]
    return np.asarray((scale[:, None] * la.solve(matrix, unit))[b])


def modal_receptance(modal: ModalModel, frequency: float) -> Array:
    shapes = interface_shapes(modal)
    dynamic = np.diag(modal.stiffness) - (2 * np.pi * frequency) ** 2
    return np.asarray(shapes / dynamic @ shapes.T)


# ----- nothing cut: the full model


@MASSES
@pytest.mark.parametrize("method", sorted(COMPLETE))
def test_all_modes_are_the_full_model(tmp_path: Path, method: str, mass: str) -> None:
    """Every dof kept: lowest 10 frequencies, receptance below and among them, static tip flexibility to 1e-8.

    Seen: 1e-11; the reference is computed in extended precision. All modes obey the same in sum: the receptance at
    20 kHz, among the highest modes.
    """
    model, modal = all_modes(tmp_path, method, mass)
    assert modal.modes == len(model.independent)
    assert all(c.ok for c in modal.health), modal.health
    np.testing.assert_allclose(modal.frequencies_hz[6:16], free_frequencies(model, 10), rtol=1e-8)
    for frequency in (5.0, 400.0, 3000.0, 20000.0):
        full, reduced = receptance(model, frequency), modal_receptance(modal, frequency)
        scale = np.sqrt(np.abs(np.outer(np.diag(full), np.diag(full))))
        np.testing.assert_allclose(reduced / scale, full / scale, atol=1e-8)
    np.testing.assert_allclose(clamped_flexibility(modal) / _tip(model), 1, atol=1e-8)


def _tip(model: FEModel) -> Array:
    """(6, 6) flexibility of the second interface, the first clamped, of the full model."""
    _, stiffness, _ = dense(model)
    b = boundary(model)
    free = np.setdiff1d(np.arange(len(stiffness)), b[:6])
    at = np.searchsorted(free, b[6:12])
    unit = np.zeros((len(free), 6))
    unit[at, np.arange(6)] = 1.0
    scale = 1 / np.sqrt(np.diag(stiffness)[free])
    inner = stiffness[np.ix_(free, free)] * np.outer(scale, scale)
    return np.asarray((scale[:, None] * la.solve(inner, scale[:, None] * unit, assume_a="pos"))[at])


@pytest.mark.parametrize("method", sorted(COMPLETE))
def test_all_modes_of_a_solid(tmp_path: Path, method: str) -> None:
    """Every dof of a small solid kept: lowest 6 frequencies and receptances to 1e-8."""
    dofs = len(build_model(solid_link(tmp_path)).independent)
    model, modal = both(solid_link(tmp_path, reduction=whole(method, dofs)))
    assert modal.modes == len(model.independent)
    assert all(c.ok for c in modal.health), modal.health
    np.testing.assert_allclose(modal.frequencies_hz[6:12], free_frequencies(model, 6), rtol=1e-8)
    for frequency in (200.0, 3000.0):
        full, reduced = receptance(model, frequency), modal_receptance(modal, frequency)
        scale = np.sqrt(np.abs(np.outer(np.diag(full), np.diag(full))))
        np.testing.assert_allclose(reduced / scale, full / scale, atol=1e-8)


def test_both_methods_agree_on_a_slender_frame(tmp_path: Path) -> None:
    """1 mm wide legs in 8 elements each: the spectrum spans 8 decades of ω², yet the modes stay orthonormal.

    Lowest 6 frequencies 2e-9 (4e-11 and 4e-10 seen): what rounding leaves of a stiffness of that condition. The file
    is legal.
    """
    slender = {"sections": {"s": {"width": 0.001}}}
    members = [{"from": a, "to": b, "elements": 8, "material": "m", "section": "s"}
               for a, b in (("root", "elbow"), ("elbow", "tip"))]  # fmt: skip
    found = []
    for method, options in (("craig-bampton", {"fixed_interface_modes": 90}), ("none", {})):
        link = frame_link(tmp_path, **slender, frame={"members": members}, reduction={"method": method, **options})
        modal = reduce_link(link)
        assert modal.modes == 102
        check = next(c for c in modal.health if c.name == "orthonormality of the modes")
        assert check.value < 1e-11
        assert all(c.ok for c in modal.health)
        path = tmp_path / f"{method}.modal.h5"
        write_modal_file(path, modal)
        assert read_modal_file(path).modes == 102
        found.append(modal.frequencies_hz[6:])
    reference = free_frequencies(build_model(link), 6)
    np.testing.assert_allclose(found[0][:6], reference, rtol=2e-9)
    np.testing.assert_allclose(found[1][:6], reference, rtol=2e-9)
    np.testing.assert_allclose(found[0], found[1], rtol=1e-6)


@pytest.mark.parametrize("kind", ["frame", "solid"])
def test_constraint_modes_alone_are_statically_exact(tmp_path: Path, kind: str) -> None:
    """No fixed-interface mode: tip flexibility to 1e-9 of the full model."""
    make = frame_link if kind == "frame" else solid_link
    model, modal = both(make(tmp_path, reduction={"fixed_interface_modes": 0}))
    assert modal.elastic_modes == 6
    full = _tip(model)
    scale = np.sqrt(np.outer(np.diag(full), np.diag(full)))
    np.testing.assert_allclose(clamped_flexibility(modal) / scale, full / scale, atol=1e-9)


# ----- what is cut


def test_more_modes_are_never_worse(tmp_path: Path) -> None:
    """Ritz: free-free frequencies fall towards those of the full model as fixed-interface modes are added."""
    model = build_model(frame_link(tmp_path))
    exact = free_frequencies(model, 6)
    last = np.full(6, np.inf)
    for count in (0, 2, 4, 8, 16):
        modal = reduce_model(model, frame_link(tmp_path, reduction={"fixed_interface_modes": count}))
        found = modal.frequencies_hz[6:12]
        assert (found < last * (1 + 1e-10)).all()
        assert (found > exact * (1 - 1e-9)).all()
        last = found
    np.testing.assert_allclose(last, exact, rtol=1e-3)


def test_clamped_truncation_converges_faster(tmp_path: Path) -> None:
    """Frequencies with the inboard interface clamped, 4 elastic modes kept of 18.

    The span of the lowest clamped modes gives all four to rounding of the basis (1e-9); free-free modes miss the
    first by more than 1 % and the fourth by more than 20 %.
    """
    model = build_model(frame_link(tmp_path))
    mass, stiffness, _ = dense(model)
    free = np.setdiff1d(np.arange(len(mass)), boundary(model)[:6])
    exact = frequencies(mass[np.ix_(free, free)], stiffness[np.ix_(free, free)], 4)
    whole = clamped_frequencies(reduce_model(model, frame_link(tmp_path)))[:4]
    np.testing.assert_allclose(whole, exact, rtol=1e-3)
    errors = {}
    for truncation in ("free-free", "clamped"):
        for kept in (4, 8):
            link = frame_link(tmp_path, reduction={"elastic_modes": kept, "truncation": truncation})
            errors[truncation, kept] = clamped_frequencies(reduce_model(model, link))[:4] / whole - 1
    assert np.abs(errors["clamped", 4]).max() < 1e-9
    assert np.abs(errors["clamped", 8]).max() < 1e-9
    assert errors["free-free", 4][0] > 1e-2
    assert errors["free-free", 4][3] > 0.2
    assert 1e-5 < errors["free-free", 8][0] < errors["free-free", 4][0]


def test_inboard_interface_may_be_named(tmp_path: Path) -> None:
    """Clamping the hand instead of the hub serves the hand."""
    model = build_model(frame_link(tmp_path))
    whole = reduce_model(model, frame_link(tmp_path))

    def held_frequencies(modal: ModalModel) -> Array:
        basis = held(interface_shapes(modal)[6:])
        return frequencies(basis.T @ modal.invariants.m @ basis, basis.T @ modal.stiffness @ basis, 4)

    for inboard, exact in (("hand", True), ("hub", False)):
        options = {"elastic_modes": 4, "truncation": "clamped", "inboard": inboard}
        modal = reduce_model(model, frame_link(tmp_path, reduction=options))
        error = np.abs(held_frequencies(modal) / held_frequencies(whole) - 1).max()
        assert (error < 1e-9) == exact


@pytest.mark.parametrize("interfaces", [[HUB], [HUB, HAND, THIRD], [HUB, HAND, THIRD, FOURTH]], ids=len)
def test_one_interface_or_many(tmp_path: Path, interfaces: list[dict[str, str]]) -> None:
    """One interface: its constraint modes are rigid motions, the elastic modes are the clamped ones. Many: six each."""
    options = {"fixed_interface_modes": 6}
    model, modal = both(frame_link(tmp_path, interfaces=interfaces, reduction=options))
    assert modal.modes == 6 * len(interfaces) + 6
    assert all(c.ok for c in modal.health), modal.health
    assert [i.name for i in modal.interface_nodes] == [i["name"] for i in interfaces]
    np.testing.assert_allclose(modal.frequencies_hz[6:9], free_frequencies(model, 3), rtol=2e-2)
    if len(interfaces) == 1:
        np.testing.assert_allclose(clamped_frequencies(modal), modal.fixed_interface.frequencies_hz, rtol=1e-9)


@pytest.mark.parametrize("kind", ["frame", "solid"])
def test_one_interface_without_elastic_modes(tmp_path: Path, kind: str) -> None:
    """The constraint modes of one interface are the rigid-body motions and no more."""
    options = {"fixed_interface_modes": 0}
    modal = (
        reduce_link(frame_link(tmp_path, interfaces=[HUB], reduction=options))
        if kind == "frame"
        else reduce_link(solid_link(tmp_path, interfaces=SOLID["interfaces"][:1], reduction=options))
    )
    assert modal.modes == 6
    assert all(c.ok for c in modal.health), modal.health


def test_frame_without_inner_nodes(tmp_path: Path) -> None:
    """Every node an interface: nothing to reduce, nothing cut, no fixed-interface modes."""
    model, modal = both(straight_link(tmp_path, 0.5, 1, interfaces=[HUB, HAND]))
    assert modal.modes == 12 == len(model.independent)
    assert len(modal.fixed_interface.frequencies_hz) == 0
    np.testing.assert_allclose(modal.frequencies_hz[6:], free_frequencies(model, 6), rtol=1e-8)


# ----- physical form


@pytest.mark.parametrize("kind", ["frame", "solid"])
def test_physical_form(tmp_path: Path, kind: str) -> None:
    """Coordinates are interface displacements and clamped modes: K is condensed, M_qq = 1, K_qq = ω².

    The condensed stiffness to 1e-9 of its diagonal: K_bb - K_bi K_ii⁻¹ K_ib, solved densely.
    """
    make = frame_link if kind == "frame" else solid_link
    model, modal = both(make(tmp_path, reduction={"form": "physical", "fixed_interface_modes": 4}))
    mass, stiffness, _ = dense(model)
    b = boundary(model)
    inner = np.setdiff1d(np.arange(len(mass)), b)
    scale = 1 / np.sqrt(np.diag(stiffness)[inner])
    inverse = np.outer(scale, scale) * la.inv(stiffness[np.ix_(inner, inner)] * np.outer(scale, scale))
    psi = -inverse @ stiffness[np.ix_(inner, b)]
    condensed = stiffness[np.ix_(b, b)] + stiffness[np.ix_(b, inner)] @ psi
    size = np.sqrt(np.outer(np.diag(condensed), np.diag(condensed)))
    np.testing.assert_allclose(modal.stiffness[:12, :12] / size, condensed / size, atol=1e-8)
    guyan = mass[np.ix_(b, b)] + mass[np.ix_(b, inner)] @ psi
    guyan = guyan + psi.T @ (mass[np.ix_(inner, b)] + mass[np.ix_(inner, inner)] @ psi)
    np.testing.assert_allclose(modal.invariants.m[:12, :12], guyan, atol=1e-9 * np.abs(guyan).max())
    np.testing.assert_allclose(modal.invariants.m[12:, 12:], np.eye(4), atol=1e-10)
    omega = 2 * np.pi * modal.fixed_interface.frequencies_hz
    np.testing.assert_allclose(modal.stiffness[12:, 12:], np.diag(omega**2), atol=1e-9 * omega[-1] ** 2)
    coupling = np.abs(modal.stiffness[:12, 12:]) / np.sqrt(np.outer(np.diag(condensed), omega**2))
    assert coupling.max() < 1e-9
    np.testing.assert_allclose(interface_shapes(modal), np.eye(12, 16), atol=1e-12)
    assert modal.kinds == ("interface displacement",) * 12 + ("fixed-interface",) * 4
    np.testing.assert_array_equal(modal.frequencies_hz, [0.0] * 12 + modal.fixed_interface.frequencies_hz.tolist())


def test_physical_form_has_the_same_modes(tmp_path: Path) -> None:
    """Eigenvalues of the physical matrices are the frequencies of the orthonormal form, to 1e-8."""
    one, two = (reduce_link(frame_link(tmp_path, reduction={"form": f})) for f in ("physical", "orthonormal"))
    clamped = [clamped_frequencies(m) for m in (one, two)]
    np.testing.assert_allclose(clamped[0], clamped[1], rtol=1e-8)
    assert one.modes == two.modes


# ----- fixed-interface modes


def test_massless_rotations_have_no_modes(tmp_path: Path) -> None:
    """Lumped mass without rotary inertia: 3 modes per inner node; asking for more is a clear error."""
    massless = {"mass": "lumped", "rotary_inertia": False}
    modal = reduce_link(frame_link(tmp_path, frame=massless, reduction={"fixed_interface_modes": 15}))
    assert len(modal.fixed_interface.frequencies_hz) == 15
    assert all(c.ok for c in modal.health), modal.health
    whole = reduce_link(frame_link(tmp_path, frame=massless, reduction={"method": "none"}))
    assert whole.modes == 3 * 7
    for options, field in (
        ({"fixed_interface_modes": 16}, "fixed_interface_modes"),
        ({"fixed_interface_modes": 15, "elastic_modes": 16}, "elastic_modes"),
        ({"method": "none", "elastic_modes": 16}, "elastic_modes"),
    ):
        with pytest.raises(FEImportError) as caught:
            reduce_link(frame_link(tmp_path, frame=massless, reduction=options))
        assert caught.value.cause is Cause.MODE_COUNT
        assert caught.value.where.endswith(f"link.toml: reduction.{field}")
        assert (caught.value.value, caught.value.limit) == (16, 15)
        assert caught.value.remedy


def test_default_number_of_fixed_interface_modes(tmp_path: Path) -> None:
    """12, or all there are."""
    assert len(reduce_link(frame_link(tmp_path)).fixed_interface.frequencies_hz) == 12
    assert len(reduce_link(straight_link(tmp_path, 0.5, 2)).fixed_interface.frequencies_hz) == 6


# ----- contract of every method


@pytest.mark.parametrize("method", sorted(REDUCTIONS))
@pytest.mark.parametrize("kind", ["frame", "solid"])
def test_basis_spans_rigid_motions(tmp_path: Path, method: str, kind: str) -> None:
    """Rule 2 of the contract, to 1e-12 of the size; interface columns are unit displacements."""
    make = frame_link if kind == "frame" else solid_link
    link = make(tmp_path, reduction={"method": method})
    model = build_model(link)
    basis = REDUCTIONS[method](model, link.description.reduction, "link.toml")
    np.testing.assert_allclose(basis.vectors @ basis.rigid, model.rigid_body_modes(), atol=1e-12)
    n = basis.interface_columns
    np.testing.assert_allclose(basis.vectors[model.interface_dofs, :n], np.eye(len(model.interface_dofs), n), atol=0)
    mass, stiffness = reduced_matrices(model, basis)
    for matrix in (mass, stiffness):
        np.testing.assert_array_equal(matrix, matrix.T)
    assert la.eigvalsh(mass)[0] > -1e-12 * np.abs(mass).max()


def test_rigid_motions_of_a_slender_solid() -> None:
    """2900 dofs, legs of 0.5 m by 0.01 m: constraint modes reproduce rigid motions to 1e-12 (3e-9 if only solved)."""
    link = load_link(Path(__file__).parents[2] / "data" / "l_shape" / "links" / "solid.toml")
    model = build_model(link)
    basis = REDUCTIONS["craig-bampton"](model, link.description.reduction, "solid.toml")
    np.testing.assert_allclose(basis.vectors @ basis.rigid, model.rigid_body_modes(), atol=1e-12)


# ----- inertia invariants


def test_solid_names_are_those_of_the_description(tmp_path: Path) -> None:
    """The interface nodes follow their faces rigidly, with equal weights."""
    modal = reduce_link(solid_link(tmp_path, reduction={"fixed_interface_modes": 2}))
    assert [i.name for i in modal.interface_nodes] == [i["name"] for i in SOLID["interfaces"]]
    for interface in modal.interface_nodes:
        assert interface.coupling == "rigid"
        assert interface.weights.sum() == pytest.approx(1.0)
        shift, turn = modal.node_shape(interface.node)
        assert turn is not None
        for node in interface.coupled_nodes:
            arm = modal.nodes[node] - interface.position
            moved = shift + np.cross(turn.T, arm).T
            np.testing.assert_allclose(modal.translation_shapes[node], moved, atol=1e-10 * np.abs(moved).max())
