"""Thermal expansion inside a modal file: written, read, checked."""

from __future__ import annotations

import h5py
import numpy as np

from fe_import.files.hdf5.files import Reader, write_array
from fe_import.modal.identities import Check
from fe_import.modal.model import ModalModel
from fe_import.modal.thermal import ThermalExpansion


def write_thermal(group: h5py.Group, thermal: ThermalExpansion) -> None:
    """Fill the group ``thermal`` of a modal file."""
    forces = "N, N, N, N m, N m, N m per K"
    for name, values, unit, meaning in (
        ("change", thermal.change, "K", "temperature change from the stated shape without stress"),
        ("force", thermal.force, "modal force per K", "generalized force of thermal expansion; mode"),
        ("restrained", thermal.restrained, forces, "section forces of the link held in its shape; place, component"),
        ("relaxed", thermal.relaxed, forces, "static section forces of the free link; place, component"),
    ):
        write_array(group, name, values, unit, meaning)


def read_thermal(file: Reader, modes: int) -> ThermalExpansion:
    """Read the group ``thermal`` of a modal file.

    Raises
    ------
    FEImportError
        MODAL_FILE.
    """
    return ThermalExpansion(
        change=file.scalar("change"),
        force=file.array("force", (modes,)),
        restrained=file.array("restrained", (None, 6)),
        relaxed=file.array("relaxed", (None, 6)),
    )


def check_thermal(model: ModalModel, thermal: ThermalExpansion, check: Check) -> None:
    """Refuse a thermal expansion that does not fit its link."""
    check(model.form == "orthonormal", "thermal", "only the orthonormal form carries it", model.form)
    places = 0 if model.recovery is None else len(model.recovery.nodes)
    for name, values, shape in (
        ("change", thermal.change, ()),
        ("force", thermal.force, (model.modes,)),
        ("restrained", thermal.restrained, (places, 6)),
        ("relaxed", thermal.relaxed, (places, 6)),
    ):
        array, item = np.asarray(values), f"thermal/{name}"
        check(array.dtype.kind == "f", item, "wrong data type", array.dtype.name)
        check(array.shape == shape, item, f"wrong shape, expected {shape}", array.shape)
        check.each(np.isfinite(array), array, item, "not finite")
    rigid = thermal.force[:6]
    check.each(rigid == 0, rigid, "thermal/force", "expansion moves no rigid body", 0)
