"""Faults that engineers make, put into sound links of each kind: refused or reported, each by its true cause.

Each row: what is wrong, how it is put there, and the words that name it, in the error or in a failed check. The sound
links, and all of ``data``, raise no alarm.
"""

from __future__ import annotations

import gzip
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
import scipy.sparse as sp
from exported_files import MARKET, MATERIAL, calculix_files, files, link_matrices, market, written
from link_files import FRAME, SOLID, merged, write_box, write_toml
from solid_meshes import box

from fe_import.description.link import LinkFile, load_link
from fe_import.elements.solid import assemble_solid
from fe_import.elements.solid_mesh import SolidMesh
from fe_import.errors import FEImportError
from fe_import.reduce import reduce_link

ROOT = Path(__file__).parents[2]
MEMBERS, NODES = FRAME["frame"]["members"], FRAME["frame"]["nodes"]
Make = Callable[[Path], LinkFile]


class Fault(NamedTuple):
    """A link with a fault, and words that name it: in one error, or in one failed check of the report."""

    make: Make
    words: tuple[str, ...]
    reported: bool = False


def frame(*words: str, reported: bool = False, **changes: Any) -> Fault:
    return Fault(lambda folder: load_link(write_toml(folder / "l.toml", merged(FRAME, changes))), words, reported)


def deck(mesh: SolidMesh) -> str:
    """A deck of a mesh; its sets x0 and x1."""
    lines = ["*NODE", *(f"{k}, {x!r}, {y!r}, {z!r}" for k, (x, y, z) in enumerate(mesh.nodes.tolist(), 1))]
    lines.append(f"*ELEMENT, TYPE=C3D{mesh.only.element.size}, ELSET=ALL")
    for k, nodes in enumerate((mesh.only.elements + 1).tolist(), 1):
        words = [str(k), *map(str, nodes)]
        lines += [
            ", ".join(words[at : at + 11]) + ("," if at + 11 < len(words) else "") for at in range(0, len(words), 11)
        ]
    for name in ("x0", "x1"):
        lines += [f"*NSET, NSET={name}", *(f"{n + 1}," for n in mesh.node_sets[name])]
    return "\n".join([*lines, ""])


def solid(*words: str, text: Callable[[], str] | None = None, reported: bool = False, **changes: Any) -> Fault:
    def make(folder: Path) -> LinkFile:
        write_box(folder / "box.inp")
        if text is not None:
            (folder / "box.inp").write_text(text(), encoding="utf-8")
        return load_link(write_toml(folder / "l.toml", merged(SOLID, changes)))

    return Fault(make, words, reported)


def shell(*words: str, **changes: Any) -> Fault:
    """The bracket of ``data``, whose two legs look to opposite sides of the sheet."""

    def make(folder: Path) -> LinkFile:
        bracket = ROOT / "data" / "shells" / "links" / "bracket.toml"
        return load_link(bracket, changes={f"shell.{key}": value for key, value in changes.items()})

    return Fault(make, words)


def moved(mesh: SolidMesh, at: tuple[float, float, float], by: tuple[float, float, float]) -> str:
    """The node nearest to a place, moved."""
    nodes = mesh.nodes.copy()
    nodes[np.linalg.norm(nodes - at, axis=1).argmin()] += by
    return deck(SolidMesh.uniform(nodes, mesh.only.elements, mesh.only.type, node_sets=mesh.node_sets))


def sliver() -> str:
    """Tetrahedra, one of whose inner nodes nearly lies in the plane of others: a scaled Jacobian of 1e-5."""
    mesh = box("tet4", (4, 2, 2), (0.2, 0.1, 0.1))
    inner = np.linalg.norm(mesh.nodes - [0.05, 0.05, 0.05], axis=1).argmin()
    nodes = mesh.nodes.copy()
    nodes[inner] += [0.0, 0.05 * (1 - 1e-5), 0.0]
    return deck(SolidMesh.uniform(nodes, mesh.only.elements, mesh.only.type, node_sets=mesh.node_sets))


def parts(gap: float, kind: str = "hex20") -> str:
    """Two boxes with a gap between them; none: their nodes coincide."""
    one, other = (box(kind, (2, 1, 1), (0.2, 0.02, 0.03)) for _ in range(2))
    nodes = np.concatenate([one.nodes, other.nodes + np.array([0.2 + gap, 0, 0])])
    elements = np.concatenate([one.only.elements, other.only.elements + len(one.nodes)])
    sets = {"x0": one.node_sets["x0"], "x1": other.node_sets["x1"] + len(one.nodes)}
    return deck(SolidMesh.uniform(nodes, elements, kind, node_sets=sets))


def hinged() -> str:
    """A deck of two boxes that share one edge."""
    nodes, elements, sets = _hinged()
    return deck(SolidMesh.uniform(nodes, elements, "hex8", node_sets=sets))


def _hinged() -> tuple[np.ndarray, np.ndarray, dict[str, np.ndarray]]:
    one = box("hex8", (2, 1, 1), (0.2, 0.02, 0.02))
    shifted = one.nodes + np.array([0.2, 0.02, 0.0])
    pairs = np.linalg.norm(one.nodes[:, None] - shifted[None], axis=2) < 1e-9
    number = np.where(pairs.any(axis=0), pairs.argmax(axis=0), 0)
    fresh = ~pairs.any(axis=0)
    number[fresh] = len(one.nodes) + np.arange(fresh.sum())
    sets = {"x0": one.node_sets["x0"], "x1": number[one.node_sets["x1"]]}
    nodes = np.concatenate([one.nodes, shifted[fresh]])
    return nodes, np.concatenate([one.only.elements, number[one.only.elements]]), sets


def matrices(*words: str, **spoil: Callable[[], bytes]) -> Fault:
    """Exported matrices of 3 hexahedra, files spoiled: ``k`` and ``m`` the matrices, ``rows``, ``mesh``."""
    names = {"k": "k.mtx", "m": "m.mtx", "rows": "rows.csv", "mesh": "k.inp"}
    return Fault(lambda folder: written(folder, MARKET, {names[key]: make() for key, make in spoil.items()}), words)


def calculix(*words: str, stiffness: Callable[[np.ndarray], np.ndarray]) -> Fault:
    """The L of 100 hexahedra as CalculiX exported it, the values of its stiffness changed."""

    def make(folder: Path) -> LinkFile:
        source = ROOT / "data" / "calculix"
        for path in source.glob("l_hex20.*"):
            (folder / path.name).write_bytes(path.read_bytes())
        place = folder / "l_hex20.sti.gz"
        entries = np.loadtxt(place)
        lines = zip(*entries[:, :2].T.astype(int).tolist(), stiffness(entries[:, 2]).tolist(), strict=True)
        place.write_bytes(gzip.compress("".join(f"{i} {j} {v!r}\n" for i, j, v in lines).encode(), 1))
        return load_link(folder / "l_hex20.toml")

    return Fault(make, words)


def without_row(matrix: sp.csc_array, row: int) -> bytes:
    dense = matrix.toarray()
    dense[row] = dense[:, row] = 0.0
    return market(sp.csc_array(dense), "general")


def edited(matrix: sp.csc_array, *entries: tuple[int, int, float]) -> bytes:
    """Entries multiplied by a factor, as they stand: nothing else is made symmetric."""
    dense = matrix.toarray()
    for i, j, factor in entries:
        dense[i, j] *= factor
    return market(sp.csc_array(dense), "general")


def held(matrix: sp.csc_array) -> bytes:
    """A spring of a hundredth of the stiffness between node 30 and the ground."""
    dense = matrix.toarray()
    dense[7, 7] *= 1.01
    return market(sp.csc_array(dense))


def with_loose_part() -> bytes:
    """The stiffness without the last element: its nodes are joined to nothing."""
    mesh = link_matrices()[0]
    rest = SolidMesh.uniform(mesh.nodes, mesh.only.elements[:-1], mesh.only.type)
    return market(assemble_solid(rest, [MATERIAL])[1])


@cache
def hinged_files() -> dict[str, bytes]:
    """Matrices and deck of two boxes that share an edge."""
    nodes, elements, sets = _hinged()
    mesh = SolidMesh.uniform(nodes, elements, "hex8", node_sets=sets)
    mass, stiffness = assemble_solid(mesh, [MATERIAL])
    return {"k.mtx": market(stiffness), "m.mtx": market(mass), **calculix_files(mesh, mass, stiffness)}


def rows_of(dofs: bytes) -> bytes:
    """CalculiX's list of dofs as text of rows."""
    lines = [line.split(".") for line in dofs.decode().split()]
    return "".join(f"{node}, {'xyz'[int(c) - 1]}\n".replace(", ", ", u") for node, c in lines).encode()


def reordered(rows: bytes) -> bytes:
    """All ux first, then all uy, all uz, where the matrices go node by node."""
    lines = rows.decode().splitlines()
    return "\n".join([*lines[:2], *sorted(lines[2:], key=lambda text: text.split(",")[1]), ""]).encode()


_, MASS, STIFFNESS = link_matrices()
K = STIFFNESS.toarray()
FAR = tuple(int(i) for i in np.argwhere(np.abs(np.triu(K, 1)) > 0.1 * np.abs(K).max())[0])  # a large entry, i < j
FREE = slice(12, 15)  # rows of a node between the two faces
COARSE = box("hex8", (4, 2, 2), (0.2, 0.1, 0.1))

FAULTS = {
    # frames
    "frame: mm read as m": frame(
        "size of the link",
        'units.length = "mm"',
        "unusual = true",
        frame={"nodes": {k: [1e3 * x for x in p] for k, p in NODES.items()}},
        sections={"s": {"width": 10.0, "height": 20.0}},
    ),
    "frame: sections in mm": frame(
        "thickness per size of the link", "mm read as m", sections={"s": {"width": 10.0, "height": 20.0}}
    ),
    "frame: point mass in g": frame(
        "point masses per mass of what carries them",
        "g read as kg",
        reported=True,
        masses=[{"node": "tip", "mass": 5000.0}],
    ),
    "frame: modulus in MPa": frame("Young's modulus", "MPa", materials={"m": {"youngs_modulus": 7e4}}),
    "frame: density in g/cm3": frame("density", "g/cm³", materials={"m": {"density": 2.7}}),
    "frame: aluminium with the density of steel": frame(
        "m has Young's modulus of aluminium", "density of steel", reported=True, materials={"m": {"density": 7850.0}}
    ),
    "frame: steel with the density of aluminium": frame(
        "modulus of steel", "density of aluminium", reported=True, materials={"m": {"youngs_modulus": 2.1e11}}
    ),
    "frame: floating part": frame(
        "no members join node",
        frame={
            "nodes": {"a": [1.0, 0.0, 0.0], "b": [1.0, 1.0, 0.0]},
            "members": [*MEMBERS, {**MEMBERS[0], "from": "a", "to": "b"}],
        },
    ),
    "frame: duplicate nodes": frame("frame.members[0]", "no length", frame={"nodes": {"elbow": NODES["root"]}}),
    "frame: negative mass": frame("masses[0].mass", "negative", masses=[{"node": "tip", "mass": -1.0}]),
    "frame: truncated file": Fault(
        lambda folder: load_link(_cut(write_toml(folder / "l.toml", FRAME))), ("l.toml", "line")
    ),
    # solids
    "solid: mm read as m": solid(
        "size of the link", "mm", text=lambda: deck(box("hex20", (3, 1, 1), (300.0, 20.0, 30.0)))
    ),
    "solid: m read as mm": solid("density", "unit slipped", units={"length": "mm"}),
    "solid: modulus in MPa": solid("Young's modulus", "MPa", materials={"m": {"youngs_modulus": 7e4}}),
    "solid: aluminium with the density of steel": solid(
        "density of steel", reported=True, materials={"m": {"density": 7850.0}}
    ),
    "solid: missing coupling": solid("2 parts", "no element face joins", text=lambda: parts(0.01)),
    "solid: duplicate nodes": solid("pairs of nodes coincide", text=lambda: parts(0.0)),
    "solid: hinge inside": solid("2 parts", "touch at nodes or edges only", text=hinged),
    "solid: grounded": solid(
        "supports (a link is free",
        "BOUNDARY",
        text=lambda: deck(box("hex20", (3, 1, 1), (0.3, 0.02, 0.03))) + "*BOUNDARY\nx0, 1, 3\n",
    ),
    "solid: negative mass": solid("materials.m.density", "above 0", materials={"m": {"density": -2700.0}}),
    "solid: order of nodes": solid(
        "inverted or flat",
        "mirrored or not VTK's",
        text=lambda: deck(
            SolidMesh.uniform(
                COARSE.nodes, COARSE.only.elements[:, [0, 3, 2, 1, 4, 7, 6, 5]], "hex8", node_sets=COARSE.node_sets
            )
        ),
    ),
    "solid: truncated file": solid(
        "line", "C3D8 has 8 nodes", text=lambda: deck(COARSE)[: deck(COARSE).index("*NSET") - 6]
    ),
    "solid: node moved into its element": solid(
        "inverted or flat", "element", text=lambda: moved(COARSE, (0.1, 0.05, 0.05), (0.06, 0.0, 0.0))
    ),
    "solid: node moved out by its element's length": solid(
        "node off the surface around it",
        "seems to be moved",
        reported=True,
        text=lambda: moved(box("hex8", (6, 4, 4), (0.3, 0.2, 0.2)), (0.15, 0.1, 0.2), (0.0, 0.0, 0.05)),
    ),
    "solid: slivers": solid("slivers", "refine or repair the mesh there", reported=True, text=sliver),
    "solid: volume locking": solid(
        "Poisson's ratio",
        "hex8 with 0.4999",
        "raise_order = true",
        reported=True,
        solid={"hex8": "compatible"},
        materials={"m": {"poissons_ratio": 0.4999}},
        text=lambda: deck(COARSE),
    ),
    "solid: volume locking of quadratic elements": solid(
        "Poisson's ratio",
        "hex20 with 0.4999",
        "refine",
        reported=True,
        materials={"m": {"poissons_ratio": 0.4999}},
    ),
    # shells
    "shell: thickness in mm": shell("thickness per size of the link", "mm read as m", thickness=2.5),
    "shell: thickness in m, mesh in mm": shell("thickness per size of the link", "m read as mm", thickness=2.5e-6),
    "shell: normals of both sides": shell(
        "normals of neighbouring shells point to opposite sides, at 12 edges", "offset", offset=0.001
    ),
    # matrices
    "matrices: mass in t": matrices(
        "speed of sound in the matrices", "mass in t read as kg", m=lambda: market(1e-3 * MASS)
    ),
    "matrices: K scaled": matrices(
        "speed of sound in the matrices", "scale of the matrices", k=lambda: market(1e-6 * STIFFNESS)
    ),
    "matrices: K in N/mm": matrices("stiffness in N/mm", k=lambda: market(1e-9 * STIFFNESS)),
    "matrices: K in N/mm, mass in kg": calculix("stiffness in N/mm", stiffness=lambda v: 1e-3 * v),
    "matrices: K of six digits": calculix(
        "by the rounding of its 6 digits",
        "export the matrices with all digits",
        stiffness=lambda v: np.array([float(f"{x:.5e}") for x in v]),
    ),
    "matrices: a row of K lost": matrices(
        "1 displacements of nodes have no stiffness", "row 5, uy of node 20", k=lambda: without_row(STIFFNESS, 4)
    ),
    "matrices: entries of K lost": matrices(
        "resists rigid-body motion at nodes ",
        "entries of these nodes are lost",
        k=lambda: edited(STIFFNESS, (*FAR, 0.5), (*FAR[::-1], 0.5)),
    ),
    "matrices: exchanged": matrices(
        "mass and stiffness are exchanged", k=lambda: market(MASS), m=lambda: market(STIFFNESS)
    ),
    "matrices: all signs": matrices(
        "negative throughout, all signs are flipped: stiffness and mass",
        k=lambda: market(-STIFFNESS),
        m=lambda: market(-MASS),
    ),
    "matrices: signs of K": matrices("all signs are flipped: stiffness", k=lambda: market(-STIFFNESS)),
    "matrices: one sign on the diagonal": matrices(
        "negative on its diagonal in 1 of 48 rows", "row 5, uy of node 20", k=lambda: edited(STIFFNESS, (4, 4, -1.0))
    ),
    "matrices: one sign off the diagonal": matrices(
        "the stiffness entry between",
        "has the wrong sign",
        k=lambda: edited(STIFFNESS, (*FAR, -1.0), (*FAR[::-1], -1.0)),
    ),
    "matrices: one sign in one triangle": matrices(
        "not symmetric at one place", f"row {max(FAR) + 1}", k=lambda: edited(STIFFNESS, (*FAR, -1.0))
    ),
    "matrices: negative mass": matrices(
        "the mass matrix is negative on its diagonal", m=lambda: edited(MASS, (3, 3, -1.0))
    ),
    "matrices: grounded": matrices(
        "resists rigid-body motion at nodes 30", "springs to ground", k=lambda: held(STIFFNESS)
    ),
    "matrices: missing coupling": matrices("parts that no stiffness joins, the smallest of", k=with_loose_part),
    "matrices: hinge inside": matrices(
        "one motion without strain inside the link, largest at (", "some part can move without strain",
        k=lambda: hinged_files()["k.mtx"],
        m=lambda: hinged_files()["m.mtx"],
        rows=lambda: rows_of(hinged_files()["k.dof"]),
        mesh=lambda: hinged_files()["k.inp"],
    ),
    "matrices: order of dofs": matrices("check the order of the dofs", rows=lambda: reordered(files()["rows.csv"])),
    "matrices: truncated file": matrices("k.mtx", "cut off", k=lambda: files()["k.mtx"][: len(files()["k.mtx"]) // 2]),
    "matrices: mesh in mm": matrices(
        "a unit slipped", 'units.length = "mm"', mesh=lambda: _millimetres(files()["k.inp"])
    ),
}


def _cut(path: Path) -> Path:
    text = path.read_text(encoding="utf-8")
    path.write_text(text[: len(text) // 2], encoding="utf-8")
    return path


def _millimetres(text: bytes) -> bytes:
    lines = text.decode().splitlines()
    end = next(k for k, line in enumerate(lines) if line.startswith("*ELEMENT"))
    for k in range(2, end):
        number, *position = lines[k].split(",")
        lines[k] = ",".join([number, *(repr(1e3 * float(x)) for x in position)])
    return "\n".join([*lines, ""]).encode()


@pytest.mark.parametrize("name", FAULTS)
def test_faults_are_named(tmp_path: Path, name: str) -> None:
    fault = FAULTS[name]
    if fault.reported:
        failed = [check.name for check in reduce_link(fault.make(tmp_path)).health if not check.ok]
        assert any(all(word in check for word in fault.words) for check in failed), failed
        return
    with pytest.raises(FEImportError) as caught:
        reduce_link(fault.make(tmp_path))
    assert all(word in str(caught.value) for word in fault.words), caught.value


def test_nodes_without_mass_are_reported(tmp_path: Path) -> None:
    """A body moves without the mass of one node, too: nothing is refused, but it is told."""
    dense = MASS.toarray()
    dense[FREE] = dense[:, FREE] = 0.0
    link = written(tmp_path, MARKET, {"m.mtx": market(sp.csc_array(dense), "general")})
    found = [check for check in reduce_link(link).health if "without mass" in check.name]
    assert [check.value for check in found] == [1.0]
    assert "the first at (" in found[0].name


SOUND: dict[str, Make] = {
    "frame": frame().make,
    "solid": solid().make,
    "matrices": matrices().make,
    "solid of tetrahedra": solid(text=lambda: deck(box("tet4", (4, 2, 2), (0.2, 0.1, 0.1)))).make,
    "solid, distorted": solid(text=lambda: deck(box("hex8", (6, 4, 4), (0.3, 0.2, 0.2), distortion=0.2))).make,
}


@pytest.mark.parametrize("name", SOUND)
def test_sound_links_raise_no_alarm(tmp_path: Path, name: str) -> None:
    assert [check.name for check in reduce_link(SOUND[name](tmp_path)).health if not check.ok] == []


LINKS = [p for p in sorted((ROOT / "data").rglob("links/*.toml")) if "solid" not in p.name] + [
    ROOT / "data" / "calculix" / "l_hex20.toml"
]


@pytest.mark.parametrize("path", LINKS, ids=lambda p: f"{p.parent.parent.name}/{p.name}")
def test_links_of_data_raise_no_alarm(path: Path) -> None:
    assert [check.name for check in reduce_link(path).health if not check.ok] == []
