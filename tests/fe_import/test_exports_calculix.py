"""CalculiX: figures of CalculiX itself, our own matrices of the same mesh, and faulty files."""

from __future__ import annotations

import gzip
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.linalg as la
import scipy.sparse as sp
from exported_files import (
    CALCULIX,
    MATERIAL,
    Fault,
    Files,
    calculix_files,
    check_fault,
    deck,
    files,
    link_matrices,
    raw,
    relined,
    swapped,
    written,
)
from link_files import boundary, dense
from solid_meshes import box

from fe_import.description.link import load_link
from fe_import.elements.solid import assemble_solid
from fe_import.elements.solid_mesh import SolidMesh
from fe_import.errors import Cause
from fe_import.exports.calculix import read_calculix
from fe_import.exports.inp_elements import picture
from fe_import.exports.inp_mesh import read_inp
from fe_import.models.model import build_model
from fe_import.reduce import reduce_link
from fe_import.solver.sparse import lowest_modes

ROOT = Path(__file__).parents[2]
EXPORTS = ROOT.parent / "shared" / "fe_exports"
LINK = ROOT / "data" / "calculix" / "l_hex20.toml"
# free-free frequencies of the mesh of LINK [rad/s], modes 7 to 30 of CalculiX 2.20 (*FREQUENCY, 30; seven digits)
CALCULIX_RAD_S = [
    769.592, 915.6387, 1303.924, 2894.662, 2914.344, 3399.75, 4271.241, 5250.663,
    5298.874, 6680.199, 7516.732, 8822.895, 10638.94, 11134.7, 11580.04, 15523.86,
    15701.87, 17636.58, 18029.82, 18559.28, 20532.6, 22784.11, 23702.76, 28096.63,
]  # fmt: skip


def free_modes(mass, stiffness, count: int) -> np.ndarray:
    """Circular frequencies of a free link, all eigenvalues moved by (100 rad/s)²."""
    omega, _ = lowest_modes((stiffness + 1e4 * mass).tocsc(), mass, count, "free link")
    return np.sqrt((omega**2 - 1e4).clip(min=0))


def test_free_frequencies_are_those_of_calculix() -> None:
    """Of the imported matrices without interfaces, to 1e-6 (the figures carry seven digits)."""
    link = load_link(LINK)
    export = read_calculix({k: link.folder / v for k, v in link.description.matrices.files.items()}, None, str(LINK))
    found = free_modes(export.mass, export.stiffness, 30)[6:]
    np.testing.assert_allclose(found, CALCULIX_RAD_S, rtol=1e-6)


def test_reduction_equals_that_of_our_own_matrices(tmp_path: Path) -> None:
    """Craig-Bampton with 20 fixed-interface modes of the same mesh and material: free-free frequencies to 1e-7.

    The lowest clamped one to 1e-6: the text's 14 digits times the condition of the clamped stiffness leave 2e-7.
    """
    text = LINK.read_text(encoding="utf-8").replace("fixed_interface_modes = 12", "fixed_interface_modes = 20")
    text = text.replace("elastic_modes = 18\n", "").replace('"l_hex20.', f'"{LINK.parent}/l_hex20.')
    imported = tmp_path / "imported.toml"
    imported.write_text(text, encoding="utf-8")
    own = tmp_path / "own.toml"
    own.write_text(
        f"""materials.steel = {{ youngs_modulus = 2.1e11, poissons_ratio = 0.3, density = 7850.0 }}
        interfaces = [{{ name = "root", face = "IFA" }}, {{ name = "tip", face = "IFB" }}]
        reduction = {{ fixed_interface_modes = 20 }}
        [solid]
        mesh = "{ROOT}/data/l_shape/meshes/l_hex20.msh"
        material = "steel"
        nodes = {{ elbow = [0.5, 0.0, 0.0] }}
        """,
        encoding="utf-8",
    )
    a, b = reduce_link(imported), reduce_link(own)
    assert a.elastic_modes == b.elastic_modes == 26
    np.testing.assert_allclose(a.frequencies_hz[6:], b.frequencies_hz[6:], rtol=1e-7)
    np.testing.assert_allclose(a.fixed_interface.frequencies_hz, b.fixed_interface.frequencies_hz, rtol=1e-6)
    assert a.mass_properties.mass == pytest.approx(2.355, rel=1e-9)
    for i, j in zip(a.interface_nodes, b.interface_nodes, strict=True):
        np.testing.assert_allclose(i.position, j.position, atol=1e-12)
    np.testing.assert_allclose(a.nodes[a.node_names["elbow"]], [0.5, 0.0, 0.0], atol=1e-12)
    assert len(a.triangles) == len(b.triangles)


def exported(job: str) -> dict[str, Path]:
    roles = {"stiffness": "mat.sti", "mass": "mat.mas", "dofs": "mat.dof", "mesh": "mesh.inp"}
    paths = {role: EXPORTS / f"{job}_{end}.gz" for role, end in roles.items()}
    if not all(p.is_file() for p in paths.values()):
        pytest.skip("needs the CalculiX exports of the tetrahedral L, which are not part of the repository")
    return paths


def test_a_mass_matrix_without_full_rank_is_legal() -> None:
    """CalculiX's rule of 4 points leaves the C3D10 mass semidefinite; frequencies as in its .dat, to 1e-6."""
    paths = exported("l_tet10")
    export = read_calculix(paths, None, "tet10")
    assert export.mass.shape == (14253, 14253)
    found = free_modes(export.mass, export.stiffness, 9)[6:]
    np.testing.assert_allclose(found, [767.3137, 915.5186, 1303.737], rtol=1e-6)


def four_point_mass(mesh: SolidMesh, density: float) -> np.ndarray:
    """Mass of straight tetrahedra with 10 nodes by the rule of 4 points that CalculiX uses (Stroud, 1971)."""
    a, b = (5 + 3 * np.sqrt(5)) / 20, (5 - np.sqrt(5)) / 20
    points = np.full((3, 4), b)
    points[:, 1:][np.eye(3, dtype=bool)] = a
    element = mesh.only.element
    values = element.shape_values(points)
    scalar = np.zeros((len(mesh.nodes),) * 2)
    for nodes in mesh.only.elements:
        edges = mesh.nodes[nodes[1:4]] - mesh.nodes[nodes[0]]
        scalar[np.ix_(nodes, nodes)] += density * abs(np.linalg.det(edges)) / 24 * values @ values.T
    return np.kron(scalar, np.eye(3))


@pytest.mark.parametrize("method", ["craig-bampton", "none"])
def test_a_small_mass_matrix_without_full_rank(tmp_path: Path, method: str) -> None:
    """6 elements have 24 mass points, fewer than nodes.

    Against the dense eigenproblem of the same matrices moved by α, in 1/(ω² + α), to 1e-8.
    """
    mesh = box("tet10", (1, 1, 1), (0.1, 0.02, 0.03))
    mass = four_point_mass(mesh, MATERIAL.density)
    assert np.linalg.matrix_rank(mass, tol=1e-12 * mass.max()) <= 72 < len(mass) == 81
    stiffness = assemble_solid(mesh, [MATERIAL])[1]
    spoiled = calculix_files(mesh, sp.csc_array(mass), stiffness)
    model = build_model(written(tmp_path, CALCULIX, spoiled))
    m, k, _ = dense(model)
    inner = np.setdiff1d(np.arange(len(m)), boundary(model))
    options = {"method": method} | ({"fixed_interface_modes": len(inner)} if method == "craig-bampton" else {})
    modal = reduce_link(written(tmp_path, CALCULIX, spoiled, {"reduction": options}))
    scale, alpha, count = 1 / np.sqrt(np.diag(k)), 1e10, 8
    both = np.outer(scale, scale)
    mu = la.eigh(m * both, (k + alpha * m) * both, eigvals_only=True)[::-1]
    expected = np.sqrt(1 / mu[6 : 6 + count] - alpha) / (2 * np.pi)
    np.testing.assert_allclose(modal.frequencies_hz[6 : 6 + count], expected, rtol=1e-8)


def test_modes_beside_massless_nodes() -> None:
    """Lanczos with massless nodes against the dense problem with these nodes condensed statically, to 1e-9."""
    mesh = box("hex8", (6, 5, 5), (0.3, 0.2, 0.2))
    mass, stiffness = assemble_solid(mesh, [MATERIAL])
    bare = (np.arange(mass.shape[0]) // 3) % 4 == 0
    keep = sp.diags_array(np.where(bare, 0.0, 1.0))
    mass = (keep @ mass @ keep).tocsc()
    k = (stiffness + 1e9 * mass).toarray()
    held = np.flatnonzero(~bare)
    condensed = k[np.ix_(held, held)] - k[np.ix_(held, bare)] @ la.solve(k[np.ix_(bare, bare)], k[np.ix_(bare, held)])
    mu = la.eigh(mass.toarray()[np.ix_(held, held)], condensed, eigvals_only=True)[::-1]
    omega, modes = lowest_modes(sp.csc_array(k), mass, 12, "test")
    np.testing.assert_allclose(omega, 1 / np.sqrt(mu[:12]), rtol=1e-9)
    np.testing.assert_allclose(modes.T @ (mass @ modes), np.eye(12), atol=1e-9)


def test_the_small_export_is_the_model_it_was_made_of(tmp_path: Path) -> None:
    """Sound files give the matrices back, to the 14 digits of the text, and labels, sets and surface."""
    mesh, mass, stiffness = link_matrices()
    model = build_model(written(tmp_path, CALCULIX))
    count = 3 * len(mesh.nodes)
    for ours, theirs in ((model.mass, mass), (model.stiffness, stiffness)):
        found = ours.toarray()
        assert np.abs(found[:count, :count] - theirs.toarray()).max() < 1e-13 * abs(theirs).max()
        assert not found[count:].any()
    assert [i.coupling for i in model.interface_nodes] == ["rigid", "rigid"]
    np.testing.assert_allclose(model.interface_nodes[1].position, [0.3, 0.01, 0.015], atol=1e-15)
    assert all(c.ok for c in reduce_link(load_link(tmp_path / "link.toml")).health)


def scaled(lines: list[str]) -> list[str]:
    """The first diagonal entry, positive, grown by a hundredth."""
    i, j, value = lines[0].split()
    return [f"{i} {j} {1.01 * float(value):.13e}", *lines[1:]]


def negative(lines: list[str]) -> list[str]:
    return [" ".join([*line.split()[:2], f"{-float(line.split()[2])!r}"]) for line in lines]


def flipped(content: bytes) -> bytes:
    packed = bytearray(gzip.compress(content))
    packed[len(packed) // 2] ^= 0xFF
    return bytes(packed)


def fault(name: str, spoiled: Callable[[], Files], cause: Cause, words: str, **changes: Any) -> Fault:
    return Fault(name, CALCULIX, spoiled, {"matrices": changes} if changes else {}, cause, words)


BAD, GROUNDED, UNREADABLE = Cause.EXPORT, Cause.GROUNDED, Cause.NOT_READABLE
BOMB = gzip.compress(b"1 1 1.0\n" * 2_600_000)
FAULTS = [
    fault("cut at a line's end", relined("k.sti", lambda lines: lines[:-1]), BAD, "the file is cut off"),
    fault("mass cut at a line's end", relined("k.mas", lambda lines: lines[:-1]), BAD, "k.mas"),
    fault("cut in a line", raw("k.sti", lambda content: content[:-4]), BAD, "the last line does not end"),
    fault("cut between columns", relined("k.sti", lambda lines: [*lines[:-1], "48 48"]), BAD, "expected 3 numbers"),
    fault("an entry lost", relined("k.mas", lambda lines: lines[:20] + lines[21:]), BAD, "different numbers of ent"),
    fault("an entry twice", relined("k.sti", lambda lines: [lines[5], *lines]), BAD, "stands at"),
    fault("both triangles", relined("k.sti", lambda lines: ["2 1 5.0", *lines]), BAD, "needs each pair once"),
    fault("not a number", relined("k.sti", lambda lines: ["1 1 nan", *lines[1:]]), BAD, "line 1: a number is not"),
    fault("too large for a double", relined("k.sti", lambda lines: ["1 1 1e400", *lines[1:]]), BAD, "not finite"),
    fault("a word", relined("k.mas", lambda lines: [*lines[:3], "2 3 abc", *lines[4:]]), BAD, "line 4: not a number"),
    fault("stars of Fortran", relined("k.mas", lambda lines: ["1 1 ******", *lines[1:]]), BAD, "not a number"),
    fault("a broken row number", relined("k.sti", lambda lines: ["1.5 2 1.0", *lines]), BAD, "must be a whole number"),
    fault("rows from zero", relined("k.sti", lambda lines: ["0 0 1.0", *lines]), BAD, "rows and columns count from 1"),
    fault("a row too many", relined("k.sti", lambda lines: [*lines, "1 49 1.0", "49 49 1.0"]), BAD, "limit 1 ... 48"),
    fault("binary", raw("k.sti", bytes(range(256)) * 9), BAD, "not a text file"),
    fault("UTF-16", raw("k.dof", lambda content: content.decode().encode("utf-16")), BAD, "not a text file"),
    fault("a giant line", raw("k.sti", b" " * 50_000), BAD, "too long a line"),
    fault("a gzip bomb", raw("k.sti", BOMB), BAD, "unpacks to far more"),
    fault("corrupt gzip", raw("k.sti", flipped), UNREADABLE, "k.sti"),
    fault("gzip cut off", raw("k.mas", lambda content: gzip.compress(content)[:-20]), UNREADABLE, "cut off"),
    fault("empty", raw("k.sti", b""), BAD, "the last entry"),
    fault("no rows", raw("k.dof", b""), BAD, "no rows"),
    fault("too few dofs", relined("k.dof", lambda lines: [*lines[:-3], *lines[-3:-1]]), GROUNDED, "node 160 lacks uz"),
    fault("a dof twice", relined("k.dof", lambda lines: ["10.2", *lines[1:]]), BAD, "two rows of one component"),
    fault("direction 10", relined("k.dof", lambda lines: [*lines[:-1], "160.10"]), BAD, "the direction from 1 to 3"),
    fault("temperatures", relined("k.dof", lambda lines: [*lines, "160.0"]), BAD, "no temperatures"),
    fault("another mesh", swapped("k.inp", "*NODE, NSET=Nall\n10,", "*NODE, NSET=Nall\n11,"), BAD, "not in the deck"),
    fault("a node of no mesh", relined("k.dof", lambda lines: [*lines[:-1], "999.3"]), BAD, "a node that the mesh"),
    fault("held by *BOUNDARY", lambda: without_node(""), GROUNDED, "held by *BOUNDARY"),
    fault("tied by *EQUATION", lambda: without_node("*EQUATION\n2\n"), GROUNDED, "dependent in *EQUATION of the deck"),
    fault("a spring to ground", relined("k.sti", scaled), GROUNDED, "at nodes 10"),
    fault("negative mass", relined("k.mas", negative), Cause.NOT_DEFINITE, "negative"),
    fault("a stretched mesh", lambda: {"k.inp": stretched()}, GROUNDED, "not where the matrices have them"),
    fault("a mixed-up node", lambda: {"k.dof": renumbered()}, GROUNDED, "not where the matrices have them"),
    fault("an include", swapped("k.inp", "*NODE", "*INCLUDE, INPUT=mesh.inp\n*NODE"), BAD, "there is no such file"),
    fault("parts", swapped("k.inp", "*NODE", "*PART, NAME=P\n*NODE"), BAD, "flat deck"),
    fault("a node twice", swapped("k.inp", "*ELEMENT", "10, 1.0\n*ELEMENT"), BAD, "stands twice"),
    fault("a bad coordinate", swapped("k.inp", "0.0", "0..0"), BAD, "expected a finite number"),
    fault("a set of nothing", swapped("k.inp", "*NSET", "*NSET, NSET=A\nB\n*NSET"), BAD, "needs set 'B'"),
    fault("a set without end", swapped("k.inp", "*NSET", "*NSET, NSET=A, GENERATE\n1, 900000000000\n*NSET"), BAD,
          "members"),
    fault("an element too short", relined("k.inp", lambda lines: [f"{line}\n*ELEMENT, TYPE=C3D8\n9, 10, 20"
                                                                   if line.startswith("** a") else line
                                                                   for line in lines]), BAD, "8 nodes"),
    fault("an element of no nodes", swapped("k.inp", "*NSET", "*ELEMENT, TYPE=S3\n9, 10, 20, 7\n*NSET"), BAD,
          "a node that is not in the deck"),
    fault("no deck", raw("k.inp", b"nothing\n"), BAD, "no nodes"),
]  # fmt: skip


def without_node(keyword: str) -> Files:
    """A link whose last node has no rows: the rows and columns of its three dofs removed."""
    mesh, mass, stiffness = link_matrices()
    keep = slice(0, mass.shape[0] - 3)
    cut = calculix_files(mesh, mass[keep, keep], stiffness[keep, keep])
    rows = cut["k.dof"].decode().splitlines()[:-3]
    return {**cut, "k.dof": ("\n".join(rows) + "\n").encode(), "k.inp": cut["k.inp"] + keyword.encode()}


def stretched() -> bytes:
    """A deck whose nodes stand elsewhere; equal factors would be another unit of length only."""
    mesh = link_matrices()[0]
    return deck(replace(mesh, nodes=mesh.nodes * np.array([1.0, 1.0, 1.001]))).encode()


def renumbered() -> bytes:
    """Two nodes exchanged in the rows."""
    return files()["k.dof"].replace(b"10.", b"#.").replace(b"20.", b"10.").replace(b"#.", b"20.")


@pytest.mark.parametrize("fault", FAULTS, ids=lambda f: f.name)
def test_faulty_exports_are_named(tmp_path: Path, fault: Fault) -> None:
    check_fault(fault, tmp_path)


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("k.sti", lambda text: text.replace("e", "D")),
        ("k.sti", lambda text: text.replace("\n", "\r\n")),
        ("k.sti", lambda text: "\n" + text + "\n\n"),
        ("k.mas", lambda text: text.replace("e+00", "e-100", 1) if "e+00" in text else text),
        ("k.inp", lambda text: text.replace("*NSET, NSET=x0", "*nset , nset = \"X0\"")),
        ("k.inp", lambda text: "\ufeff" + text + "*STEP\n*FREQUENCY, SOLVER=MATRIXSTORAGE\n*END STEP\n"),
        ("k.inp", lambda text: text.replace("*ELEMENT, TYPE=C3D8", "*NODE\n9999, 1.0, 2.0\n*ELEMENT,\nTYPE=C3D8")),
        ("k.inp", lambda text: text + "*ELEMENT, TYPE=U1\n77, 1\n*TRANSFORM, NSET=X0, TYPE=R\n0,1,0,1,0,0\n"),
    ],
    ids=["Fortran's D", "carriage returns", "blank lines", "tiny", "lower case", "a whole deck", "orphan", "unread"],
)
def test_what_programs_write_is_read(tmp_path: Path, name: str, change: Callable[[str], str]) -> None:
    """Spellings that mean the same give the same matrices; nodes without elements and rows are left out."""
    sound = build_model(written(tmp_path, CALCULIX))
    for packed in (False, True):
        content = change(files()[name].decode()).encode()
        model = build_model(written(tmp_path, CALCULIX, {name: gzip.compress(content) if packed else content}))
        assert abs(model.stiffness - sound.stiffness).max() == 0
        assert abs(model.mass - sound.mass).max() <= 1e-99
        assert len(model.nodes) == len(sound.nodes)


def test_sets_of_a_deck(tmp_path: Path) -> None:
    """Generated sets, sets of sets, sets of elements, sets in pieces: the nodes that a reader of the manual expects."""
    path = tmp_path / "deck.inp"
    path.write_text(
        "*HEADING\nanything, at all\n*NODE, NSET=ALL\n1,0,0,0\n2,1.\n3,0,1\n4,0,0,1D0\n7,9,9,9,\n"
        "*ELEMENT, TYPE=C3D4, ELSET=E\n5, 1, 2,\n3, 4\n*NSET, NSET=ODD, GENERATE\n1, 3, 2\n"
        "*NSET, NSET=BOTH\nODD, 4,\n*NSET, NSET=BOTH\n7\n*NSET, NSET=OF, ELSET=E\n*NSET,NSET=ONE,GENERATE\n2,2\n",
        encoding="utf-8",
    )
    mesh = read_inp(path)
    assert mesh.labels.tolist() == [1, 2, 3, 4, 7]
    assert mesh.nodes[3].tolist() == [0.0, 0.0, 1.0]
    found = {name: mesh.labels[members].tolist() for name, members in mesh.node_sets.items()}
    assert found == {"ALL": [1, 2, 3, 4, 7], "ODD": [1, 3], "BOTH": [1, 3, 4, 7], "OF": [1, 2, 3, 4], "ONE": [2]}
    assert mesh.element_nodes().tolist() == [0, 1, 2, 3]


@pytest.mark.parametrize(("kind", "element_type"), [("C3D4", "tet4"), ("C3D10", "tet10"), ("C3D8R", "hex8"),
                                                    ("C3D20R", "hex20")])  # fmt: skip
def test_pictures_of_solids(kind: str, element_type: str) -> None:
    """The surface closes: areas as vectors sum to zero, and their flux of x/3 is the volume."""
    mesh = box(element_type, (2, 1, 1), (2.0, 1.0, 1.5))
    lines, triangles = picture({kind: mesh.only.elements})
    assert not len(lines)
    a, b, c = (mesh.nodes[triangles[:, k]] for k in range(3))
    areas = np.cross(b - a, c - a) / 2
    assert np.abs(areas.sum(axis=0)).max() < 1e-14
    assert np.einsum("ti,ti->", areas, (a + b + c) / 3) / 3 == pytest.approx(3.0, rel=1e-14)


def test_pictures_of_wedges_shells_and_beams() -> None:
    """Two wedges on each other show no face between them; shells and beams are drawn as they are."""
    wedges = np.array([[0, 1, 2, 3, 4, 5], [3, 4, 5, 6, 7, 8]])
    assert len(picture({"C3D6": wedges})[1]) == 2 + 2 * 3 * 2
    long = np.arange(15)[None]
    assert len(picture({"C3D15": long})[1]) == 2 * 4 + 3 * 6
    lines, triangles = picture({"S4R": np.array([[0, 1, 2, 3]]), "B32": np.array([[4, 5, 6]]), "MASS": np.array([[0]])})
    assert triangles.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert lines.tolist() == [[4, 5], [5, 6]]
