"""Parts and instances, systems of points: the same flat deck, written out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from decks import part
from scipy.spatial.transform import Rotation
from solid_meshes import box
from test_ties import MATERIAL, frequencies, link

from fe_import.elements.attachments import AttachedBeam, AttachedMass, AttachedSpring, TiedNodes
from fe_import.errors import FEImportError
from fe_import.mesh.read import read_mesh

COARSE, FINE = box("hex8", (2, 1, 1), (0.2, 0.03, 0.02)), box("hex8", (2, 2, 3), (0.15, 0.03, 0.02))
AXIS, ANGLE = np.array([0.1, 0.2, -0.3]), 40.0
SHIFT = np.array([0.05, -0.02, 0.01])


def moved(points: np.ndarray) -> np.ndarray:
    """Translated, then turned about the line from (0, 0, 0.1) along AXIS."""
    turn = Rotation.from_rotvec(np.radians(ANGLE) * AXIS / np.linalg.norm(AXIS))
    base = np.array([0.0, 0.0, 0.1])
    return turn.apply(points + SHIFT - base) + base


def instance(name: str, of: str, *rows: str) -> list[str]:
    return [f"*INSTANCE, NAME={name}, PART={of}", *rows, "*END INSTANCE"]


TURN = f"0., 0., 0.1, {AXIS[0]}, {AXIS[1]}, {AXIS[2] + 0.1}, {ANGLE}"
PLACED = ", ".join(map(str, SHIFT))


def assembled(*lines: str) -> list[str]:
    """Two parts, each numbered from 1; the second one stands behind the first."""
    parts = ["*PART, NAME=Long", *part(COARSE, (0, 0, 0), 1, "A"), "*END PART"]
    parts += ["*PART, NAME=Fine", *part(FINE, (0, 0, 0), 1, "A"), "*END PART"]
    both = [*instance("One", "Long"), *instance("Two", "Fine", "0.2, 0., 0.")]
    return [*parts, "*ASSEMBLY, NAME=All", *both, *lines, "*END ASSEMBLY", *MATERIAL]


def test_two_instances(tmp_path):
    """Sets with the name of the instance, a tie between its surfaces; the frequencies of the flat deck, to 1e-9."""
    lines = ["*NSET, NSET=Root, INSTANCE=one", "A-x0", "*TIE, NAME=T", "two.S-A-x0, One.S-A-x1"]
    hub = {"name": "hub", "face": "Root", "coupling": "averaged", "weights": "uniform"}
    model = link(tmp_path, assembled(*lines), interfaces=[hub], solid={"hex8": "compatible"})
    flat = [*part(COARSE, (0, 0, 0), 1, "A"), *part(FINE, (0.2, 0, 0), 1001, "B"), *MATERIAL]
    (tmp_path / "flat").mkdir()
    flat += ["*TIE, NAME=T", "S-B-x0, S-A-x1"]
    expected = link(tmp_path / "flat", flat, solid={"hex8": "compatible"})
    np.testing.assert_allclose(frequencies(model), frequencies(expected), rtol=1e-9)
    mesh = read_mesh(tmp_path / "two.inp")
    assert {"One.A-x0", "Two.A-x1", "Root"} <= mesh.node_sets.keys()
    assert {"One.A", "Two.A"} <= mesh.element_sets.keys()
    np.testing.assert_array_equal(mesh.node_sets["Root"], mesh.node_sets["One.A-x0"])
    np.testing.assert_allclose(mesh.nodes[mesh.node_sets["Two.A-x1"], 0], 0.35)


def test_sets_of_an_assembly(tmp_path):
    """Labels with an instance before them or in the parameter, ranges, sets of sets, elements, surfaces."""
    lines = ["*TIE, NAME=T", "Two.S-A-x0, One.S-A-x1", "*NSET, NSET=N", "One.1, Two.3"]
    lines += ["*NSET, NSET=N, INSTANCE=Two", "5"]
    lines += ["*NSET, NSET=R, GENERATE, INSTANCE=Two", "1, 5, 2", "*NSET, NSET=S", "N, One.A-x0"]
    lines += ["*ELSET, ELSET=E, INSTANCE=Two", "1, 2", "*NSET, NSET=OfE, ELSET=E", "*SURFACE, NAME=Up", "E, S2"]
    (tmp_path / "two.inp").write_text("\n".join(assembled(*lines)) + "\n")
    mesh = read_mesh(tmp_path / "two.inp")
    assert not mesh.lost_sets
    first = len(COARSE.nodes)
    np.testing.assert_array_equal(mesh.node_sets["N"], [0, first + 2, first + 4])
    np.testing.assert_array_equal(mesh.node_sets["R"], [first, first + 2, first + 4])
    np.testing.assert_array_equal(mesh.node_sets["S"], np.union1d(COARSE.node_sets["x0"], mesh.node_sets["N"]))
    np.testing.assert_array_equal(mesh.element_sets["E"], [len(COARSE.only), len(COARSE.only) + 1])
    np.testing.assert_array_equal(mesh.node_sets["OfE"], first + np.unique(FINE.only.elements[:2]))
    faces = FINE.only.elements[:2][:, FINE.only.element.faces[FINE.only.element.cell.deck_faces[1]]]
    np.testing.assert_array_equal(mesh.node_sets["Up"], first + np.unique(faces))


def test_elements_between_instances(tmp_path):
    """Springs and masses of the assembly name nodes of instances."""
    lines = ["*TIE, NAME=T", "Two.S-A-x0, One.S-A-x1", "*ELEMENT, TYPE=SPRINGA, ELSET=S", "1, One.1, Two.5"]
    lines += ["*SPRING, ELSET=S", "", "300.", "*ELEMENT, TYPE=MASS, ELSET=M", "2, Two.5", "*MASS, ELSET=M", "0.4"]
    (tmp_path / "two.inp").write_text("\n".join(assembled(*lines)) + "\n")
    mesh = read_mesh(tmp_path / "two.inp")
    first = len(COARSE.nodes)
    (spring,) = (item for item in mesh.attachments if isinstance(item, AttachedSpring))
    (mass,) = (item for item in mesh.attachments if isinstance(item, AttachedMass))
    assert {node for _, terms in spring.forms for node, _, _ in terms} == {0, first + 4}
    assert (mass.node, mass.mass) == (first + 4, 0.4)


def test_a_moved_instance(tmp_path):
    """Translated, then turned about a line that stands still; an only instance keeps the names of its part."""
    lines = ["*PART, NAME=P", *part(COARSE, (0, 0, 0), 1, "A"), "*END PART", "*ASSEMBLY, NAME=All"]
    lines += [*instance("I", "P", PLACED, TURN), "*NSET, NSET=Far, INSTANCE=I", "A-x1", "*NSET, NSET=Also", "I.A-x1"]
    (tmp_path / "one.inp").write_text("\n".join([*lines, "*END ASSEMBLY", *MATERIAL]) + "\n")
    mesh = read_mesh(tmp_path / "one.inp")
    np.testing.assert_allclose(mesh.nodes, moved(COARSE.nodes), rtol=0, atol=1e-15)
    assert {"A-x0", "A-x1", "Far", "Also"} <= mesh.node_sets.keys()
    for name in ("Far", "Also"):
        np.testing.assert_array_equal(mesh.node_sets[name], COARSE.node_sets["x1"])


BEAMS = ["*NODE", "500, 0.2, 0.015, 0.01", "501, 0.3, 0.1, 0.05", "*ELEMENT, TYPE=B31, ELSET=BEAM", "500, 500, 501"]
BEAMS += ["*BEAM SECTION, ELSET=BEAM, MATERIAL=M, SECTION=RECT", "0.01, 0.012", "0.1, 0.3, 1."]


WOOD = ["*MATERIAL, NAME=M", "*ELASTIC, TYPE=ENGINEERING CONSTANTS", "1.4e11,1e10,8e9,.3,.25,.4,5e9,4e9", "3e9,"]
WOOD += ["*DENSITY", "1600.,"]


@pytest.mark.parametrize("turned", [False, True])
def test_a_reference_point_of_the_assembly(tmp_path, turned):
    """Numbered like a node of the instance, with a mass; joined by a coupling to its surface, named by a set."""
    rows = [PLACED, TURN] if turned else []
    lines = ["*PART, NAME=P", *part(COARSE, (0, 0, 0), 1, "A"), "*END PART", "*ASSEMBLY, NAME=All"]
    place = np.array([0.25, 0.015, 0.01])
    place = moved(place) if turned else place
    point = "1, " + ", ".join(repr(float(x)) for x in place)
    lines += [*instance("I", "P", *rows), "*NODE", point, "*NSET, NSET=Point", "1,"]
    lines += ["*ELEMENT, TYPE=MASS, ELSET=M", "1, 1", "*MASS, ELSET=M", "0.4"]
    lines += ["*COUPLING, CONSTRAINT NAME=C, REF NODE=Point, SURFACE=I.S-A-x1", "*KINEMATIC", "1, 6", "*END ASSEMBLY"]
    model = link(tmp_path, [*lines, *MATERIAL])
    flat = [*part(COARSE, (0, 0, 0), 1, "A"), *MATERIAL, "*NODE", "900, 0.25, 0.015, 0.01"]
    flat += ["*ELEMENT, TYPE=MASS, ELSET=M", "900, 900", "*MASS, ELSET=M", "0.4"]
    (tmp_path / "flat").mkdir()
    expected = link(tmp_path / "flat", [*flat, "*RIGID BODY, NSET=A-x1, REF NODE=900"])
    np.testing.assert_allclose(frequencies(model), frequencies(expected), rtol=1e-8)


@pytest.mark.parametrize("shape", ["RECTANGULAR", "CYLINDRICAL"])
def test_directions_turn_with_the_instance(tmp_path, shape):
    """Orientations of materials and sections of beams: a turned instance has the frequencies of one that is not."""
    body = [*part(COARSE, (0, 0, 0), 1, "A"), *BEAMS[:-3], "*RIGID BODY, NSET=A-x1, REF NODE=500"]
    general = ["*BEAM GENERAL SECTION, ELSET=BEAM, DENSITY=2700.", "1.2e-4, 1e-9, 0., 2e-9, 3e-9", "0.1, 0.3, 1."]
    body = [line.replace("MATERIAL=M", "MATERIAL=M, ORIENTATION=O") for line in body]
    body += [BEAMS[3], BEAMS[4], *general, "7e10, 2.6e10"]
    body += [f"*ORIENTATION, NAME=O, SYSTEM={shape}", "1., 2., .5, -1., 1., 0.", "3, 30."]
    found = []
    for rows in ([], [PLACED, TURN]):
        lines = ["*PART, NAME=P", *body, "*END PART", "*ASSEMBLY, NAME=All", *instance("I", "P", *rows)]
        found.append(frequencies(link(tmp_path, [*lines, "*END ASSEMBLY", *WOOD])))
    np.testing.assert_allclose(found[1], found[0], rtol=1e-8)


def test_the_same_part_twice(tmp_path):
    """Beams, sections and couplings of a part belong to each of its instances."""
    body = [*part(COARSE, (0, 0, 0), 1, "A"), *BEAMS, "*RIGID BODY, NSET=A-x1, REF NODE=500"]
    lines = ["*PART, NAME=P", *body, "*END PART", "*ASSEMBLY, NAME=All"]
    lines += [*instance("One", "P"), *instance("Two", "P", "0., 0.03, 0.")]
    lines += ["*TIE, NAME=T", "Two.Low, One.Up", "*END ASSEMBLY", *MATERIAL]
    top = [f"{k + 1}, S{number}" for k in range(2) for number in (5,)]
    bottom = [f"{k + 1}, S{number}" for k in range(2) for number in (3,)]
    lines = [*lines[: lines.index("*END PART")], "*SURFACE, NAME=Up", *top, "*SURFACE, NAME=Low", *bottom,
             *lines[lines.index("*END PART") :]]  # fmt: skip
    (tmp_path / "two.inp").write_text("\n".join(lines) + "\n")
    mesh = read_mesh(tmp_path / "two.inp")
    beams = [item for item in mesh.attachments if isinstance(item, AttachedBeam)]
    assert len(beams) == 2
    np.testing.assert_array_equal(beams[0].element.axes, beams[1].element.axes)
    ends = [mesh.further_nodes[list(b.element.nodes)] for b in beams]
    np.testing.assert_allclose(ends[1] - ends[0], np.tile([0, 0.03, 0], (2, 1)), atol=1e-15)
    assert sum(isinstance(item, TiedNodes) for item in mesh.attachments) == 1
    assert len(mesh.materials.sections) == 2


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        (["*SPRING, ELSET=S", "1, 1", "5."], "in an instance that is turned"),
        (["*ROTARY INERTIA, ELSET=R", "1e-4, 2e-4, 3e-4"], "in an instance that is turned"),
        (["*EQUATION", "2", "1, 1, 1., 2, 1, -1."], "in an instance that is turned"),
        ([*BEAMS[:-1]], "a section without direction 1 in an instance that is turned"),
    ],
)
def test_what_a_turned_instance_may_not_hold(tmp_path, lines, words):
    elements = ["*ELEMENT, TYPE=SPRING2, ELSET=S", "800, 1, 2", "*ELEMENT, TYPE=ROTARYI, ELSET=R", "801, 1"]
    wanted = [e for k, e in enumerate(elements) if ("SPRING" in lines[0], "ROTARY" in lines[0])[k // 2]]
    body = ["*PART, NAME=P", *part(COARSE, (0, 0, 0), 1, "A"), *wanted, *lines, "*END PART", "*ASSEMBLY, NAME=All"]
    body += [*instance("I", "P", "0.,0.,0.", TURN), "*END ASSEMBLY", *MATERIAL]
    (tmp_path / "two.inp").write_text("\n".join(body))
    with pytest.raises(FEImportError) as caught:
        read_mesh(tmp_path / "two.inp")
    assert words in str(caught.value)


SYSTEMS = {
    "shifted": ("0.1, 0.2, 0.3", lambda x: x - [0.1, 0.2, 0.3]),
    "in the plane": (
        "0.1, 0.2, 0.3, 0.1, 1.2, 0.3",
        lambda x: (x - [0.1, 0.2, 0.3]) @ [[0, -1, 0], [1, 0, 0], [0, 0, 1]],
    ),
    "three points": (
        "0.1, 0.2, 0.3, 0.1, 0.2, 1.3\n0.1, 1.2, 0.5",
        lambda x: (x - [0.1, 0.2, 0.3]) @ [[0, 0, -1], [0, 1, 0], [1, 0, 0]],
    ),
}


@pytest.mark.parametrize("name", SYSTEMS)
@pytest.mark.parametrize("cylindrical", [False, True])
def test_systems_of_points(tmp_path: Path, name: str, cylindrical: bool) -> None:
    """*SYSTEM and *NODE, SYSTEM=C: points in local coordinates are where they were; an empty one ends it."""
    rows, local = SYSTEMS[name]
    given = local(COARSE.nodes)
    if cylindrical:
        x, y, z = given.T
        given = np.column_stack([np.hypot(x, y), np.degrees(np.arctan2(y, x)), z])
    lines = part(COARSE, (0, 0, 0), 1, "A")
    nodes = [f"{k + 1}, " + ", ".join(repr(float(v)) for v in p) for k, p in enumerate(given)]
    start = ["*SYSTEM", *rows.splitlines(), "*NODE" + (", SYSTEM=C" if cylindrical else ""), *nodes]
    lines = [*start, "*SYSTEM", "*NODE", "900, 1., 2., 3.", *lines[1 + len(nodes) :], *MATERIAL]
    (tmp_path / "one.inp").write_text("\n".join(lines) + "\n")
    np.testing.assert_allclose(read_mesh(tmp_path / "one.inp").nodes, COARSE.nodes, rtol=0, atol=1e-15)
