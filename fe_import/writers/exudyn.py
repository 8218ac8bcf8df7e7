"""A reduced link as exudyn reads it: what its ``ObjectFFRFreducedOrderInterface`` loads from an HDF5 file.

A body of exudyn (floating frame, A. Zwölfer and J. Gerstmayr, Acta Mech. 231 (2020)) has modes Ψ of translations, in a
frame that rides on it, and constants that are integrals over its mass. With the modes B of the link in which its first
interface rests, and the invariants m, X_a, Z_ab and ρ = [ρ_t, ρ_r] of the modal file (`fe_import.modal.inertia`), these
are, because its x̃ e_a = x × e_a = -e_a × x:

    ΨᵀMΨ = Bᵀ m B         Φ_tᵀMΨ = ρ_tᵀ m B       x̃ᵀMΨ = -ρ_rᵀ m B       Ψ̃ᵀMΨ = -Bᵀ X_aᵀ B
    x̃ᵀMx̃ = ρ_rᵀ m ρ_r     Φ_tᵀMΨ̃ = -ρ_tᵀ X_b B    x̃ᵀMΨ̃ = ρ_rᵀ X_b B      Ψ̃ᵀMΨ̃ = Bᵀ Z_ab B

for any mass matrix, that of beams with its rotations included. Nodes are points of the body and carry no mass there.
Six more around each interface follow its displacement and rotation, so that joints may turn with it, on beams too.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np

from fe_import.errors import Cause, FEImportError
from fe_import.files.hdf5.files import write_array, write_atomically, write_attribute, write_strings
from fe_import.modal.model import ModalModel
from fe_import.model import Array
from fe_import.writers.base import MARK
from fe_import.writers.resting import resting_body

AROUND = 6
"""Points around an interface."""

_REACH = 1e-2  # of the size of the link: their distance from it


def exudyn_body(model: ModalModel) -> dict[str, Any]:
    """What the file holds, by exudyn's names, SI.

    Parameters
    ----------
    model : ModalModel

    Returns
    -------
    dict
        Arrays, numbers and texts; ``interfaces``: numbers of the points around each, by its name.

    Raises
    ------
    FEImportError
        ``MODE_COUNT``: no elastic mode.
    """
    body = resting_body(model, "a body of exudyn")
    basis, count = body.basis, body.basis.shape[1]
    nodes, shapes, around = _points(model)
    moved, turned = body.mixed[:, :3], body.mixed[:, 3:]  # axis, row, mode
    whole = model.mass_properties
    return {
        "fileVersion": 1,
        "type": "ObjectFFRFreducedOrderInterface",
        "rigidBodyNodeType": "NodeType.RotationEulerParameters",
        "infoList": np.array([count, len(nodes), 3, 4, 7, 7 + count]),
        "modeBasis": (shapes @ basis).reshape(3 * len(nodes), count),
        "xRef": nodes.ravel(),
        "trigList": model.triangles,
        "postProcessingModes": {},
        "massMatrixReduced": body.mass,
        "stiffnessMatrixReduced": body.stiffness,
        "totalMass": whole.mass,
        "Mtt": whole.mass * np.eye(3),
        "chiU": whole.centre_of_mass,
        "chiUtilde": np.cross(whole.centre_of_mass, np.eye(3)).T,
        "inertiaLocal": body.rigid[3:, 3:],
        "mPhitTPsi": body.coupling[:3],
        "mXRefTildePsi": -body.coupling[3:],
        "mPsiTildePsi": -body.first.transpose(2, 0, 1).reshape(3 * count, count),
        "mPhitTPsiTilde": -moved.transpose(1, 2, 0).reshape(3, 3 * count),
        "mXRefTildePsiTilde": turned.transpose(1, 2, 0).reshape(3, 3 * count),
        "mPsiTildePsiTilde": body.second.transpose(2, 0, 3, 1).reshape(3 * count, 3 * count),
        "interfaces": around,
    }


def write_exudyn(path: Path, model: ModalModel) -> dict[str, Any]:
    """Write the file, completely or not at all; gives its content.

    Raises
    ------
    FEImportError
        ``MODE_COUNT``, ``NOT_WRITABLE``.
    """
    content = exudyn_body(model)
    write_atomically(path, lambda group: _fill(group, content), FEImportError, Cause.NOT_WRITABLE)
    return content


def _fill(group: h5py.Group, content: dict[str, Any]) -> None:
    write_attribute(group, "mark", f"{MARK}: an ObjectFFRFreducedOrderInterface of exudyn, SI")
    for name, value in content.items():
        kind = type(value).__name__  # dict, int, float, str, ndarray
        if isinstance(value, dict):
            inner = group.create_group(name)
            _fill(inner, value)
        elif isinstance(value, str):
            write_strings(group, name, value, "")
        else:
            write_array(group, name, value, "SI", "")
        group[name].attrs["datatype"] = kind  # of any length: exudyn takes others for bytes


def _points(model: ModalModel) -> tuple[Array, Array, dict[str, Any]]:
    """(n, 3) places, (n, 3, m) displacements per modal coordinate, and numbers of those around interfaces."""
    reach = _REACH * float(np.ptp(model.nodes, axis=0).max())
    offsets = reach * np.concatenate([np.eye(3), -np.eye(3)])
    places, shapes, around, count = [model.nodes], [model.translation_shapes], {}, len(model.nodes)
    for interface in model.interface_nodes:
        moved, turned = model.node_shape(interface.node)
        assert turned is not None  # interfaces turn
        places.append(interface.position + offsets)
        shapes.append(moved + np.cross(turned.T[None], offsets[:, None]).transpose(0, 2, 1))
        around[interface.name.replace("/", "_")] = np.arange(count, count + AROUND)
        count += AROUND
    return np.concatenate(places), np.concatenate(shapes), around
