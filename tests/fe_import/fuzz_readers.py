"""The readers of fe_import with small sound files, for `fuzzing`."""

from __future__ import annotations

import importlib
import tempfile
import tomllib
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import meshio
import msgspec
import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from exported_files import CALCULIX, MARKET, NPZ, files
from fuzzing import Facts, Reader
from link_files import FRAME, toml
from modal_models import synthetic_model
from solid_meshes import box
from superelements import Reduced, condensed, deck, frame_model, matrix_input, punch, substructure

from fe_import.build import build_model
from fe_import.link import LinkDescription, load_link
from fe_import.mesh import read_mesh
from fe_import.modal_file import read_modal_file, write_modal_file
from fe_import.model import FEModel
from fe_import.solid_mesh import SolidMesh


def leaves(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Every value of nested tables, records and arrays with its place."""
    if hasattr(value, "__dataclass_fields__"):
        value = {name: getattr(value, name) for name in value.__dataclass_fields__}
    elif isinstance(value, msgspec.Struct):
        value = msgspec.to_builtins(value)
    if isinstance(value, dict):
        for key, item in value.items():
            yield from leaves(item, (*path, key))
    elif isinstance(value, (list, tuple)):
        yield (*path, "length", len(value))
        for k, item in enumerate(value):
            yield from leaves(item, (*path, k))
    elif isinstance(value, np.ndarray):
        yield (*path, value.shape, value.dtype.str, value.tobytes())
    else:
        yield (*path, value)


def content(value: Any) -> Facts:
    """Facts of records."""
    return frozenset(leaves(value))


def mesh_facts(mesh: SolidMesh) -> Facts:
    """Nodes, elements and sets by position, as numbers change when a node is lost."""
    places = [tuple(p) for p in mesh.nodes.tolist()]
    found: set[Any] = {("type", mesh.element_type), *(("node", p) for p in places)}
    found |= {("element", tuple(places[n] for n in e)) for e in mesh.elements.tolist()}
    found |= {("node set", name, places[n]) for name, members in mesh.node_sets.items() for n in members}
    for name, members in mesh.element_sets.items():
        found |= {("element set", name, tuple(places[n] for n in mesh.elements[e])) for e in members}
    return frozenset(found | {("lost", name) for name in mesh.lost_sets})


def model_facts(model: FEModel) -> Facts:
    """Entries of the matrices, nodes, rows, named nodes, nodes of the interfaces."""
    found: set[Any] = {("node", k, *p) for k, p in enumerate(model.nodes.tolist())}
    found |= {("row", k, *rows) for k, rows in enumerate(model.dof_map.tolist())}
    for name, matrix in (("mass", model.mass), ("stiffness", model.stiffness)):
        entries = sp.coo_array(matrix)
        found |= {(name, *e) for e in zip(*(c.tolist() for c in entries.coords), entries.data.tolist(), strict=True)}
    found |= {("name", *item) for item in model.node_names.items()}
    for interface in model.interface_nodes:
        found |= {("member", interface.name, n) for n in interface.coupled_nodes.tolist()}
    return frozenset(found)


# ---- exported matrices -----------------------------------------------------------------------------------------------


def built(folder: Path) -> FEModel:
    """The model of the folder's link."""
    return build_model(load_link(folder / "link.toml"))


def description(table: dict[str, Any]) -> bytes:
    """A link description."""
    return "".join(f"{key} = {toml(value)}\n" for key, value in table.items()).encode()


def bar() -> Reduced:
    """Two kept nodes, two modes: a free elastic link, its matrices full, no entry like another."""
    with tempfile.TemporaryDirectory() as folder:
        return condensed(frame_model(Path(folder)), (0, 3, 6), 2)


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
    flat = {**MARKET, "matrices": {**MARKET["matrices"], "files": {
        "stiffness": "k.mtx", "mass": "m.mtx", "dofs": "rows.csv", "nodes": "nodes.txt", "sets": "sets.txt"}}}  # fmt: skip
    for name, table, targets, options in (
        ("calculix: matrices, dofs", CALCULIX, ("k.sti", "k.mas", "k.dof"), {}),
        ("calculix: deck", CALCULIX, ("k.inp",), {"counts": False}),
        ("matrix market", MARKET, ("k.mtx", "m.mtx", "rows.csv"), {}),
        ("nodes, sets", flat, ("nodes.txt", "sets.txt"), {"counts": False}),
        ("npz", NPZ, ("k.npz", "m.npz"), {"binary": True}),
    ):
        used = {*table["matrices"]["files"].values()}
        held = {n: c for n, c in {**sound, **text}.items() if n in used}
        yield Reader(name, {**held, "link.toml": description(table)}, targets, built, model_facts, **options)
    packed = {n: sound[n] for n in ("k.sti", "k.mas", "k.dof", "k.inp")}
    yield Reader(
        "calculix, gzip", packed, tuple(packed), _packed_calculix, model_facts, packed=True
    )


def _packed_calculix(folder: Path) -> FEModel:
    (folder / "link.toml").write_bytes(description(CALCULIX))
    return built(folder)


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
    yield Reader("abaqus: matrices", {**entries, "link.toml": link}, ("k.mtx", "m.mtx"), built, model_facts)
    yield Reader("abaqus: deck", {**entries, "link.toml": link}, ("k.inp",), built, model_facts, counts=False)
    held = {"k.mtx": substructure(parts).encode(), "k.inp": nodes}
    link = _link("abaqus", {"stiffness": "k.mtx", "mesh": "k.inp"}, parts.labels, options={"modal_nodes": [900_000]})
    yield Reader("abaqus: substructure", {**held, "link.toml": link}, ("k.mtx",), built, model_facts)
    link = _link("nastran-dmig", {"stiffness": "k.pch"}, parts.labels)
    held = {"k.pch": punch(parts).encode(), "link.toml": link}
    yield Reader("nastran: dmig", held, ("k.pch",), built, model_facts)
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
    lines += ["$EndNodes", "$Elements", f"3 {2 + len(mesh.elements)} 1 {2 + len(mesh.elements)}"]
    for k, quad in enumerate(ends, start=1):
        lines += [f"2 {k} 3 1", f"{k} " + " ".join(str(n + 1) for n in quad.ravel())]
    lines.append(f"3 1 5 {len(mesh.elements)}")
    lines += [f"{k} " + " ".join(str(n + 1) for n in e) for k, e in enumerate(mesh.elements.tolist(), start=3)]
    return "\n".join([*lines, "$EndElements", ""]).encode()


def _meshes() -> Iterator[Reader]:
    mesh = box("hex8", (2, 1, 1))
    ends = [mesh.elements[:1, [0, 3, 7, 4]], mesh.elements[1:, [1, 2, 6, 5]]]
    part = meshio.Mesh(
        mesh.nodes,
        [("hexahedron", mesh.elements), ("quad", np.concatenate(ends))],
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
    sound[".inp.gz"] = sound[".inp"]
    options = {
        ".inp": {"counts": False}, ".bdf": {"counts": False}, ".vtk": {"binary": True}, ".inp.gz": {"packed": True},
    }  # fmt: skip
    for suffix, data in sound.items():
        name = f"box{suffix}"
        yield Reader(
            f"mesh {suffix}", {name: data}, (name,), _mesh_of(name), mesh_facts, **options.get(suffix, {})
        )


def _mesh_of(name: str) -> Callable[[Path], SolidMesh]:
    return lambda folder: read_mesh(folder / name)


# ---- descriptions, modal files -----------------------------------------------------------------------------------------


def taken(text: bytes, record: Any) -> bool:
    """Whether every value of a TOML file is in the record as it stands."""

    def flat(value: Any, path: tuple[Any, ...] = ()) -> dict[tuple[Any, ...], Any]:
        if isinstance(value, dict):
            items: Any = value.items()
        elif isinstance(value, (list, tuple)):
            items = enumerate(value)
        else:
            return {path: value}
        return {k: v for key, item in items for k, v in flat(item, (*path, key)).items()}

    held = flat(msgspec.to_builtins(record))
    return all(held.get(path) == value for path, value in flat(tomllib.loads(text.decode())).items())


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
    return load_link(folder / "link.toml").description


def _judge_link(text: bytes, found: LinkDescription) -> bool:
    return taken(text, found)


@cache
def modal_bytes() -> bytes:
    """A modal file."""
    with tempfile.TemporaryDirectory() as folder:
        write_modal_file(Path(folder) / "m.h5", synthetic_model(1))
        return (Path(folder) / "m.h5").read_bytes()


@cache
def readers() -> tuple[Reader, ...]:
    """All of them."""
    return (
        *_solid_exports(),
        *_reduced_exports(),
        *_meshes(),
        Reader("link.toml", {"link.toml": FRAME_TOML}, ("link.toml",), _description, content, judge=_judge_link),
        Reader(
            "modal file", {"m.h5": modal_bytes()}, ("m.h5",), lambda f: read_modal_file(f / "m.h5"), content, binary=True
        ),
    )
