"""Masses of reduced links: what every cut keeps, effective masses of modes, the invariants of their inertia."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from link_files import (
    both,
    frame_link,
    solid_link,
    straight_link,
)

from fe_import.reduce import reduce_link, reduce_model

CUTS: list[dict[str, Any]] = [
    {},
    {"fixed_interface_modes": 0},
    {"fixed_interface_modes": 5, "elastic_modes": 0},
    {"fixed_interface_modes": 5, "elastic_modes": 1},
    {"fixed_interface_modes": 5, "elastic_modes": 4, "truncation": "clamped"},
    {"fixed_interface_modes": 5, "form": "physical"},
    {"method": "none", "elastic_modes": 3},
]


@pytest.mark.parametrize("kind", ["frame", "lumped", "solid", "loaded solid"])
@pytest.mark.parametrize("options", CUTS, ids=str)
def test_mass_properties_survive_every_cut(tmp_path: Path, kind: str, options: dict[str, Any]) -> None:
    """Mass, centre of mass, inertia and the rigid motions are those of the full model, to 1e-9."""
    if kind in ("frame", "lumped"):
        link = frame_link(tmp_path, reduction=options, frame={"mass": "lumped" if kind == "lumped" else "consistent"})
    else:
        masses = [{"node": "hand", "mass": 0.2, "inertia": [1e-4, 1e-4, 1e-4]}] if "loaded" in kind else []
        link = solid_link(tmp_path, reduction=options, masses=masses)
    model, modal = both(link)
    full, reduced = modal.full_mass_properties, modal.mass_properties
    assert reduced.mass == pytest.approx(full.mass, rel=1e-9)
    size = np.linalg.norm(np.ptp(model.nodes, axis=0))
    np.testing.assert_allclose(reduced.centre_of_mass, full.centre_of_mass, atol=1e-9 * size)
    np.testing.assert_allclose(reduced.inertia, full.inertia, atol=1e-9 * np.abs(full.inertia).max())
    rigid = modal.invariants.rigid
    fields = model.rigid_body_modes()
    np.testing.assert_allclose(modal.translation_shapes @ rigid, fields[model.dof_map[:, :3]], atol=1e-9)
    assert all(c.ok for c in modal.health), modal.health


def test_effective_mass_of_a_clamped_beam(tmp_path: Path) -> None:
    """First bending mode of a clamped-clamped beam carries (4α/βL)² = 0.6903 of the mass, the second none.

    φ = cosh βx - cos βx - α(sinh βx - sin βx), ∫φ² = L, and φ'''' = β⁴φ gives ∫φ = [φ''']/β⁴ = 4α/β, with
    βL = 4.7300407, α = 0.9825022 (Blevins 1979); third mode likewise, βL = 10.9956078, α = 0.9999664. The second,
    βL = 7.8532046, α = 1.0007773, carries 0.433 of the inertia about the centre. The axial one carries 8/π².
    1e-4 with 40 elements; 1e-3 for the axial displacement (order 2).
    """
    changes = {"frame": {"theory": "euler-bernoulli", "rotary_inertia": False}}
    link = straight_link(tmp_path, 1.0, 40, **changes, reduction={"fixed_interface_modes": 60})
    table = reduce_link(link).fixed_interface
    area, inertia = 2e-4, 0.01 * 0.02**3 / 12
    roots = np.array([4.73004074, 7.85320462, 10.9956078])
    bending = roots**2 * math.sqrt(7e10 * inertia / (2700 * area)) / (2 * np.pi)
    first, second, third = (int(np.abs(table.frequencies_hz / f - 1).argmin()) for f in bending)
    np.testing.assert_allclose(table.frequencies_hz[[first, second, third]], bending, rtol=1e-5)
    assert table.effective_mass[first, 2] == pytest.approx((4 * 0.9825022 / roots[0]) ** 2, rel=1e-4)
    assert round(table.effective_mass[first, 2], 3) == 0.690
    assert table.effective_mass[second, 2] < 1e-12
    turning = (4 - 2 * 1.00077731 * roots[1]) / roots[1] ** 2  # ∫xφ by parts, of a total 1/12
    assert table.effective_mass[second, 4] == pytest.approx(12 * turning**2, rel=1e-4)
    assert table.effective_mass[first, 4] < 1e-12
    assert table.effective_mass[third, 2] == pytest.approx((4 * 0.9999664 / roots[2]) ** 2, rel=1e-4)
    axial = int(table.effective_mass[:, 0].argmax())
    assert table.frequencies_hz[axial] == pytest.approx(math.sqrt(7e10 / 2700) / 2, rel=1e-3)
    assert table.effective_mass[axial, 0] == pytest.approx(8 / np.pi**2, rel=1e-3)
    assert table.effective_mass[first, [0, 1]].max() < 1e-12


@pytest.mark.parametrize("kind", ["frame", "solid"])
def test_effective_masses_add_up(tmp_path: Path, kind: str) -> None:
    """Never above 1 in sum, rising with the number of modes; a fine clamped beam's tend to all of it.

    What is left of 20 elements is near the clamped ends, about 1/20 of the mass.
    """
    if kind == "solid":
        totals = [
            reduce_link(solid_link(tmp_path, reduction={"fixed_interface_modes": n})).fixed_interface.effective_mass
            for n in (3, 20)
        ]
    else:
        link = straight_link(tmp_path, 1.0, 20, reduction={"fixed_interface_modes": 114})
        whole = reduce_link(link).fixed_interface.effective_mass
        totals = [whole[:10], whole]
        assert (whole.sum(axis=0)[:3] > 0.95).all()
        assert (whole.sum(axis=0)[3:] > 0.85).all()  # rotation: the ends weigh three times as much
    few, many = (t.sum(axis=0) for t in totals)
    assert (few <= many + 1e-12).all()
    assert (many < 1 + 1e-9).all()


INVARIANTS: list[tuple[str, dict[str, Any], dict[str, Any]]] = [
    ("frame", {"mass": "consistent"}, {}),
    ("frame", {"mass": "consistent"}, {"method": "none"}),
    ("frame", {"mass": "consistent"}, {"elastic_modes": 5, "truncation": "clamped"}),
    ("frame", {"mass": "consistent"}, {"form": "physical"}),
    ("frame", {"mass": "lumped"}, {}),
    ("solid", {}, {"elastic_modes": 9}),
    ("solid", {}, {"form": "physical", "fixed_interface_modes": 3}),
]


@pytest.mark.parametrize(("kind", "frame", "options"), INVARIANTS)
def test_kinetic_energy_of_the_invariants(
    tmp_path: Path, kind: str, frame: dict[str, Any], options: dict[str, Any]
) -> None:
    """T from m, X, Z equals ½ wᵀ M w with the velocity of every node written out, to 1e-12.

    A node at x with displacement u and rotation φ moves with v + ω × (x + u) + u̇ and turns with ω + ω × φ + φ̇.
    """
    body = {"node": "hand", "mass": 0.2, "inertia": [[2e-3, 1e-4, 0.0], [1e-4, 1e-3, 0.0], [0.0, 0.0, 3e-3]]}
    link = (
        frame_link(tmp_path, frame=frame, reduction=options, masses=[body])
        if kind == "frame"
        else solid_link(tmp_path, reduction=options, masses=[body])
    )
    model, modal = both(link)
    inertia = modal.invariants
    rng = np.random.default_rng(11)
    v, omega = rng.standard_normal((2, 3))
    size = np.abs(modal.translation_shapes).max(axis=(0, 1))
    q, rate = rng.standard_normal((2, modal.modes)) / np.where(size > 0, size, 1)
    w = np.zeros(model.mass.shape[0])
    turning = {int(node): k for k, node in enumerate(modal.rotation_nodes)}
    for node, x in enumerate(modal.nodes):
        shape = modal.translation_shapes[node]
        w[model.dof_map[node, :3]] = v + np.cross(omega, x + shape @ q) + shape @ rate
        if node in turning:
            turn = modal.rotation_shapes[turning[node]]
            w[model.dof_map[node, 3:]] = omega + np.cross(omega, turn @ q) + turn @ rate
    expected = 0.5 * w @ (model.mass @ w)
    s = rate + inertia.rigid @ np.concatenate([v, omega])
    found = 0.5 * s @ inertia.m @ s
    found += np.einsum("a,i,aij,j->", omega, s, inertia.X, q)
    found += 0.5 * np.einsum("a,b,i,abij,j->", omega, omega, q, inertia.Z, q)
    assert found == pytest.approx(expected, rel=1e-12)


def test_invariants_of_some_modes(tmp_path: Path) -> None:
    """Truncating the invariants is reducing with fewer modes."""
    link = frame_link(tmp_path, reduction={"fixed_interface_modes": 5})
    model, whole = both(link)
    fewer = reduce_model(model, frame_link(tmp_path, reduction={"fixed_interface_modes": 5, "elastic_modes": 4}))
    cut = whole.invariants.truncated(np.arange(10))
    for name in ("m", "X", "Z", "rigid"):
        expected = getattr(fewer.invariants, name)
        np.testing.assert_allclose(getattr(cut, name), expected, atol=1e-9 * np.abs(expected).max())
    double = cut + cut
    np.testing.assert_allclose(double.Z, 2 * cut.Z)
    np.testing.assert_array_equal(double.rigid, cut.rigid)
