"""What a modal model must satisfy before anything is computed with it: shapes, ranges, names, identities."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from fe_import.modal.identities import Check, check_matrices, check_orthonormal, check_rigid_motion
from fe_import.modal.model import ModalModel
from fe_import.modal.recovery_file import check_recovery
from fe_import.modal.second_order_file import check_second_order
from fe_import.modal.thermal_file import check_thermal

FORMS = ("orthonormal", "physical")
COUPLINGS = ("node", "rigid", "averaged")
_LONGEST_TEXT = 1_000_000


def validate(model: ModalModel, where: str, root: str = "") -> None:
    """Refuse a modal model that is not consistent.

    Parameters
    ----------
    model : ModalModel
    where : str
        Name of the file, for messages.
    root : str
        Group of the model inside the file.

    Raises
    ------
    FEImportError
        MODAL_FILE, at the first fault found.
    """
    check = Check(where, root)
    with np.errstate(all="ignore"):  # absurd numbers end in a comparison that fails
        _check_shapes(model, check)
        _check_texts(model, check)
        _check_tables(model, check)
        _check_interfaces(model, check)
        check_matrices(model, check)
        if model.form == "orthonormal":
            check_orthonormal(model, check)
        check_rigid_motion(model, check)
        if model.recovery is not None:
            check_recovery(model, model.recovery, check)
        if model.second_order is not None:
            check_second_order(model, model.second_order, check)
        if model.thermal is not None:
            check_thermal(model, model.thermal, check)


def _check_shapes(model: ModalModel, check: Check) -> None:
    n, m, k, f = (
        np.shape(a)[0] if np.ndim(a) else 0
        for a in (
            model.nodes,
            model.frequencies_hz,
            model.rotation_nodes,
            model.fixed_interface.frequencies_hz,
        )
    )
    check(n > 0, "nodes", "a link has at least one node")
    check(m >= 6, "frequencies_hz", "fewer modes than rigid-body motions", m, "at least 6")
    inertia, full, fixed = model.invariants, model.full_mass_properties, model.fixed_interface
    arrays: list[tuple[str, Any, tuple[int | None, ...], str]] = [
        ("nodes", model.nodes, (n, 3), "f"),
        ("mode_shapes/translation", model.translation_shapes, (n, 3, m), "f"),
        ("mode_shapes/rotation_nodes", model.rotation_nodes, (k,), "i"),
        ("mode_shapes/rotation", model.rotation_shapes, (k, 3, m), "f"),
        ("reduced/mass", inertia.m, (m, m), "f"),
        ("reduced/stiffness", model.stiffness, (m, m), "f"),
        ("inertia/X", inertia.X, (3, m, m), "f"),
        ("inertia/Z", inertia.Z, (3, 3, m, m), "f"),
        ("inertia/rigid", inertia.rigid, (m, 6), "f"),
        ("frequencies_hz", model.frequencies_hz, (m,), "f"),
        ("damping_ratios", model.damping_ratios, (m,), "f"),
        ("residuals", model.residuals, (m,), "f"),
        ("full_model/mass", np.asarray(full.mass, dtype=float), (), "f"),
        ("full_model/centre_of_mass", full.centre_of_mass, (3,), "f"),
        ("full_model/inertia", full.inertia, (3, 3), "f"),
        ("fixed_interface/frequencies_hz", fixed.frequencies_hz, (f,), "f"),
        ("fixed_interface/effective_mass", fixed.effective_mass, (f, 6), "f"),
        ("health/values", np.array([c.value for c in model.health], dtype=float), (None,), "f"),
        ("health/limits", np.array([c.limit for c in model.health], dtype=float), (None,), "f"),
        ("pictures/lines", model.lines, (None, 2), "i"),
        ("pictures/triangles", model.triangles, (None, 3), "i"),
        ("pictures/heights", model.heights, (len(model.heights) and len(model.nodes), 2), "f"),
    ]
    if model.surface is not None:
        arrays.append(("pictures/surface/points", model.surface.points, (None, 3), "f"))
        arrays.append(("pictures/surface/triangles", model.surface.triangles, (None, 3), "i"))
    for number, one in enumerate(model.interface_nodes, start=1):
        place = f"interfaces/{number:04d}"
        arrays.append((f"{place}/position", one.position, (3,), "f"))
        arrays.append((f"{place}/coupled_nodes", one.coupled_nodes, (None,), "i"))
        arrays.append((f"{place}/weights", one.weights, (len(one.coupled_nodes),), "f"))
    for item, values, shape, kind in arrays:
        array = np.asarray(values)
        check(array.dtype.kind == kind, item, "wrong data type", array.dtype.name)
        fits = array.ndim == len(shape) and all(w in (None, s) for w, s in zip(shape, array.shape, strict=True))
        expected = ", ".join("any" if s is None else str(s) for s in shape)
        check(fits, item, f"wrong shape, expected ({expected})", array.shape)
        check.each(np.isfinite(array), array, item, "not finite")
    check(len(model.kinds) == m, "kinds", "one kind per mode", len(model.kinds), m)


def _check_texts(model: ModalModel, check: Check) -> None:
    check(model.form in FORMS, "@form", "unknown form", model.form, " or ".join(FORMS))
    texts: dict[str, Iterable[str]] = {
        "@name": [model.name],
        "kinds": model.kinds,
        "node_names/names": model.node_names,
        "health/names": [c.name for c in model.health],
        "provenance": [*model.provenance, *model.provenance.values()],
        "interfaces": [i.name for i in model.interface_nodes],
    }
    for item, values in texts.items():
        for text in values:
            check(_storable(text), item, "a text must be UTF-8 without NUL, at most 1 MB", ascii(text[:50]))
    for item, required in (("kinds", model.kinds), ("node_names/names", model.node_names)):
        check(all(required), item, "a name must not be empty")
    check(all(model.provenance), "provenance", "a key must not be empty")


def _storable(text: str) -> bool:
    try:
        return "\0" not in text and len(text.encode("utf-8")) < _LONGEST_TEXT
    except UnicodeEncodeError:
        return False


def _check_tables(model: ModalModel, check: Check) -> None:
    n = len(model.nodes)
    turning = model.rotation_nodes
    rising = np.diff(turning, prepend=-1) > 0
    check.each(rising, turning, "mode_shapes/rotation_nodes", "nodes must rise, each once", "from 0")
    for item, nodes in (
        ("mode_shapes/rotation_nodes", turning),
        ("node_names/nodes", np.array(list(model.node_names.values()), dtype=np.int64)),
        ("pictures/lines", model.lines),
        ("pictures/triangles", model.triangles),
    ):
        check.each((nodes >= 0) & (nodes < n), nodes, item, "no such node", f"0 to {n - 1}")
    if model.surface is not None:
        corners, n = model.surface.triangles, len(model.surface.points)
        inside = (corners >= 0) & (corners < n)
        check.each(inside, corners, "pictures/surface/triangles", "no such corner", f"0 to {n - 1}")
    for item, values in (
        ("frequencies_hz", model.frequencies_hz),
        ("damping_ratios", model.damping_ratios),
        ("residuals", model.residuals),
        ("fixed_interface/frequencies_hz", model.fixed_interface.frequencies_hz),
        ("fixed_interface/effective_mass", model.fixed_interface.effective_mass),
    ):
        check.each(values >= 0, values, item, "must not be negative", 0)
    check(model.full_mass_properties.mass >= 0, "full_model/mass", "must not be negative")


def _check_interfaces(model: ModalModel, check: Check) -> None:
    n, size = len(model.nodes), float(np.abs(model.nodes).max()) or 1.0
    names: set[str] = set()
    for number, one in enumerate(model.interface_nodes, start=1):
        group = f"interfaces/{number:04d}"
        check(_storable(one.name) and one.name, f"{group}/name", "a name must not be empty, UTF-8 without NUL")
        check(one.name not in names, f"{group}/name", "an interface name stands twice", one.name)
        names.add(one.name)
        check(one.coupling in COUPLINGS, f"{group}/coupling", "unknown", one.coupling, " or ".join(COUPLINGS))
        check(0 <= one.node < n, f"{group}/node", "no such node", one.node, f"0 to {n - 1}")
        check(one.node in model.rotation_nodes, f"{group}/node", "an interface node needs rotations", one.node)
        off = np.abs(one.position - model.nodes[one.node]).max()
        check(off <= 1e-6 * size, f"{group}/position", "not the position of its node", float(off), 1e-6 * size)
        coupled, weights = one.coupled_nodes, one.weights
        check(len(coupled) > 0, f"{group}/coupled_nodes", "moves no node")
        inside = (coupled >= 0) & (coupled < n)
        check.each(inside, coupled, f"{group}/coupled_nodes", "no such node", f"0 to {n - 1}")
        check.each(weights > 0, weights, f"{group}/weights", "weights must be positive", 0)
        check(abs(weights.sum() - 1) <= 1e-8, f"{group}/weights", "must sum to 1", float(weights.sum()), 1)
