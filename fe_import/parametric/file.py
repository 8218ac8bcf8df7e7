"""The file of a family of links: flat HDF5, with the modal model in the middle of its ranges inside."""

from __future__ import annotations

from pathlib import Path

import h5py
import msgspec
import numpy as np

from fe_import.description.check import check_link
from fe_import.description.link import LinkFile
from fe_import.description.records import LinkDescription
from fe_import.errors import Cause, FEImportError
from fe_import.files.hdf5.files import (
    Reader,
    open_for_reading,
    write_array,
    write_atomically,
    write_attribute,
    write_strings,
)
from fe_import.modal.check import validate
from fe_import.modal.file import read_modal_group, write_modal_group
from fe_import.model import Array
from fe_import.parametric.interpolation import MOST_DEGREE, Interpolant
from fe_import.parametric.model import Bound, ParametricModel
from fe_import.parametric.samples import Z_PAIRS

SCHEMA = "erls parametric model"
SCHEMA_VERSION = 1


def write_parametric_file(path: Path | str, family: ParametricModel) -> None:
    """Write a family, completely or not at all; equal families give equal bytes.

    Raises
    ------
    FEImportError
        MODAL_FILE: the member in the middle is not consistent; NOT_WRITABLE.
    """
    validate(family.middle, str(path))
    write_atomically(path, lambda group: _write(group, family), FEImportError, Cause.NOT_WRITABLE)


def _write(group: h5py.Group, family: ParametricModel) -> None:
    write_attribute(group, "schema", SCHEMA)
    write_attribute(group, "schema_version", SCHEMA_VERSION)
    description = msgspec.json.encode(family.link.description, order="deterministic").decode()
    write_strings(group, "description", description, "the link description, as JSON")
    write_strings(group, "source", family.link.path.name, "its file")
    grid, bound = family.grid, family.bound
    for name, values, unit, meaning in (
        ("grid/degrees", grid.degrees, "1", "of each term along each parameter"),
        ("grid/mixing", grid.mixing, "1", "what each term has of each part"),
        ("shapes/translation", family.translation_shapes, "m", "elastic fields of the basis; node, axis, field"),
        ("shapes/rotation", family.rotation_shapes, "rad", "their rotations; rotation node, axis, field"),
        ("shapes/moving", family.moving, "1", "rows of displacements, then rotations, that change; from 0"),
        ("bound/frequencies", bound.frequencies, "1", "largest relative error, inboard interface held"),
        ("bound/flexibility", bound.flexibility, "1", "largest relative error, inboard interface held"),
        ("bound/places", bound.places, "1", "at which errors were looked for, besides the corners"),
    ):
        write_array(group, name, values, unit, meaning)
    for name, part in grid.parts.items():
        write_array(group, f"grid/parts/{name}", part, "SI", f"parts of {name}; part, then as in the basis")
    write_modal_group(group.create_group("middle"), family.middle)


def read_parametric_file(path: Path | str) -> ParametricModel:
    """Read and check a family.

    Raises
    ------
    FEImportError
        FILE_NOT_FOUND; NOT_READABLE: not an HDF5 file; MODAL_FILE: anything wrong inside.
    """
    with open_for_reading(path, FEImportError, Cause.MODAL_FILE) as file:
        return _read(file, Path(path))


def _read(file: Reader, path: Path) -> ParametricModel:
    if (schema := file.attribute("schema", str)) != SCHEMA:
        raise file.fail("@schema", "not what the file of a family has", schema, SCHEMA)
    if (version := file.attribute("schema_version", int)) != SCHEMA_VERSION:
        raise file.fail("@schema_version", "unknown version of the file of a family", version, SCHEMA_VERSION)
    try:
        description = msgspec.json.decode(file.text("description"), type=LinkDescription)
        check_link(description, f"{path}: /description")
    except msgspec.MsgspecError as problem:
        raise file.fail("description", f"no link description: {problem}") from None
    count = len(description.parameters)
    if not count:
        raise file.fail("description", "a family needs parameters")
    middle = read_modal_group(file.group["middle"], str(path)) if "middle" in file.names_inside() else None
    if middle is None or middle.form != "orthonormal":
        raise file.fail("middle", "there is no modal model in orthonormal form")
    n, turning = len(middle.nodes), len(middle.rotation_nodes)
    translation = file.array("shapes/translation", (n, 3, None))
    k = translation.shape[2]
    moving = file.integers("shapes/moving", (None,), 0, 3 * (n + turning))
    grid, parts = file.subgroup("grid"), file.subgroup("grid").subgroup("parts")
    mixing = grid.array("mixing", (None, None))
    shapes: dict[str, tuple[int, ...]] = {
        "stiffness": (k, k),
        "mass": (6 + k, 6 + k),
        "X": (3, 6 + k, 6 + k),
        "Z": (len(Z_PAIRS), 6 + k, 6 + k),
        "nodes": (n, 3),
        "moving": (len(moving), k),
    }
    inside = parts.names_inside()
    arrays: dict[str, Array] = {
        name: parts.array(name, (mixing.shape[1], *shape))
        for name, shape in shapes.items()
        if name in inside or name in ("stiffness", "mass", "X", "Z")
    }
    bounds = np.array([[p.lower, p.upper] for p in description.parameters.values()]).T
    degrees = grid.integers("degrees", (len(mixing), count), 0, MOST_DEGREE + 1)
    numbers = [file.scalar(f"bound/{name}") for name in ("frequencies", "flexibility")]
    places = int(np.asarray(file.integers("bound/places", (), 0)))
    return ParametricModel(
        LinkFile(path.with_name(file.text("source")), description),
        middle,
        translation,
        file.array("shapes/rotation", (turning, 3, k)),
        moving,
        Interpolant(bounds[0], bounds[1], degrees, mixing, arrays),
        Bound(numbers[0], numbers[1], places),
    )
