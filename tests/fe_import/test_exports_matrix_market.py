"""Matrix Market and NPZ: every spelling gives the same matrices, and faulty files are named."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io
import scipy.sparse as sp
from exported_files import (
    MARKET,
    NPZ,
    Fault,
    Files,
    Table,
    check_fault,
    files,
    link_matrices,
    market,
    npz,
    raw,
    relined,
    swapped,
    written,
)

from fe_import.errors import Cause
from fe_import.exports.row_files import node_frames
from fe_import.models.model import build_model

BAD, UNREADABLE = Cause.EXPORT, Cause.NOT_READABLE


def stiffness() -> sp.csc_array:
    return link_matrices()[2]


def shuffled(content: bytes) -> bytes:
    """Entries in another order, some on the other side of the diagonal."""
    head, *lines = content.decode().splitlines()
    size, *entries = [line for line in lines if not line.startswith("%")]
    order = np.random.default_rng(1).permutation(len(entries))
    mixed = [entries[k].split() for k in order]
    turned = [" ".join((j, i, v) if k % 3 else (i, j, v)) for k, (i, j, v) in enumerate(mixed)]
    return "\n".join([head, "% comment", "%", size, *turned, ""]).encode()


def array_file(symmetry: str) -> bytes:
    buffer = io.BytesIO()
    scipy.io.mmwrite(buffer, stiffness().toarray(), symmetry=symmetry, precision=15)
    return buffer.getvalue()


def mapping(content: bytes) -> bytes:
    """The rows as Ansys' mapping file, in another order."""
    rows = [line.split(",") for line in content.decode().splitlines()[2:]]
    lines = [f"{k:10d} {node:>10s} {c.strip().upper():>6s}" for k, (node, c) in enumerate(rows, start=1)]
    return "\n".join(["   Matrix Eqn.   Node   DOF", *reversed(lines), ""]).encode()


def without_deck(**roles: str) -> Table:
    """Other files in place of the deck."""
    kept = {role: name for role, name in MARKET["matrices"]["files"].items() if role != "mesh"}
    return {**MARKET, "matrices": {**MARKET["matrices"], "files": {**kept, **roles}}}


def nodes_file() -> bytes:
    points = link_matrices()[0].nodes
    return "".join(f"{10 * (k + 1)};{p[0]!r};{p[1]!r};{p[2]!r}\n" for k, p in enumerate(points.tolist())).encode()


def sets_file() -> bytes:
    sets = link_matrices()[0].node_sets
    return "".join(f"{name.upper()} {10 * (n + 1)}\n" for name in ("x0", "x1") for n in sets[name]).encode()


SPELLINGS: list[tuple[str, Table, Callable[[], Files]]] = [
    ("as SciPy writes it", MARKET, dict),
    ("any order, both sides", MARKET, raw("k.mtx", shuffled)),
    ("general", MARKET, lambda: {"k.mtx": market(stiffness(), "general")}),
    ("array", MARKET, lambda: {"k.mtx": array_file("general")}),
    ("symmetric array", MARKET, lambda: {"k.mtx": array_file("symmetric")}),
    ("Fortran's D, capitals", MARKET, raw("k.mtx", lambda c: c.upper().replace(b"E", b"D").replace(
        b"%%MATRIXMARKDT MATRIX COORDINATD RDAL SYMMDTRIC", b"%%MatrixMarket MATRIX Coordinate REAL symmetric"))),
    ("numbered components", MARKET, raw("rows.csv", lambda c: c.replace(b"ux", b"1").replace(b"uz", b"3"))),
    ("Ansys' mapping", MARKET, raw("rows.csv", mapping)),
    ("csc", NPZ, dict),
    ("csr", NPZ, lambda: {"k.npz": npz(stiffness().tocsr())}),
    ("coo", NPZ, lambda: {"k.npz": npz(stiffness().tocoo())}),
    ("matrix, not array", NPZ, lambda: {"k.npz": npz(sp.csc_matrix(stiffness()))}),
]  # fmt: skip


@pytest.mark.parametrize(("base", "spoiled"), [s[1:] for s in SPELLINGS], ids=[s[0] for s in SPELLINGS])
def test_spellings_of_the_same_matrices(tmp_path: Path, base: Table, spoiled: Callable[[], Files]) -> None:
    """The matrices they were written from, to the 15 digits of the text."""
    _, mass, k = link_matrices()
    model = build_model(written(tmp_path, base, spoiled()))
    count = mass.shape[0]
    for found, true in ((model.mass, mass), (model.stiffness, k)):
        assert abs(found[:count, :count] - true).max() <= 1e-14 * abs(true).max()


def test_nodes_and_sets_without_a_deck(tmp_path: Path) -> None:
    """The same faces; their middle is the mean of the nodes, because there are no triangles."""
    spoiled = {"nodes.csv": nodes_file(), "sets.txt": sets_file()}
    base = without_deck(nodes="nodes.csv", sets="sets.txt")
    model = build_model(written(tmp_path, base, spoiled))
    deck = build_model(written(tmp_path, MARKET))
    np.testing.assert_array_equal(model.nodes[:-2], deck.nodes[:-2])
    np.testing.assert_allclose(model.nodes[-2:], [[0.0, 0.01, 0.015], [0.3, 0.01, 0.015]], atol=1e-15)
    assert abs(model.stiffness - deck.stiffness).max() == 0
    assert not len(model.triangles)


def test_frames_of_ansys() -> None:
    """Angles turn about z, then the new x, then the new y axis (MAPDL, LOCAL); 90 degrees each, by hand."""
    x, y, z = np.eye(3)
    quarters = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0], [1, 0, 1], [0, 0, 0]])
    found = node_frames(90.0 * quarters)
    axes = [(y, -x, z), (x, z, -y), (-z, y, x), (y, z, x), (-z, -x, y), (x, y, z)]
    np.testing.assert_allclose(found, [np.stack(a, axis=1) for a in axes], atol=1e-15)


def entry(name: str, change: Callable[[Any], Any]) -> Callable[[], Files]:
    """One array of the NPZ file changed."""

    def spoil() -> Files:
        with np.load(io.BytesIO(files()["k.npz"])) as arrays:
            data = dict(arrays)
        buffer = io.BytesIO()
        np.savez_compressed(buffer, **{**data, name: change(data[name])})
        return {"k.npz": buffer.getvalue()}

    return spoil


def rewritten(name: str, content: bytes) -> Callable[[], Files]:
    """One entry of the NPZ file with raw content."""

    def spoil() -> Files:
        source, buffer = zipfile.ZipFile(io.BytesIO(files()["k.npz"])), io.BytesIO()
        with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as target:
            for info in source.infolist():
                target.writestr(info.filename, content if info.filename == name else source.read(info))
        return {"k.npz": buffer.getvalue()}

    return spoil


def declared(shape: str) -> bytes:
    """An array's header that promises more than there is."""
    header = f"{{'descr': '<f8', 'fortran_order': False, 'shape': ({shape},), }}".ljust(117) + "\n"
    return b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header.encode() + b"\0" * 80


def first(lines: list[str]) -> int:
    """Where the line of sizes stands."""
    return next(k for k, line in enumerate(lines) if not line.startswith("%"))


def sizes(text: str) -> Callable[[], Files]:
    return relined("k.mtx", lambda lines: [*lines[: first(lines)], text, *lines[first(lines) + 1 :]])


def grown(number: int) -> Callable[[], Files]:
    """As many entries declared as ``number`` more than there are."""

    def change(lines: list[str]) -> list[str]:
        rows, columns, count = lines[first(lines)].split()
        return [*lines[: first(lines)], f"{rows} {columns} {int(count) + number}", *lines[first(lines) + 1 :]]

    return relined("k.mtx", change)


def fault(name: str, spoiled: Callable[[], Files], cause: Cause, words: str, **matrices: Any) -> Fault:
    base = NPZ if "k.npz" in spoiled() else MARKET
    return Fault(name, base, spoiled, {"matrices": matrices}, cause, words)


def unlike() -> sp.csc_array:
    skew = stiffness().tolil()
    skew[3, 0] *= 1.001
    return skew.tocsc()


GIANT = "900000000000 900000000000 9000000000000"
FAULTS = [
    fault("one triangle where two are declared", lambda: {"k.mtx": market(sp.triu(stiffness()), "general")}, BAD,
          "one triangle"),
    fault("two triangles where one is declared", lambda: {"k.mtx": market(stiffness(), "general").replace(
        b"general", b"symmetric")}, BAD, "needs each pair once"),
    fault("not symmetric", lambda: {"k.mtx": market(unlike(), "general")}, Cause.NOT_DEFINITE, "is not symmetric"),
    fault("a giant header", sizes(GIANT), BAD, "limit 48 rows of dofs"),
    fault("many entries declared", grown(10**12), BAD, "the file ends early"),
    fault("one entry too few", grown(1), BAD, "the file ends early"),
    fault("one entry too many", grown(-1), BAD, "more entries than declared"),
    fault("oblong", sizes("48 47 3"), BAD, "48 x 47"),
    fault("sizes of words", sizes("a b c"), BAD, "expected 3 whole numbers"),
    fault("sizes below zero", sizes("-48 -48 3"), BAD, "expected 3 whole numbers"),
    fault("complex", swapped("k.mtx", "real", "complex"), BAD, "'complex', limit real"),
    fault("pattern", swapped("k.mtx", "real", "pattern"), BAD, "cannot be mass or stiffness"),
    fault("skew", swapped("k.mtx", "symmetric", "skew-symmetric"), BAD, "'skew-symmetric'"),
    fault("Hermitian", swapped("k.mtx", "symmetric", "hermitian"), BAD, "'hermitian'"),
    fault("a vector", swapped("k.mtx", "matrix", "vector"), BAD, "'vector'"),
    fault("no header", swapped("k.mtx", "%%MatrixMarket", "%%Matrix"), BAD, "expected '%%MatrixMarket"),
    fault("empty", raw("k.mtx", b""), BAD, "expected '%%MatrixMarket"),
    fault("only a header", raw("k.mtx", b"%%MatrixMarket matrix coordinate real general\n"), BAD, "3 whole numbers"),
    fault("dofs of another model", relined("rows.csv", lambda lines: lines[:-1]), BAD, "limit 47 rows"),
    fault("a temperature", swapped("rows.csv", "uz", "temp"), BAD, "components: ux, uy, uz"),
    fault("a component twice", swapped("rows.csv", "uy", "ux"), BAD, "node 10 ux"),
    fault("an unknown node", swapped("rows.csv", "10, uz", "15, uz"), BAD, "the mesh does not have; got 15"),
    fault("a node without its uz", relined("rows.csv", lambda lines: [
        "modal" if line == "10, uz" else line for line in lines]), Cause.GROUNDED, "1 nodes lack some"),
    fault("half of the rotations", relined("rows.csv", lambda lines: [
        line.replace("160, u", "10, r") if line != "160, ux" else "modal" for line in lines]), BAD,
          "all three rotations"),
    fault("no rows at all", raw("rows.csv", b"# nothing\n"), BAD, "no rows"),
    fault("modal rows only", raw("rows.csv", b"modal\n" * 48), BAD, "no node has three displacements"),
    fault("a mapping with a gap", raw("rows.csv", lambda c: mapping(c).replace(b"        48 ", b"        49 ")), BAD,
          "row numbers must be 1, 2"),
    fault("two kinds of rows", raw("rows.csv", lambda c: c + b"49 10 ux\n"), BAD, "expected a node and a component"),
    fault("nodes and mesh", lambda: {"nodes.csv": nodes_file()}, Cause.BAD_FIELD, "exactly one of the files",
          files={"nodes": "nodes.csv"}),
    fault("a mesh without numbers", lambda: {"k.msh": b"$MeshFormat"}, BAD, "must be an input deck",
          files={"mesh": "k.msh"}),
    fault("a set without nodes", lambda: {"sets.txt": b"A 10 20\nB\n"}, BAD, "belong into one line",
          files={"sets": "sets.txt"}),
    fault("a set of no node", lambda: {"sets.txt": b"A 10 20 21\n"}, BAD, "names what is no node",
          files={"sets": "sets.txt"}),
    fault("npz: pickled", entry("data", lambda a: np.array([None, "x"], dtype=object)), BAD, "holds objects"),
    fault("npz: complex", entry("data", lambda a: a * 1j), BAD, "finite real numbers"),
    fault("npz: not a number", entry("data", lambda a: a * np.nan), BAD, "finite real numbers"),
    fault("npz: absurd", entry("data", lambda a: a * 1e100), BAD, "absurd"),
    fault("npz: blocks", lambda: {"k.npz": npz(sp.bsr_array(stiffness()))}, BAD, "save matrix.tocsc()"),
    fault("npz: another size", lambda: {"k.npz": npz(sp.eye_array(3, format="csc"))}, BAD, "does not fit the dofs"),
    fault("npz: rows outside", entry("indices", lambda a: a + 1), BAD, "outside of the matrix"),
    fault("npz: rows below zero", entry("indices", lambda a: a - 1), BAD, "outside of the matrix"),
    fault("npz: a row twice", entry("indices", lambda a: a.clip(max=a[1])), BAD, "stands at"),
    fault("npz: fractions", entry("indices", lambda a: a + 0.5), BAD, "must hold whole numbers"),
    fault("npz: pointer falls", entry("indptr", lambda a: a[::-1].copy()), BAD, "faulty index pointer"),
    fault("npz: pointer too short", entry("indptr", lambda a: a[:-1]), BAD, "faulty index pointer"),
    fault("npz: fewer values", entry("data", lambda a: a[:-1]), BAD, "faulty index pointer"),
    fault("npz: promises more", rewritten("data.npy", declared("900000000000")), BAD, "not as long"),
    fault("npz: promises the impossible", rewritten("data.npy", declared("-2, -5")), UNREADABLE, "cannot be read"),
    fault("npz: a bomb", rewritten("data.npy", declared("8000000") + b"\0" * 64_000_000), BAD, "far more than"),
    fault("npz: no array", rewritten("data.npy", b"nothing"), UNREADABLE, "cannot be read as a sparse matrix"),
    fault("npz: cut off", raw("k.npz", lambda c: c[:-30]), UNREADABLE, "cannot be read as a sparse matrix"),
    fault("npz: text", raw("k.npz", b"1 1 1.0\n"), UNREADABLE, "save_npz"),
]  # fmt: skip


@pytest.mark.parametrize("fault", FAULTS, ids=lambda f: f.name)
def test_faulty_exports_are_named(tmp_path: Path, fault: Fault) -> None:
    check_fault(fault, tmp_path)


NODE_FAULTS = [
    ("a node twice", b"10 0 0 0\n10 1 0 0\n", "stands in line 1"),
    ("eight numbers", b"10 0 0 0 0 0 0 0\n", "three coordinates"),
    ("an empty field", b"10,,0,0\n", "three coordinates"),
    ("a coordinate of words", b"10 0 0 x\n", "three coordinates"),
    ("not finite", b"10 0 0 inf\n", "three coordinates"),
    ("no number", b"10 0 0 0\nx 0 0 0\n", "three coordinates"),
    ("none", b"node x y z\n", "no nodes"),
    ("a first line that looks like a header", b"x10 0 0 0\n20 1 0 0\n", "three coordinates"),
    ("beyond the moon", files()["k.inp"].split(b"*ELEMENT")[0].split(b"Nall\n")[1] + b"999, 1e200\n", "absurdly far"),
]


@pytest.mark.parametrize("fault", NODE_FAULTS, ids=[n[0] for n in NODE_FAULTS])
def test_faulty_nodes_are_named(tmp_path: Path, fault: tuple[str, bytes, str]) -> None:
    name, content, words = fault
    check_fault(Fault(name, without_deck(nodes="nodes.csv"), lambda: {"nodes.csv": content}, {}, BAD, words), tmp_path)
