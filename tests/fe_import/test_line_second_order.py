"""Second-order fields along the cross sections of links that are bare matrices: beside beams, solids, closed forms."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg as la
from link_files import FRAME, SOLID, Array, frame_link, solid_link, straight_link, write_toml
from solid_meshes import box
from test_second_order import field_at, orthonormal
from test_seeded_faults import deck

from fe_import.description.link import load_link
from fe_import.model import FEModel
from fe_import.models.model import build_model
from fe_import.second_order.compute import second_order
from fe_import.second_order.frame import frame_second_order
from fe_import.second_order.line import line_second_order

ROOT = Path(__file__).parents[2]


def bare(model: FEModel) -> FEModel:
    """What is known of exported matrices."""
    return replace(model, kind="matrices", beams=None, stress=None, stiffness_parts={})


def modes(model: FEModel, count: int) -> Array:
    """Rigid-body motions, then the lowest modes of the free link."""
    mass, stiffness = (matrix.toarray() for matrix in model.reduced_matrices())
    return np.hstack([model.rigid_body_modes(), la.eigh(stiffness, mass)[1][:, 6 : 6 + count]])


@pytest.mark.parametrize("reference", [0, 1])
def test_beams_are_the_limit(tmp_path: Path, reference: int) -> None:
    """Of an L with a point mass at its tip: fields and terms of mass are those of its beams, off by the square of the
    distance of sections.
    """
    masses = [{"node": "tip", "mass": 0.4, "inertia": [1e-3, 2e-3, 3e-3]}]
    errors = []
    for elements in (10, 20):
        members = [{**member, "elements": elements} for member in FRAME["frame"]["members"]]
        model = build_model(frame_link(tmp_path, masses=masses, frame={"members": members}))
        assert model.beams is not None
        shapes, nodes = modes(model, 4), np.array([i.node for i in model.interface_nodes])
        exact = frame_second_order(model, model.beams, shapes, reference, np.sort(nodes))
        found, statement = line_second_order(bare(model), shapes, reference, np.sort(nodes))
        assert "cross sections along its line" in statement
        errors.append([
            np.abs(getattr(found, name) - getattr(exact, name)).max() / np.abs(getattr(exact, name)).max()
            for name in ("momentum", "spin", "modal", "translation", "rotation")
        ])  # fmt: skip
    coarse, fine = np.array(errors)
    assert (fine < 0.01).all()
    assert (fine < coarse / 3.5).all()  # 4


def meshed(folder: Path, kind: str, divisions: tuple[int, int, int], size: tuple[float, float, float]) -> FEModel:
    (folder / "box.inp").write_text(deck(box(kind, divisions, size)), encoding="utf-8")
    return build_model(load_link(write_toml(folder / "link.toml", SOLID)))


def bent(model: FEModel) -> Array:
    """Rigid-body motions, and bending by a constant curvature about y, with what it does across."""
    x, z = model.nodes[:, 0], model.nodes[:, 2] - model.nodes[:, 2].mean()
    shapes = np.hstack([model.rigid_body_modes(), np.zeros((model.mass.shape[0], 1))])
    shapes[model.dof_map[:, 0], 6], shapes[model.dof_map[:, 2], 6] = -x * z, x**2 / 2
    turning = model.dof_map[:, 3] >= 0
    shapes[model.dof_map[turning, 4], 6] = -x[turning]
    return shapes


def solid_bar(folder: Path) -> FEModel:
    return meshed(folder, "hex20", (20, 1, 1), (1.0, 0.02, 0.03))


def ladder(folder: Path) -> FEModel:
    """Two members side by side, joined by rungs: rings, but each across a section."""
    return build_model(load_link(ROOT / "data/thermal/links/bimetal.toml"))


def strip(folder: Path) -> FEModel:
    return build_model(straight_link(folder, 1.0, 20))


@pytest.mark.parametrize("make", [strip, solid_bar, ladder])
def test_shortening_of_a_bent_bar(tmp_path: Path, make: Callable[[Path], FEModel]) -> None:
    """An arc of unit curvature: u₂ = -∫ x²/2 dx = -L³/6 at the tip, to the square of the distance of sections."""
    model = make(tmp_path)
    tip = model.interface_nodes[1].node
    found, _ = line_second_order(bare(model), bent(model), 0, np.unique([model.interface_nodes[0].node, tip]))
    length = float(np.ptp(model.nodes[:, 0]))
    second = field_at(found, tip, np.array([0.0, 0, 0, 0, 0, 0, 1.0]))
    np.testing.assert_allclose(second, [-(length**3) / 6, 0, 0, 0, 0, 0], atol=2e-3 * length**3)


def compact(folder: Path) -> FEModel:
    return build_model(solid_link(folder))


def plate(folder: Path) -> FEModel:
    return meshed(folder, "hex8", (12, 12, 1), (0.3, 0.3, 0.01))


def ring(folder: Path) -> FEModel:
    """A triangle of members."""
    nodes = {"root": [0.0, 0.0, 0.0], "elbow": [0.3, 0.0, 0.0], "tip": [0.3, 0.4, 0.0]}
    sides = (("root", "elbow"), ("elbow", "tip"), ("root", "tip"))
    members = [{"from": a, "to": b, "elements": 12, "material": "m", "section": "s"} for a, b in sides]
    return build_model(frame_link(folder, frame={"nodes": nodes, "members": members}))


def with_modal_rows(folder: Path) -> FEModel:
    model = strip(folder)
    return replace(model, dof_map=np.where(model.dof_map == model.dof_map.max(), -1, model.dof_map))


@pytest.mark.parametrize(
    ("make", "reason"),
    [
        (compact, "as condensed matrices and compact links do"),
        (plate, "cross sections deform"),
        (ring, "the link forms a ring"),
        (with_modal_rows, "rows of modal coordinates"),
    ],
)
def test_what_has_no_line_says_so(tmp_path: Path, make: Callable[[Path], FEModel], reason: str) -> None:
    model = bare(make(tmp_path))
    field, statement = second_order(model, orthonormal(model, 3), 0)
    assert field is None
    assert statement.startswith("not available: matrices have no elements, and ")
    assert reason in statement
