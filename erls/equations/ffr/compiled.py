"""The constants of a chain of floating frames, packed for `erls.equations.ffr`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from erls.equations.compiled_system import CompiledSystem, Factoring, acceleration_in
from erls.equations.ffr import compiled_functions as equations
from erls.equations.ffr import layout
from erls.equations.ffr.interface_motion import InterfaceMotion
from erls.equations.ffr.second_order import SecondOrderData
from erls.equations.serial.decoupled_modes import MIXING, DecoupledModes, decoupled_modes
from erls.equations.serial.packing import Packer, joint_numbers, step_parts
from erls.maths.so3 import Array

if TYPE_CHECKING:
    from erls.equations.ffr.equations import Ffr

DENSE = 60  # coordinates up to which dense factors cost less than elimination link by link

_EFFECTS = {
    layout.FIRST_ORDER: "inertia_first_order",
    layout.SECOND_ORDER: "inertia_second_order",
    layout.CORIOLIS: "coriolis",
    layout.CENTRIFUGAL: "centrifugal_load",
    layout.SOFTENING: "spin_softening",
}


def _put_node(pack: Packer, node: InterfaceMotion | None) -> int:
    if node is None:
        return -1
    return pack.put(np.concatenate([node.position, node.translation.ravel(), node.rotation.ravel()]))


def _put_second_order(pack: Packer, chain: Ffr, k: int, outboard: InterfaceMotion | None) -> dict[int, int]:
    """Second-order displacements of a link, if it has any."""
    data = chain.data[k]
    if not isinstance(data, SecondOrderData):
        return {layout.BEND: -1, layout.BENT: 0}
    nodes = [node for node in (outboard, chain.recursion.inboard[k]) if node is not None]
    # a column for each coordinate that they are multiplied with
    stacks: list[Array] = [data.bend.transpose(1, 0, 2)]
    for node in nodes:
        assert node.second_order is not None  # as the data of its link
        stacks.append(node.second_order.transpose(2, 0, 1))
    skew: Array = data.bend[3:] - data.bend[3:].transpose(0, 2, 1)
    return {
        layout.BEND: pack.put(np.hstack(stacks)),
        layout.BENT: 6 + 6 * len(nodes),
        layout.SPIN: pack.put(data.spin.reshape(9, data.size, data.size).transpose(2, 0, 1)),
        layout.SKEW: pack.put(skew.transpose(1, 0, 2)),
        layout.PER_MASS: pack.put(np.asarray(data.per_mass, dtype=float)),
    }


def _decoupled_modes(chain: Ffr, k: int) -> DecoupledModes:
    link = chain.mechanism.links[k]
    return decoupled_modes(chain.data[k].elastic, link.stiffness, link.damping)


def _put_basis(pack: Packer, basis: DecoupledModes | None) -> dict[int, int]:
    """Coordinates for `erls.equations.ffr.link_by_link`."""
    if basis is None:
        return {}
    return {
        layout.BASIS: pack.put(basis.vectors),
        layout.BASIS_STIFFNESS: pack.put(basis.stiffness),
        layout.BASIS_DAMPING: pack.put(basis.damping),
    }


def _rotation_axes(chain: Ffr, k: int) -> Array:
    """(axes, 3) about which the frame of a link turns: on the ground that of its joint alone; behind a link, on mean
    axes, or with a corrected twist all three.
    """
    if k > 0 or chain.recursion.inboard[k] is not None or isinstance(chain.data[k], SecondOrderData):
        return np.eye(3)
    turning = chain.recursion.screws[k][None, 3:]
    return turning if chain.mechanism.joints[k].type.revolute else np.zeros((0, 3))


def compile_frames(chain: Ffr, dense: int = DENSE) -> CompiledSystem:
    """The compiled form of a chain.

    Parameters
    ----------
    chain : Ffr
    dense : int
        Coordinates up to which iteration matrices get dense factors. Beyond, they are solved link by link, with the
        damping that couples elastic coordinates of a link left out of them where that hardly slows iterations down.
    """
    mechanism, recursion = chain.mechanism, chain.recursion
    links = len(mechanism.links)
    pack = Packer(np.zeros(layout.HEADER + links * layout.RECORD, dtype=np.int64), mechanism.gravity)
    free = {int(k): i for i, k in enumerate(chain.free_joints)}
    memory = shifted = 0
    bases = [_decoupled_modes(chain, k) if chain.size > dense else None for k in range(links)]
    for k, (joint, data) in enumerate(zip(mechanism.joints, chain.data, strict=True)):
        e, drive, axes = data.size, joint.drive, _rotation_axes(chain, k)
        outboard = recursion.outboard[k + 1] if k + 1 < links else None
        half = np.einsum("ca,aij->cij", axes, data.half)
        turned = np.einsum("ca,aij->cij", axes, data.turned)
        square = np.einsum("ca,db,abij->cdij", axes, axes, data.square)
        pairs = [(i, i) for i in range(len(axes))] + ([(0, 1), (0, 2), (1, 2)] if len(axes) == 3 else [])
        record = {
            layout.MODES: e,
            layout.FIRST_MODE: len(free) + chain.modes[k].start,
            layout.JOINT: free.get(k, -1),
            layout.AXES: len(axes),
            layout.SLIDES: int(not joint.type.revolute),
            layout.MOTION: pack.put_curve(drive.motion),
            layout.LOAD: pack.put_curve(drive.load),
            layout.FEED: int(drive.feed_forward),
            layout.EFFORT: int(k in chain.efforts.active),
            layout.MEMORY: memory,
            layout.STEP: pack.put(step_parts(recursion.before[k], joint.type.revolute, recursion.after[k])),
            layout.SCREW: pack.put(recursion.screws[k]),
            layout.RIGID_STEP: pack.put(step_parts(joint.before, joint.type.revolute, joint.after)),
            layout.RIGID_SCREW: pack.put(joint.screw),
            layout.OUTBOARD: _put_node(pack, outboard),
            layout.INBOARD: _put_node(pack, recursion.inboard[k]),
            layout.AXIS: pack.put(axes),
            layout.RIGID: pack.put(data.rigid),
            layout.MOMENT: pack.put(np.array([data.mass, *data.first_moment])),
            layout.COUPLING: pack.put(data.coupling),
            layout.ELASTIC: pack.put_columns(data.elastic),
            layout.HALF: pack.put(half),
            layout.TURNED: pack.put_columns(*turned),
            layout.GYROSCOPIC: pack.put_columns(*(turned - turned.transpose(0, 2, 1))),
            layout.SQUARE: pack.put_columns(*((square[i, j] + square[j, i]) / 2 for i, j in pairs)),
            layout.STIFFNESS: pack.put(mechanism.links[k].stiffness),
            layout.DAMPING: pack.put(mechanism.links[k].damping),
            layout.FORCES: pack.put(joint_numbers(joint.forces, drive, joint.rotor_inertia, joint.position)),
            **_put_second_order(pack, chain, k, outboard),
            **_put_basis(pack, bases[k]),
            layout.SHIFTED: shifted,
        }
        for place, value in record.items():
            pack.integers[layout.HEADER + k * layout.RECORD + place] = value
        memory += layout.memory_size(e, isinstance(data, SecondOrderData))
        shifted += layout.factor_size(e)
    header = {
        layout.LINKS: links,
        layout.WEIGHT: int(bool(np.any(mechanism.gravity))),
        layout.FEED_FORWARD: int(bool(chain.efforts.leading)),
        layout.MATRIX: memory,
        **{place: int(name in mechanism.effects) for place, name in _EFFECTS.items()},
    }
    for place, value in header.items():
        pack.integers[place] = value
    factoring, accelerate, room = None, "erls.equations.ffr.solve", chain.size**2 + chain.size
    if all(basis is not None and basis.mixing < MIXING for basis in bases):
        from erls.equations.ffr import factoring as linked  # here: it is compiled on its own

        accelerate, room = "erls.equations.ffr.factoring", shifted
        factoring = Factoring(shifted, linked.factor, linked.solve, linked.factor_complex, linked.solve_complex)
    return CompiledSystem(
        size=chain.size,
        reals=pack.reals,
        integers=np.array(pack.integers, dtype=np.int64),
        scratch=np.zeros(memory + room),
        residual=equations.residual,
        mass_matrix=equations.mass_matrix,
        stiffness_and_damping=equations.stiffness_and_damping,
        load_acceleration=acceleration_in(accelerate),
        factoring=factoring,
    )
