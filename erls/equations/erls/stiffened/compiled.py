"""The constants of second order of a chain in the joint-angle gauge, packed for `erls.equations.erls.stiffened`."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from erls.equations.compiled_system import CompiledSystem, acceleration_in
from erls.equations.erls import layout as at
from erls.equations.erls.compiled import combined_modes, compile_chain
from erls.equations.erls.paper.second_order_compatibility import frame_second_order
from erls.equations.erls.paper.second_order_inertia import compliance
from erls.equations.erls.stiffened import compiled_functions as equations
from erls.equations.erls.stiffened import layout as more
from erls.equations.serial.packing import Packer
from erls.maths.se3 import inverse, twist_transform
from erls.maths.so3 import Array

if TYPE_CHECKING:
    from erls.equations.erls.chain import Erls

_PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))  # of axes


def _stack(matrices: Array) -> Array:
    """(columns, matrices, rows) of (matrices, rows, columns)."""
    return np.ascontiguousarray(matrices.transpose(2, 0, 1))


def _forms(matrices: Array) -> Array:
    """(k, m (m + 1) / 2) of (k, m, m): what the products of `erls.equations.erls.stiffened.tensors.pairs` stand
    with.
    """
    size = matrices.shape[1]
    places = [(i, j) for i in reversed(range(size)) for j in range(i, size)]
    first, second = np.array(places, dtype=np.int64).reshape(-1, 2).T
    both = matrices[:, first, second] + matrices[:, second, first]
    return np.asarray(both * np.where(first == second, 0.5, 1.0))


def _constants(chain: Erls, k: int, axes: Array) -> dict[int, Array]:
    """What link k has of second order, by place in its record; ``axes`` are those about which it turns."""
    link = chain.mechanism.links[k]
    modes = combined_modes(link, chain.compatibility.rows[k].own)
    data, n = link.second_order, len(modes)
    turns, moves = slice(6 if k == 0 else 3, None), slice(6 if k == 0 else 0, None)
    x, z = modes.T @ link.invariants.X @ modes, modes.T @ link.invariants.Z @ modes
    momenta, spin = np.zeros((6, n, n)), np.zeros((3 * len(axes), n, n))
    if data is not None:
        momenta = modes.T @ data.momentum @ modes
        spin = modes.T @ np.einsum("nd,cdab->ncab", axes, data.spin).reshape(spin.shape) @ modes
    momenta, spin, bow = (tensor[:, turns, turns] for tensor in (momenta, spin, _bow(chain, k, modes)))
    return {
        more.MASS: _stack((modes.T @ link.invariants.m @ modes)[None]),
        more.X: _stack(x[:, :, moves]),
        more.X_TOP: x[:, :6, moves],
        more.X_ODD: _stack((x - x.transpose(0, 2, 1))[:, moves, moves]),
        more.X_FORMS: _forms(x[:, moves, moves]),
        more.Z: _stack(np.stack([(z[a, b] + z[b, a]) / 2 for a, b in _PAIRS])[:, moves, moves]),
        more.ROWS: _stack(np.concatenate([momenta.transpose(0, 2, 1), spin])),
        more.ODD: _stack((momenta - momenta.transpose(0, 2, 1))[3:]),
        more.FORMS: _forms(momenta),
        more.BOW: _stack(bow),
        more.BOW_FORMS: _forms(bow),
        more.COMPLIANCE: compliance(link.invariants.rigid_mass_matrix),
        more.REACH: _reach(chain, k),
    }


def _bow(chain: Erls, k: int, modes: Array) -> Array:
    """(6, n, n) displacement of the outboard interface, as motions of the link's frame."""
    link, n = chain.mechanism.links[k], len(modes)
    if k + 1 == len(chain.mechanism.links) or link.outboard is None:
        return np.zeros((6, n, n))
    before = chain.mechanism.joints[k + 1].before
    found = frame_second_order(link, link.outboard, before)
    if found is None:
        return np.zeros((6, n, n))
    return np.asarray(np.einsum("ij,jab->iab", twist_transform(inverse(before)), modes.T @ found @ modes))


def _reach(chain: Erls, k: int) -> Array:
    """(6,) axis of a slide, and arm from the inboard interface to the joint, in link axes; zeros on the ground."""
    link, joint = chain.mechanism.links[k], chain.mechanism.joints[k]
    if k == 0:
        return np.zeros(6)
    slide = np.zeros(3) if joint.type.revolute else joint.screw[:3]
    arm = np.zeros(3) if link.second_order is None else inverse(joint.after)[:3, 3] - link.inboard.position
    return np.concatenate([slide, arm])


def compile_stiffened(chain: Erls) -> CompiledSystem | None:
    """The compiled form of a chain with second-order displacements in the joint-angle gauge.

    Parameters
    ----------
    chain : Erls

    Returns
    -------
    CompiledSystem or None
        None when a link's modes hold no exact rigid-body motions.
    """
    base = compile_chain(chain, dense=chain.size)  # link by link it solves with other inertias
    if base is None:
        return None
    pack = Packer(base.integers, base.reals)
    header, memory = [0] * more.HEADER, len(base.scratch)
    records: list[int] = []
    order: list[int] = []
    for k, link in enumerate(chain.mechanism.links):
        numbers = base.integers[at.HEADER + k * at.RECORD : at.HEADER + (k + 1) * at.RECORD]
        e, axes, axis, joint, first = (int(numbers[i]) for i in (at.MODES, at.AXES, at.AXIS, at.JOINT, at.FIRST_MODE))
        constants = _constants(chain, k, base.reals[axis : axis + 3 * axes].reshape(axes, 3))
        kept, left = (e, e) if k == 0 else (3 + e, 6 + e)
        record = {
            more.CURVED: int(link.second_order is not None),
            more.BOWS: int(constants[more.BOW].any()),
            more.ARMED: int(constants[more.REACH].any()),
            more.KEPT: kept,
            more.LEFT: left,
            more.START: len(order),
            **{place: pack.put(values) for place, values in constants.items()},
        }
        for place, size in more.memory_sizes(e, kept, left, axes).items():
            record[place] = memory
            memory += size
        records += [record[place] for place in range(more.RECORD)]
        order += ([joint] if joint >= 0 else []) + list(range(first, first + e))
    n = chain.size
    header[more.ORDER], header[more.MATRIX] = len(pack.integers), memory
    header[more.COLUMNS] = memory + n * (n + 1) // 2
    return replace(
        base,
        reals=pack.reals,
        integers=np.array([*pack.integers, *order, *header, *records], dtype=np.int64),
        scratch=np.zeros(header[more.COLUMNS] + more.ROW_COUNT * n),
        residual=equations.residual,
        mass_matrix=equations.mass_matrix,
        stiffness_and_damping=equations.stiffness_and_damping,
        load_acceleration=acceleration_in("erls.equations.erls.stiffened.elimination"),
    )
