"""Derivatives of modal models: against the derivative of the space of modes in closed form, laws of scale, refusals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
import scipy.linalg as la

from fe_import.derivatives import modal_derivatives
from fe_import.description.link import LinkFile, load_link, with_numbers
from fe_import.elements.frame import assemble_frame
from fe_import.elements.sections import SectionConstants
from fe_import.errors import Cause, FEImportError
from fe_import.modal.held_shapes import arrays_in
from fe_import.model import FEModel
from fe_import.models.frame import frame_mesh
from fe_import.models.model import build_model

ARM = Path(__file__).parents[2] / "data" / "robot" / "links" / "arm.toml"
WIDTH = "sections.bar.width"
ODD = range(1, 400, 2)  # terms of the series of torsion: the last one is 1e-13 of the first
RICHARDSON = ((-2, 1 / 12), (-1, -2 / 3), (1, 2 / 3), (2, -1 / 12))


def _free_modes(count: int) -> LinkFile:
    """The square arm with its lowest modes, free."""
    return _coarse(load_link(ARM, {"method": "mode-displacement", "elastic_modes": count}))


def _coarse(link: LinkFile) -> LinkFile:
    """Of eight elements."""
    assert link.description.frame is not None
    members = [msgspec.structs.replace(link.description.frame.members[0], elements=8)]
    frame = msgspec.structs.replace(link.description.frame, members=members)
    return LinkFile(link.path, msgspec.structs.replace(link.description, frame=frame))


def _slope(models: Sequence[FEModel], of: str, step: float) -> np.ndarray:
    """Derivative of an assembled matrix, of fourth order."""
    parts = [weight / step * getattr(m, of).toarray() for m, (_, weight) in zip(models, RICHARDSON, strict=True)]
    return np.asarray(sum(parts))


def _complex_slopes(link: LinkFile, key: str) -> tuple[np.ndarray, np.ndarray]:
    """dM/dp and dK/dp of a straight bar of square section, by a complex step through its assembly."""
    description, tiny = link.description, 1e-30
    frame = description.frame
    assert frame is not None
    mesh = frame_mesh(description, frame, "bar")
    whole = float(np.linalg.norm(mesh.nodes[1] - mesh.nodes[0]))
    elements: list[Any] = []
    for element in mesh.elements:
        if key == WIDTH:
            b, h = 0.01 + 1j * tiny, 0.01
            k = element.section.shear_factor_y
            series = sum(np.tanh(n * np.pi * b / h / 2) / n**5 for n in ODD)
            turning = b * h**3 * (1 / 3 - 64 / np.pi**5 * h / b * series)
            own: Any = SectionConstants(b * h, b * h**3 / 12, b**3 * h / 12, turning, k, k)  # type: ignore[arg-type]
            elements.append(replace(element, section=own))
        else:
            longer: Any = element.length * (1 + 1j * tiny / whole)
            elements.append(replace(element, length=longer))
    settings = {"mass": frame.mass, "rotary_inertia": frame.rotary_inertia}
    shear = frame.theory == "timoshenko"
    mass, stiffness, _ = assemble_frame(len(mesh.nodes), elements, shear=shear, **settings)  # type: ignore[arg-type]
    return mass.toarray().imag / tiny, stiffness.toarray().imag / tiny


@pytest.mark.parametrize("key", [WIDTH, "frame.nodes.tip.0"])
def test_space_of_modes_in_closed_form(key: str) -> None:
    """Two pairs of equal frequencies, which the width parts: φ_k' = Σ_o φ_o φ_oᵀ(K' - λ_k M')φ_k / (λ_k - λ_o) + Φ G.

    o runs over the modes left out, G over shapes that are held: of what least squares leave of Φ' in the space of the
    modes. Matrices are differentiated by a complex step through their assembly, with which differences of assembled
    ones agree to 1e-9; nothing is differenced else. To 1e-9; measured 7e-11.
    """
    link = _free_modes(4)
    found = modal_derivatives(link, key)
    value = found.value
    models = [build_model(with_numbers(link, {key: value * (1 + at * 2e-3)})) for at, _ in RICHARDSON]
    mass_slope, stiffness_slope = _complex_slopes(link, key)
    for of, exact in (("mass", mass_slope), ("stiffness", stiffness_slope)):
        assert np.abs(_slope(models, of, 2e-3 * value) - exact).max() <= 1e-9 * np.abs(exact).max(), of
    model = build_model(link)
    mass, stiffness = model.mass.toarray(), model.stiffness.toarray()
    values, fields = la.eigh(stiffness, mass)
    kept = np.empty((len(mass), 4))
    for node, rows in enumerate(model.dof_map):
        kept[rows[:3]] = found.model.translation_shapes[node][:, 6:]
        kept[rows[3:]] = found.model.rotation_shapes[node][:, 6:]
    left, own = fields[:, 10:], np.diag(found.model.stiffness)[6:]
    change = np.empty_like(kept)
    for k in range(4):
        push = left.T @ (stiffness_slope - own[k] * mass_slope) @ kept[:, k]
        change[:, k] = left @ (push / (own[k] - values[10:]))
    rigid = model.rigid_body_modes()  # they move with nodes that move
    change -= rigid @ np.linalg.solve(rigid.T @ mass @ rigid, rigid.T @ mass_slope @ kept)
    size = np.linalg.norm(np.ptp(model.nodes, axis=0))
    scale = np.where(np.isin(np.arange(len(mass)), model.dof_map[:, :3]), 1.0, size)[:, None]
    span = scale * np.hstack([rigid, kept])
    held = np.linalg.lstsq(span, scale * change, rcond=None)[0]
    shapes = change - np.hstack([rigid, kept]) @ held
    for of, slope, whole, name in (
        (mass, mass_slope, np.eye(4), "invariants.m"),
        (stiffness, stiffness_slope, np.diag(own), "stiffness"),
    ):
        both = kept.T @ of @ shapes
        expected = kept.T @ slope @ kept + both + both.T
        scales = np.sqrt(np.outer(np.diag(whole), np.diag(whole)))
        apart = (value * (found.arrays[name][6:, 6:] - expected)) / scales
        assert np.abs(apart).max() <= 1e-9, name


@pytest.mark.parametrize("of", ["youngs_modulus", "density"])
def test_material_scales_matrices_alone(of: str) -> None:
    """Shapes are held: K and with it Ω scales with E, M with ρ, recovery and second order follow; to 1e-9.

    Damping 2 ζ Ω, given by a ratio, goes with the root of either.
    """
    link = _coarse(load_link(ARM))
    damped = msgspec.structs.replace(link.description.damping, ratio=0.01)
    link = LinkFile(link.path, msgspec.structs.replace(link.description, damping=damped))
    found = modal_derivatives(link, f"materials.aluminium.{of}")
    arrays = {name: found.value * array for name, array in found.arrays.items()}
    own = found.model
    stiff, heavy = (1.0, 0.0) if of == "youngs_modulus" else (0.0, 1.0)
    damping = np.diag(2 * own.damping_ratios * 2 * np.pi * own.frequencies_hz)
    second = own.second_order
    assert second is not None
    for name, expected in {
        "stiffness": stiff * own.stiffness,
        "damping": 0.5 * damping,
        "invariants.m": heavy * own.invariants.m,
        "invariants.X": heavy * own.invariants.X,
        "invariants.Z": heavy * own.invariants.Z,
        "invariants.rigid": 0.0 * own.invariants.rigid,
        "translation_shapes": 0.0 * own.translation_shapes,
        "second_order.momentum": heavy * second.momentum,
        "second_order.modal": heavy * second.modal,
        "second_order.translation": 0.0 * second.translation,
    }.items():
        largest = np.abs(damping if name == "damping" else _array(own, name)).max()
        assert np.abs(arrays[name] - expected).max() <= 1e-9 * largest, name


@pytest.mark.parametrize("key", [WIDTH, "frame.nodes.tip.0"])
def test_every_array_by_steps_of_other_sizes(key: str) -> None:
    """Of twice the size: as Richardson's, of what is left out sixteen times as much; to 1e-8, measured 1e-9."""
    link = _coarse(load_link(ARM))
    found = modal_derivatives(link, key)
    wider = modal_derivatives(link, key, 2 * found.value)
    whole = arrays_in(found.model, np.eye(len(found.model.stiffness)))
    assert found.arrays.keys() == whole.keys()
    for name, array in found.arrays.items():
        scale = max(np.abs(found.value * array).max(), np.abs(whole[name]).max())
        assert np.abs(found.value * (wider.arrays[name] - array)).max() <= 1e-8 * scale, name


def _array(model: object, name: str) -> np.ndarray:
    for step in name.split("."):
        model = getattr(model, step)
    return np.asarray(model)


def test_cuts_between_equal_frequencies_are_refused() -> None:
    """The pair is named: kept whole at the value itself, it parts beside it."""
    with pytest.raises(FEImportError, match=r"would part modes of equal frequency \([\d.]+ Hz\)") as caught:
        modal_derivatives(_free_modes(3), WIDTH)
    assert caught.value.cause == Cause.MODE_COUNT


def test_steps_that_are_no_small_changes_are_refused() -> None:
    """A thermal expansion of zero does not tell that one per kelvin is enormous; with that told, forces are linear."""
    link, key = ARM.parents[2] / "thermal" / "links" / "bimetal.toml", "materials.stiff.thermal_expansion"
    with pytest.raises(FEImportError, match="steps of differences are too large"):
        modal_derivatives(link, key)
    assert modal_derivatives(link, key, 1e-5).arrays["thermal.force"].any()


@pytest.mark.parametrize(
    ("key", "told"),
    [
        ("reduction.elastic_modes", "chooses modes"),
        ("sections.bar.shape", "not a number"),
        ("sections.bar.nothing", "none of that name"),
        ("sections..width", "not a dotted key"),
        ("frame.members.4.elements", "no member '4'"),
        ("frame.members.0.elements", "whole number"),
    ],
)
def test_refusals(key: str, told: str) -> None:
    with pytest.raises(FEImportError, match=told):
        modal_derivatives(_free_modes(4), key)
