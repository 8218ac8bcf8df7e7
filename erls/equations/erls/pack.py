"""A chain in the joint-angle gauge as records, from a mechanism."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from erls.equations.compiled_system import CompiledSystem, Factoring, function_in
from erls.equations.erls import records as own
from erls.equations.serial import pack, segments
from erls.equations.serial.condensed import condensed as elimination_memory
from erls.equations.serial.contacts import put_contacts
from erls.equations.serial.decoupled_modes import MIXING, DecoupledModes, decoupled_modes
from erls.equations.serial.ends import end_state
from erls.equations.serial.kept import kept, kept_record
from erls.equations.serial.loads import overwrite_loads, put_loads
from erls.equations.serial.modal_inertia import compliance, modal_inertia, stiffened
from erls.equations.serial.modal_inertia_kernels import Warp, warp_record, warp_state
from erls.equations.serial.nodes import RESTING, laid_node, laid_node_state
from erls.equations.serial.records import JOINT, Modes, Serial
from erls.equations.serial.records import Joint as JointNumbers
from erls.maths.records import Laid, Memory, laid, place_of, python_reader
from erls.maths.se3 import inverse, pose, twist_transform
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.joints import Joint
from erls.mechanism.links import Link
from erls.mechanism.loops import loop_ends

_see_serial = python_reader(Serial)
_PARALLEL = 1e-13  # sine of the angle between axes that count as one
DENSE = 40  # coordinates up to which dense factors cost less than elimination link by link


def _zeros(make: Callable[..., Any]) -> Callable[..., Laid]:
    """Memory by its sizes: zeros, which are shared and copied where they go."""
    return cache(lambda *sizes: laid(make(*sizes)))


_bend_state, _change, _link_state = _zeros(own.bend_state), _zeros(own.change), _zeros(own.link_state)
_warp_state, _end_state = _zeros(warp_state), _zeros(end_state)
_RIGID_WARP, _RESTING = laid(warp_record(None)), laid(RESTING)
_PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))  # of axes


def rotation_axes(joints: Sequence[Joint]) -> list[Array]:
    """(A, 3) for each link: the one axis about which it can turn, in its own frame, or all three; none for a link that
    only slides.
    """
    result: list[Array] = []
    for joint in joints:
        axes = result[joint.parent] if joint.parent >= 0 else np.zeros((0, 3))
        if joint.freedom.vector:
            axes = np.eye(3)
        elif joint.freedom.turns:
            along = joint.before[:3, joint.freedom.axis]
            if len(axes) == 1 and np.linalg.norm(np.cross(axes[0], along)) > _PARALLEL:
                axes = np.eye(3)
            elif len(axes) < 3:
                axes = joint.screw[None, 3:]
        elif len(axes) == 1:
            axes = axes @ joint.before[:3, :3] @ joint.after[:3, :3]
        result.append(axes)
    return result


@dataclass(frozen=True)
class Shapes:
    """What the equations hold of a link and of the interface of its parent.

    Attributes
    ----------
    modes : (m, n) array
        [ρ Ψ]: its modal coordinates per (u, q_d).
    out : (6, e of the parent) array
        What the parent's interface moves, as a motion of the parent's frame.
    """

    modes: Array
    out: Array


def combined_modes(link: Link, joint: Joint) -> Array:
    """(m, m) the modes [ρ Ψ] of a link over its own, with Ψ leaving its inboard interface where it is."""
    return _combined_modes(link, joint.after)


def _combined_modes(link: Link, after: Array) -> Array:
    interface = link.interface_shape(link.inboard, inverse(after))
    stay = -np.linalg.solve(interface[:, :6], interface[:, 6:])
    return np.hstack([link.invariants.rigid, np.vstack([stay, np.eye(link.elastic_modes)])])


def shapes(mechanism: Mechanism) -> list[Shapes]:
    """Of all links."""
    result: list[Shapes] = []
    for link, joint in zip(mechanism.links, mechanism.joints, strict=True):
        out = np.zeros((6, 0))
        if joint.seat is not None:
            moved_frame = mechanism.links[joint.parent].interface_shape(joint.seat, joint.before)
            out = twist_transform(inverse(joint.before)) @ moved_frame @ result[joint.parent].modes[:, 6:]
        result.append(Shapes(kept(_combined_modes, link, joint.after), out))
    return result


def _link(link: Link, modes: Array, axes: Array, out: Array, vectors: Array, before: Array, parent: int) -> own.Link:
    """Constants of a link; ``vectors`` are its decoupled coordinates, ``before`` those of its parent."""
    mass = modes.T @ link.invariants.m @ modes
    x = modes.T @ np.einsum("ca,aij->cij", axes, link.invariants.X) @ modes
    z = np.einsum("ca,db,abij->cdij", axes, axes, link.invariants.Z)
    pairs = [(i, j) for i, j in _PAIRS if max(i, j) < len(axes)]
    n = modes.shape[1]
    return own.Link(
        parent=parent,
        axes=axes,
        mass=(mass + mass.T) / 2,
        x=x.transpose(0, 2, 1),
        z=np.array([modes.T @ ((z[i, j] + z[j, i]) / 2) @ modes for i, j in pairs]).reshape(len(pairs), n, n),
        out=out.T,
        rigid_decoupled=mass[:6, 6:] @ vectors,
        out_decoupled=(out @ before).T,
    )


def _columns(matrices: Array) -> Array:
    """(columns, matrices * rows) of (matrices, rows, columns)."""
    count, rows, columns = matrices.shape
    return np.ascontiguousarray(matrices.transpose(2, 0, 1)).reshape(columns, count * rows)


def _bend(link: Link, basis: Array, axes: Array, warps: bool) -> own.Bend:
    curved = _curved(link)
    rows, odd, e = np.zeros((6 + 3 * len(axes), 0, 0)), np.zeros((3, 0, 0)), basis.shape[1]
    if curved:
        assert link.second_order is not None
        momenta = basis.T @ link.second_order.momentum @ basis
        spin = np.einsum("nd,cdab->ncab", axes, basis.T @ link.second_order.spin @ basis)
        rows = np.concatenate([momenta.transpose(0, 2, 1), spin.reshape(3 * len(axes), e, e)])
        odd = (momenta - momenta.transpose(0, 2, 1))[3:]
    return own.Bend(
        curved=int(curved),
        warped=int(curved and warps),
        axes=axes,
        rows=_columns(rows),
        odd=_columns(odd),
        compliance=compliance(link.invariants.rigid_mass_matrix),
    )


def _before(mechanism: Mechanism, k: int, bends: bool) -> Array:
    """Pose of a joint from the frame of the parent; where that is anchored, from the interface which it stands on."""
    joint = mechanism.joints[k]
    if not bends or joint.seat is None or not mechanism.links[joint.parent].elastic_modes:
        return joint.before
    return pose(position=-mechanism.links[joint.parent].model.nodes[joint.seat.node]) @ joint.before


def _curved(link: Link) -> bool:
    """Whether a link has second-order displacements."""
    return link.second_order is not None and link.elastic_modes > 0


def _seat(mechanism: Mechanism, k: int, found: Sequence[Shapes]) -> Laid:
    """The interface of its parent on which the joint of link k stands."""
    joint = mechanism.joints[k]
    if joint.seat is None:
        return _RESTING
    link = mechanism.links[joint.parent]
    return laid_node(joint.parent, link, found[joint.parent].modes[:, 6:], joint.seat.node, _curved(link))


def _warp(link: Link, basis: Array) -> Warp:
    return warp_record(modal_inertia(link, {"modal_inertia"}, basis))


def _mass(link: Link, modes: Array) -> Array:
    return np.asarray(modes.T @ link.invariants.m @ modes)


def _decoupled(link: Link, mass: Array) -> DecoupledModes:
    return decoupled_modes(mass, link.stiffness, link.damping)


def _modes(link: Link, first: int, mass: Array) -> Modes:
    return pack.modes_record(first, mass, link, kept(_decoupled, link, mass))


def _bends(
    mechanism: Mechanism, found: Sequence[Shapes], axes: Sequence[Array], constants: Memory, scratch: Memory
) -> dict[str, int]:
    """Places of what chains with second-order displacements have, by the names of fields of `Chain`."""
    links, count, places = mechanism.links, range(len(mechanism.links)), {}
    modes = [link.elastic_modes for link in links]
    inertial = "modal_inertia" in mechanism.effects
    bends = [kept_record(_bend, links[k], found[k].modes[:, 6:], axes[k], inertial) for k in count]
    seats = [_seat(mechanism, k, found) for k in count]
    warps = [
        kept_record(_warp, link, found[k].modes[:, 6:]) if bends[k].record.warped else _RIGID_WARP
        for k, link in enumerate(links)
    ]
    places["bends"] = constants.put_all(bends)
    places["seats"] = constants.put_all(seats)
    places["warps"] = constants.put_all(warps)
    before = [modes[parent] if parent >= 0 else 0 for parent in mechanism.parents]
    states = [_bend_state(modes[k], before[k], len(axes[k])) for k in count]
    places["bend_states"] = scratch.put_all(states)
    places["seat_states"] = scratch.put_all(list(map(laid_node_state, seats)))
    places["warp_states"] = scratch.put_all([_warp_state(modes[k] * bends[k].record.warped) for k in count])
    places["changes"] = scratch.put_all([_change(modes[k]) for k in count])
    return places


@cache
def _segments(
    parents: tuple[int, ...], sizes: tuple[int, ...], modes: tuple[int, ...], curved: tuple[int, ...]
) -> tuple[list[Laid], list[Laid]]:
    """Memory for elimination, by what a link moves, its elastic coordinates, and what its curvature adds to rows."""
    rooms = [
        segments.segment(
            parent,
            sizes[k],
            modes[k],
            sizes[parent] if parent >= 0 else 0,
            modes[parent] if parent >= 0 else 0,
            6 if parent >= 0 and modes[parent] else 0,
            curved[k],
        )
        for k, parent in enumerate(parents)
    ]
    return list(map(laid, rooms)), list(map(laid, elimination_memory(rooms)))


def with_numbers(system: CompiledSystem, mechanism: Mechanism) -> CompiledSystem:
    """The same system with where the joints of another mechanism start, and its loads.

    Parameters
    ----------
    system : CompiledSystem
        Which `pack_chain` made, and nobody used.
    mechanism : Mechanism
        One that differs from that of the system in nothing else.
    """
    reals, integers = system.reals.copy(), system.integers.copy()
    serial = _see_serial(reals, integers, int(integers[0]))
    for k, joint in enumerate(mechanism.joints):
        reals[place_of(JointNumbers, "held", integers, serial.joints + k * JOINT)] = joint.position
    overwrite_loads(mechanism, serial, reals, integers)
    return replace(system, reals=reals, integers=integers, scratch=system.scratch.copy())


_UNBENT = dict.fromkeys(("bends", "seats", "warps", "bend_states", "seat_states", "warp_states", "changes"), -1)


def pack_chain(mechanism: Mechanism, dense: int = DENSE, complete: bool = False) -> CompiledSystem:
    """The compiled form of a chain in the joint-angle gauge.

    Parameters
    ----------
    mechanism : Mechanism
    dense : int
        Coordinates up to which iteration matrices get dense factors. Beyond, they are solved link by link, with the
        damping that couples elastic coordinates of a link left out of them where that hardly slows iterations down.
    complete : bool
        Whether the wrenches of links are complete. No joint feels what a link carries by itself, and for the motion
        that is left out: moments about axes about which no joint turns, and what acts on the ground.
    """
    links, count = mechanism.links, len(mechanism.links)
    free = [k for k, joint in enumerate(mechanism.joints) if not joint.drive.prescribed]
    modes = [link.elastic_modes for link in links]
    firsts = len(free) + np.concatenate([[0], np.cumsum(modes)]).astype(int)
    found = shapes(mechanism)
    axes = [np.eye(3)] * count if complete else rotation_axes(mechanism.joints)
    bends = stiffened(mechanism)
    curved = [bends and _curved(link) for link in links]
    ends = loop_ends(mechanism.loops)
    integers: list[int] = [0]
    constants, scratch, condensed = Memory(integers), Memory(integers), Memory(integers)

    masses = [kept(_mass, link, shape.modes) for shape, link in zip(found, links, strict=True)]
    decoupled = [kept(_decoupled, link, mass[6:, 6:]) for mass, link in zip(masses, links, strict=True)]
    joints = [
        pack.joint_record(
            constants,
            joint,
            free.index(k) if k in free else -1,
            pack.step_parts(_before(mechanism, k, bends), joint.freedom, joint.after),
            joint.screw,
        )
        for k, joint in enumerate(mechanism.joints)
    ]
    parents = mechanism.parents
    # anchored links turn as displacements make them turn
    axes = [np.eye(3) if bends and parent >= 0 else each for each, parent in zip(axes, parents, strict=True)]
    inertial = [np.eye(3) if curved[k] else axes[k] for k in range(count)]
    vectors = [each.vectors for each in decoupled]
    vectors_before = [vectors[parent] if parent >= 0 else np.zeros((0, 0)) for parent in parents]
    # on the ground a link moves along its joint alone
    sizes = [6 + (0 if bends else len(axes[k])) if parent >= 0 or curved[k] else 1 for k, parent in enumerate(parents)]
    warped = bends and "modal_inertia" in mechanism.effects
    curved_rows = [6 + warped * modes[k] if curved[k] else 0 for k in range(count)]
    rooms, elimination = _segments(tuple(parents), tuple(sizes), tuple(modes), tuple(curved_rows))
    chain = own.Chain(
        links=constants.put_all(
            [
                kept_record(_link, links[k], found[k].modes, inertial[k], found[k].out, vectors[k], before, parent)
                for k, (parent, before) in enumerate(zip(parents, vectors_before, strict=True))
            ],
        ),
        states=scratch.put_all([_link_state(modes[k], len(inertial[k])) for k in range(count)]),
        **(_bends(mechanism, found, axes, constants, scratch) if bends else _UNBENT),
        segments=scratch.put_all(rooms),
        condensed=condensed.put_all(elimination),
        factors=0,
        left=0,
        **pack.effect_flags(mechanism.effects),
        weight=int(bool(np.any(mechanism.gravity))),
        complete=int(complete),
        end_count=len(ends),
        ends=constants.put_all([pack.end_record(links[k], found[k].modes, bends, end) for k, end in ends]),
        end_states=scratch.put_all([_end_state(6 + modes[k]) for k, _ in ends]),
    )
    rigid, rigid_state = pack.rigid_links(mechanism, constants, scratch)
    size, own_name, kind = len(free) + sum(modes), "erls.equations.erls", "stiffened_" if bends else ""
    residual = function_in(f"{own_name}.{kind}residual", "residual")()
    serial = Serial(
        links=count,
        joints=constants.put_all(joints),
        joint_states=pack.joint_states(scratch, count),
        modes=constants.put_all(
            [kept_record(_modes, links[k], int(firsts[k]), masses[k][6:, 6:]) for k in range(count)]
        ),
        **pack.addresses(mechanism, own.call_loads),
        rigid_links=rigid,
        rigid_states=rigid_state,
        **put_loads(mechanism, [shape.modes for shape in found], curved, constants, scratch),
        **put_contacts(mechanism, residual, size, constants, scratch),
        own=0,
        gravity=mechanism.gravity,
    )
    room = len(condensed.numbers)
    chain = chain._replace(factors=len(scratch.numbers), left=len(scratch.numbers) + room)
    serial = serial._replace(own=constants.put(chain))
    integers[0] = constants.put(serial)
    factoring = None
    if size > dense and not mechanism.contacts and max((each.mixing for each in decoupled), default=0.0) < MIXING:
        factor, factor_complex = (
            function_in(f"{own_name}.{kind}factors", name)() for name in ("factor", "factor_complex")
        )
        solve, solve_complex = (function_in(f"{own_name}.solve", name)() for name in ("solve", "solve_complex"))
        factoring = Factoring(room, factor, solve, factor_complex, solve_complex)
    return CompiledSystem(
        size=size,
        reals=constants.numbers,
        integers=np.array(integers, dtype=np.int64),
        scratch=np.concatenate([scratch.numbers, np.zeros(room + (size if bends else 0))]),
        residual=residual,
        mass_matrix=function_in(f"{own_name}.{kind}mass_matrix", "mass_matrix")(),
        stiffness_and_damping=function_in("erls.equations.serial.stiffness", "stiffness_and_damping")(),
        load_acceleration=function_in(f"{own_name}.{kind}acceleration", "acceleration"),
        factoring=factoring,
        load_frames=function_in(f"{own_name}.{kind}ends", "frames"),
    )
