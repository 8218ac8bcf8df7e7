"""The modal file: round trip, reproducible bytes, and that no faulty file or model passes."""

from __future__ import annotations

import copy
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from modal_models import same, synthetic_model

from fe_import.errors import Cause, FEImportError
from fe_import.files.hdf5.files import open_for_reading, write_atomically
from fe_import.modal.check import validate
from fe_import.modal.file import read_modal_file, read_modal_group, write_modal_file, write_modal_group
from fe_import.modal.model import ModalModel

MODEL = synthetic_model()


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A good modal file."""
    path = tmp_path / "link.modal.h5"
    write_modal_file(path, MODEL)
    return path


def physical_model() -> ModalModel:
    """The synthetic model in another, not orthonormal basis."""
    mix = np.random.default_rng(1).normal(size=(MODEL.modes, MODEL.modes))
    i = MODEL.invariants
    inertia = replace(
        i, m=mix.T @ i.m @ mix, X=mix.T @ i.X @ mix, Z=mix.T @ i.Z @ mix, rigid=np.linalg.solve(mix, i.rigid)
    )
    return replace(
        MODEL,
        form="physical",
        invariants=replace(inertia, m=(inertia.m + inertia.m.T) / 2),
        stiffness=mix.T @ MODEL.stiffness @ mix,
        translation_shapes=MODEL.translation_shapes @ mix,
        rotation_shapes=MODEL.rotation_shapes @ mix,
    )


def rigid_link() -> ModalModel:
    """Without elastic modes, mass, interfaces, names, pictures or provenance."""
    model = synthetic_model(0)
    i = model.invariants
    return replace(
        model,
        invariants=replace(i, m=0 * i.m, X=0 * i.X, Z=0 * i.Z),
        full_mass_properties=replace(model.full_mass_properties, mass=0.0, inertia=np.zeros((3, 3))),
        interface_nodes=(),
        node_names={},
        health=(),
        lines=np.zeros((0, 2), dtype=np.int64),
        triangles=np.zeros((0, 3), dtype=np.int64),
        provenance={},
        name="",
    )


@pytest.mark.parametrize("model", [MODEL, synthetic_model(0), physical_model(), rigid_link()])
def test_round_trip(tmp_path: Path, model: ModalModel) -> None:
    before = copy.deepcopy(model)
    write_modal_file(tmp_path / "a.h5", model)
    assert same(model, before)
    again = read_modal_file(str(tmp_path / "a.h5"))
    assert same(again, model)
    write_modal_file(tmp_path / "b.h5", again)
    assert (tmp_path / "a.h5").read_bytes() == (tmp_path / "b.h5").read_bytes()


def test_reading_again(path: Path) -> None:
    """What was read before neither shares memory with what is read again, nor hides that the file has changed."""
    first, second = read_modal_file(path), read_modal_file(path)
    assert same(first, second)
    second.frequencies_hz[7] = 1.0
    second.provenance["by"] = "hand"
    assert same(read_modal_file(path), first)
    content, status = path.read_bytes(), path.stat()
    write_modal_file(path, rigid_link())
    os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))
    assert same(read_modal_file(path), rigid_link())
    place = content.index(MODEL.frequencies_hz.tobytes())
    path.write_bytes(content[:place] + bytes([content[place] ^ 1]) + content[place + 1 :])
    os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))
    with pytest.raises(FEImportError) as caught:
        read_modal_file(path)
    assert caught.value.cause is Cause.MODAL_FILE
    path.unlink()
    with pytest.raises(FEImportError) as caught:
        read_modal_file(path)
    assert caught.value.cause is Cause.FILE_NOT_FOUND


def test_every_dataset_says_unit_and_meaning(path: Path) -> None:
    described = []

    def look(name: str, item: h5py.HLObject) -> None:
        if isinstance(item, h5py.Dataset):
            described.append(name)
            assert item.attrs["description"]
            assert "unit" in item.attrs

    with h5py.File(path) as file:
        file.visititems(look)
        assert file.attrs["units"] == b"SI"
    assert {"nodes", "inertia/Z", "interfaces/0002/weights", "full_model/inertia", "kinds"} <= set(described)


def test_inside_another_file(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"

    def write(file: h5py.Group) -> None:
        write_modal_group(file.create_group("links/one"), MODEL)
        write_modal_group(file.create_group("links/two"), MODEL)
        file["links/two/frequencies_hz"][7] = 1.0

    write_atomically(path, write, FEImportError, Cause.NOT_WRITABLE)
    with open_for_reading(path, FEImportError, Cause.MODAL_FILE) as file:
        assert same(read_modal_group(file.group["links/one"], str(path)), MODEL)
        with pytest.raises(FEImportError) as caught:
            read_modal_group(file.group["links/two"], str(path))
    assert caught.value.where == f"{path}: /links/two/frequencies_hz"


def test_interrupted_write_keeps_the_old_file(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = path.read_bytes()

    def interrupted(group: h5py.Group, model: ModalModel) -> None:
        write_modal_group(group, model)
        raise KeyboardInterrupt

    monkeypatch.setattr("fe_import.modal.file.write_modal_group", interrupted)
    with pytest.raises(KeyboardInterrupt):
        write_modal_file(path, synthetic_model(seed=1))
    assert path.read_bytes() == before
    assert os.listdir(path.parent) == [path.name]


def put(name: str, values: Any, **options: Any) -> Callable[[h5py.File], None]:
    """Replace a dataset."""

    def change(file: h5py.File) -> None:
        del file[name]
        file.create_dataset(name, data=values, **options)

    return change


def entry(name: str, index: Any, value: Any) -> Callable[[h5py.File], None]:
    """Change one value of a dataset."""

    def change(file: h5py.File) -> None:
        values = np.array(file[name])
        values[index] = value
        file[name][...] = values

    return change


def remove(name: str) -> Callable[[h5py.File], None]:
    """Delete an item."""
    return lambda file: file.__delitem__(name)


def attribute(name: str, value: Any) -> Callable[[h5py.File], None]:
    """Set a root attribute."""
    return lambda file: file.attrs.__setitem__(name, value)


def link(name: str, target: Any) -> Callable[[h5py.File], None]:
    """Put a link in the place of a dataset."""

    def change(file: h5py.File) -> None:
        del file[name]
        file[name] = target

    return change


def virtual(file: h5py.File) -> None:
    layout = h5py.VirtualLayout(shape=(5, 3), dtype="f8")
    layout[...] = h5py.VirtualSource("elsewhere.h5", "nodes", shape=(5, 3))
    del file["nodes"]
    file.create_virtual_dataset("nodes", layout)


def external(file: h5py.File) -> None:
    del file["nodes"]
    file.create_dataset("nodes", shape=(5, 3), dtype="f8", external=[("elsewhere.bin", 0, 120)])


def huge(file: h5py.File) -> None:
    del file["nodes"]
    file.create_dataset("nodes", shape=(10**8, 3), dtype="f8", chunks=(100, 3), compression="gzip")[:5] = 0


def indefinite() -> np.ndarray:
    mass = np.eye(MODEL.modes)
    mass[6:8, 6:8] = [[1, 2], [2, 1]]
    return mass


TEXT = h5py.string_dtype()
BAD_Z = MODEL.invariants.Z.copy()
BAD_Z[0, 1, 2, 3] += 1e-3 * np.abs(BAD_Z).max()
BENT = MODEL.translation_shapes.copy()
BENT[3, 1] *= 1.001
KINDS = np.array([k.encode() for k in MODEL.kinds])

FAULTS: list[tuple[str, Callable[[h5py.File], None], str, str]] = [
    ("schema", attribute("schema", "other"), "@schema", "not what a modal file has"),
    ("version", attribute("schema_version", np.int64(1)), "@schema_version", "unknown version"),
    ("version text", attribute("schema_version", "1"), "@schema_version", "type int"),
    ("no version", lambda f: f.attrs.__delitem__("schema_version"), "@schema_version", "missing"),
    ("units", attribute("units", "mm"), "@units", "not what"),
    ("form", attribute("form", "other"), "@form", "unknown form"),
    ("no nodes", remove("nodes"), "nodes", "missing"),
    ("no group", remove("inertia"), "inertia/X|inertia/m|reduced/mass", "missing"),
    ("no kinds", remove("kinds"), "kinds", "missing"),
    ("no interfaces", remove("interfaces"), "interfaces", "missing"),
    ("interface gap", remove("interfaces/0001"), "interfaces/0001", "missing"),
    ("rank", put("nodes", np.zeros(15)), "nodes", "shape"),
    ("single", put("nodes", np.zeros((5, 3), "f4")), "nodes", "type"),
    ("integers", put("nodes", np.zeros((5, 3), "i8")), "nodes", "type"),
    ("modes", put("frequencies_hz", np.zeros(8)), "mode_shapes/translation", "shape"),
    ("few modes", put("frequencies_hz", np.zeros(5)), "", "shape"),
    ("NaN", entry("mode_shapes/translation", (3, 1, 7), np.nan), "mode_shapes/translation", r"\[3, 1, 7\]"),
    ("inf", entry("inertia/Z", (2, 1, 0, 5), np.inf), "inertia/Z", r"\[2, 1, 0, 5\] is not finite"),
    ("asymmetric mass", entry("reduced/mass", (7, 8), 0.1), "reduced/mass", "not symmetric, at .7, 8."),
    ("indefinite mass", put("reduced/mass", indefinite()), "reduced/mass", "semidefinite"),
    ("not orthonormal", put("reduced/mass", 1.001 * np.eye(9)), "reduced/mass|inertia/X", "orthonormal|fit"),
    ("asymmetric stiffness", entry("reduced/stiffness", (7, 6), 9e5), "reduced/stiffness", "not symmetric"),
    ("negative stiffness", entry("reduced/stiffness", (8, 8), -9e5), "reduced/stiffness", "semidefinite"),
    ("grounded", entry("reduced/stiffness", (2, 2), 99.0), "reduced/stiffness", "resists a rigid"),
    ("other stiffness", entry("reduced/stiffness", (8, 8), 9e5), "reduced/stiffness", "diag"),
    ("frequencies", entry("frequencies_hz", 7, 5.0), "frequencies_hz", "must rise, at .7."),
    ("negative frequency", entry("frequencies_hz", 0, -1.0), "frequencies_hz", "negative"),
    ("kinds", put("kinds", KINDS[::-1].astype("S10")), "kinds", "first 6"),
    ("kinds count", put("kinds", KINDS[:5].astype("S10")), "kinds", "shape"),
    ("damping", entry("damping_ratios", 6, -0.01), "damping_ratios", "negative"),
    ("Z", put("inertia/Z", BAD_Z), "inertia/Z", r"Z\[0, 1\] is not Z\[1, 0\]'"),
    ("X", put("inertia/X", MODEL.invariants.X[[1, 0, 2]]), "inertia/X", r"X\[0\] does not fit"),
    ("Z scaled", put("inertia/Z", 2 * MODEL.invariants.Z), "inertia/Z", r"Z\[0, 0\] does not fit X"),
    ("rigid", put("inertia/rigid", MODEL.invariants.rigid[:, [1, 0, 2, 3, 4, 5]]), "inertia/X", "fit"),
    ("bent", put("mode_shapes/translation", BENT), "mode_shapes/translation", "rigidly"),
    ("turned", entry("mode_shapes/rotation", (0, 0, 3), 9.0), "mode_shapes/rotation", "rigidly"),
    ("moved node", entry("nodes", (3, 0), 1.5), "mode_shapes/translation", "rigidly"),
    ("rotation nodes", entry("mode_shapes/rotation_nodes", 1, 4), "mode_shapes/rotation_nodes", "must rise"),
    ("rotation node", entry("mode_shapes/rotation_nodes", 2, 5), "mode_shapes/rotation_nodes", "too large"),
    ("interface node", entry("interfaces/0001/node", (), 5), "interfaces/0001/node", "too large"),
    ("interface node below", entry("interfaces/0002/node", (), -1), "interfaces/0002/node", "too small"),
    ("without rotation", entry("interfaces/0001/node", (), 1), "interfaces/0001/node", "rotations"),
    ("misplaced", entry("interfaces/0001/position", 0, 9.0), "interfaces/0001/position", "position"),
    ("name twice", put("interfaces/0002/name", "hub", dtype=TEXT), "interfaces/0002/name", "twice"),
    ("name empty", put("interfaces/0002/name", "", dtype=TEXT), "interfaces/0002/name", "empty"),
    ("coupling", put("interfaces/0001/coupling", "glue", dtype=TEXT), "interfaces/0001/coupling", "unknown"),
    ("coupled", entry("interfaces/0002/coupled_nodes", 1, 99), "interfaces/0002/coupled_nodes", r"\[1\]"),
    ("weights", put("interfaces/0002/weights", [-0.5, 1.5]), "interfaces/0002/weights", "positive, at .0."),
    ("weight sum", put("interfaces/0002/weights", [0.5, 0.6]), "interfaces/0002/weights", "sum to 1"),
    ("node name", put("node_names/names", ["tip", "tip"], dtype=TEXT), "node_names/names", "twice"),
    ("named node", entry("node_names/nodes", 0, 5), "node_names/nodes", "too large"),
    ("line", entry("pictures/lines", (1, 1), 5), "pictures/lines", r"\[1, 1\] is too large"),
    ("triangle", entry("pictures/triangles", (0, 0), -1), "pictures/triangles", "too small"),
    ("mass", put("full_model/mass", -1.0), "full_model/mass", "negative"),
    ("inertia", put("full_model/inertia", -np.eye(3)), "full_model/inertia", "semidefinite"),
    ("effective", put("fixed_interface/effective_mass", np.zeros((3, 6))), "fixed_interface/eff", "shape"),
    ("health", put("health/values", np.zeros(1)), "health/values", "shape"),
    ("soft link", link("nodes", h5py.SoftLink("/mode_shapes")), "nodes", "links are refused"),
    ("external link", link("nodes", h5py.ExternalLink("b.h5", "/x")), "nodes", "links are refused"),
    ("external storage", external, "nodes", "external storage"),
    ("virtual", virtual, "nodes", "virtual"),
    ("object type", put("kinds", np.array([b"ab"], dtype="V2")), "kinds", "type refused"),
    ("huge", huge, "nodes", "far more data|more data than"),
    ("provenance", lambda f: f["provenance"].attrs.__setitem__("n", 3), "provenance/@n", "type str"),
]


@pytest.mark.parametrize(("change", "item", "message"), [f[1:] for f in FAULTS], ids=[f[0] for f in FAULTS])
def test_faulty_file(path: Path, change: Callable[[h5py.File], None], item: str, message: str) -> None:
    with h5py.File(path, "r+") as file:
        change(file)
    with pytest.raises(FEImportError, match=message) as caught:
        read_modal_file(path)
    assert caught.value.cause == Cause.MODAL_FILE
    assert any(caught.value.where.startswith(f"{path}: /{i}") for i in item.split("|"))
    assert caught.value.remedy
    assert caught.value.exit_code == 2


@pytest.mark.parametrize(
    ("content", "cause"),
    [(None, "FILE_NOT_FOUND"), (b"", "NOT_READABLE"), (b"nodes\n" * 99, "NOT_READABLE")],
    ids=["missing", "empty", "text"],
)
def test_not_a_modal_file(tmp_path: Path, content: bytes | None, cause: str) -> None:
    path = tmp_path / "a.h5"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(FEImportError) as caught:
        read_modal_file(path)
    assert caught.value.cause == Cause[cause]
    assert str(path) in str(caught.value)


FAULTY_MODELS: list[tuple[str, dict[str, Any]]] = [
    ("@form", {"form": "free"}),
    ("kinds", {"kinds": MODEL.kinds[:-1]}),
    ("kinds", {"kinds": (*MODEL.kinds[:-1], "")}),
    ("nodes", {"nodes": MODEL.nodes[:, :2]}),
    ("nodes", {"nodes": np.zeros((0, 3))}),
    ("frequencies_hz", {"frequencies_hz": np.zeros(5)}),
    ("mode_shapes/rotation_nodes", {"rotation_nodes": np.array([0.0, 2.0, 4.0])}),
    ("mode_shapes/rotation_nodes", {"rotation_nodes": np.array([4, 2, 0])}),
    ("pictures/lines", {"lines": np.array([[0, 5]])}),
    ("node_names/nodes", {"node_names": {"a": -1}}),
    ("node_names/names", {"node_names": {"": 0}}),
    ("provenance", {"provenance": {"a\0b": "c"}}),
    ("provenance", {"provenance": {"": "c"}}),
    ("provenance", {"provenance": {"a": "\ud800"}}),
    ("@name", {"name": "\ud800"}),
    ("interfaces/0002/name", {"interface_nodes": MODEL.interface_nodes[:1] * 2}),
    ("damping_ratios", {"damping_ratios": np.full(9, np.nan)}),
    ("health/values", {"health": (replace(MODEL.health[0], value=float("nan")),)}),
]


@pytest.mark.parametrize(("item", "change"), FAULTY_MODELS)
def test_faulty_model_is_not_written(tmp_path: Path, item: str, change: dict[str, Any]) -> None:
    model = replace(MODEL, **change)
    with pytest.raises(FEImportError) as caught:
        write_modal_file(tmp_path / "a.h5", model)
    assert caught.value.cause == Cause.MODAL_FILE
    assert caught.value.where == f"{tmp_path / 'a.h5'}: /{item}"
    assert os.listdir(tmp_path) == []
    with pytest.raises(FEImportError):
        validate(model, "model")
