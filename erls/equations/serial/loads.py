"""Forces and moments on displaced nodes of links: what they do to a link's frame and to its coordinates.

With the node's pose N(q) in the frame of its link and its twist Ad(N⁻¹) ν + A(q) q̇ in its own axes, the virtual power
of a wrench W there is

    W · (Ad(N⁻¹) ν + A q̇)  =  Ad(N)⁻ᵀ W · ν + Aᵀ W · q̇,

the generalized forces on ν and on q (ERLS-CMS paper, section 4.4, eq. 64-67, there for small displacements of the
node). A follower gives W itself; other loads are turned into the axes of the node, from the world or from those of
another node.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Annotated, Any, NamedTuple

import numpy as np

from erls.equations import compiled_system as contract
from erls.equations.serial.nodes import (
    NODE,
    NODE_STATE,
    NodeState,
    centre_record,
    from_node_axes,
    laid_node,
    laid_node_state,
    move_node,
    place_node,
    read_node,
    read_node_state,
)
from erls.equations.serial.records import MODES, Serial, read_modes
from erls.equations.serial.time_curves import curve, put_curve
from erls.maths.calls import caller
from erls.maths.jit import ENABLED, part
from erls.maths.products import add_columns, clear
from erls.maths.records import Laid, Memory, Vector, laid, place_of, python_reader, reader, room, table_size
from erls.maths.so3 import Array
from erls.maths.spatial import dot6, rotate, rotate_back, transform_force_back, transform_motion
from erls.mechanism.chain import Mechanism
from erls.mechanism.contacts import PointContact
from erls.mechanism.links import Link
from erls.mechanism.loads import CENTRE, PointLoad
from fe_import.model import IntArray

LOADS: Any = None
"""Signature of a formulation's ``loads``: place of the `Serial`, memory, time, y, v, forces."""
TOUCH: Any = None
"""Signature of `erls.equations.serial.touch.touch`: place of the `Serial`, number of the load, memory."""
if ENABLED:
    from numba import types as _t

    _memory = (contract.REALS, contract.INTEGERS, contract.REALS)
    LOADS = _t.void(_t.int64, *_memory, _t.float64, contract.REALS, contract.REALS, contract.REALS)
    TOUCH = _t.void(_t.int64, _t.int64, *_memory)

call_touch = caller(TOUCH, "erls.equations.serial.touch:touch")


class Load(NamedTuple):
    """A wrench on a node, given or that of a contact.

    Attributes
    ----------
    link : int
        That carries the node.
    reference : int
        Link whose node turns the wrench, or takes part in the contact; -1 for the world.
    follower : int
        Whether that is the node itself.
    factor : int
        Place of the curve that multiplies the wrench; -1 without.
    contact : int
        Number of the contact that gives the wrench; -1 without.
    side : int
        Of a contact: 0 its node, 1 what carries its plane.
    wrench : (6,) array
        Force [N] and moment [N m].
    """

    link: int
    reference: int
    follower: int
    factor: int
    contact: int
    side: int
    wrench: Vector


class LoadState(NamedTuple):
    """Working memory of a load on a link with n coordinates.

    Attributes
    ----------
    pose, other, spare : (12,) arrays
        Of the link and of the one whose node turns the wrench, in the world, where their axes are asked for; spare.
    given : (6,) array
        The wrench in the axes of its node.
    wrench, forces : (6,), (n,) arrays
        On the link's frame and on its coordinates.
    moved, turning : (6,) arrays
        Twist of the node in its axes; of a contact, also that of the node on the other side.
    power : (1,) array
        Of what is not elastic [W].
    """

    pose: Annotated[Array, "12"]
    other: Annotated[Array, "12"]
    spare: Annotated[Array, "12"]
    given: Annotated[Array, "6"]
    wrench: Annotated[Array, "6"]
    forces: Annotated[Array, "n"]
    moved: Annotated[Array, "6"]
    turning: Annotated[Array, "6"]
    power: Annotated[Array, "1"]


read_load, read_load_state = reader(Load), reader(LoadState)
LOAD, LOAD_STATE = table_size(Load), table_size(LoadState)
_see_state = python_reader(LoadState)


@cache
def _load_state(n: int) -> Laid:
    return laid(room(LoadState, n=n))


def put_loads(
    mechanism: Mechanism, bases: list[Array], bent: list[bool], constants: Memory, scratch: Memory
) -> dict[str, int]:
    """Records of all loads; the places of the first, by the names of fields of `Serial`.

    Parameters
    ----------
    mechanism : Mechanism
    bases : list of (m, n) arrays
        Modal coordinates of each link per coordinate that the formulation has of it.
    bent : list of bool
        Which links have second-order displacements.
    constants, scratch : Memory
    """
    sides = sides_of(mechanism.contacts)
    own = [*mechanism.loads, *(load for load, _, _ in sides)]
    places_of = [(-1, 0)] * len(mechanism.loads) + [(number, side) for _, number, side in sides]

    def at(k: int, node: int) -> Laid:
        given = k, mechanism.links[k], bases[k]
        return laid(centre_record(*given, bent[k])) if node == CENTRE else laid_node(*given, node, bent[k])

    nodes = [node for load in own for node in (at(load.link, load.node), at(*(load.axes or (load.link, load.node))))]
    records = [
        Load(
            link=load.link,
            reference=load.axes[0] if load.axes else -1,
            follower=int(load.follower),
            factor=put_curve(constants, load.factor),
            contact=number,
            side=side,
            wrench=_wrench(mechanism, load),
        )
        for load, (number, side) in zip(own, places_of, strict=True)
    ]
    tables: dict[str, tuple[Memory, list[Any]]] = {
        "load_records": (constants, records),
        "load_nodes": (constants, nodes),
        "load_states": (scratch, [_load_state(bases[load.link].shape[1]) for load in own]),
        "load_node_states": (scratch, list(map(laid_node_state, nodes))),
    }
    return {"load_count": len(own), **{name: memory.put_all(every) for name, (memory, every) in tables.items()}}


def _wrench(mechanism: Mechanism, load: PointLoad) -> Array:
    return load.wrench * (_mass(mechanism.links[load.link]) if load.node == CENTRE else 1.0)


def overwrite_loads(mechanism: Mechanism, serial: Serial, reals: Array, integers: IntArray) -> None:
    """Put the wrenches of a mechanism in the place of others on the same nodes."""
    for k, load in enumerate(mechanism.loads):
        at = place_of(Load, "wrench", integers, serial.load_records + k * LOAD)
        reals[at : at + 6] = _wrench(mechanism, load)


def sides_of(contacts: Sequence[PointContact]) -> list[tuple[PointLoad, int, int]]:
    """Every contact as a load on its node, and one on what carries its plane; its number, and the side: 0, 1."""
    result = []
    for number, contact in enumerate(contacts):
        result.append((PointLoad(contact.link, contact.node, np.zeros(6), contact.base), number, 0))
        if contact.base is not None:
            result.append((PointLoad(*contact.base, np.zeros(6), (contact.link, contact.node)), number, 1))
    return result


def _mass(link: Link) -> float:
    """Of a link with what it carries [kg]."""
    return float(np.trace(link.invariants.rigid_mass_matrix[:3, :3])) / 3


def load_powers(system: contract.CompiledSystem, serial: Serial) -> list[Array]:
    """Views (1,) of the power that a residual leaves of every load [W]."""
    places = (serial.load_states + k * LOAD_STATE for k in range(serial.load_count))
    return [_see_state(system.scratch, system.integers, at).power for at in places]


@part
def elastic_places(serial: Serial, reals: Array, integers: IntArray, k: int, shift: int) -> tuple[int, int]:
    """Places of the elastic coordinates of link k, ``shift`` behind those among the independent coordinates."""
    modes = read_modes(reals, integers, serial.modes + k * MODES)
    return modes.first + shift, modes.first + shift + len(modes.stiffness)


@part
def needs_world(load: Load) -> bool:
    """Whether the wrench is turned by what stands on another link than its node, or by nothing, or is of a contact."""
    return load.contact >= 0 or load.reference != load.link


@part
def act(
    serial: Serial, at: int, reals: Array, integers: IntArray, scratch: Array, number: int, t: float, q: Array,
    rates: Array, twist: Array, other_q: Array, other_rates: Array, other_twist: Array,
) -> None:  # fmt: skip
    """A load in the motion of its link: ``wrench`` and ``forces``, what it does to the frame and to the coordinates.

    Parameters
    ----------
    serial, at, reals, integers, scratch : Serial, its place, arrays
    number : int
        Of the load, whose ``pose`` and ``other`` stand in its memory if `needs_world`.
    t : float
    q, rates : (n,) arrays
        Coordinates of the link and their rates.
    twist : (6,) array
        Of the link's frame, in its axes.
    other_q, other_rates, other_twist : arrays
        Those of the link whose node turns the wrench, or takes part in the contact.
    """
    load = read_load(reals, integers, serial.load_records + number * LOAD)
    work = read_load_state(scratch, integers, serial.load_states + number * LOAD_STATE)
    node = read_node(reals, integers, serial.load_nodes + 2 * number * NODE)
    moved = read_node_state(scratch, integers, serial.load_node_states + 2 * number * NODE_STATE)
    place_node(node, moved, q)
    move_node(node, moved, rates, rates[0:0])
    transform_motion(moved.pose, twist, work.moved)
    for i in range(6):
        work.moved[i] += moved.twist[i]
    turner = read_node(reals, integers, serial.load_nodes + (2 * number + 1) * NODE)
    turned = read_node_state(scratch, integers, serial.load_node_states + (2 * number + 1) * NODE_STATE)
    if load.reference >= 0 and not load.follower:
        place_node(turner, turned, other_q)
    if load.contact >= 0:
        if load.reference >= 0:
            move_node(turner, turned, other_rates, other_rates[0:0])
            transform_motion(turned.pose, other_twist, work.turning)
            for i in range(6):
                work.turning[i] += turned.twist[i]
        call_touch(serial.touch, at, number, reals, integers, scratch)
    else:
        factor = 1.0 + 0.0 * load.wrench[0]
        if load.factor >= 0:
            factor = curve(reals, integers, load.factor, t)[0]
        for i in range(6):
            work.given[i] = factor * load.wrench[i]
        if not load.follower:
            _turn(load, work, turned, moved, work.given[:3])
            _turn(load, work, turned, moved, work.given[3:])
        work.power[0] = dot6(work.given, work.moved)
    transform_force_back(moved.pose, work.given, work.wrench)
    from_node_axes(moved.pose, moved.tangent, work.given, work.moved)
    clear(work.forces)
    add_columns(moved.rows, work.moved, 1.0, work.forces)


@part
def _turn(load: Load, work: LoadState, turned: NodeState, moved: NodeState, x: Array) -> None:
    """A vector (3,) from the axes in which it is given into those of the node."""
    if load.reference >= 0:
        rotate(turned.pose, x, x)
    if needs_world(load):
        if load.reference >= 0:
            rotate(work.other, x, x)
        rotate_back(work.pose, x, x)
    rotate_back(moved.pose, x, x)
