"""A reduced link as standard input data (SID): text that SIMPACK, FlexibleBodies of Modelica and others read.

O. Wallrapp, Mech. Struct. & Mach. 22 (1994) 283-304; R. Schwertassek and O. Wallrapp, Dynamik flexibler
Mehrkörpersysteme (1999), ch. 6. With the twist of the floating frame in its axes, a the acceleration of its origin
(weight as -g), and the shape functions Φ of the modes q, the equations of a body are

    [m 1, mdCM~ᵀ, Ctᵀ; mdCM~, J, Crᵀ; Ct, Cr, Me] [a; ω̇; q̈] + [ω~ω~ mdCM + 2 ω~ Ctᵀ q̇; Σ Gr_k q̇_k ω + ω~ J ω;
        Σ Ge_k q̇_k ω + Oe (ω_x², ω_y², ω_z², ω_x ω_y, ω_y ω_z, ω_x ω_z)] + [0; 0; ksigma + Ke q + De q̇] = loads

with mdCM, J, Cr and Oe polynomials of first order in q. From the constants of `fe_import.writers.resting`, with
H_k = (ρ_rᵀX_aB)_k (rows a) and c_k = (ρ_rᵀmB)_k,

    mdCM¹ = Ct⁰ᵀ = ρ_tᵀmB    J¹_k = H_k + H_kᵀ    Cr⁰ = (ρ_rᵀmB)ᵀ    Cr¹ = BᵀX_aB    Ge = BᵀX_aB - (BᵀX_aB)ᵀ
    Gr_k = H_k + H_kᵀ - c_k~                      Oe⁰ = -J¹ (half on the diagonal)   Oe¹ = -BᵀZ_abB, both orders.

Files have the layout of those that FEMBS writes: J as six rows xx, yy, zz, xy, xz, yz; columns of Gr and Ge axis by
axis, each with all modes; indices of first-order terms are row, mode, column; twelve digits.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fe_import.errors import Cause, FEImportError
from fe_import.files.output import replacing
from fe_import.modal.model import ModalModel
from fe_import.model import Array
from fe_import.writers.base import MARK
from fe_import.writers.resting import RestingBody, resting_body

_EQUALS = 48  # column of the equals signs
_LEAST = 1e-99  # exponents of two digits
_DIAGONAL = ((0, 0), (1, 1), (2, 2))
_OF_J = (*_DIAGONAL, (0, 1), (0, 2), (1, 2))
_OF_OE = (*_DIAGONAL, (0, 1), (1, 2), (0, 2))


@dataclass(frozen=True)
class _Taylor:
    """A matrix (r, c), and (r, k, c) what each of the k modes adds; None: not of first order."""

    zeroth: Array
    first: Array | None = None
    symmetric: bool = False


def write_sid(path: Path, model: ModalModel) -> dict[str, int]:
    """Write the file, completely or not at all.

    Parameters
    ----------
    path : Path
    model : ModalModel
        In either form.

    Returns
    -------
    dict of int
        Numbers of the nodes by name: interfaces, then all other nodes with a name.

    Raises
    ------
    FEImportError
        ``MODE_COUNT``: no elastic mode; ``NOT_WRITABLE``.
    """
    body = resting_body(model, "a file of standard input data")
    places = {i.name: i.node for i in model.interface_nodes}
    taken = set(places.values())
    places |= {name: node for name, node in model.node_names.items() if node not in taken and name not in places}
    with replacing(path, FEImportError, Cause.NOT_WRITABLE) as temporary:
        temporary.write_text("".join(f"{line}\n" for line in _lines(model, body, list(places.values()))), "ascii")
    return {name: number for number, name in enumerate(places, start=1)}


def _lines(model: ModalModel, body: RestingBody, places: list[int]) -> Iterator[str]:
    count, name = len(body.frequencies), re.sub(r"[^A-Za-z0-9_.+-]", "_", model.name)
    yield f"{len(places):5d}{count:4d}    :No. nodes, No. modes:SID {MARK}, in SI units"
    yield " part"
    yield _line(6, "new modal", f" {name}")
    yield f"{'':11s}refmod"
    yield _line(16, "mass", _number(model.mass_properties.mass))
    yield _line(16, "nelastq", f"{count:5d}")
    for k, frequency in enumerate(body.frequencies.tolist(), start=1):
        yield _line(16, f"ielastq ({k:4d})", f" Eigen Mode {k:4d} : {frequency:12.3f} Hz")
    yield f"{'':11s}end refmod"
    yield f"{'':11s}frame"
    for number, node in enumerate(places, start=1):
        yield _line(16, "new node", f"{number:9d}")
        yield _line(21, "rframe", " body ref")
        for key, matrix in _node(model, body.basis, node).items():
            yield from _block(21, key, matrix, count)
        yield f"{'':16s}end node"
    yield f"{'':11s}end frame"
    for key, matrix in _inertia(body).items():
        yield from _block(11, key, matrix, count)
    for key, matrix in _forces(model, body).items():
        yield from _block(11, key, matrix, count)
    yield "      end modal"
    yield " end part"


def _node(model: ModalModel, basis: Array, node: int) -> dict[str, _Taylor]:
    """Place, shapes and axes; a node that has no rotation of its own keeps its axes."""
    moved, turned = model.node_shape(node)
    phi = moved @ basis
    psi = np.zeros_like(phi) if turned is None else turned @ basis
    return {
        "origin": _Taylor(model.nodes[node][:, None], phi[:, :, None]),
        "phi": _Taylor(phi),
        "psi": _Taylor(psi),
        "AP": _Taylor(np.eye(3), np.cross(psi.T[:, None], np.eye(3)).transpose(2, 0, 1)),
    }


def _inertia(body: RestingBody) -> dict[str, _Taylor]:
    count = len(body.frequencies)
    moved, c = body.coupling[:3], body.coupling[3:]
    h = body.mixed[:, 3:]  # axis, row, mode
    inertia = h + h.transpose(1, 0, 2)
    moment = body.rigid[3:, :3]
    centre = np.array([[moment[2, 1] - moment[1, 2]], [moment[0, 2] - moment[2, 0]], [moment[1, 0] - moment[0, 1]]]) / 2
    crossed = np.cross(c.T[:, None], np.eye(3)).transpose(2, 1, 0)  # c_k × e_column: row, column, mode
    x = body.first.transpose(1, 2, 0)  # row, mode, axis
    squares = [(body.second[a, b] + body.second[b, a]) / (2 if a == b else 1) for a, b in _OF_OE]
    loads = [inertia[a, b] / (2 if a == b else 1) for a, b in _OF_OE]
    whole, bent = ([part[a, b] for a, b in _OF_J] for part in (body.rigid[3:, 3:], inertia))
    return {
        "mdCM": _Taylor(centre, moved[:, :, None]),
        "J": _Taylor(np.array(whole)[:, None], np.stack(bent)[:, :, None]),
        "Ct": _Taylor(moved.T),
        "Cr": _Taylor(c.T, x),
        "Me": _Taylor(body.mass, symmetric=True),
        "Gr": _Taylor((inertia - crossed).reshape(3, 3 * count)),
        "Ge": _Taylor((x - x.transpose(1, 0, 2)).transpose(0, 2, 1).reshape(count, 3 * count)),
        "Oe": _Taylor(-np.stack(loads, axis=1), -np.stack(squares, axis=2)),
    }


def _forces(model: ModalModel, body: RestingBody) -> dict[str, _Taylor]:
    """Of the reference state (thermal expansion), stiffness, damping."""
    count, thermal = len(body.frequencies), model.thermal
    heat = np.zeros(count) if thermal is None else -thermal.change * (thermal.force @ body.basis)
    damping = 4 * np.pi * model.damping_ratios * model.frequencies_hz  # none in the physical form
    return {
        "ksigma": _Taylor(heat[:, None]),
        "Ke": _Taylor(body.stiffness, symmetric=True),
        "De": _Taylor(body.basis.T @ (damping[:, None] * body.basis), symmetric=True),
    }


def _block(indent: int, key: str, matrix: _Taylor, modes: int) -> Iterator[str]:
    entries = [*_entries("m0", matrix.zeroth), *([] if matrix.first is None else _entries("m1", matrix.first))]
    rows, columns = matrix.zeroth.shape
    structure = 0 if not entries else 2 if matrix.symmetric else 3
    numbers = {"order": int(matrix.first is not None), "nrow": rows, "ncol": columns, "nq": modes, "nqn": 0}
    yield f"{'':{indent}s}{key}"
    for name, value in (numbers | {"structure": structure}).items():
        yield _line(26, name, f"{value:5d}")
    yield from entries
    yield f"{'':{indent}s}end {key}"


def _entries(name: str, values: Array) -> list[str]:
    """All that are not zero."""
    found = np.argwhere(np.abs(values) >= _LEAST)
    return [
        _line(26, f"{name}({','.join(f'{i + 1:2d}' for i in place)})", _number(values[tuple(place)]))
        for place in found.tolist()
    ]


def _line(indent: int, key: str, value: str) -> str:
    return f"{f'{chr(32) * indent}{key}':{_EQUALS}s}={value}"


def _number(value: float) -> str:
    return f"{value:18.11E}".replace("E", "D")
