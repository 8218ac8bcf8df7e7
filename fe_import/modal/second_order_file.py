"""The second-order field inside a modal file: written, read, checked."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from fe_import.files.hdf5.files import Reader, write_array
from fe_import.modal.identities import EXACT, Check
from fe_import.modal.second_order import SecondOrder

if TYPE_CHECKING:
    from fe_import.modal.model import ModalModel


def write_second_order(group: h5py.Group, field: SecondOrder) -> None:
    """Fill the group ``second_order`` of a modal file."""
    pair = "per unit of both modal coordinates"
    for name, values, unit, meaning in (
        ("reference", field.reference, "1", "interface whose motion is linear in the modes, from 0"),
        ("momentum", field.momentum, f"SI {pair}", "S, then P; axis, mode, mode"),
        ("spin", field.spin, f"SI {pair}", "W; axis, axis, mode, mode"),
        ("modal", field.modal, f"SI {pair}", "K; elastic mode, mode, mode"),
        ("nodes", field.nodes, "1", "nodes with a stored field, from 0"),
        ("translation", field.translation, f"m {pair}", "node, axis, pair a <= b of elastic modes, row by row"),
        ("rotation", field.rotation, f"rad {pair}", "rotation vector; node, axis, pair"),
    ):
        write_array(group, name, values, unit, meaning)


def read_second_order(file: Reader, interfaces: int, nodes: int, modes: int) -> SecondOrder:
    """Read the group ``second_order`` of a modal file.

    Parameters
    ----------
    file : Reader
    interfaces, nodes, modes : int
        Of the link.

    Raises
    ------
    FEImportError
        MODAL_FILE.
    """
    stored = file.integers("nodes", (None,), 0, nodes)
    shape = (len(stored), 3, _pairs(modes))
    return SecondOrder(
        reference=int(file.integers("reference", (), 0, interfaces)),
        momentum=file.array("momentum", (6, modes, modes)),
        spin=file.array("spin", (3, 3, modes, modes)),
        modal=file.array("modal", (modes - 6, modes, modes)),
        nodes=stored,
        translation=file.array("translation", shape),
        rotation=file.array("rotation", shape),
    )


def _pairs(modes: int) -> int:
    return (modes - 6) * (modes - 5) // 2


def check_second_order(model: ModalModel, field: SecondOrder, check: Check) -> None:
    """Refuse a field that does not fit its link."""
    check(model.form == "orthonormal", "second_order", "only the orthonormal form carries it", model.form)
    interfaces = len(model.interface_nodes)
    known = isinstance(field.reference, int) and 0 <= field.reference < interfaces
    check(known, "second_order/reference", "no such interface", field.reference, f"0 to {interfaces - 1}")
    m, k = model.modes, len(np.atleast_1d(field.nodes))
    arrays: list[tuple[str, Any, tuple[int, ...], str]] = [
        ("momentum", field.momentum, (6, m, m), "f"),
        ("spin", field.spin, (3, 3, m, m), "f"),
        ("modal", field.modal, (m - 6, m, m), "f"),
        ("nodes", field.nodes, (k,), "i"),
        ("translation", field.translation, (k, 3, _pairs(m)), "f"),
        ("rotation", field.rotation, (k, 3, _pairs(m)), "f"),
    ]
    for name, values, shape, kind in arrays:
        array, item = np.asarray(values), f"second_order/{name}"
        check(array.dtype.kind == kind, item, "wrong data type", array.dtype.name)
        check(array.shape == shape, item, f"wrong shape, expected {shape}", array.shape)
        check.each(np.isfinite(array), array, item, "not finite")
    n, nodes = len(model.nodes), field.nodes
    check.each((nodes >= 0) & (nodes < n), nodes, "second_order/nodes", "no such node", f"0 to {n - 1}")
    check.each(np.diff(nodes, prepend=-1) > 0, nodes, "second_order/nodes", "nodes must rise, each once", "from 0")
    missing = [i.name for i in model.interface_nodes if i.node not in nodes]
    check(not missing, "second_order/nodes", "every interface needs its field", ", ".join(missing))
    for name, values in (("momentum", field.momentum[:3]), ("spin", field.spin)):  # in the modes
        off = np.abs(values - np.swapaxes(values, -1, -2))
        limit = EXACT * max(float(np.abs(values).max(initial=0.0)), 1e-300)
        check.each(off <= limit, off, f"second_order/{name}", "not symmetric", limit)
