"""Ties, multi-point constraints and couplings of decks: against CalculiX, one mesh instead of two, and other words."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from calculix import NEEDS_CALCULIX, calculix_frequencies
from decks import part
from link_files import SOLID, dense, merged, write_toml
from solid_meshes import box

from fe_import.description.link import load_link
from fe_import.elements.attachments import LinearEquation
from fe_import.elements.solid_orders import raised
from fe_import.errors import Cause, FEImportError
from fe_import.interfaces.dependence import Dependence
from fe_import.interfaces.ties import feet_on_faces
from fe_import.interfaces.weights import area_weights, face_shapes
from fe_import.mesh.read import read_mesh
from fe_import.model import FEModel
from fe_import.models.attached import attached_constraints, attached_nodes
from fe_import.models.model import build_model

MATERIAL = ["*MATERIAL, NAME=M", "*ELASTIC", "7e10, .33", "*DENSITY", "2700.,"]


def two_parts(kind: str, gap: float = 0.0) -> list[str]:
    """Two boxes of meshes that do not fit: the nodes of the fine one lie on the faces of the coarse one."""
    coarse, fine = box(kind, (2, 1, 1), (0.2, 0.03, 0.02)), box(kind, (2, 2, 3), (0.15, 0.03, 0.02))
    return [*part(coarse, (0, 0, 0), 1, "A"), *part(fine, (0.2 + gap, 0, 0), 1001, "B"), *MATERIAL]


TIE = ["*TIE, NAME=T, POSITION TOLERANCE=0.002", "S-B-x0, S-A-x1"]


def link(folder: Path, lines: list[str], **changes: Any) -> FEModel:
    """The deck as a link of its own materials, its interface on the far end of the first part."""
    (folder / "two.inp").write_text("\n".join(lines) + "\n")
    hub = {"name": "hub", "face": "A-x0", "coupling": "averaged", "weights": "uniform"}
    table = merged(SOLID, {"solid": {"mesh": "two.inp", "material": ""}, "interfaces": [hub]})
    return build_model(load_link(write_toml(folder / "link.toml", merged(table, changes))))


def frequencies(model: FEModel) -> np.ndarray:
    """The first 8 elastic frequencies [Hz], rows without mass condensed."""
    mass, stiffness, _ = dense(model)
    keep = np.diag(mass) > 0
    inner = np.linalg.solve(stiffness[np.ix_(~keep, ~keep)], stiffness[np.ix_(~keep, keep)])
    k, m = stiffness[np.ix_(keep, keep)] - stiffness[np.ix_(keep, ~keep)] @ inner, mass[np.ix_(keep, keep)]
    half = np.linalg.inv(np.linalg.cholesky(m))
    return np.sqrt(np.abs(np.linalg.eigvalsh(half @ k @ half.T)[6:14])) / (2 * np.pi)


@NEEDS_CALCULIX
@pytest.mark.parametrize("kind", ["hex8", "hex20"])
def test_a_tie_as_calculix_has_it(tmp_path, kind):
    """Free frequencies of two parts that do not fit, to 2e-6: both by the shape functions of the faces."""
    lines = [*two_parts(kind), *TIE]
    judge = calculix_frequencies(tmp_path, lines, 14)
    found = frequencies(link(tmp_path, lines, solid={"hex8": "compatible"}))
    np.testing.assert_allclose(found, judge[6:], rtol=2e-6)


KINDS = ["tet4", "tet10", "wedge6", "wedge15", "hex8", "hex20"]


def constraints(folder: Path, lines: list[str], **solid: Any) -> tuple[Dependence, np.ndarray, np.ndarray]:
    """Constraints of the deck alone, nodes and rows of their displacements."""
    (folder / "two.inp").write_text("\n".join(lines) + "\n")
    mesh = read_mesh(folder / "two.inp")
    if solid.get("raise_order"):
        mesh = raised(mesh)
    places = attached_nodes(mesh)
    return attached_constraints(mesh, places)[0], places.nodes, places.dof_map[:, :3]


def worst(state: Dependence, rows: np.ndarray, values: np.ndarray) -> float:
    """Largest departure of a field (nodes, 3) from the constraints."""
    field = np.zeros(state.matrix.shape[0])
    field[rows] = values
    return float(np.abs(state.matrix @ field[state.independent] - field).max())


@pytest.mark.parametrize("kind", KINDS)
def test_fields_across_a_tie(tmp_path, kind):
    """Linear fields, and of quadratic elements all quadratic ones, satisfy the constraints, to rounding."""
    state, nodes, rows = constraints(tmp_path, [*two_parts(kind), *TIE])
    assert len(state.independent) < state.matrix.shape[0] - 20
    x = nodes - nodes.mean(axis=0)
    direction, tensor = np.array([1.0, -2.0, 0.5]), np.random.default_rng(1).standard_normal((3, 3))
    assert worst(state, rows, x @ tensor) < 1e-14
    bent = np.einsum("ni,ij,nj->n", x, tensor, x)[:, None] * direction
    linear = kind in ("tet4", "wedge6", "hex8")
    assert (worst(state, rows, bent) > 1e-6) if linear else (worst(state, rows, bent) < 1e-15)


@pytest.mark.parametrize("kind", ["hex8", "tet4"])
def test_a_tie_of_a_raised_mesh(tmp_path, kind):
    """Nodes in the middle of edges are tied too, to quadratic faces."""
    state, nodes, rows = constraints(tmp_path, [*two_parts(kind), *TIE], raise_order=True)
    x = nodes - nodes.mean(axis=0)
    bent = np.einsum("ni,ij,nj->n", x, np.eye(3) + 0.3, x)[:, None] * np.ones(3)
    assert worst(state, rows, bent) < 1e-15
    plain, *_ = constraints(tmp_path, [*two_parts(kind), *TIE])
    both = [s.matrix.shape[0] - len(s.independent) for s in (state, plain)]
    assert both[0] > 2 * both[1]


@pytest.mark.parametrize("kind", ["hex20", "tet10"])
def test_a_tie_over_a_gap(tmp_path, kind):
    """Rigid-body motion passes exactly; frequencies are those without a gap to its share of the length."""
    state, nodes, rows = constraints(tmp_path, [*two_parts(kind, gap=1e-4), *TIE])
    turn = np.cross([0.3, -0.2, 0.5], nodes) + np.array([1.0, 2.0, 3.0])
    assert worst(state, rows, turn) < 1e-14
    near = frequencies(link(tmp_path, [*two_parts(kind, gap=1e-4), *TIE]))
    np.testing.assert_allclose(near, frequencies(link(tmp_path, [*two_parts(kind), *TIE])), rtol=2e-3)


def test_nodes_far_from_the_faces_stay_free(tmp_path):
    """Half of the second part hangs over: its nodes there are counted; far from all faces, the tie is refused."""
    coarse, fine = box("hex8", (2, 1, 1), (0.2, 0.03, 0.02)), box("hex8", (2, 2, 3), (0.15, 0.03, 0.02))
    lines = [*part(coarse, (0, 0, 0), 1, "A"), *part(fine, (0.2, 0.015, 0), 1001, "B"), *MATERIAL, "*TIE, NAME=T"]
    model = link(tmp_path, [*lines, "S-B-x0, S-A-x1"])
    assert model.notes["attached"] == "1 TIE (4 nodes beyond its tolerance stay free)"
    apart = [*part(coarse, (0, 0, 0), 1, "A"), *part(fine, (0.3, 0, 0), 1001, "B"), *MATERIAL, "*TIE, NAME=T"]
    with pytest.raises(FEImportError, match=r"none of its nodes lies on one of its faces, nearest; got 0\.") as caught:
        link(tmp_path, [*apart, "S-B-x0, S-A-x1"])
    assert caught.value.cause is Cause.MESH


def test_ties_that_share_nodes(tmp_path):
    """Said twice, and with first and second exchanged, it changes nothing that once does not."""
    lines = two_parts("hex20")
    once = frequencies(link(tmp_path, [*lines, *TIE]))
    np.testing.assert_allclose(frequencies(link(tmp_path, [*lines, *TIE, TIE[1]])), once, rtol=1e-9)
    fitting = box("hex20", (2, 1, 1), (0.2, 0.03, 0.02))
    lines = [*part(fitting, (0, 0, 0), 1, "A"), *part(fitting, (0.2, 0, 0), 1001, "B"), *MATERIAL]
    ways = (["S-B-x0, S-A-x1"], ["S-A-x1, S-B-x0"], ["S-B-x0, S-A-x1", "S-A-x1, S-B-x0"])
    found = [frequencies(link(tmp_path, [*lines, TIE[0], *way])) for way in ways]
    whole = box("hex20", (4, 1, 1), (0.4, 0.03, 0.02))
    expected = frequencies(link(tmp_path, [*part(whole, (0, 0, 0), 1, "A"), *MATERIAL]))
    for way in found:
        np.testing.assert_allclose(way, expected, rtol=1e-8)


def ended(*lines: str) -> list[str]:
    """A bar of hexahedra with a beam behind its end, and further lines."""
    mesh = box("hex20", (2, 1, 1), (0.2, 0.03, 0.02))
    beams = ["*NODE", "9000, 0.2, 0.015, 0.01", "9001, 0.3, 0.1, 0.05", "*ELEMENT, TYPE=B31, ELSET=BEAM"]
    beams += ["9000, 9000, 9001", "*BEAM SECTION, ELSET=BEAM, MATERIAL=M, SECTION=RECT", "0.01, 0.012"]
    return [*part(mesh, (0, 0, 0), 1, "A"), *MATERIAL, *beams, *lines]


def labels_of_end() -> list[int]:
    return (box("hex20", (2, 1, 1), (0.2, 0.03, 0.02)).node_sets["x1"] + 1).tolist()


def test_couplings_and_multi_point_constraints(tmp_path):
    """A rigid end in four words; as an average in two, the weights of which are the shares of the area."""
    rigid = {
        "rigid body": ["*RIGID BODY, NSET=A-x1, REF NODE=9000"],
        "pinned": ["*RIGID BODY, PIN NSET=A-x1, REF NODE=9000"],
        "coupling": ["*COUPLING, CONSTRAINT NAME=C, REF NODE=9000, SURFACE=S-A-x1", "*KINEMATIC", "1, 6"],
        "beams": ["*MPC", *(f"BEAM, {n}, 9000" for n in labels_of_end())],
        "set": ["*MPC", "BEAM, A-x1, 9000"],
    }
    found = {name: frequencies(link(tmp_path, ended(*lines))) for name, lines in rigid.items()}
    for values in found.values():
        np.testing.assert_allclose(values, found["rigid body"], rtol=1e-9)
    average = ["*COUPLING, CONSTRAINT NAME=C, REF NODE=9000, SURFACE=S-A-x1", "*DISTRIBUTING"]
    state, nodes, rows = constraints(tmp_path, ended(*average))
    loose = frequencies(link(tmp_path, ended(*average)))
    assert (loose < found["rigid body"]).all()
    mesh = read_mesh(tmp_path / "two.inp")
    end = mesh.node_sets["A-x1"]
    shares = area_weights(mesh, end, "")
    row = state.matrix[[rows[-2, 0]]] if nodes[-2, 0] == 0.2 else state.matrix[[rows[-1, 0]]]
    np.testing.assert_allclose(row.sum(), 1.0, rtol=1e-12)  # an average of displacements along x
    fields = np.zeros(state.matrix.shape[0])
    fields[rows[end, 0]] = np.arange(len(end))
    assert float((row @ fields[state.independent])[0]) == pytest.approx(shares @ np.arange(len(end)), rel=1e-9)


def test_links_and_pins(tmp_path):
    """PIN joins displacements; LINK keeps a distance: one equation along the line; TIE of beams joins rotations."""
    far = ["*NODE", "9002, 0.3, 0.1, 0.05", "9003, 0.35, 0.2, 0.05"]
    far += ["*ELEMENT, TYPE=B31, ELSET=BEAM", "9002, 9002, 9003"]
    base = ["*RIGID BODY, NSET=A-x1, REF NODE=9000"]
    whole = ["*NODE", "9003, 0.35, 0.2, 0.05", "*ELEMENT, TYPE=B31, ELSET=BEAM", "9002, 9001, 9003"]
    tied = frequencies(link(tmp_path, ended(*base, *far, "*MPC", "TIE, 9002, 9001")))
    np.testing.assert_allclose(tied, frequencies(link(tmp_path, ended(*base, *whole))), rtol=1e-9)
    state, nodes, rows = constraints(tmp_path, ended(*base, *far, "*MPC", "PIN, 9002, 9001"))
    free, *_ = constraints(tmp_path, ended(*base, *far, "*MPC", "LINK, 9003, 9001"))
    plain, *_ = constraints(tmp_path, ended(*base, *far, "*MPC", "PIN, 9002, 9001", "PIN, 9002, 9001"))
    assert len(free.independent) - len(state.independent) == 2
    assert len(plain.independent) == len(state.independent)
    first, second = (int(np.flatnonzero(np.isclose(nodes[:, 1], y))[0]) for y in (0.1, 0.2))
    motion = free.matrix @ np.random.default_rng(0).standard_normal(len(free.independent))
    relative = motion[rows[second]] - motion[rows[first]]
    assert abs(relative @ (nodes[second] - nodes[first])) < 1e-14


@pytest.mark.parametrize(("kind", "numbers"), [("C", "0., 0.4, 0., 1., 0.4, 0."), ("R", "0.1, 0.5, 0., 0., 0.1, 0.4")])
def test_equations_in_axes_of_their_own(tmp_path, kind, numbers):
    """*TRANSFORM, rectangular and cylindrical: component 1 of a node is along the first direction, or outward."""
    turned = [f"*TRANSFORM, NSET=PAIR, TYPE={kind}", numbers, "*EQUATION", "2", "1, 1, 3., 2, 1, -1."]
    (tmp_path / "two.inp").write_text("\n".join(ended("*NSET, NSET=PAIR", "1, 2", *turned)) + "\n")
    with pytest.raises(FEImportError, match="BEAM SECTION on a node that nothing joins"):
        read_mesh(tmp_path / "two.inp")
    mesh = read_mesh(tmp_path / "two.inp", ["BEAM SECTION"])
    (item,) = (i for i in mesh.attachments if isinstance(i, LinearEquation))
    outward = mesh.nodes[:2] * [0, 1, 1] - [0, 0.4, 0] if kind == "C" else np.array([[0.1, 0.5, 0.0]] * 2)
    outward = outward / np.linalg.norm(outward, axis=1)[:, None] * np.array([[3.0], [-1.0]])
    expected = {(node, c): outward[node, c] for node in (0, 1) for c in range(3) if outward[node, c]}
    assert {(n, c): pytest.approx(v, rel=1e-12) for n, c, v in item.terms} == expected


FAULTS = {
    "plane": (["*MPC", "PLANE, 1, 2, 3"], "a constraint PLANE is not followed"),
    "three": (["*MPC", "BEAM, 1, 2, 3"], "needs two nodes, or two sets"),
    "itself": (["*MPC", "BEAM, 1, 1"], "a node follows itself"),
    "sets": (["*MPC", "PIN, A-x0, PAIR"], "sets of different size"),
    "no surface": (["*TIE, NAME=T", "S-A-x1, NONE"], "surface NONE is not there"),
    "nodes": (["*SURFACE, NAME=N, TYPE=NODE", "1,", "*TIE, NAME=T", "S-A-x1, N"], "a second surface that is made of"),
    "cyclic": (["*TIE, NAME=T, CYCLIC SYMMETRY", "S-A-x1, S-A-x0"], "CYCLICSYMMETRY is not followed"),
    "tolerance": (["*TIE, NAME=T, POSITION TOLERANCE=-1.", "S-A-x1, S-A-x0"], "a tolerance must be positive"),
    "sphere": (["*TRANSFORM, NSET=PAIR, TYPE=S", "0.,0.,0.,1.,0.,0.", "*EQUATION", "1", "1,1,1."], "rectangular or"),
    "parallel": (["*TRANSFORM, NSET=PAIR", "1.,0.,0.,2.,0.,0.", "*EQUATION", "1", "1,1,1."], "that are parallel"),
    "translations": (
        ["*COUPLING, CONSTRAINT NAME=C, REF NODE=9000, SURFACE=S-A-x1", "*DISTRIBUTING", "1, 3"],
        "displacements and rotations of a continuum",
    ),
}


@pytest.mark.parametrize("name", FAULTS)
def test_constraints_that_cannot_be_used(tmp_path, name):
    lines, words = FAULTS[name]
    (tmp_path / "two.inp").write_text("\n".join(ended("*NSET, NSET=PAIR", "1, 2", *lines)) + "\n")
    with pytest.raises(FEImportError) as caught:
        read_mesh(tmp_path / "two.inp")
    assert caught.value.cause is Cause.NOT_USED
    assert words in str(caught.value)


@pytest.mark.parametrize("width", [3, 4, 6, 8, 9])
def test_feet_on_curved_faces(width):
    """Above a face that is bent the gap is the least distance that a fine raster finds; a turn is met exactly."""
    corners = np.array([(0, 0), (1, 0), (0, 1)] if width in (3, 6) else [(0, 0), (1, 0), (1, 1), (0, 1)], dtype=float)
    edges = (corners + np.roll(corners, -1, axis=0)) / 2
    plane = np.vstack([corners, edges, corners.mean(axis=0)])[:width]
    random = np.random.default_rng(width)
    nodes = np.column_stack([plane, np.zeros(width)]) + 0.05 * random.standard_normal((width, 3))
    points = np.array([[0.3, 0.25, 0.1], [0.25, 0.3, -0.05]])
    feet = feet_on_faces(points, nodes, [np.arange(width)[None]])
    raster = np.stack(np.meshgrid(*(np.linspace(0, 1, 401),) * 2)).reshape(2, -1)
    if width in (3, 6):
        raster = raster[:, raster.sum(axis=0) <= 1]
    surface = face_shapes(width, raster)[0].T @ nodes
    least = np.linalg.norm(points[:, None] - surface[None], axis=2).min(axis=1)
    np.testing.assert_allclose(feet.gaps, least, rtol=1e-3)
    spin = np.array([0.3, -0.4, 0.7])
    moved = np.einsum("pwcd,pwd->pc", feet.motions[:, :width], np.cross(spin, nodes)[feet.nodes[:, :width]])
    np.testing.assert_allclose(moved, np.cross(spin, points), atol=1e-14)
