"""Masses, springs, constraints, materials of mesh files, beside links described otherwise and closed forms."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.linalg as la
from link_files import SOLID, merged, solid_link, write_box, write_toml
from solid_meshes import BAR, bulk

from fe_import.description.link import LinkFile, load_link
from fe_import.elements.attachments import AttachedMass, AverageNode, LinearEquation, RigidBody
from fe_import.errors import Cause, FEImportError
from fe_import.mesh.read import read_mesh
from fe_import.modal.inertia import mass_properties
from fe_import.model import FEModel
from fe_import.models.model import build_model
from fe_import.reduce import reduce_link


def with_cards(folder: Path, *lines: str, **changes: Any) -> LinkFile:
    """The box of `SOLID`, only its face x0 an interface, with further lines in its deck."""
    link = solid_link(folder, interfaces=SOLID["interfaces"][:1], **changes)
    mesh = folder / "box.inp"
    mesh.write_text(mesh.read_text() + "\n".join(lines) + "\n")
    return link


def frequencies(model: FEModel) -> np.ndarray:
    """The first 14 elastic free-free frequencies [rad/s], dense."""
    mass, stiffness = model.reduced_matrices()
    m, k = mass.toarray(), stiffness.toarray()
    keep = np.diag(m) > 0
    inner = np.linalg.solve(k[np.ix_(~keep, ~keep)], k[np.ix_(~keep, keep)]) if (~keep).any() else None
    if inner is not None:  # rows without mass
        k = k[np.ix_(keep, keep)] - k[np.ix_(keep, ~keep)] @ inner
        m = m[np.ix_(keep, keep)]
    return np.sqrt(la.eigh(k, m, eigvals_only=True)[6:20])


def end_and_centre(folder: Path) -> tuple[list[int], np.ndarray]:
    """Labels of the nodes of x1 (from 1 in the order of the mesh), and the centre of the face."""
    solid_link(folder)
    mesh = read_mesh(folder / "box.inp")
    nodes = mesh.node_sets["x1"]
    return (nodes + 1).tolist(), mesh.nodes[nodes].mean(axis=0)


@pytest.mark.parametrize("keyword", ["rigid body", "coupling"])
def test_a_mass_on_a_rigid_face(tmp_path, keyword):
    """A reference node with mass and inertia, joined to a face: the same as an interface with them there, to 1e-9."""
    _, centre = end_and_centre(tmp_path)
    lines = ["*NODE", "9000, " + ", ".join(map(repr, centre.tolist()))]
    if keyword == "rigid body":
        lines += ["*RIGID BODY, NSET=x1, REF NODE=9000"]
    else:
        lines += ["*SURFACE, NAME=END, TYPE=NODE", "x1,", "*COUPLING, CONSTRAINT NAME=C, REF NODE=9000, SURFACE=END"]
        lines += ["*KINEMATIC", "1, 3"]
    lines += ["*ELEMENT, TYPE=MASS, ELSET=M", "9000, 9000", "*MASS, ELSET=M", "0.2"]
    lines += ["*ELEMENT, TYPE=ROTARYI, ELSET=R", "9001, 9000", "*ROTARY INERTIA, ELSET=R", "1e-4, 2e-4, 3e-4"]
    model = build_model(with_cards(tmp_path, *lines))
    masses = [{"node": "hand", "mass": 0.2, "inertia": [1e-4, 2e-4, 3e-4]}]
    expected = build_model(solid_link(tmp_path, masses=masses))
    np.testing.assert_allclose(frequencies(model), frequencies(expected), rtol=1e-9)
    rigid, same = model.rigid_body_modes(), expected.rigid_body_modes()
    ours, theirs = mass_properties(rigid.T @ model.mass @ rigid), mass_properties(same.T @ expected.mass @ same)
    assert ours.mass == pytest.approx(theirs.mass, rel=1e-12)
    np.testing.assert_allclose(ours.inertia, theirs.inertia, rtol=1e-12, atol=1e-18)
    assert model.notes["attached"] == f"1 {keyword.upper()}, 1 MASS, 1 ROTARY INERTIA"


def test_the_whole_reduction(tmp_path):
    """Sound by the health report; provenance and second order say what is attached."""
    _, centre = end_and_centre(tmp_path)
    lines = ["*NODE", "9000, " + ", ".join(map(repr, centre.tolist())), "*RIGID BODY, NSET=x1, REF NODE=9000"]
    lines += ["*ELEMENT, TYPE=MASS, ELSET=M", "9000, 9000", "*MASS, ELSET=M", "0.2"]
    modal = reduce_link(with_cards(tmp_path, *lines))
    assert all(check.ok for check in modal.health)
    assert "1 RIGID BODY" in modal.provenance["source: attached"]
    assert "attaches" in modal.provenance["second_order"]
    without = reduce_link(with_cards(tmp_path, *lines, solid={"ignore": ["RIGID BODY", "MASS"]}))
    assert modal.mass_properties.mass == pytest.approx(without.mass_properties.mass + 0.2, rel=1e-12)
    assert '"MASS": 1' in without.provenance["left out"]


def test_equations_and_springs(tmp_path):
    """Against the full matrices of the same solid on the null space of the equations, spring energies added."""
    labels = np.array(end_and_centre(tmp_path)[0])
    plain = build_model(with_cards(tmp_path))
    points = read_mesh(tmp_path / "box.inp").nodes
    y, z = points[labels - 1, 1:].T
    a, b, c, d = (int(labels[(y == j) & (z == k)][0]) for j in (y.min(), y.max()) for k in (z.min(), z.max()))
    lines = ["*EQUATION", "4", f"{a}, 1, 1., {b}, 1, -1., {c}, 1, -1., {d}, 1, 1."]  # the corners stay in a plane
    lines += ["*ELEMENT, TYPE=SPRINGA, ELSET=S", f"9000, 1, {d}", "*SPRING, ELSET=S", "", "3e5"]
    model = build_model(with_cards(tmp_path, *lines))
    assert len(model.independent) == len(plain.independent) - 1
    row = np.zeros(plain.mass.shape[0])
    row[plain.dof_map[np.array([a, b, c, d]) - 1, 0]] = [1, -1, -1, 1]
    along = points[d - 1] - points[0]
    spring = np.zeros(len(row))
    spring[plain.dof_map[[d - 1], :3]], spring[plain.dof_map[[0], :3]] = along, -along
    spring /= np.linalg.norm(along)
    c_matrix = plain.coupling.toarray()
    basis = la.null_space((row @ c_matrix)[None])
    fields = c_matrix @ basis
    k = fields.T @ (plain.stiffness.toarray() + 3e5 * np.outer(spring, spring)) @ fields
    m = fields.T @ plain.mass.toarray() @ fields
    massive = la.eigh(k + 1e8 * m, m + 1e-14 * np.trace(m) * np.eye(len(m)), eigvals_only=True)
    ours_m, ours_k = (x.toarray() for x in model.reduced_matrices())
    ours = la.eigh(ours_k + 1e8 * ours_m, ours_m + 1e-14 * np.trace(m) * np.eye(len(m)), eigvals_only=True)
    np.testing.assert_allclose(ours[6:16], massive[6:16], rtol=1e-6)


FAULTS = {
    "resists rigid motion": (["*EQUATION", "2", "{a}, 1, 1., {b}, 2, -1."], Cause.MESH, "resist rigid-body motion"),
    "two bodies": (
        ["*NODE", "9000, 1., 0., 0.", "9001, 1., 0., 0.1"]
        + [f"*RIGID BODY, NSET=x1, REF NODE={n}" for n in (9000, 9001)],
        Cause.MESH,
        "follows other nodes already",
    ),
    "mass in the air": (
        ["*NODE", "9000, 1., 0., 0.", "*ELEMENT, TYPE=MASS, ELSET=M", "9000, 9000", "*MASS, ELSET=M", "0.2"],
        Cause.DISCONNECTED,
        "nothing joins",
    ),
    "rigid interface": (
        ["*NODE", "9000, 0., 0., 0.", "*RIGID BODY, NSET=x0, REF NODE=9000"],
        Cause.INTERFACE,
        "follow others",
    ),
    "ground": (
        ["*ELEMENT, TYPE=SPRING1, ELSET=S", "9000, 1", "*SPRING, ELSET=S", "1", "100."],
        Cause.NOT_USED,
        "a spring to the ground",
    ),
    "distributing": (
        [
            *("*SURFACE, NAME=E, TYPE=NODE", "x1,", "*COUPLING, CONSTRAINT NAME=C, REF NODE=1, SURFACE=E"),
            "*DISTRIBUTING, WEIGHTING METHOD=LINEAR",
        ],
        Cause.NOT_USED,
        "weights of *DISTRIBUTING that fall with the distance",
    ),
    "mass without value": (["*ELEMENT, TYPE=MASS, ELSET=M", "9000, 1"], Cause.NOT_USED, "without a value"),
    "nonlinear": (
        ["*ELEMENT, TYPE=SPRINGA, ELSET=S", "9000, 1, {b}", "*SPRING, ELSET=S, NONLINEAR", "", "0., 0.", "1., 1."],
        Cause.NOT_USED,
        "NONLINEAR is not followed",
    ),
}


@pytest.mark.parametrize("name", FAULTS)
def test_what_cannot_be_attached(tmp_path, name):
    lines, cause, words = FAULTS[name]
    labels, _ = end_and_centre(tmp_path)
    with pytest.raises(FEImportError) as caught:
        build_model(with_cards(tmp_path, *(line.format(a=labels[0], b=labels[1]) for line in lines)))
    assert caught.value.cause is cause
    assert words in str(caught.value)


def test_raised_order_keeps_bodies(tmp_path):
    """The mid-side nodes of a rigid face follow too: as an interface there, which the raised set gives."""
    both = solid_link(tmp_path, solid={"raise_order": True})
    mesh = write_box(tmp_path / "box.inp", kind="hex8")
    expected = build_model(both)
    one = with_cards(tmp_path, solid={"raise_order": True})
    write_box(mesh, kind="hex8")
    lines = ["*NODE", "9000, 0.3, 0.01, 0.015", "*RIGID BODY, NSET=x1, REF NODE=9000", ""]
    mesh.write_text(mesh.read_text() + "\n".join(lines))
    model = build_model(one)
    assert model.stress.mesh.only.type == "hex20"
    np.testing.assert_allclose(frequencies(model), frequencies(expected), rtol=1e-8)


def test_cards_of_nastran(tmp_path):
    """CONM2 with its arm and inertia, RBE2 and RBE3: numbers as on the cards; the mass where the arm ends."""
    end = [10 * n + 7 for n in BAR.node_sets["x1"]]
    root = [10 * n + 7 for n in BAR.node_sets["x0"]]
    cards = [f"RBE2,90,901,123456,{','.join(map(str, end))}", "GRID,901,,1.,.5,.5", "GRID,902,,0.,.5,.5"]
    cards += ["CONM2,91,901,0,1.5,.1,.2,.3", ",.01,.001,.02,.002,.003,.03"]
    cards += [f"RBE3,92,,902,123456,1.,123,{','.join(map(str, root[:2]))}", f",{','.join(map(str, root[2:]))}"]
    (tmp_path / "bar.bdf").write_text(bulk(BAR, *cards))
    mesh = read_mesh(tmp_path / "bar.bdf")
    kinds = {type(item): item for item in mesh.attachments}
    assert {RigidBody, AttachedMass, AverageNode} == kinds.keys()
    assert LinearEquation not in kinds
    np.testing.assert_array_equal(np.sort(kinds[RigidBody].nodes), BAR.node_sets["x1"])
    np.testing.assert_array_equal(np.sort(kinds[AverageNode].nodes), BAR.node_sets["x0"])
    np.testing.assert_allclose(mesh.further_nodes, [[1, 0.5, 0.5], [0, 0.5, 0.5]])
    hub = {"name": "hub", "face": "SET:5", "coupling": "averaged", "weights": "uniform"}
    table = merged(SOLID, {"solid": {"mesh": "bar.bdf"}, "interfaces": [hub]})
    (tmp_path / "bar.bdf").write_text(bulk(BAR, *cards, "SET1,5," + ",".join(map(str, root))))
    model = build_model(load_link(write_toml(tmp_path / "link.toml", table)))
    rigid = model.rigid_body_modes()
    found = mass_properties(rigid.T @ model.mass @ rigid)
    solid = 2700.0
    assert found.mass == pytest.approx(solid + 1.5, rel=1e-12)
    centre = (solid * np.array([0.5, 0.5, 0.5]) + 1.5 * np.array([1.1, 0.7, 0.8])) / (solid + 1.5)
    np.testing.assert_allclose(found.centre_of_mass, centre, rtol=1e-12)
    np.testing.assert_allclose(model.coupling @ rigid[model.independent], rigid, atol=1e-12)


MATERIALS = ["*MATERIAL, NAME=Alu", "*ELASTIC", "7e10, .33", "*DENSITY", "2700.,"]
MATERIALS += ["*SOLID SECTION, ELSET=all, MATERIAL=alu"]


def test_materials_of_a_deck(tmp_path):
    """The same model as with the material in the description; judged like that one, and not listed as left out."""
    own = with_cards(tmp_path, *MATERIALS, solid={"material": ""}, materials={})
    model, modal = build_model(own), reduce_link(own)
    expected = build_model(with_cards(tmp_path))
    assert abs(model.stiffness - expected.stiffness).max() == 0
    assert abs(model.mass - expected.mass).max() == 0
    assert model.materials == {"ALU": (7e10, 0.33, 2700.0)}
    assert "left out" not in modal.provenance
    assert any("density" in check.name for check in modal.health)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("*ELASTIC", "*ELASTIC, TYPE=TRACTION"), "elastic of type TRACTION"),
        (("7e10, .33", "7e10, .33\n6e10, .33, 100."), "changes with temperature"),
        (("*DENSITY\n2700.,", ""), "lacks *ELASTIC or *DENSITY"),
        (("MATERIAL=alu", "MATERIAL=alu, COMPOSITE"), "layers"),
        (("ELSET=all", "ELSET=none"), "'none' holds no solid elements".replace("'none'", "'NONE'")),
        (("*SOLID SECTION, ELSET=all, MATERIAL=alu", ""), "no *SOLID SECTION"),
    ],
)
def test_materials_that_cannot_be_used(tmp_path, change, words):
    lines = "\n".join(MATERIALS).replace(*change)
    with pytest.raises(FEImportError) as caught:
        build_model(with_cards(tmp_path, lines, solid={"material": ""}))
    assert caught.value.cause is Cause.BAD_FIELD
    assert words in str(caught.value)


FILLINGS = {  # lines, mass that they add to each half of a box of two densities, 8000 and 2000, of 9e-5 m³ each
    "per volume": (["*NONSTRUCTURAL MASS, ELSET=LEFT, UNITS=MASS PER VOLUME", "400."], (0.036, 0.0)),
    "by mass": (["*NONSTRUCTURAL MASS, ELSET=ALL, UNITS=TOTAL MASS", "0.5"], (0.4, 0.1)),
    "by volume": (
        ["*NONSTRUCTURAL MASS, ELSET=all, UNITS=TOTAL MASS, DISTRIBUTION=VOLUME PROPORTIONAL", "0.5"],
        (0.25, 0.25),
    ),
}


@pytest.mark.parametrize("name", FILLINGS)
def test_nonstructural_mass(tmp_path, name):
    """Of sets of elements, in each half of the box; to be left out on purpose."""
    lines, added = FILLINGS[name]
    materials = {"m": {"density": 8000.0}, "n": {"youngs_modulus": 7e10, "poissons_ratio": 0.3, "density": 2000.0}}
    regions = [{"set": "LEFT", "material": "m"}, {"set": "RIGHT", "material": "n"}]
    solid = {"material": "", "regions": regions}
    halves = ["*ELSET, ELSET=LEFT", "1,", "*ELSET, ELSET=RIGHT", "2,"]
    write = {"solid": solid, "materials": materials}
    found = []
    for more in (lines, []):
        link = with_cards(tmp_path, **write)
        write_box(tmp_path / "box.inp", along=2)
        mesh = tmp_path / "box.inp"
        mesh.write_text(mesh.read_text() + "\n".join([*halves, *more]) + "\n")
        model = build_model(link)
        rigid = model.rigid_body_modes()
        found.append(mass_properties(rigid.T @ model.mass @ rigid))
    assert found[0].mass - found[1].mass == pytest.approx(sum(added), rel=1e-9)
    moment = found[0].mass * found[0].centre_of_mass[0] - found[1].mass * found[1].centre_of_mass[0]
    assert moment == pytest.approx(added[0] * 0.075 + added[1] * 0.225, rel=1e-9)
    mesh.write_text(mesh.read_text() + "\n".join(lines) + "\n")
    left = build_model(with_ignored(tmp_path, write))
    assert left.left_out["NONSTRUCTURAL MASS"] == 1
    rigid = left.rigid_body_modes()[:, 0]
    assert rigid @ left.mass @ rigid == pytest.approx(found[1].mass, rel=1e-12)


def with_ignored(folder: Path, write: dict[str, Any]) -> LinkFile:
    """The link in a folder, without its nonstructural masses."""
    table = merged(merged(SOLID, write), {"solid": {"ignore": ["NONSTRUCTURAL MASS"]}})
    return load_link(write_toml(folder / "link.toml", table))


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        (["*NONSTRUCTURAL MASS, ELSET=all, UNITS=MASS PER AREA", "1."], "per volume or in total"),
        (["*NONSTRUCTURAL MASS, ELSET=all, UNITS=TOTAL MASS", "-1."], "must be positive"),
        (["*NONSTRUCTURAL MASS, ELSET=none, UNITS=TOTAL MASS", "1."], "does not define"),
        (
            ["*ELEMENT, TYPE=S4, ELSET=S", "900, 1, 2, 3, 4", "*NONSTRUCTURAL MASS, ELSET=S, UNITS=TOTAL MASS", "1."],
            "of other elements than solids",
        ),
    ],
)
def test_nonstructural_mass_that_cannot_be_used(tmp_path, lines, words):
    with pytest.raises(FEImportError) as caught:
        build_model(with_cards(tmp_path, *lines))
    assert caught.value.cause is Cause.NOT_USED
    assert words in str(caught.value)
