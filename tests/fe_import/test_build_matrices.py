"""Links of matrices: nodes with rotations, frames, modal rows, units; against the models the matrices were made of."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from exported_files import MARKET, Fault, check_fault, link_matrices, market, raw, written
from link_files import FRAME, frame_link, merged, solid_link, write_toml

from fe_import.description.link import LinkFile, load_link
from fe_import.errors import Cause, FEImportError
from fe_import.exports.dofs import COMPONENTS
from fe_import.exports.row_files import node_frames
from fe_import.model import FEModel
from fe_import.models.model import build_model
from fe_import.reduce import reduce_link

ROOT = Path(__file__).parents[2]
KEPT = {"reduction": {"fixed_interface_modes": 8}}
ROWS = {"stiffness": "k.mtx", "mass": "m.mtx", "dofs": "rows.txt", "nodes": "nodes.txt"}


def row_names(dof_map: np.ndarray, rows: np.ndarray) -> list[str]:
    """What the dofs file says of some rows, nodes numbered 1, 2, ..."""
    names = {row: f"{node + 1} {COMPONENTS[c]}" for (node, c), row in np.ndenumerate(dof_map) if row >= 0}
    return [names.get(int(row), "modal") for row in rows]


def exported(
    folder: Path,
    mass: Any,
    stiffness: Any,
    rows: list[str],
    nodes: np.ndarray,
    angles: np.ndarray | None = None,
    **changes: Any,
) -> LinkFile:
    """A link of matrices, its interfaces on nodes 1 and, by name, the last one of the nodes."""
    for name, matrix in (("m.mtx", mass), ("k.mtx", stiffness)):
        (folder / name).write_bytes(market(sp.csc_array(matrix), "general"))
    (folder / "rows.txt").write_text("\n".join(rows) + "\n", encoding="utf-8")
    table = nodes if angles is None else np.hstack([nodes, angles])
    lines = [f"{k} " + " ".join(map(repr, line)).removesuffix(" 0.0") for k, line in enumerate(table.tolist(), start=1)]
    (folder / "nodes.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")
    base = {
        "matrices": {"format": "matrix-market", "files": ROWS, "nodes": {"elbow": FRAME["frame"]["nodes"]["elbow"]}},
        "interfaces": [{"name": "hub", "node": "1"}, {"name": "hand", "node": "3"}],
        **KEPT,
    }
    return load_link(write_toml(folder / "link.toml", merged(base, changes)))


def of_frame(folder: Path, model: FEModel, angles: np.ndarray | None = None, **changes: Any) -> LinkFile:
    """A frame's matrices, as a program exports them whose nodes have frames of their own."""
    turn = np.eye(len(model.independent))
    if angles is not None:
        for node, axes in enumerate(node_frames(angles)):
            for rows in (model.dof_map[node, :3], model.dof_map[node, 3:]):
                turn[np.ix_(rows, rows)] = axes
    rows = row_names(model.dof_map, model.independent)
    matrices = [turn.T @ m.toarray() @ turn for m in (model.mass, model.stiffness)]
    return exported(folder, *[(m + m.T) / 2 for m in matrices], rows, model.nodes, angles, **changes)


@pytest.mark.parametrize("turned", [False, True])
def test_a_frame_comes_back(tmp_path: Path, turned: bool) -> None:
    """Nodes with rotations, in frames of their own: the frame's frequencies to 1e-8 and its elbow by position."""
    own = frame_link(tmp_path, **KEPT)
    model = build_model(own)
    expected = reduce_link(own)
    angles = np.random.default_rng(3).uniform(-180, 180, (len(model.nodes), 3)) if turned else None
    link = of_frame(tmp_path, model, angles)
    again = build_model(link)
    assert abs(again.stiffness - model.stiffness).max() < 1e-13 * abs(model.stiffness).max()
    assert abs(again.mass - model.mass).max() < 1e-13 * abs(model.mass).max()
    assert again.coupling is None
    modal = reduce_link(link)
    np.testing.assert_allclose(modal.frequencies_hz[6:], expected.frequencies_hz[6:], rtol=1e-8)
    assert modal.node_names == {"elbow": model.node_names["elbow"]}
    assert [i.coupling for i in modal.interface_nodes] == ["node", "node"]


def test_masses_on_nodes(tmp_path: Path) -> None:
    """A mass with inertia on an interface and on a named node, as on the frame."""
    masses = [{"node": "hand", "mass": 0.3, "inertia": [1e-4, 2e-4, 1e-4]}, {"node": "elbow", "mass": 0.2}]
    own = frame_link(tmp_path, masses=masses, **KEPT)
    model = build_model(frame_link(tmp_path, **KEPT))
    expected = reduce_link(own)
    modal = reduce_link(of_frame(tmp_path, model, masses=masses))
    np.testing.assert_allclose(modal.frequencies_hz[6:], expected.frequencies_hz[6:], rtol=1e-8)
    assert modal.mass_properties.mass == pytest.approx(expected.mass_properties.mass, rel=1e-12)


def test_units(tmp_path: Path) -> None:
    """Matrices in mm, t and s (N, N mm) give the link of SI, point masses in the same units included."""
    masses = [{"node": "hand", "mass": 0.3, "inertia": [1e-4, 2e-4, 1e-4]}]
    model = build_model(frame_link(tmp_path, **KEPT))
    expected = reduce_link(frame_link(tmp_path, masses=masses, **KEPT))
    scale = np.ones(len(model.independent))
    scale[model.dof_map[:, 3:].ravel()] = 1e3  # mm per rad
    both = np.outer(scale, scale)
    rows = row_names(model.dof_map, model.independent)
    matrices = model.mass.toarray() * both * 1e-3, model.stiffness.toarray() * both * 1e-3
    changes = {
        "units": {"length": "mm", "mass": "t"},
        "masses": [{"node": "hand", "mass": 0.3e-3, "inertia": [1e-1, 2e-1, 1e-1]}],
        "matrices": {"nodes": {"elbow": [500.0, 100.0, 50.0]}},
    }
    modal = reduce_link(exported(tmp_path, *matrices, rows, model.nodes * 1e3, **changes))
    np.testing.assert_allclose(modal.frequencies_hz[6:], expected.frequencies_hz[6:], rtol=1e-8)
    np.testing.assert_allclose(modal.nodes, expected.nodes, rtol=1e-12)
    assert modal.mass_properties.mass == pytest.approx(expected.mass_properties.mass, rel=1e-12)


@pytest.mark.parametrize("length", ["m", "mm"])
def test_superelements_have_modal_rows(tmp_path: Path, length: str) -> None:
    """A frame reduced by Craig-Bampton elsewhere: importing its rows again changes no frequency (1e-8), in any unit
    and with modal coordinates of any scale."""
    physical = reduce_link(frame_link(tmp_path, reduction={"fixed_interface_modes": 8, "form": "physical"}))
    expected = reduce_link(frame_link(tmp_path, **KEPT))
    unit = {"m": 1.0, "mm": 1e3}[length]
    dof_map = np.arange(12).reshape(2, 6)
    scale = np.r_[np.tile([1 / unit] * 3 + [1.0] * 3, 2), np.full(8, 7.0)]
    both = np.outer(scale, scale) * unit**2
    nodes = np.stack([i.position for i in physical.interface_nodes]) * unit
    rows = row_names(dof_map, np.arange(20))
    assert rows[-8:] == ["modal"] * 8
    changes = {
        "units": {"length": length},
        "matrices": {"nodes": {"elbow": nodes[0].tolist()}},
        "interfaces": [{"name": "hub", "node": "1"}, {"name": "hand", "node": "2"}],
        "reduction": {"fixed_interface_modes": 8},
    }
    matrices = physical.invariants.m * both, physical.stiffness * both
    modal = reduce_link(exported(tmp_path, *[(m + m.T) / 2 for m in matrices], rows, nodes, **changes))
    np.testing.assert_allclose(modal.frequencies_hz[6:], expected.frequencies_hz[6:], rtol=1e-8)
    assert modal.mass_properties.mass == pytest.approx(expected.mass_properties.mass, rel=1e-10)


def test_solids_with_reference_nodes(tmp_path: Path) -> None:
    """A solid whose faces follow nodes with rotations: these carry the interfaces, nodes without rows are dropped."""
    own = solid_link(tmp_path, **KEPT)
    model = build_model(own)
    mass, stiffness = model.reduced_matrices()
    rows = row_names(model.dof_map, model.independent)
    count = len(model.nodes)
    changes = {
        "interfaces": [{"name": "hub", "node": str(count - 1)}, {"name": "hand", "node": str(count)}],
        "matrices": {"nodes": {"elbow": [0.1, 0.0, 0.0]}},
    }
    link = exported(tmp_path, mass.toarray(), stiffness.toarray(), rows, model.nodes, **changes)
    again = build_model(link)
    assert len(again.nodes) == count - 16
    np.testing.assert_allclose(again.interface_nodes[1].position, [0.3, 0.01, 0.015])
    expected = reduce_link(own)
    np.testing.assert_allclose(reduce_link(link).frequencies_hz[6:], expected.frequencies_hz[6:], rtol=1e-8)


def test_averaged_faces(tmp_path: Path) -> None:
    """The interface node of an averaged face, named in any case, is in its middle and passes rigid motion on exactly."""
    averaged = [{"name": n, "face": f, "coupling": "averaged"} for n, f in (("hub", "x0"), ("hand", "X1"))]
    model = build_model(written(tmp_path, {**MARKET, "interfaces": averaged}))
    assert [i.coupling for i in model.interface_nodes] == ["averaged", "averaged"]
    np.testing.assert_allclose(model.interface_nodes[0].weights.sum(), 1.0, rtol=1e-14)
    np.testing.assert_allclose(model.interface_nodes[0].position, [0.0, 0.01, 0.015], atol=1e-15)
    rigid = model.rigid_body_modes()
    assert abs(rigid - model.coupling @ rigid[model.independent]).max() < 1e-12


def test_a_substructure_of_calculix_is_refused(tmp_path: Path) -> None:
    """It is the block of the kept dofs, which resists every motion; the message says so and what to export."""
    folder = ROOT.parent / "shared" / "fe_exports"
    matrix, mesh = folder / "l_hex20_sub.mtx.gz", folder / "l_hex20_mesh.inp.gz"
    if not matrix.is_file():
        pytest.skip("needs the CalculiX substructure, which is not part of the repository")
    roles = {"stiffness": str(matrix), "mass": str(matrix), "mesh": str(mesh)}
    base = {"matrices": {"format": "abaqus", "files": roles}, "interfaces": [{"name": "a", "face": "IFA"}]}
    path = write_toml(tmp_path / "link.toml", base)
    with pytest.raises(FEImportError, match="CalculiX") as caught:
        reduce_link(path)
    assert caught.value.cause is Cause.GROUNDED
    assert "SOLVER=MATRIXSTORAGE" in caught.value.remedy


BAD, REFERENCE, INTERFACE = Cause.BAD_FIELD, Cause.BAD_REFERENCE, Cause.INTERFACE
HUB = MARKET["interfaces"][0]


def kept_block() -> dict[str, bytes]:
    """The rows of both faces out of the larger matrices."""
    mesh, mass, stiffness = link_matrices()
    nodes = np.concatenate([mesh.node_sets["x0"], mesh.node_sets["x1"]])
    rows = (3 * nodes[:, None] + np.arange(3)).ravel()
    names = "".join(f"{10 * (n + 1)} {c}\n" for n in nodes for c in ("ux", "uy", "uz"))
    return {
        "k.mtx": market(stiffness[rows][:, rows]),
        "m.mtx": market(mass[rows][:, rows]),
        "rows.csv": names.encode(),
    }


def fault(name: str, changes: Any, cause: Cause, words: str, spoiled: Any = dict) -> Fault:
    return Fault(name, MARKET, spoiled, changes, cause, words)


def files_of(**roles: Any) -> dict[str, Any]:
    return {"matrices": {"files": roles}}


FAULTS = [
    fault("unknown format", {"matrices": {"format": "calculics"}}, REFERENCE, "did you mean 'calculix'?"),
    fault("unknown role", files_of(stifness="k.mtx"), REFERENCE, "did you mean 'stiffness'?"),
    Fault("a role too few", {**MARKET, "matrices": {"format": "npz", "files": {"mass": "m.npz"}}}, dict, {}, BAD,
          "needs the file 'stiffness'"),
    fault("no such file", files_of(mass="mm.mtx"), Cause.FILE_NOT_FOUND, "matrices.files.mass"),
    fault("a folder", files_of(mass="."), Cause.FILE_NOT_FOUND, "matrices.files.mass"),
    fault("unknown option", {"matrices": {"options": {"triangle": "upper"}}}, Cause.UNKNOWN_FIELD, "'triangle'"),
    fault("node and face", {"interfaces": [{**HUB, "node": "10"}]}, INTERFACE, "exactly one of"),
    fault("neither", {"interfaces": [{"name": "hub"}]}, INTERFACE, "exactly one of"),
    fault("unknown set", {"interfaces": [HUB, {"name": "b", "face": "X2"}]}, REFERENCE, "interfaces[1].face"),
    fault("no rotations", {"interfaces": [{"name": "a", "node": "10"}]}, INTERFACE, "has no rotations"),
    fault("unknown number", {"interfaces": [{"name": "a", "node": "11"}]}, REFERENCE, "numbers 10 ... 160"),
    fault("unknown name", {"interfaces": [{"name": "a", "node": "tip"}]}, REFERENCE, "unknown name 'tip'"),
    fault("position of a node", {"interfaces": [{"name": "a", "node": "10", "position": [0.0] * 3}]}, INTERFACE,
          "no position"),
    fault("named number", {"matrices": {"nodes": {"p": 11}}}, REFERENCE, "matrices.nodes.p: no node of this number"),
    fault("named position", {"matrices": {"nodes": {"p": [9.0, 0.0, 0.0]}}}, REFERENCE, "near this position"),
    fault("a material", {"materials": {"m": {"youngs_modulus": 7e10, "poissons_ratio": 0.3, "density": 2700.0}}}, BAD,
          "hold stiffness and mass already"),
    fault("named not a number", {"matrices": {"nodes": {"p": [float("nan"), 0.0, 0.0]}}}, BAD, "finite"),
    fault("orphan in a set", {}, INTERFACE, "1 nodes of this set have no rows",
          raw("k.inp", lambda c: c.replace(b"*NODE, NSET=Nall", b"*NODE, NSET=X0\n999,1,1,1\n*NODE"))),
    fault("empty set", {"interfaces": [{"name": "a", "face": "NONE"}]}, INTERFACE, "this set has no nodes",
          raw("k.inp", lambda c: c + b"*NSET, NSET=NONE\n")),
    fault("two nodes", {"interfaces": [{"name": "a", "face": "TWO"}]}, INTERFACE, "too few nodes",
          raw("k.inp", lambda c: c + b"*NSET, NSET=TWO\n10, 20\n")),
    fault("named orphan", {"matrices": {"nodes": {"p": 999}}}, REFERENCE, "this node has no rows",
          raw("k.inp", lambda c: c.replace(b"*NODE, NSET=Nall", b"*NODE\n999,1,1,1\n*NODE"))),
    fault("the kept block", {}, Cause.GROUNDED, "the block of the kept dofs", kept_block),
    fault("mass by direction", {}, Cause.EXPORT, "the mass of the link differs by direction",
          lambda: {"m.mtx": market(sp.csc_array(link_matrices()[1] @ sp.diags_array([1.0, 1.0, 0.0] * 16)))}),
    fault("a negative mass", {}, Cause.NOT_DEFINITE, "negative", lambda: {"m.mtx": market(-link_matrices()[1])}),
    fault("a mass of negative motions", {}, Cause.NOT_DEFINITE, "motions of negative kinetic energy",
          lambda: {"m.mtx": market(twisted())}),
]  # fmt: skip


def twisted() -> sp.csc_array:
    """A mass matrix with a positive diagonal that gives relative motion of two nodes negative energy."""
    mass = link_matrices()[1].tolil()
    pull = 2 * mass[0, 0]
    for c in range(3):
        a, b = c, 6 + c
        mass[a, b] += pull
        mass[b, a] += pull
        mass[a, a] += 0.1 * pull
        mass[b, b] += 0.1 * pull
    return mass.tocsc()


@pytest.mark.parametrize("fault", FAULTS, ids=lambda f: f.name)
def test_faulty_descriptions_are_named(tmp_path: Path, fault: Fault) -> None:
    check_fault(fault, tmp_path)
