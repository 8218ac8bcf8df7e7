"""Beams in decks beside solids: against closed forms, frames described otherwise, and CalculiX."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.linalg
from link_files import SOLID, dense, frame_link, solid_link, write_box

from fe_import.description.link import LinkFile
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
    two = np.cross(along, [0.1, 0.2, 1.0]).tolist()
    frame = {
        "nodes": {"root": ROOT.tolist(), "elbow": (ROOT + along / 2).tolist(), "tip": TIP.tolist()},
        "members": [
            {"from": a, "to": b, "elements": 3, "material": "m", "section": "s", "local_z": two}
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


X_AXIS = (ROOT, ROOT + np.array([0.5, 0.0, 0.0]))
G = E / (2 * (1 + NU))
SECTIONS = {  # type, its line, area, moments about directions 1 and 2, torsion constant; directions 1, 2 are y, z
    "circle": ("CIRC", "0.03, 0.03", np.pi * 0.015**2, np.pi / 4 * 0.015**4, np.pi / 4 * 0.015**4),
    "tube": ("PIPE", "0.02, 0.003", np.pi * (0.02**2 - 0.017**2), *(2 * [np.pi / 4 * (0.02**4 - 0.017**4)])),
    "box": (
        *("BOX", "0.04, 0.06, 0.004, 0.004, 0.004, 0.004", 0.04 * 0.06 - 0.032 * 0.052),
        *((0.04 * 0.06**3 - 0.032 * 0.052**3) / 12, (0.06 * 0.04**3 - 0.052 * 0.032**3) / 12),
    ),
}


@pytest.mark.parametrize("name", SECTIONS)
def test_sections(tmp_path, name):
    """Stretch, and the bending moments that the two directions take, closed forms to 1e-9."""
    shape, line, area, about_1, about_2 = SECTIONS[name]
    lines = [*beam_nodes(2, *X_AXIS), *beam_elements(2), *section(line, "0., 1., 0.", shape=shape)]
    found = tip_flexibility(on_rigid_box(tmp_path, *lines))
    expected = 0.5 / (E * np.array([area, about_1, about_2]))
    np.testing.assert_allclose([found[0, 0], found[4, 4], found[5, 5]], expected, rtol=1e-9)


def test_a_general_section(tmp_path):
    """Its own constants, modulus and density; no factor of shear but 1, as Abaqus has it."""
    lines = [*beam_nodes(2, *X_AXIS), *beam_elements(2)]
    lines += ["*BEAM GENERAL SECTION, ELSET=BEAMS, DENSITY=5000.", "2e-4, 3e-9, 0., 2e-9, 4e-9", "0., 1., 0."]
    model = on_rigid_box(tmp_path, *lines, "6e10, 2e10")
    found = np.diag(tip_flexibility(model))
    bend = [0.5**3 / 3 / (6e10 * i) + 0.5 / (2e10 * 2e-4) for i in (2e-9, 3e-9)]
    expected = [0.5 / (6e10 * 2e-4), *bend, 0.5 / (2e10 * 4e-9), 0.5 / (6e10 * 3e-9), 0.5 / (6e10 * 2e-9)]
    np.testing.assert_allclose(found, expected, rtol=1e-9)
    rigid = model.rigid_body_modes()[:, 0]
    assert rigid @ model.mass @ rigid == pytest.approx(0.3 * 0.02 * 0.03 * RHO + 5000 * 2e-4 * 0.5, rel=1e-12)


@pytest.mark.parametrize("way", ["default", "further node", "round along the default"])
def test_directions(tmp_path, way):
    """Direction 1 is that of the section's second line, (0, 0, -1) without it, that of a further node before both."""
    nodes = beam_nodes(1, *X_AXIS)
    lines, rows = beam_elements(1), ["0.01, 0.02"]
    if way == "further node":
        nodes += ["*NODE", "9500, 0.3, 0.01, 5."]
        lines, rows = ["*ELEMENT, TYPE=B31, ELSET=BEAMS", "9000, 9000, 9001, 9500"], ["0.01, 0.02", "0., 1., 0."]
    if way == "round along the default":
        nodes = beam_nodes(1, ROOT, ROOT + np.array([0.0, 0.0, 0.5]))
        round_one = [*nodes, *beam_elements(1), *section("0.02, 0.02", shape="CIRC")]
        found = np.diag(tip_flexibility(on_rigid_box(tmp_path, *round_one)))
        np.testing.assert_allclose(found[3:5], 0.5 / (E * np.pi / 64 * 0.02**4), rtol=1e-9)
        return
    found = np.diag(tip_flexibility(on_rigid_box(tmp_path, *nodes, *lines, *section(*rows))))
    thin = 0.02 * 0.01**3 / 12  # direction 1 is z or -z: the section is thin along z
    np.testing.assert_allclose(found[4:], [0.5 / (E * thin), 0.5 / (E * 0.01 * 0.02**3 / 12)], rtol=1e-9)


def test_offsets(tmp_path):
    """Shares of the thickness against the directions, as CalculiX places its sections: the pull bends the beam."""
    lines = [*beam_nodes(2, *X_AXIS), *beam_elements(2), *section("0.01, 0.02", "0., 1., 0.")]
    lines = [line + ", OFFSET1=0.5, OFFSET2=-0.25" if "BEAM SECTION" in line else line for line in lines]
    model = on_rigid_box(tmp_path, *lines)
    rigid = model.rigid_body_modes()
    box, beam = 0.3 * 0.02 * 0.03 * RHO, 0.01 * 0.02 * 0.5 * RHO
    moments = rigid.T @ model.mass @ rigid
    centre = np.array([-moments[1, 5], moments[0, 5]]) / -moments[0, 0]  # x and y of the centre of mass
    assert moments[0, 0] == pytest.approx(box + beam, rel=1e-12)
    expected = (box * np.array([0.15, 0.01]) + beam * np.array([0.55, 0.01 - 0.005])) / (box + beam)
    np.testing.assert_allclose(centre, expected, rtol=1e-9)
    assert moments[0, 4] / moments[0, 0] == pytest.approx((box * 0.015 + beam * 0.02) / (box + beam), rel=1e-9)
    found = tip_flexibility(model)
    thin, tall = 0.02 * 0.01**3 / 12, 0.01 * 0.02**3 / 12
    stretched = 0.5 / E * (1 / 2e-4 + 0.005**2 / thin + 0.005**2 / tall)
    assert found[0, 0] == pytest.approx(stretched, rel=1e-9)


FAULTS = {
    "alone": (section("0.01, 0.02"), Cause.MESH, "turn freely about the 1 nodes that they share with the solid, which"),
    "along": (section("0.01, 0.02", "1., 0., 0."), Cause.NOT_USED, "direction 1 of a section lies along its beam"),
    "sizes": (section("0.01"), Cause.NOT_USED, "a section RECT of 1 numbers"),
    "one number": (section("0.01", shape="CIRC"), Cause.NOT_USED, "a radius to Abaqus, a diameter to CalculiX"),
    "ellipse": (section("0.01, 0.02", shape="CIRC"), Cause.NOT_USED, "an ellipse"),
    "thick": (section("0.01, 0.02", shape="PIPE"), Cause.NOT_USED, "the wall is thicker"),
    "walls": (section("1., 1., .1, .2, .1, .2", shape="BOX"), Cause.NOT_USED, "walls of different thickness"),
    "shape": (section("1., 1., .1, .2, .1, .2", shape="I"), Cause.NOT_USED, "a section I"),
    "material": (["*BEAM SECTION, ELSET=BEAMS, MATERIAL=NONE, SECTION=RECT", "1., 1."], Cause.NOT_USED, "'NONE' lacks"),
    "words": (section("a, b"), Cause.NOT_USED, "could not convert"),
    "infinite": (section("1., inf"), Cause.NOT_USED, "not finite"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_beams_that_cannot_be_used(tmp_path, name):
    """On one node of the solid, whose place the message tells; or with the reason."""
    lines, cause, words = FAULTS[name]
    corner = [beam_elements(1)[0], "9000, 1, 9001"]
    tip = ["*NODE", "9001, -0.5, 0., 0.", "*NSET, NSET=TIP", "9001,"]
    with pytest.raises(FEImportError) as caught:
        build_model(deck_link(tmp_path, *tip, *corner, *lines, interfaces=SOLID["interfaces"][1:]))
    assert caught.value.cause is cause
    assert words in str(caught.value)


def test_a_beam_on_the_clamped_face(tmp_path):
    """On a node of a rigid face it is clamped too: no hinge, and the health report is sound."""
    corner = [beam_elements(1)[0], "9000, 1, 9001"]
    tip = ["*NODE", "9001, -0.5, 0., 0.", "*NSET, NSET=TIP", "9001,"]
    modal = reduce_link(deck_link(tmp_path, *tip, *corner, *section("0.01, 0.02")))
    assert all(check.ok for check in modal.health)
    assert modal.provenance["source: attached"] == "1 BEAM SECTION"
    assert "attaches" in modal.provenance["second_order"]
    assert {"MATERIAL", "ELASTIC", "DENSITY"}.isdisjoint(modal.provenance.get("left out", ""))


def test_an_interface_needs_a_node_that_turns(tmp_path):
    lines = [*beam_nodes(1), *beam_elements(1), *RECT, "*RIGID BODY, NSET=X1, REF NODE=9000", "*NSET, NSET=ONE", "1,"]
    for node, words in (("ONE", "does not turn"), ("NONE", "no node of this name"), ("TIP", None)):
        link = deck_link(tmp_path, *lines, interfaces=[{"name": "hand", "node": node}])
        if words is None:
            assert build_model(link).interface_nodes[0].coupling == "node"
            continue
        with pytest.raises(FEImportError, match=words):
            build_model(link)
    link = deck_link(tmp_path, *lines, interfaces=[{"name": "hand", "node": "TIP", "coupling": "averaged"}])
    with pytest.raises(FEImportError, match="couples no others"):
        build_model(link)


# deflections [m] along y and z under 1 kN at the end of a cantilever of 1 m along x, by CalculiX 2.20 with ten B32R,
# which it expands to solids; direction 1 is y
CALCULIX = {
    "RECT": ("0.02, 0.04", 1.749730e-01, 4.420220e-02),
    "CIRC": ("0.03, 0.03", 1.166030e-01, 1.166030e-01),
    "PIPE": ("0.02, 0.003", 7.825994e-02, 7.825994e-02),
    "BOX": ("0.04, 0.06, 0.004, 0.004, 0.004, 0.004", 2.660419e-02, 1.376808e-02),
}


@pytest.mark.parametrize("shape", CALCULIX)
def test_sections_beside_calculix(tmp_path, shape):
    """Within 3 %: its solids are held in width too at the clamp, and locked in shear a little."""
    line, along_y, along_z = CALCULIX[shape]
    ends = ROOT, ROOT + np.array([1.0, 0.0, 0.0])
    lines = [*beam_nodes(2, *ends), *beam_elements(2), *section(line, "0., 1., 0.", shape=shape)]
    found = tip_flexibility(on_rigid_box(tmp_path, *lines))
    np.testing.assert_allclose(1e3 * np.diag(found)[1:3], [along_y, along_z], rtol=0.03)


def test_the_mesh_error_counts_all_energy(tmp_path):
    """A coarse box locks; a long soft beam on it bends alone in the first modes, so that they are right."""
    tip = ROOT + np.array([3.0, 0.0, 0.0])
    lines = [*beam_nodes(4, ROOT, tip), *beam_elements(4), *section("0.004, 0.004", "0., 1., 0.")]
    lines += ["*RIGID BODY, NSET=x1, REF NODE=9000"]
    link = deck_link(tmp_path, *lines, solid={"mesh_error": 0.05, "hex8": "compatible"})
    write_box(tmp_path / "one.inp", kind="hex8")
    nodes = (tmp_path / "box.inp").read_text().partition("*NODE\n9000")
    (tmp_path / "box.inp").write_text((tmp_path / "one.inp").read_text() + "".join(nodes[1:]))
    assert all(check.ok for check in reduce_link(link).health)
    (tmp_path / "box.inp").write_text((tmp_path / "one.inp").read_text())
    with pytest.raises(FEImportError, match="hex8 elements are too stiff on this mesh"):
        reduce_link(solid_link(tmp_path, solid={"mesh": "one.inp", "mesh_error": 0.05, "hex8": "compatible"}))
