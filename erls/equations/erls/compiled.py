"""The constants of a chain in the joint-angle gauge, packed for `erls.equations.erls`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from erls.equations.compiled_system import CompiledSystem, Factoring, acceleration_in
from erls.equations.erls import compiled_functions as equations
from erls.equations.erls import layout
from erls.equations.serial.decoupled_modes import MIXING, decoupled_modes
from erls.equations.serial.packing import Packer, joint_numbers, step_parts
from erls.maths.se3 import inverse, twist_transform
from erls.maths.so3 import Array
from erls.mechanism.joints import Joint
from erls.mechanism.links import Link

if TYPE_CHECKING:
    from erls.equations.erls.chain import Erls

_SAME = 1e-9  # relative: rigid-body modes are what they should be
_PARALLEL = 1e-13  # sine of the angle between axes that count as one

DENSE = 40  # coordinates up to which dense factors cost less than elimination link by link

_EFFECTS = {
    layout.FIRST_ORDER: "inertia_first_order",
    layout.SECOND_ORDER: "inertia_second_order",
    layout.CORIOLIS: "coriolis",
    layout.CENTRIFUGAL: "centrifugal_load",
    layout.SOFTENING: "spin_softening",
}


def _rotation_axes(joints: tuple[Joint, ...]) -> list[Array]:
    """(axes, 3) for each link: the one axis about which it can turn, in its own frame, or all three; none for a link
    that only slides.
    """
    result: list[Array] = []
    axes = np.zeros((0, 3))
    for joint in joints:
        if joint.type.revolute:
            along = joint.before[:3, 2]
            if len(axes) == 1 and np.linalg.norm(np.cross(axes[0], along)) > _PARALLEL:
                axes = np.eye(3)
            elif len(axes) < 3:
                axes = joint.screw[None, 3:]
        elif len(axes) == 1:
            axes = axes @ joint.before[:3, :3] @ joint.after[:3, :3]
        result.append(axes)
    return result


def _close(found: Array, expected: Array) -> bool:
    return bool(np.abs(found - expected).max(initial=0.0) <= _SAME * max(1.0, float(np.abs(expected).max(initial=0.0))))


def combined_modes(link: Link, own: Array) -> Array:
    """(m, m) the modes [ρ Ψ] of a link over its own, which leave its inboard interface where it is: ``own`` q = 0."""
    stay = -np.linalg.solve(own[:, :6], own[:, 6:])
    return np.hstack([link.invariants.rigid, np.vstack([stay, np.eye(link.elastic_modes)])])


def compile_chain(chain: Erls, dense: int = DENSE) -> CompiledSystem | None:
    """The compiled form of a chain in the joint-angle gauge.

    Parameters
    ----------
    chain : Erls
    dense : int
        Coordinates up to which iteration matrices get dense factors. Beyond, they are solved link by link, with the
        damping that couples elastic coordinates of a link left out of them where that hardly slows iterations down.

    Returns
    -------
    CompiledSystem or None
        None when a link's modes hold no exact rigid-body motions.
    """
    mechanism, places = chain.mechanism, chain.compatibility.layout
    links = len(mechanism.links)
    pack = Packer(np.zeros(layout.HEADER + links * layout.RECORD, dtype=np.int64))
    pack.put(mechanism.gravity)
    header = pack.integers
    header[layout.LINKS] = links
    for place, name in _EFFECTS.items():
        header[place] = int(name in mechanism.effects)
    header[layout.WEIGHT] = int(bool(np.any(mechanism.gravity)))
    axes_of = _rotation_axes(mechanism.joints)
    free = {int(k): i for i, k in enumerate(chain.free_joints)}
    memory, mixing = 0, 0.0
    shifted = sum(layout.memory_size(link.elastic_modes) for link in mechanism.links)
    for k, (link, joint, rows) in enumerate(
        zip(mechanism.links, mechanism.joints, chain.compatibility.rows, strict=True)
    ):
        e, rho = link.elastic_modes, link.invariants.rigid
        if not (_close(rho[6:], np.zeros((e, 6))) and _close(rows.own @ rho, twist_transform(inverse(joint.after)))):
            return None
        modes = combined_modes(link, rows.own)
        mass = modes.T @ link.invariants.m @ modes
        axes = axes_of[k]
        x = np.einsum("ca,aij->cij", axes, link.invariants.X)
        x = modes.T @ x @ modes
        z = np.einsum("ca,db,abij->cdij", axes, axes, link.invariants.Z)
        pairs = [(i, i) for i in range(len(axes))] + ([(0, 1), (0, 2), (1, 2)] if len(axes) == 3 else [])
        z_pairs = [modes.T @ ((z[i, j] + z[j, i]) / 2) @ modes for i, j in pairs]
        out = np.zeros((6, e))
        if k + 1 < links:
            following = chain.compatibility.rows[k + 1].previous
            assert following is not None  # only the first joint sits on the ground
            out = twist_transform(inverse(mechanism.joints[k + 1].before)) @ following @ modes[:, 6:]
        basis = decoupled_modes(mass[6:, 6:], link.stiffness, link.damping)
        mixing = max(mixing, basis.mixing)
        rigid_basis, out_basis = mass[:6, 6:] @ basis.vectors, out @ basis.vectors
        shares = rigid_basis @ rigid_basis.T, out_basis @ rigid_basis.T, out_basis @ out_basis.T
        block = np.concatenate([part.ravel() for part in (np.ones(e), rigid_basis, out_basis, *shares)])
        drive = joint.drive
        record = {
            layout.MODES: e,
            layout.FIRST_MODE: len(free) + places.elastic_of[k].start,
            layout.JOINT: free.get(k, -1),
            layout.AXES: len(axes),
            layout.SLIDES: int(not joint.type.revolute),
            layout.MOTION: pack.put_curve(drive.motion),
            layout.LOAD: pack.put_curve(drive.load),
            layout.FEED: int(drive.feed_forward),
            layout.EFFORT: int(k in chain.active_joints),
            layout.MEMORY: memory,
            layout.STEP: pack.put(step_parts(joint.before, joint.type.revolute, joint.after)),
            layout.SCREW: pack.put(joint.screw),
            layout.AXIS: pack.put(axes),
            layout.MASS: pack.put_columns(mass),
            layout.X: pack.put_columns(*x),
            layout.Z: pack.put_columns(*z_pairs),
            layout.OUT: pack.put_columns(out),
            layout.STIFFNESS: pack.put(link.stiffness),
            layout.DAMPING: pack.put(link.damping),
            layout.BASIS: pack.put(basis.vectors),
            layout.OUT_BASIS: pack.put_columns(out_basis),
            layout.RIGID_BASIS: pack.put_columns(rigid_basis),
            layout.BASIS_STIFFNESS: pack.put(basis.stiffness),
            layout.BASIS_DAMPING: pack.put(basis.damping),
            layout.BLOCK: pack.put(block),
            layout.FORCES: pack.put(joint_numbers(joint.forces, drive, joint.rotor_inertia, joint.position)),
            layout.SHIFTED: shifted,
        }
        for place, value in record.items():
            pack.integers[layout.HEADER + k * layout.RECORD + place] = value
        memory += layout.memory_size(e)
        shifted += layout.block_size(e)
    header[layout.FEED_FORWARD] = int(chain.needs_feed_forward)
    from_blocks = None
    if chain.size > dense and mixing < MIXING:
        from erls.equations.erls import shifted as linked  # here: it is compiled on its own

        size = shifted + 3
        from_blocks = Factoring(size, linked.factor, linked.solve, linked.factor_complex, linked.solve_complex)
    return CompiledSystem(
        size=chain.size,
        reals=pack.reals,
        integers=np.array(pack.integers, dtype=np.int64),
        scratch=np.zeros(memory),
        residual=equations.residual,
        mass_matrix=equations.mass_matrix,
        stiffness_and_damping=equations.stiffness_and_damping,
        load_acceleration=acceleration_in("erls.equations.erls.elimination"),
        factoring=from_blocks,
    )
