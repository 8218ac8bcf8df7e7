"""The modal file: a `ModalModel` in flat HDF5, for this program, MATLAB and Julia.

The same group can stand inside another file (a run file embeds the modal models that it was computed with).
"""

from __future__ import annotations

import hashlib
import os
import stat
from collections.abc import Iterable
from contextlib import suppress
from copy import deepcopy
from pathlib import Path

import h5py
import numpy as np

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
from fe_import.modal.inertia import InertiaInvariants, MassProperties
from fe_import.modal.model import FixedInterfaceModes, HealthCheck, ModalModel
from fe_import.modal.recovery_file import read_recovery, write_recovery
from fe_import.modal.second_order_file import read_second_order, write_second_order
from fe_import.modal.thermal_file import read_thermal, write_thermal
from fe_import.model import MOST_TRIANGLES, Array, IntArray, InterfaceNode, Surface

SCHEMA = "erls modal model"
SCHEMA_VERSION = 4
UNITS = "SI"

_KEPT, _LARGEST = 32, 4_000_000  # models, and bytes of a file
_lately: dict[bytes, ModalModel] = {}


def write_modal_file(path: Path | str, model: ModalModel) -> None:
    """Validate a modal model and write it, completely or not at all; equal models give equal bytes.

    Raises
    ------
    FEImportError
        MODAL_FILE: the model is not consistent; NOT_WRITABLE.
    """
    validate(model, str(path))
    write_atomically(path, lambda group: write_modal_group(group, model), FEImportError, Cause.NOT_WRITABLE)


def read_modal_file(path: Path | str) -> ModalModel:
    """Read and validate a modal file.

    What this process has read lately, a mechanism of equal links or the variants of a study, is copied from memory
    while the file keeps every byte.

    Raises
    ------
    FEImportError
        FILE_NOT_FOUND; NOT_READABLE: not an HDF5 file; MODAL_FILE: anything wrong inside.
    """
    digest = _digest(path)
    if digest in _lately:
        return deepcopy(_lately[digest])
    with open_for_reading(path, FEImportError, Cause.MODAL_FILE) as file:
        model = read_modal_group(file.group, str(path))
    if digest and digest == _digest(path):  # not replaced meanwhile
        _lately[digest] = deepcopy(model)
        while len(_lately) > _KEPT:
            del _lately[next(iter(_lately))]
    return model


def _digest(path: Path | str) -> bytes:
    """SHA-256 of a file; empty for what is too large to be kept in memory, or no file."""
    with suppress(OSError, ValueError):
        status = os.stat(path)
        if stat.S_ISREG(status.st_mode) and status.st_size <= _LARGEST:
            with open(path, "rb") as file:
                return hashlib.file_digest(file, "sha256").digest()
    return b""


def write_modal_group(group: h5py.Group, model: ModalModel) -> None:
    """Fill an empty group with a modal model that passed `validate`."""
    write_attribute(group, "schema", SCHEMA)
    write_attribute(group, "schema_version", SCHEMA_VERSION)
    write_attribute(group, "units", UNITS)
    write_attribute(group, "name", model.name)
    write_attribute(group, "form", model.form)
    inertia, full, fixed = model.invariants, model.full_mass_properties, model.fixed_interface
    modal = "SI, per unit of both modal coordinates"
    for name, values, unit, description in (
        ("frequencies_hz", model.frequencies_hz, "Hz", "frequency of each mode, 0 for rigid-body modes"),
        ("damping_ratios", model.damping_ratios, "1", "modal damping ratios"),
        ("residuals", model.residuals, "1", "by how much each frequency is too high, as a share"),
        ("nodes", model.nodes, "m", "undeformed positions in the mesh frame; node, axis"),
        ("mode_shapes/translation", model.translation_shapes, "m", "displacements; node, axis, mode"),
        ("mode_shapes/rotation", model.rotation_shapes, "rad", "rotations; rotation node, axis, mode"),
        ("mode_shapes/rotation_nodes", model.rotation_nodes, "1", "nodes that carry rotations, from 0"),
        ("reduced/mass", inertia.m, modal, "reduced mass matrix"),
        ("reduced/stiffness", model.stiffness, modal, "reduced stiffness matrix"),
        ("inertia/X", inertia.X, modal, "U' M A_a U; axis a, mode, mode"),
        ("inertia/Z", inertia.Z, modal, "U' A_a' M A_b U; axis a, axis b, mode, mode"),
        ("inertia/rigid", inertia.rigid, "SI", "modal coordinates of unit translations and rotations"),
        ("full_model/mass", full.mass, "kg", "mass of the full model"),
        ("full_model/centre_of_mass", full.centre_of_mass, "m", "centre of mass of the full model"),
        ("full_model/inertia", full.inertia, "kg m^2", "inertia of the full model about its centre of mass"),
        ("fixed_interface/frequencies_hz", fixed.frequencies_hz, "Hz", "frequencies with clamped interfaces"),
        (
            "fixed_interface/effective_mass",
            fixed.effective_mass,
            "1",
            "share of mass and of inertia; mode, axis",
        ),
        ("health/values", [c.value for c in model.health], "1", "value of each check"),
        ("health/limits", [c.limit for c in model.health], "1", "passed when value <= limit; 1.8e308: reported only"),
        ("node_names/nodes", _integers(model.node_names.values()), "1", "nodes that have a name, from 0"),
        ("pictures/lines", model.lines, "1", "line segments for pictures; nodes from 0"),
        ("pictures/triangles", model.triangles, "1", "surface triangles for pictures; nodes from 0"),
    ):
        write_array(group, name, values, unit, description)
    if len(model.heights):
        write_array(group, "pictures/heights", model.heights, "m", "bottom and top of shells above each node")
    if model.surface is not None:
        corners, triangles = model.surface.points, model.surface.triangles
        write_array(group, "pictures/surface/points", corners, "m", "corners of what a rigid link is drawn as")
        write_array(group, "pictures/surface/triangles", triangles, "1", "of these corners, from 0")
    write_strings(group, "kinds", model.kinds, "what moves in each mode")
    write_strings(group, "health/names", tuple(c.name for c in model.health), "checks of the reduction")
    write_strings(group, "node_names/names", tuple(model.node_names), "names of node_names/nodes")
    interfaces = group.create_group("interfaces")
    for number, interface in enumerate(model.interface_nodes, start=1):
        _write_interface(interfaces.create_group(f"{number:04d}"), interface)
    if model.recovery is not None:
        write_recovery(group.create_group("recovery"), model.recovery)
    if model.second_order is not None:
        write_second_order(group.create_group("second_order"), model.second_order)
    if model.thermal is not None:
        write_thermal(group.create_group("thermal"), model.thermal)
    provenance = group.create_group("provenance")
    for key, text in sorted(model.provenance.items()):
        write_attribute(provenance, key, text)


def _integers(values: Iterable[int]) -> IntArray:
    return np.array(list(values), dtype=np.int64)


def _write_interface(group: h5py.Group, interface: InterfaceNode) -> None:
    write_strings(group, "name", interface.name, "name of the interface")
    write_strings(group, "coupling", interface.coupling, "node, rigid (RBE2) or averaged (RBE3)")
    write_array(group, "node", interface.node, "1", "index of the interface node, from 0")
    write_array(group, "position", interface.position, "m", "position in the mesh frame")
    write_array(group, "coupled_nodes", interface.coupled_nodes, "1", "nodes it moves or averages, from 0")
    write_array(group, "weights", interface.weights, "1", "weights of the coupled nodes, sum 1")


def read_modal_group(group: h5py.Group, where: str) -> ModalModel:
    """Read and validate a modal model from a group of a file opened with `open_for_reading`.

    Parameters
    ----------
    group : h5py.Group
    where : str
        Name of the file, for messages.
    """
    file = Reader(group, where, FEImportError, Cause.MODAL_FILE)
    for name, known in (("schema", SCHEMA), ("units", UNITS)):
        if (text := file.attribute(name, str)) != known:
            raise file.fail(f"@{name}", "not what a modal file has", text, known)
    if (version := file.attribute("schema_version", int)) != SCHEMA_VERSION:
        raise file.fail("@schema_version", "unknown version of the modal file", version, SCHEMA_VERSION)

    frequencies = file.array("frequencies_hz", (None,))
    nodes = file.array("nodes", (None, 3))
    rotation_nodes = file.integers("mode_shapes/rotation_nodes", (None,), 0, len(nodes))
    fixed_frequencies = file.array("fixed_interface/frequencies_hz", (None,))
    n, m, k = len(nodes), len(frequencies), len(rotation_nodes)
    provenance = file.subgroup("provenance")
    interface_nodes = _read_interfaces(file.subgroup("interfaces"), n)
    inside = file.names_inside()
    model = ModalModel(
        name=file.attribute("name", str),
        form=file.attribute("form", str),
        nodes=nodes,
        node_names=_read_node_names(file, n),
        translation_shapes=file.array("mode_shapes/translation", (n, 3, m)),
        rotation_nodes=rotation_nodes,
        rotation_shapes=file.array("mode_shapes/rotation", (k, 3, m)),
        interface_nodes=interface_nodes,
        stiffness=file.array("reduced/stiffness", (m, m)),
        invariants=InertiaInvariants(
            m=file.array("reduced/mass", (m, m)),
            X=file.array("inertia/X", (3, m, m)),
            Z=file.array("inertia/Z", (3, 3, m, m)),
            rigid=file.array("inertia/rigid", (m, 6)),
        ),
        frequencies_hz=frequencies,
        kinds=file.names("kinds", m),
        damping_ratios=file.array("damping_ratios", (m,)),
        residuals=file.array("residuals", (m,)),
        full_mass_properties=MassProperties(
            mass=file.scalar("full_model/mass"),
            centre_of_mass=file.array("full_model/centre_of_mass", (3,)),
            inertia=file.array("full_model/inertia", (3, 3)),
        ),
        fixed_interface=FixedInterfaceModes(
            fixed_frequencies, file.array("fixed_interface/effective_mass", (len(fixed_frequencies), 6))
        ),
        health=_read_health(file),
        lines=file.integers("pictures/lines", (None, 2), 0, n),
        triangles=file.integers("pictures/triangles", (None, 3), 0, n),
        provenance={key: provenance.attribute(key, str) for key in provenance.attribute_names()},
        recovery=read_recovery(file.subgroup("recovery"), n, m) if "recovery" in inside else None,
        second_order=read_second_order(file.subgroup("second_order"), len(interface_nodes), n, m)
        if "second_order" in inside
        else None,
        thermal=read_thermal(file.subgroup("thermal"), m) if "thermal" in inside else None,
        heights=_read_heights(file, n),
        surface=_read_surface(file),
    )
    validate(model, where, (group.name or "").rstrip("/"))
    return model


def _read_heights(file: Reader, nodes: int) -> Array:
    """Of shells, where there are some."""
    if "heights" not in file.subgroup("pictures").names_inside():
        return np.zeros((0, 2))
    return file.array("pictures/heights", (nodes, 2))


def _read_surface(file: Reader) -> Surface | None:
    """Of rigid links, where one is given."""
    if "surface" not in file.subgroup("pictures").names_inside():
        return None
    points = file.array("pictures/surface/points", (None, 3))
    triangles = file.integers("pictures/surface/triangles", (None, 3), 0, len(points))
    if len(triangles) > MOST_TRIANGLES:
        message = "more triangles than a link may be drawn with"
        raise file.fail("pictures/surface/triangles", message, len(triangles), MOST_TRIANGLES)
    return Surface(points, triangles)


def _read_node_names(file: Reader, nodes: int) -> dict[str, int]:
    names = file.names("node_names/names")
    places = file.integers("node_names/nodes", (len(names),), 0, nodes)
    result = dict(zip(names, places.tolist(), strict=True))
    if len(result) != len(names):
        twice = next(n for k, n in enumerate(names) if n in names[:k])
        raise file.fail("node_names/names", "a node name stands twice", twice)
    return result


def _read_health(file: Reader) -> tuple[HealthCheck, ...]:
    names = file.names("health/names")
    values = file.array("health/values", (len(names),)).tolist()
    limits = file.array("health/limits", (len(names),)).tolist()
    return tuple(HealthCheck(*check) for check in zip(names, values, limits, strict=True))


def _read_interfaces(file: Reader, nodes: int) -> tuple[InterfaceNode, ...]:
    result: list[InterfaceNode] = []
    for number in range(1, len(file.names_inside()) + 1):
        one = file.subgroup(f"{number:04d}")
        coupled = one.integers("coupled_nodes", (None,), 0, nodes)
        interface = InterfaceNode(
            name=one.text("name"),
            node=int(one.integers("node", (), 0, nodes)),
            position=one.array("position", (3,)),
            coupled_nodes=coupled,
            weights=one.array("weights", (len(coupled),)),
            coupling=one.text("coupling"),
        )
        result.append(interface)
    return tuple(result)
