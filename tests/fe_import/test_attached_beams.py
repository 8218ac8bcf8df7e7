"""Beams in decks beside solids: against closed forms, frames described otherwise, and CalculiX."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.linalg
from link_files import SOLID, dense, frame_link, merged, solid_link, write_toml

from fe_import.description.link import LinkFile, load_link
from fe_import.errors import Cause, FEImportError
from fe_import.model import FEModel
from fe_import.models.model import build_model
from fe_import.reduce import reduce_link

E, NU, RHO = 7e10, 0.33, 2700.0
MATERIAL = ["*MATERIAL, NAME=ALU", "*ELASTIC", f"{E}, {NU}", "*DENSITY", f"{RHO},"]
ROOT, TIP = np.array([0.3, 0.01, 0.015]), np.array([0.7, 0.31, -0.185])


def beam_nodes(count: int, start: Any = ROOT, end: Any = TIP, first: int = 9000) -> list[str]:
    """Lines of nodes on a straight line, the last one in the set TIP."""
    steps = np.linspace(start, end, count + 1)
    lines = ["*NODE", *(f"{first + k}, " + ", ".join(repr(float(x)) for x in p) for k, p in enumerate(steps))]
    return [*lines, "*NSET, NSET=TIP", f"{first + count},", "*NSET, NSET=ROOT", f"{first},"]


def beam_elements(count: int, kind: str = "B31", first: int = 9000) -> list[str]:
    """Lines of elements in the set BEAMS."""
    lines = [f"*ELEMENT, TYPE={kind}, ELSET=BEAMS"]
    if kind == "B32":
        return [*lines, *(f"{first + k}, {first + k}, {first + k + 1}, {first + k + 2}" for k in range(0, count, 2))]
    return [*lines, *(f"{first + k}, {first + k}, {first + k + 1}" for k in range(count))]


def section(*rows: str, shape: str = "RECT") -> list[str]:
    return [f"*BEAM SECTION, ELSET=BEAMS, MATERIAL=ALU, SECTION={shape}", *rows, *MATERIAL]


RECT = section("0.01, 0.02", "0.1, 0.2, 1.")


def deck_link(folder: Path, *lines: str, interfaces: Any = None, **changes: Any) -> LinkFile:
    """The box of `SOLID` with further lines in its deck; interfaces unless given: its face x0, and the node TIP."""
    given = interfaces or [SOLID["interfaces"][0], {"name": "hand", "node": "TIP"}]
    link = solid_link(folder, interfaces=given, **changes)
    mesh = folder / "box.inp"
    mesh.write_text(mesh.read_text() + "\n".join(lines) + "\n")
    return link


def on_rigid_box(folder: Path, *lines: str) -> FEModel:
    """Beams from node 9000, which the whole box follows; both ends of the beams are interfaces."""
    interfaces = [{"name": "hub", "node": "ROOT"}, {"name": "hand", "node": "TIP"}]
    rigid = ["*RIGID BODY, ELSET=ALL, REF NODE=9000"]
    return build_model(deck_link(folder, *lines, *rigid, interfaces=interfaces))


def tip_flexibility(model: FEModel) -> np.ndarray:
    """(6, 6) motion of the second interface per unit load there, the first one held."""
    _, stiffness, _ = dense(model)
    place = np.searchsorted(model.independent, model.interface_dofs)
    free = np.setdiff1d(np.arange(len(stiffness)), place[:6])
    columns = np.searchsorted(free, place[6:])
    return np.linalg.inv(stiffness[np.ix_(free, free)])[np.ix_(columns, columns)]


@pytest.mark.parametrize("kind", ["B31", "B32"])
def test_a_cantilever(tmp_path, kind):
    """Deflection, twist and stretch of a rectangular beam that stands askew, closed forms to 1e-9."""
    model = on_rigid_box(tmp_path, *beam_nodes(4), *beam_elements(4, kind), *RECT)
    length = float(np.linalg.norm(TIP - ROOT))
    x = (TIP - ROOT) / length
    one = np.array([0.1, 0.2, 1.0])
    one -= (one @ x) * x
    one /= np.linalg.norm(one)
    two = np.cross(x, one)
    axes = np.kron(np.eye(2), np.stack([x, one, two]))
    found = axes @ tip_flexibility(model) @ axes.T
    area, shear = 0.01 * 0.02, E / (2 * (1 + NU))
    bend = {1: E * 0.02 * 0.01**3 / 12, 2: E * 0.01 * 0.02**3 / 12}  # deflection in direction 1, 2
    assert found[0, 0] == pytest.approx(length / (E * area), rel=1e-9)
    for direction, stiffness in bend.items():
        slender, sheared = length**3 / (3 * stiffness), length / (5 / 6 * shear * area)
        assert found[direction, direction] == pytest.approx(slender + sheared, rel=1e-9)
    assert found[5, 5] == pytest.approx(length / bend[1], rel=1e-9)
    assert found[1, 5] == pytest.approx(length**2 / (2 * bend[1]), rel=1e-9)
    torsion = 0.01**3 * 0.02 * 0.228682  # Timoshenko & Goodier, table for b / a = 2: 0.229
    assert found[3, 3] == pytest.approx(length / (shear * torsion), rel=1e-5)


def test_a_frame_in_a_deck(tmp_path):
    """Frequencies of beams on a rigid box are those of a frame with the box as a mass, to 1e-9."""
    model = on_rigid_box(tmp_path, *beam_nodes(6), *beam_elements(6), *section("0.01, 0.02", "0.1, 0.2, 1."))
    plain = build_model(solid_link(tmp_path))
    rigid = plain.rigid_body_modes()
    inertia = rigid.T @ plain.mass @ rigid
    shift = np.eye(6)
    x, y, z = ROOT
    shift[:3, 3:] = [[0, -z, y], [z, 0, -x], [-y, x, 0]]  # motion of the origin per motion of ROOT: θ × (0 - ROOT)
    along = TIP - ROOT
    one = np.array([0.1, 0.2, 1.0])
    frame = {
        "nodes": {"root": ROOT.tolist(), "elbow": (ROOT + along / 2).tolist(), "tip": TIP.tolist()},
        "members": [
            {"from": a, "to": b, "elements": 3, "material": "m", "section": "s", "local_z": np.cross(along, one).tolist()}
            for a, b in (("root", "elbow"), ("elbow", "tip"))
        ],
    }
    (tmp_path / "frame").mkdir()
    same = build_model(frame_link(tmp_path / "frame", frame=frame))
    mass, stiffness, _ = dense(same)
    root = same.dof_map[same.node_names["root"]]
    mass[np.ix_(root, root)] += shift.T @ inertia @ shift
    found_mass, found_stiffness, _ = dense(model)
    expected = scipy.linalg.eigh(stiffness, mass, eigvals_only=True)[6:]
    found = scipy.linalg.eigh(found_stiffness, found_mass, eigvals_only=True)[6:]
    np.testing.assert_allclose(found, expected, rtol=1e-9)
