"""The readers of fe_import with small sound files, for `fuzzing`."""

from __future__ import annotations

import gzip
import importlib
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import meshio
import numpy as np
import scipy.sparse as sp
from exported_files import CALCULIX, FRD, MARKET, NPZ, files, frd_files
from fuzzing import Facts, Reader
from fuzzing_facts import content, taken
from fuzzing_hdf5 import edited
from link_files import toml
from mesh_writers import archive, exodus, universal
from modal_models import synthetic_model
from solid_meshes import box, bulk
from superelements import Reduced, condensed, deck, frame_model, matrix_input, punch, substructure

from fe_import.description.link import load_link
from fe_import.description.records import LinkDescription
from fe_import.elements.solid_mesh import SolidMesh
from fe_import.health.report import check_model
from fe_import.mesh.read import read_mesh
from fe_import.modal.check import validate
from fe_import.modal.file import read_modal_file, write_modal_file, write_modal_group
from fe_import.modal.model import ModalModel
from fe_import.model import FEModel
from fe_import.models.model import build_model


def mesh_facts(mesh: SolidMesh) -> Facts:
    """Nodes, elements and sets by position, as numbers change when a node is lost."""
    places = [tuple(p) for p in mesh.nodes.tolist()]
    found: set[Any] = {("type", mesh.only.type), *(("node", p) for p in places)}
    found |= {("element", tuple(places[n] for n in e)) for e in mesh.only.elements.tolist()}
    found |= {("set", name, places[n]) for name, members in mesh.node_sets.items() for n in members}
    for name, members in mesh.element_sets.items():
        found |= {("set", name, tuple(places[n] for n in mesh.only.elements[e])) for e in members}
    return frozenset(found)


def model_facts(model: FEModel) -> Facts:
    """Entries of the matrices, nodes, rows, named nodes, nodes of the interfaces."""
    made = {i.node for i in model.interface_nodes if i.coupling != "node"}  # they follow from the faces
    found: set[Any] = {("node", k, *p) for k, p in enumerate(model.nodes.tolist()) if k not in made}
    found |= {("row", k, *rows) for k, rows in enumerate(model.dof_map.tolist())}
    found |= {("cell", *cell) for cells in (model.lines, model.triangles) for cell in cells.tolist()}
    for name, matrix in (("mass", model.mass), ("stiffness", model.stiffness)):
        entries = sp.coo_array(matrix)
        found |= {(name, *e) for e in zip(*(c.tolist() for c in entries.coords), entries.data.tolist(), strict=True)}
    found |= {("name", *item) for item in model.node_names.items()}
    for interface in model.interface_nodes:
        found |= {("member", interface.name, n) for n in interface.coupled_nodes.tolist()}
    return frozenset(found)


# ---- exported matrices -----------------------------------------------------------------------------------------------


def built(folder: Path) -> FEModel:
    """The model of the folder's link, as it is reduced: checked."""
    model = build_model(load_link(folder / "link.toml"))
    check_model(model, model.source)
    return model


def description(table: dict[str, Any]) -> bytes:
    """A link description."""
    return "".join(f"{key} = {toml(value)}\n" for key, value in table.items()).encode()


def bar() -> Reduced:
    """Two kept nodes, two modes: a free elastic link, its matrices full, no entry like another."""
    with tempfile.TemporaryDirectory() as folder:
        parts = condensed(frame_model(Path(folder)), (0, 3, 6), 2)
    return replace(parts, mass=_without_rounding(parts.mass), stiffness=_without_rounding(parts.stiffness))


def _without_rounding(matrix: np.ndarray) -> np.ndarray:
    """Zero where only rounding is left, which each library leaves otherwise, and whose damage nobody can notice."""
    size = np.sqrt(np.abs(np.diag(matrix)))
    return np.where(np.abs(matrix) > 1e-12 * np.outer(size, size), matrix, 0.0)


def _link(kind: str, names: dict[str, str], labels: list[int], **matrices: Any) -> bytes:
    interfaces = [{"name": "hub", "node": str(labels[0])}, {"name": "hand", "node": str(labels[-1])}]
    table = {"format": kind, "files": names, **matrices}
    return description({"matrices": table, "interfaces": interfaces, "reduction": {"method": "none"}})


def _solid_exports() -> Iterator[Reader]:
    sound = files()
    nodes = [f"{k} {x!r} {y!r} {z!r}" for k, (x, y, z) in _labelled_nodes()]
    text = {
        "nodes.txt": ("\n".join(nodes) + "\n").encode(),
        "sets.txt": "".join(f"{n} {' '.join(map(str, m))}\n" for n, m in _labelled_sets()).encode(),
    }
    roles = {role: name for role, name in MARKET["matrices"]["files"].items() if role != "mesh"}
    roles |= {"nodes": "nodes.txt", "sets": "sets.txt"}
    flat = {**MARKET, "matrices": {**MARKET["matrices"], "files": roles}}
    countless = {"counts": False, "ends": False}
    for name, table, targets, options in (
        ("calculix: matrices, dofs", CALCULIX, ("k.sti", "k.mas", "k.dof"), {}),
        ("calculix: deck", CALCULIX, ("k.inp",), countless),
        ("calculix: results", FRD, ("k.frd",), {}),
        ("matrix market", MARKET, ("k.mtx", "m.mtx", "rows.csv"), {}),
        ("nodes, sets", flat, ("nodes.txt", "sets.txt"), countless),
        ("npz", NPZ, ("k.npz", "m.npz"), {"binary": True, "exact": True}),
    ):
        used = {*table["matrices"]["files"].values()}
        held = {n: c for n, c in {**sound, **frd_files(), **text}.items() if n in used}
        yield Reader(name, {**held, "link.toml": description(table)}, targets, built, model_facts, **options)
    packed = {n: gzip.compress(sound[n], mtime=0) for n in ("k.sti", "k.mas", "k.dof", "k.inp")}
    held = {**packed, "link.toml": description(CALCULIX)}
    yield Reader("calculix, gzip", held, tuple(packed), built, model_facts, binary=True, exact=True)


def _labelled_nodes() -> Iterator[tuple[int, list[float]]]:
    mesh = box("hex8", (3, 1, 1), (0.3, 0.02, 0.03))
    return ((10 * (k + 1), p) for k, p in enumerate(mesh.nodes.tolist()))


def _labelled_sets() -> Iterator[tuple[str, list[int]]]:
    mesh = box("hex8", (3, 1, 1), (0.3, 0.02, 0.03))
    return ((name.upper(), [10 * (n + 1) for n in mesh.node_sets[name]]) for name in ("x0", "x1"))


def _reduced_exports() -> Iterator[Reader]:
    parts = bar()
    whole = Reduced(parts.mass[:18, :18], parts.stiffness[:18, :18], parts.positions)
    places = {str(n): p for n, p in zip(parts.labels, parts.positions.tolist(), strict=True)}
    nodes = deck(parts).encode()
    entries = {
        "k.mtx": matrix_input(whole.stiffness, whole.rows).encode(),
        "m.mtx": matrix_input(whole.mass, whole.rows).encode(),
        "k.inp": nodes,
    }
    names = {"stiffness": "k.mtx", "mass": "m.mtx", "mesh": "k.inp"}
    link = _link("abaqus", names, parts.labels)
    held = {**entries, "link.toml": link}
    yield Reader("abaqus: matrices", held, ("k.mtx", "m.mtx"), built, model_facts, counts=False)
    yield Reader("abaqus: deck", held, ("k.inp",), built, model_facts, counts=False, ends=False)
    held = {"k.mtx": substructure(parts).encode(), "k.inp": nodes}
    link = _link("abaqus", {"stiffness": "k.mtx", "mesh": "k.inp"}, parts.labels, options={"modal_nodes": [900_000]})
    yield Reader("abaqus: substructure", {**held, "link.toml": link}, ("k.mtx",), built, model_facts)
    link = _link("nastran-dmig", {"stiffness": "k.pch"}, parts.labels)
    held = {"k.pch": punch(parts).encode(), "link.toml": link}
    yield Reader("nastran: dmig", held, ("k.pch",), built, model_facts, counts=False)
    op4 = importlib.import_module("pyyeti.nastran.op4")
    link = _link("nastran-op4", {"stiffness": "k.op4"}, parts.labels, options={
        "boundary": parts.labels, "positions": places})  # fmt: skip
    for kind, binary in (("binary", True), ("text", False)):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "k.op4"
            op4.write(path, {"kaax": parts.stiffness, "maax": parts.mass}, binary=binary, digits=16)
            held = {"k.op4": path.read_bytes(), "link.toml": link}
        yield Reader(f"nastran: op4, {kind}", held, ("k.op4",), built, model_facts, binary=binary)


# ---- meshes ----------------------------------------------------------------------------------------------------------


def gmsh_text(mesh: SolidMesh, ends: list[np.ndarray]) -> bytes:
    """MSH 4.1 as gmsh writes it: a volume "body" of the elements, surfaces "x0" and "x1" of one quadrangle each."""
    count, low, high = len(mesh.nodes), "0 0 0", "2 1 1"
    lines = ["$MeshFormat", "4.1 0 8", "$EndMeshFormat", "$PhysicalNames", "3", '2 2 "x0"', '2 3 "x1"', '3 1 "body"']
    lines += ["$EndPhysicalNames", "$Entities", "0 0 2 1", f"1 {low} {high} 1 2 0", f"2 {low} {high} 1 3 0"]
    lines += [f"1 {low} {high} 1 1 2 1 2", "$EndEntities", "$Nodes", f"1 {count} 1 {count}", f"3 1 0 {count}"]
    lines += [*(str(k + 1) for k in range(count)), *(" ".join(map(repr, p)) for p in mesh.nodes.tolist())]
    lines += ["$EndNodes", "$Elements", f"3 {2 + len(mesh.only.elements)} 1 {2 + len(mesh.only.elements)}"]
    for k, quad in enumerate(ends, start=1):
        lines += [f"2 {k} 3 1", f"{k} " + " ".join(str(n + 1) for n in quad.ravel())]
    lines.append(f"3 1 5 {len(mesh.only.elements)}")
    lines += [f"{k} " + " ".join(str(n + 1) for n in e) for k, e in enumerate(mesh.only.elements.tolist(), start=3)]
    return "\n".join([*lines, "$EndElements", ""]).encode()


def _meshes() -> Iterator[Reader]:
    mesh = box("hex8", (2, 1, 1))
    ends = [mesh.only.elements[:1, [0, 3, 7, 4]], mesh.only.elements[1:, [1, 2, 6, 5]]]
    part = meshio.Mesh(
        mesh.nodes,
        [("hexahedron", mesh.only.elements), ("quad", np.concatenate(ends))],
        cell_data={"part": [np.array([1, 1]), np.array([2, 3])]},
    )
    shells = meshio.Mesh(mesh.nodes, part.cells, cell_data={"nastran:ref": part.cell_data["part"]})
    sets = meshio.Mesh(mesh.nodes, part.cells[:1], point_sets={k: mesh.node_sets[k] for k in ("x0", "x1")})
    sound = {".msh": gmsh_text(mesh, ends)}
    for suffix, data in ((".inp", sets), (".bdf", shells), (".vtu", part), (".vtk", part)):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f"box{suffix}"
            meshio.write(path, data)
            sound[suffix] = path.read_bytes()
    tags = {key: [np.array([1, 1])] for key in ("gmsh:physical", "gmsh:geometrical")}
    hexes = meshio.Mesh(mesh.nodes, part.cells[:1], cell_data=tags)
    for suffix, form, binary in (("-2.msh", "gmsh22", False), ("-binary.msh", "gmsh", True)):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f"box{suffix}"
            meshio.write(path, hexes, form, binary=binary)
            sound[suffix] = path.read_bytes()
    sound[".unv"], sound[".cdb"] = universal(mesh).encode(), archive(mesh).encode()
    with tempfile.TemporaryDirectory() as folder:
        exodus(Path(folder) / "box.e", mesh)
        sound[".e"] = (Path(folder) / "box.e").read_bytes()
    sound[".inp.gz"] = gzip.compress(sound[".inp"], mtime=0)
    options: dict[str, Any] = {
        ".inp": {"counts": False, "ends": False},
        ".bdf": {"counts": False, "ends": False},
        ".vtu": {"counts": False},
        ".vtk": {"binary": True},
        "-binary.msh": {"binary": True},
        ".unv": {"counts": False, "ends": False},
        ".cdb": {"counts": False, "ends": False},
        ".e": {"binary": True},
        ".inp.gz": {"binary": True, "exact": True},
    }
    for suffix, data in sound.items():
        name = f"box{suffix}"
        more = {"told": _lost, **options.get(suffix, {})}
        yield Reader(f"mesh {suffix}", {name: data}, (name,), _mesh_of(name), mesh_facts, **more)


ASSEMBLED = """*PART, NAME=Bar
*NODE
{nodes}
20, 3., .5, .5
21, 4., .5, 1.
*ELEMENT, TYPE=C3D8, ELSET=All
{elements}
*ELEMENT, TYPE=B31, ELSET=Beam
20, 20, 21
*NSET, NSET=End
{end}
*NSET, NSET=Root
{root}
*SURFACE, NAME=Up
1, S2
2, S2
*SURFACE, NAME=Low
1, S1
2, S1
*SOLID SECTION, ELSET=All, MATERIAL=Wood, ORIENTATION=Along
*BEAM SECTION, ELSET=Beam, MATERIAL=Alu, SECTION=RECT, OFFSET1=0.1
.01, .02
0., 1., .2
*ORIENTATION, NAME=Along
1., 2., 0., 0., 1., 0.
3, 20.
*RIGID BODY, NSET=End, REF NODE=20
*NONSTRUCTURAL MASS, ELSET=All, UNITS=TOTAL MASS
2.5
*END PART
*ASSEMBLY, NAME=All
*INSTANCE, NAME=One, PART=Bar
*END INSTANCE
*INSTANCE, NAME=Two, PART=Bar
0., 0., 1.
*END INSTANCE
*NSET, NSET=Corners
One.1, Two.2
*TIE, NAME=T
Two.Low, One.Up
*MPC
BEAM, Two.21, One.21
*EQUATION
4
One.5, 1, 1., One.6, 1, -1., Two.5, 1, -1., Two.6, 1, 1.
*END ASSEMBLY
*MATERIAL, NAME=Wood
*ELASTIC, TYPE=ENGINEERING CONSTANTS
1.4e11, 1e10, 8e9, .3, .25, .4, 5e9, 4e9
3e9,
*DENSITY
1600.,
*MATERIAL, NAME=Alu
*ELASTIC
7e10, .33
*DENSITY
2700.,
"""
CARDS = """CORD1R,4,7,17,27
GRID,900,,3.,.5,.5,4
GRID,901,4,1.,.3,.2
RBE2,910,900,123456,{end}
CBAR,911,3,900,901,0.,1.,.2,GGG
,,5,.1,.2,.3
PBARL,3,1,,BOX
,.02,.03,.002,.001,.1
CBEAM,912,5,900,901,7
PBEAM,5,1,2.-4,6.-9,1.-9,,4.-9
,YES,1.,2.-4
,
,.8,.8
CBUSH,913,6,900,901,7,,,4
,.25
PBUSH,6,K,10.,20.,30.,40.,50.,60.
CELAS1,914,7,900,1,901,1
PELAS,7,100.
RBAR,915,901,7,123456
MPC,3,17,1,1.,27,1,-1.
,,37,1,-1.,47,1,1.
MAT11,8,1.4+11,1.+10,8.+9,.3,.25,.4,5.+9
,4.+9,3.+9,1600.
CONM2,916,901,4,1.5,.1,.2,.3
,.01,,.02,,,.025"""


def _decks() -> Iterator[Reader]:
    """Parts, beams, constraints, materials; bars, springs, systems."""
    mesh = box("hex8", (2, 1, 1), (2.0, 1.0, 1.0))
    end = (mesh.node_sets["x1"] + 1).tolist()
    nodes = "\n".join(f"{k}, " + ", ".join(map(repr, p)) for k, p in enumerate(mesh.nodes.tolist(), start=1))
    rows = (", ".join(map(str, [k, *(e + 1)])) for k, e in enumerate(mesh.only.elements, start=1))
    sides = {name: ", ".join(str(n + 1) for n in mesh.node_sets[own]) for name, own in (("root", "x0"), ("end", "x1"))}
    text = ASSEMBLED.format(nodes=nodes, elements="\n".join(rows), **sides)
    options: dict[str, Any] = {"counts": False, "ends": False, "told": _lost}
    yield Reader("assembly", {"all.inp": text.encode()}, ("all.inp",), _mesh_of("all.inp"), mesh_facts, **options)
    cards = CARDS.format(end=",".join(str(10 * n - 3) for n in end))
    text = bulk(mesh, *cards.splitlines())
    yield Reader("bars", {"all.bdf": text.encode()}, ("all.bdf",), _mesh_of("all.bdf"), mesh_facts, **options)


def _lost(mesh: SolidMesh) -> Facts:
    return frozenset(mesh.lost_sets)


def _mesh_of(name: str) -> Callable[[Path], SolidMesh]:
    return lambda folder: read_mesh(folder / name)


# ---- descriptions, modal files ---------------------------------------------------------------------------------------


FRAME_TOML = b"""name = "arm"
[materials.m]
youngs_modulus = 7e10
poissons_ratio = 0.33
density = 2700.0
[sections.s]
shape = "rectangular"
width = 0.01
height = 0.02
[frame]
theory = "timoshenko"
rotary_inertia = true
[frame.nodes]
root = [0.0, 0.0, 0.0]
tip = [0.5, 0.0, 0.0]
[[frame.members]]
from = "root"
to = "tip"
elements = 3
material = "m"
section = "s"
local_z = [0.0, 0.0, 1.0]
[[masses]]
node = "tip"
mass = 0.1
inertia = [1e-5, 1e-5, 2e-5]
[[interfaces]]
name = "hub"
node = "root"
[[interfaces]]
name = "hand"
node = "tip"
[reduction]
method = "craig-bampton"
fixed_interface_modes = 2
elastic_modes = 4
[damping]
ratio = 0.01
"""


def _description(folder: Path) -> LinkDescription:
    link = load_link(folder / "link.toml")
    build_model(link)
    return link.description


def _modal_files() -> Iterator[Reader]:
    """Sealed, damaged and edited; and without a seal, in the newest and the oldest format, where only checks help."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "m.h5"
        write_modal_file(path, synthetic_model(1))
        sound = {"sealed": path.read_bytes()}
        for version in ("v108", "earliest"):
            with h5py.File(path, "w", libver=(version, "v108")) as file:
                write_modal_group(file, synthetic_model(1))
            sound[version] = path.read_bytes()
    exact: dict[str, Any] = {"binary": True, "exact": True}
    yield Reader("modal file", {"m.h5": sound["sealed"]}, ("m.h5",), _modal, content, **exact)
    yield Reader("modal file, edited", {"m.h5": sound["sealed"]}, ("m.h5",), _modal, content, damage=edited, **exact)
    for version in ("v108", "earliest"):
        held = {"m.h5": sound[version]}
        name = f"modal file, {version}, no seal"
        yield Reader(name, held, ("m.h5",), _modal, content, binary=True, judge=_valid)
        yield Reader(f"{name}, edited", held, ("m.h5",), _modal, content, judge=_valid, damage=edited)


def _modal(folder: Path) -> ModalModel:
    return read_modal_file(folder / "m.h5")


def _valid(_: bytes, model: ModalModel) -> bool:
    validate(model, "again")
    return True


def _descriptions() -> Iterator[Reader]:
    yield Reader("link.toml", {"link.toml": FRAME_TOML}, ("link.toml",), _description, content, judge=taken)


GROUPS: dict[str, Callable[[], Iterator[Reader]]] = {
    "full matrices": _solid_exports,
    "reduced matrices": _reduced_exports,
    "meshes": _meshes,
    "decks": _decks,
    "descriptions": _descriptions,
    "modal files": _modal_files,
}
