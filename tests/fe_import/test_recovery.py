"""Recovery of stress and section forces: closed forms, complete bases, files, faulty requests."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.linalg as la
from link_files import (
    Array,
    boundary,
    dense,
    frame_link,
    interface_shapes,
    merged,
    solid_link,
    straight_link,
    write_box,
)
from modal_models import same
from solid_meshes import box

from fe_import.description.link import LinkFile
from fe_import.description.records import Recovery
from fe_import.elements.elasticity import isotropic_moduli
from fe_import.elements.solid import SolidMaterial
from fe_import.elements.solid_elements import SOLID_ELEMENTS
from fe_import.elements.solid_stress import solid_stress
from fe_import.errors import Cause, FEImportError
from fe_import.modal.file import read_modal_file, write_modal_file
from fe_import.modal.model import ModalModel
from fe_import.modal.recovery_maps import RecoveryMaps, spin_products, von_mises
from fe_import.models.model import build_model
from fe_import.recovery.recover import mode_acceleration, recovery_maps, required_maps
from fe_import.reduce import reduce_link, reduction_summary
from fe_import.reduction.free_body import inertia_relief

ALL = {"recovery": {"all": True}}
LENGTH, WIDTH, HEIGHT, MODULUS, DENSITY = 0.8, 0.01, 0.02, 7e10, 2700.0
AREA = WIDTH * HEIGHT


def maps_of(modal: ModalModel) -> RecoveryMaps:
    """The recovery maps that a test asked for."""
    assert modal.recovery is not None
    return modal.recovery


def balanced(hand: Array, arm: Array) -> Array:
    """(12,) a wrench on the hand, and what holds it on the hub, ``arm`` from hub to hand."""
    return np.concatenate([-hand[:3], -hand[3:] - np.cross(arm, hand[:3]), hand])


@pytest.mark.parametrize("theory", ["timoshenko", "euler-bernoulli"])
def test_section_forces_of_a_cantilever(tmp_path: Path, theory: str) -> None:
    """End force and moment: N = F, V = F, T, M(x) = M + (L - x) x F, to rounding, at every element end."""
    modal = reduce_link(straight_link(tmp_path, LENGTH, 4, frame={"theory": theory}, **ALL))
    maps = maps_of(modal)
    end = np.array([3.0, 5.0, -7.0, 0.2, 0.3, -0.4])
    found = maps.loads @ balanced(end, np.array([LENGTH, 0.0, 0.0]))
    arm = LENGTH - modal.nodes[maps.nodes, 0]
    expected = np.tile(end, (len(arm), 1))
    expected[:, 4] -= arm * end[2]
    expected[:, 5] += arm * end[1]
    assert maps.components == ("N", "Vy", "Vz", "T", "My", "Mz")
    assert len(maps.nodes) == 8
    np.testing.assert_allclose(found, expected, atol=1e-9 * np.abs(expected).max())


def test_section_forces_in_local_axes(tmp_path: Path) -> None:
    """Where the bent frame ends, the section forces are the end load, turned into the element's axes."""
    modal = reduce_link(frame_link(tmp_path, **ALL))
    maps = maps_of(modal)
    hub, hand = modal.interface_nodes
    load = np.array([3.0, 5.0, -7.0, 0.2, 0.3, -0.4])
    found = maps.loads @ balanced(load, hand.position - hub.position)
    (last,) = np.flatnonzero(maps.nodes == hand.node)
    axes = maps.axes[last]
    a, b = modal.lines[maps.elements[last]]
    along = modal.nodes[b] - modal.nodes[a]
    np.testing.assert_allclose(axes[0], along / np.linalg.norm(along), atol=1e-12)
    np.testing.assert_allclose(found[last], np.concatenate([axes @ load[:3], axes @ load[3:]]), atol=1e-8)


def test_inertia_relief_of_a_pushed_bar(tmp_path: Path) -> None:
    """A free bar pulled at its end: N rises evenly to F; an element shows the mean of its ends."""
    modal = reduce_link(straight_link(tmp_path, LENGTH, 5, **ALL))
    maps = maps_of(modal)
    middle = modal.nodes[modal.lines[maps.elements], 0].mean(axis=1)
    np.testing.assert_allclose(maps.loads[:, 0, 6], middle / LENGTH, atol=1e-10)


def test_centrifugal_force_of_a_rod(tmp_path: Path) -> None:
    """Turning about its end, N = ρ A ω² (L² - x²) / 2; an element of length h shows its mean, plus ρ A ω² h² / 60.

    That is what the cubic shapes of the consistent mass put on the nodes more than linear ones; rotary inertia adds
    less than 2 % to it.
    """
    modal = reduce_link(straight_link(tmp_path, LENGTH, 5, **ALL))
    maps = maps_of(modal)
    omega = np.array([0.0, 0.0, 4.0])
    pull = DENSITY * AREA * 16.0 * LENGTH**2 / 2
    hub = np.zeros(12)
    hub[0] = -pull
    found = (maps.spin @ spin_products(omega) + maps.loads @ hub)[:, 0]
    ends = modal.nodes[modal.lines[maps.elements], 0]
    mean_square = (ends[:, 0] ** 2 + ends[:, 0] * ends[:, 1] + ends[:, 1] ** 2) / 3
    more = found - pull * (1 - mean_square / LENGTH**2)
    np.testing.assert_allclose(more, pull / 30 / 5**2, rtol=0.02)


def test_stress_in_a_bar_under_tension_and_bending(tmp_path: Path) -> None:
    """Clamped rigidly at its ends: at mid-span σ = F / A within 1e-6, M z / I within 1 %."""
    link = solid_link(tmp_path, **ALL)
    write_long_box(tmp_path / "box.inp")
    modal = reduce_link(link)
    maps = maps_of(modal)
    arm = modal.interface_nodes[1].position - modal.interface_nodes[0].position
    section, inertia = 0.02 * 0.03, 0.02 * 0.03**3 / 12
    middle = np.flatnonzero(np.abs(modal.nodes[maps.nodes, 0] - 0.3) < 1e-9)
    assert len(middle) >= 8
    tension = maps.loads[middle] @ balanced(np.array([100.0, 0, 0, 0, 0, 0]), arm) * section / 100.0
    np.testing.assert_allclose(tension, np.tile([1.0, 0, 0, 0, 0, 0], (len(middle), 1)), atol=1e-6)
    force = 10.0
    bending = maps.loads[middle] @ balanced(np.array([0, 0, force, 0, 0, 0]), arm)
    z = modal.nodes[maps.nodes[middle], 2] - 0.015
    expected = -force * (arm[0] - 0.3) * z / inertia  # M_y = -F (L - x); σ = M_y z / I_y
    np.testing.assert_allclose(bending[:, 0], expected, atol=0.01 * np.abs(expected).max())


def write_long_box(path: Path) -> None:
    """24 x 1 x 2 hexahedra of 20 nodes, 0.6 m x 0.02 m x 0.03 m."""
    mesh = box("hex20", (24, 1, 2), (0.6, 0.02, 0.03))
    lines = ["*NODE", *(f"{k}, " + ", ".join(map(repr, p)) for k, p in enumerate(mesh.nodes.tolist(), start=1))]
    lines += ["*ELEMENT, TYPE=C3D20, ELSET=all"]
    for k, nodes in enumerate(mesh.only.elements + 1, start=1):
        lines += [", ".join(map(str, [k, *nodes[:15]])) + ",", ", ".join(map(str, nodes[15:]))]
    for name in ("x0", "x1"):
        lines += [f"*NSET, NSET={name}", *(f"{n + 1}," for n in mesh.node_sets[name])]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


@pytest.mark.parametrize("element_type", SOLID_ELEMENTS)
def test_constant_strain_gives_exact_stress(element_type: str) -> None:
    """At every node of a distorted mesh, in every element type."""
    mesh = box(element_type, distortion=0.2)
    lam, mu = 3.0, 2.0
    gradient = np.random.default_rng(1).normal(size=(3, 3))  # du_a / dx_b
    found = nodal_stress(mesh, lam, mu, mesh.nodes @ gradient.T)
    strain = (gradient + gradient.T) / 2
    exact = lam * np.trace(strain) * np.eye(3) + 2 * mu * strain
    row = exact[[0, 1, 2, 0, 1, 2], [0, 1, 2, 1, 2, 0]]
    np.testing.assert_allclose(found, np.tile(row, (len(mesh.nodes), 1)), atol=1e-10)


@pytest.mark.parametrize("element_type", ["tet10", "hex20", "hex27"])
def test_pure_bending_gives_exact_stress(element_type: str) -> None:
    """σ_xx = -E κ z, nothing else: linear stress is extrapolated to the nodes without error."""
    mesh = box(element_type, (2, 1, 1), (2.0, 1.0, 1.0))
    modulus, nu, kappa = 5.0, 0.3, 0.1
    lam, mu = modulus * nu / ((1 + nu) * (1 - 2 * nu)), modulus / (2 * (1 + nu))
    x, y, z = mesh.nodes.T
    field = kappa * np.stack([-x * z, nu * y * z, (x**2 + nu * (z**2 - y**2)) / 2], axis=1)
    expected = np.zeros((len(mesh.nodes), 6))
    expected[:, 0] = -modulus * kappa * z
    np.testing.assert_allclose(nodal_stress(mesh, lam, mu, field), expected, atol=1e-12)


def nodal_stress(mesh: Any, lam: float, mu: float, field: Array) -> Array:
    """(n, 6) stress of a displacement field (n, 3)."""
    n = len(mesh.nodes)
    dof_map = np.full((n, 6), -1)
    dof_map[:, :3] = np.arange(3 * n).reshape(n, 3)
    source = solid_stress(mesh, [SolidMaterial(1.0, 0.0, 1.0, own_moduli=isotropic_moduli(lam, mu))])
    return source.evaluate(field.reshape(-1, 1), dof_map, source.site_nodes)[:, :, 0]


def test_von_mises() -> None:
    """Tension counts as it is, shear √3 times, pressure not at all."""
    states = [[4.0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 2.0, 0], [7.0, 7.0, 7.0, 0, 0, 0]]
    np.testing.assert_allclose(von_mises(np.array(states)), [4.0, 2 * np.sqrt(3), 0.0], atol=1e-12)


def averaged_solid(folder: Path, **changes: Any) -> LinkFile:
    """The solid with a hand that averages its face (RBE3)."""
    interfaces = [{"name": "hub", "face": "x0"}, {"name": "hand", "face": "x1", "coupling": "averaged"}]
    return solid_link(folder, interfaces=interfaces, **changes)


@pytest.mark.parametrize("make", [frame_link, solid_link, averaged_solid])
def test_all_modes_reproduce_the_full_model(tmp_path: Path, make: Callable[..., Any]) -> None:
    """Clamped at the hub, loaded at the hand: σ from modal coordinates is that of a direct solution, to 1e-8."""
    link = make(tmp_path, reduction={"method": "none"}, **ALL)
    model, modal = build_model(link), reduce_link(link)
    maps = maps_of(modal)
    _, stiffness, _ = dense(model)
    hub, hand = np.split(boundary(model), 2)
    free = np.setdiff1d(np.arange(len(stiffness)), hub)
    load = np.array([1.0, 2.0, 3.0, 0.04, 0.05, 0.06])
    force = np.zeros(len(stiffness))
    force[hand] = load
    field = np.zeros(len(stiffness))
    field[free] = la.solve(stiffness[np.ix_(free, free)], force[free], assume_a="pos")
    full = field if model.coupling is None else model.coupling @ field
    assert model.stress is not None
    exact = model.stress.evaluate(full[:, None], model.dof_map, np.arange(len(maps.nodes)))[:, :, 0]
    # elastic coordinates of the held link: q = Ω⁻² Φᵀ (loads and reactions)
    shapes = interface_shapes(modal)
    arm = modal.interface_nodes[1].position - modal.interface_nodes[0].position
    loads = balanced(load, arm)
    q = np.zeros(modal.modes)
    q[6:] = shapes[:, 6:].T @ loads / (2 * np.pi * modal.frequencies_hz[6:]) ** 2
    np.testing.assert_allclose(maps.modes @ q, exact, atol=1e-8 * np.abs(exact).max())
    modes, remainder, _, _ = mode_acceleration(modal)
    for row in range(6):
        scale = np.abs(maps.loads[:, row]).max()
        assert np.abs(remainder[:, row]).max() <= 1e-8 * scale
    np.testing.assert_allclose(modes @ q, exact, atol=1e-8 * np.abs(exact).max())


def test_mode_acceleration_is_exact_at_rest_with_any_modes(tmp_path: Path) -> None:
    """Under constant loads the modes left out are all there: the maps of 2 modes and of all give one stress."""
    link = frame_link(tmp_path, reduction={"elastic_modes": 2}, **ALL)
    modal = reduce_link(link)
    maps = maps_of(modal)
    hub, hand = modal.interface_nodes
    loads = balanced(np.array([1.0, 2.0, 3.0, 0.04, 0.05, 0.06]), hand.position - hub.position)
    q = np.zeros(modal.modes)
    q[6:] = interface_shapes(modal)[:, 6:].T @ loads / (2 * np.pi * modal.frequencies_hz[6:]) ** 2
    modes, remainder, _, _ = mode_acceleration(modal)
    exact = maps.loads @ loads
    assert np.abs(maps.modes @ q - exact).max() > 0.1 * np.abs(exact).max()  # two modes alone are far off
    np.testing.assert_allclose(modes @ q + remainder @ loads, exact, atol=1e-9 * np.abs(exact).max())


def test_gravity_and_rigid_acceleration_need_no_column(tmp_path: Path) -> None:
    """The loads M R of a rigid-body acceleration leave the free link without strain."""
    model = build_model(frame_link(tmp_path))
    weight = np.asarray(model.mass @ model.rigid_body_modes())
    unit_loads = inertia_relief(model, np.eye(len(weight)))
    assert np.abs(inertia_relief(model, weight)).max() < 1e-12 * np.abs(unit_loads).max()


@pytest.mark.parametrize("make", [frame_link, solid_link])
def test_units_do_not_matter(tmp_path: Path, make: Callable[..., Any]) -> None:
    """A description in mm, t, s gives the stress per newton of the one in SI."""
    (tmp_path / "si").mkdir()
    (tmp_path / "mm").mkdir()
    si = maps_of(reduce_link(make(tmp_path / "si", **ALL)))
    material = {"youngs_modulus": 7e4, "poissons_ratio": 0.33, "density": 2.7e-9}
    changes: dict[str, Any] = {"units": {"length": "mm", "mass": "t", "time": "s"}, "materials": {"m": material}}
    if make is frame_link:
        changes["sections"] = {"s": {"width": 10.0, "height": 20.0}}
        nodes = {"root": [100.0, 0.0, 0.0], "elbow": [500.0, 100.0, 50.0], "tip": [600.0, 500.0, -100.0]}
        changes["frame"] = {"nodes": nodes}
    link = make(tmp_path / "mm", **merged(changes, ALL))
    if make is solid_link:
        write_box(tmp_path / "mm" / "box.inp", 1000.0)
    mm = maps_of(reduce_link(link))
    for row in range(6):
        scale = np.abs(si.loads[:, row]).max()
        np.testing.assert_allclose(mm.loads[:, row], si.loads[:, row], atol=1e-7 * scale)
    np.testing.assert_allclose(np.abs(mm.modes), np.abs(si.modes), atol=1e-5 * np.abs(si.modes).max())


def test_only_what_is_asked_for(tmp_path: Path) -> None:
    """Nodes and members choose element ends; nothing is stored unless asked for; the size is told."""
    assert reduce_link(frame_link(tmp_path)).recovery is None
    some = reduce_link(frame_link(tmp_path, recovery={"nodes": ["elbow"], "sets": ["elbow-tip"]}))
    maps = maps_of(some)
    assert maps.elements.tolist() == [2, 3, 3, 4, 4, 5, 5]
    assert (maps.nodes == some.node_names["elbow"]).sum() == 2
    assert reduction_summary(some)["recovery"] == {
        "quantity": "section forces",
        "places": 7,
        "megabytes": pytest.approx(7 * 6 * 8 * (2 * some.modes + 12 + 6) / 1e6),
    }
    face = maps_of(reduce_link(solid_link(tmp_path, recovery={"sets": ["x0"]})))
    assert len(face.nodes) == 8


@pytest.mark.parametrize("make", [frame_link, solid_link])
def test_round_trip(tmp_path: Path, make: Callable[..., Any]) -> None:
    """A file gives back every map to the last bit."""
    modal = reduce_link(make(tmp_path, **ALL))
    write_modal_file(tmp_path / "a.h5", modal)
    again = read_modal_file(tmp_path / "a.h5")
    assert same(again, modal)
    write_modal_file(tmp_path / "b.h5", again)
    assert (tmp_path / "a.h5").read_bytes() == (tmp_path / "b.h5").read_bytes()


def test_faulty_maps_are_refused(tmp_path: Path) -> None:
    """Whatever does not fit the link is named."""
    modal = reduce_link(frame_link(tmp_path, reduction={"elastic_modes": 3}, **ALL))
    good = maps_of(modal)
    strained = good.modes.copy()
    strained[0, 0, 2] = 1.0
    for change, place in (
        ({"quantity": "colour"}, "recovery/@quantity"),
        ({"nodes": good.nodes + 7}, "recovery/nodes"),
        ({"elements": good.elements + 7}, "recovery/elements"),
        ({"axes": 2 * good.axes}, "recovery/axes"),
        ({"modes": good.modes[:, :, :8]}, "recovery/modes"),
        ({"inertia": good.inertia[:1]}, "recovery/inertia"),
        ({"loads": good.loads * np.nan}, "recovery/loads"),
        ({"spin": good.spin.astype(int)}, "recovery/spin"),
        ({"modes": strained}, "recovery/modes"),
    ):
        with pytest.raises(FEImportError) as caught:
            write_modal_file(tmp_path / "a.h5", replace(modal, recovery=replace(good, **change)))
        assert caught.value.cause == Cause.MODAL_FILE
        assert place in caught.value.where


@pytest.mark.parametrize(
    ("recovery", "cause", "where", "said"),
    [
        ({"nodes": ["elbo"]}, Cause.BAD_REFERENCE, "recovery.nodes[0]", "elbow"),
        ({"sets": ["root-elbow", "hub"]}, Cause.BAD_REFERENCE, "recovery.sets[1]", "root-elbow"),
        ({}, Cause.BAD_FIELD, "recovery", "all = true"),
        ({"all": True, "points": ["tip"]}, Cause.UNKNOWN_FIELD, "recovery", "points"),
    ],
)
def test_faulty_requests(tmp_path: Path, recovery: dict[str, Any], cause: Cause, where: str, said: str) -> None:
    """The message names the field and what there is."""
    with pytest.raises(FEImportError) as caught:
        reduce_link(frame_link(tmp_path, recovery=recovery))
    assert caught.value.cause == cause
    assert where in caught.value.where
    assert said in str(caught.value)


def test_links_without_elements_or_maps(tmp_path: Path) -> None:
    """Bare matrices have nothing to recover from; nor have the physical form and a file without maps."""
    link = frame_link(tmp_path)
    bare = replace(build_model(link), kind="matrices", stress=None)
    with pytest.raises(FEImportError, match="no elements") as caught:
        recovery_maps(bare, np.zeros((42, 6)), Recovery(all=True), "link.toml")
    assert caught.value.where == "link.toml: recovery"
    with pytest.raises(FEImportError, match="physical form"):
        frame_link(tmp_path, reduction={"form": "physical"}, **ALL)
    with pytest.raises(FEImportError, match=r"\[recovery\]"):
        required_maps(reduce_link(link), "link 'l'")
