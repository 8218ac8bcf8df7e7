"""The file of what a reduced link leaves out: it stands beside the modal file in a cache."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np

from fe_import.errors import Cause, FEImportError
from fe_import.files.hdf5.files import Reader, open_for_reading, write_array, write_atomically, write_attribute
from fe_import.modal.inertia import InertiaInvariants
from fe_import.modal.left_out import LeftOut
from fe_import.modal.model import ModalModel

SCHEMA = "erls fields left out"
SCHEMA_VERSION = 2


def write_left_out_file(path: Path, left: LeftOut) -> None:
    """Write it, completely or not at all.

    Raises
    ------
    FEImportError
        NOT_WRITABLE.
    """
    write_atomically(path, lambda group: _write(group, left), FEImportError, Cause.NOT_WRITABLE)


def _write(group: h5py.Group, left: LeftOut) -> None:
    write_attribute(group, "schema", SCHEMA)
    write_attribute(group, "schema_version", SCHEMA_VERSION)
    inertia, both = left.invariants, "SI, per unit of both coordinates"
    for name, values, unit, meaning in (
        ("stiffness", left.stiffness, "1/s^2", "squared frequencies of the fields by themselves"),
        ("translation", left.translation_shapes, "m", "displacements; node, axis, field"),
        ("rotation", left.rotation_shapes, "rad", "rotations; rotation node, axis, field"),
        ("thermal", left.thermal, "modal force per K", "generalized force of thermal expansion; field"),
        ("inertia/m", inertia.m, both, "mass matrix of modes and fields"),
        ("inertia/X", inertia.X, both, "U' M A_a U; axis a"),
        ("inertia/Z", inertia.Z, both, "U' A_a' M A_b U; axis a, axis b"),
        ("inertia/rigid", inertia.rigid, "SI", "coordinates of unit translations and rotations"),
        ("refined", int(left.refined), "1", "whether the fields hold what the mesh leaves out"),
    ):
        write_array(group, name, values, unit, meaning)


def read_left_out_file(path: Path, model: ModalModel) -> LeftOut:
    """Read what a modal model leaves out.

    Raises
    ------
    FEImportError
        FILE_NOT_FOUND, NOT_READABLE, MODAL_FILE: damaged, or of another model.
    """
    with open_for_reading(path, FEImportError, Cause.MODAL_FILE) as file:
        return _read(file, model)


def _read(file: Reader, model: ModalModel) -> LeftOut:
    stiffness = file.array("stiffness", (None,))
    count = len(stiffness)
    size = model.modes + count
    return LeftOut(
        stiffness=stiffness,
        translation_shapes=file.array("translation", (len(model.nodes), 3, count)),
        rotation_shapes=file.array("rotation", (len(model.rotation_nodes), 3, count)),
        thermal=file.array("thermal", (count,)),
        invariants=InertiaInvariants(
            m=file.array("inertia/m", (size, size)),
            X=file.array("inertia/X", (3, size, size)),
            Z=file.array("inertia/Z", (3, 3, size, size)),
            rigid=file.array("inertia/rigid", (size, 6)),
        ),
        refined=bool(np.asarray(file.integers("refined", (), 0, 2))),
    )
