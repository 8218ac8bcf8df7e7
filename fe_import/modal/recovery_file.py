"""Recovery maps inside a modal file: written, read, checked."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from fe_import.files.hdf5.files import Reader, write_array, write_attribute
from fe_import.modal.identities import EXACT, Check
from fe_import.modal.recovery_maps import COMPONENTS, UNITS, RecoveryMaps

if TYPE_CHECKING:
    from fe_import.modal.model import ModalModel


def write_recovery(group: h5py.Group, maps: RecoveryMaps) -> None:
    """Fill the group ``recovery`` of a modal file."""
    write_attribute(group, "quantity", maps.quantity)
    write_attribute(group, "components", " ".join(maps.components))
    unit = "Pa" if maps.quantity == "stress" else ", ".join(UNITS[maps.quantity])
    for name, values, per, meaning in (
        ("modes", maps.modes, "unit modal coordinate", "place, component, mode"),
        ("inertia", maps.inertia, "unit modal force", "static, under M times mode shape; place, component, mode"),
        ("loads", maps.loads, "N and N m", "static, under interface loads; place, component, 6 per interface"),
        ("spin", maps.spin, "rad^2/s^2", "static, of wx^2, wy^2, wz^2, wx wy, wy wz, wz wx; place, component, pair"),
    ):
        write_array(group, name, values, f"{unit} per {per}", f"{maps.quantity}; {meaning}")
    write_array(group, "nodes", maps.nodes, "1", "node of each place, from 0")
    write_array(group, "elements", maps.elements, "1", "line of pictures/lines whose end this is, -1 for nodal stress")
    write_array(group, "axes", maps.axes, "1", "axes of the components in the mesh frame; place, row, axis")


def read_recovery(file: Reader, nodes: int, modes: int) -> RecoveryMaps:
    """Read the group ``recovery`` of a modal file.

    Parameters
    ----------
    file : Reader
    nodes, modes : int
        Of the link.

    Raises
    ------
    FEImportError
        MODAL_FILE.
    """
    places = file.integers("nodes", (None,), 0, nodes)
    count = len(places)
    return RecoveryMaps(
        quantity=file.attribute("quantity", str),
        nodes=places,
        elements=file.integers("elements", (count,), -1),
        axes=file.array("axes", (count, 3, 3)),
        modes=file.array("modes", (count, 6, modes)),
        inertia=file.array("inertia", (count, 6, modes)),
        loads=file.array("loads", (count, 6, None)),
        spin=file.array("spin", (count, 6, 6)),
    )


def check_recovery(model: ModalModel, maps: RecoveryMaps, check: Check) -> None:
    """Refuse recovery maps that do not fit their link."""
    check(model.form == "orthonormal", "recovery", "only the orthonormal form carries recovery data", model.form)
    check(maps.quantity in COMPONENTS, "recovery/@quantity", "unknown", maps.quantity, " or ".join(COMPONENTS))
    p = len(np.atleast_1d(maps.nodes))
    arrays: list[tuple[str, Any, tuple[int, ...], str]] = [
        ("nodes", maps.nodes, (p,), "i"),
        ("elements", maps.elements, (p,), "i"),
        ("axes", maps.axes, (p, 3, 3), "f"),
        ("modes", maps.modes, (p, 6, model.modes), "f"),
        ("inertia", maps.inertia, (p, 6, model.modes), "f"),
        ("loads", maps.loads, (p, 6, 6 * len(model.interface_nodes)), "f"),
        ("spin", maps.spin, (p, 6, 6), "f"),
    ]
    for name, values, shape, kind in arrays:
        array, item = np.asarray(values), f"recovery/{name}"
        check(array.dtype.kind == kind, item, "wrong data type", array.dtype.name)
        check(array.shape == shape, item, f"wrong shape, expected {shape}", array.shape)
        check.each(np.isfinite(array), array, item, "not finite")
    n, lines = len(model.nodes), len(model.lines)
    check.each((maps.nodes >= 0) & (maps.nodes < n), maps.nodes, "recovery/nodes", "no such node", f"0 to {n - 1}")
    known = (maps.elements >= -1) & (maps.elements < lines)
    check.each(known, maps.elements, "recovery/elements", "no such element", f"-1 to {lines - 1}")
    off = np.abs(maps.axes @ np.swapaxes(maps.axes, 1, 2) - np.eye(3))
    check.each(off <= EXACT, off, "recovery/axes", "not orthonormal", EXACT)
    for name, values in (("modes", maps.modes), ("inertia", maps.inertia)):
        rigid = values[:, :, :6]
        check.each(rigid == 0, rigid, f"recovery/{name}", "rigid-body modes carry no stress", 0)
