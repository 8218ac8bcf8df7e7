"""The arrays of a nodal system. Nodes k, velocities n = 6 k, conditions of joints m, unknowns N = n + m.

A pose is 12 numbers: position, then rotation, rows first. Pairs of frames are the poses of an element's or a joint's
frames in its first and its second node (for the ground, in the world). A node −1 is the ground, or none. A sample holds
what depends on time alone: of every joint the prescribed coordinate with two derivatives (0 unless prescribed), the
factor of every load, and of every actuator the wanted coordinate, the wanted rate and the torque besides.

Functions are given flat memory, whose last integer says where `Layout` lies, and read from it the records that they
use (`erls.maths.records`): a call with some hundred arrays would take as long as the forces on a body. Working memory
begins with a sample. The numbers of constants and of working memory may be complex.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from erls.equations.compiled_system import INTEGERS, MATRIX, REALS
from erls.maths.calls import caller
from erls.maths.jit import ENABLED
from erls.maths.records import Indices, Matrix, Pairs, Pile, Stack, Vector, reader

HELICOIDAL, LINEAR = 1, 2
"""How beams interpolate motion: as they do strains, or places and turns of their ends each by itself."""


class Model(NamedTuple):
    """What does not change during a run.

    Attributes
    ----------
    local : int
        1 on SE(3), 0 on R³×SO(3).
    gravity : (2, 3) array
        On beams and on bodies [m/s²].
    pairs : (E, 2) array
        Nodes of all elements, kind by kind in the order below, and of the joints, which come last.
    beam_nodes, beam_frames, beam_built, beam_stiffness, beam_inertia, beam_moving : arrays
        (e, 2), (e, 24), (e, 6), (e, 6, 6) per length, (e, 6, 6) times length, (e,) how it interpolates the motion of
        its mass: 0 where it has none, `HELICOIDAL`, `LINEAR`.
    body_nodes, bodies : arrays
        (b,), (b, 6, 6).
    load_nodes, load_positions, loads, load_dead : arrays
        (l, 2) where they act and in whose axes they are given, -1 for the world; (l, 3), (l, 6), (l,) whether the load
        keeps its direction there, rather than in the axes of its own node.
    actuator_nodes, actuator_frames, actuator_along, actuator_active, actuators : arrays
        (a, 2), (a, 24), (a,) row of the twist, (a,), and (a, 17): rotor, stiffness, rest, damping, friction, transition
        rate, proportional and derivative gain, what the motor gives at least and at most, friction of a joint that is
        said to slide (as of `erls.equations.serial.records.Joint`), stops.
    contact_nodes, contacts : arrays
        (c, 2) what carries the plane, and the node, and (c, 28): the point in its node; in what carries the plane, a
        point of that and its three axes; the law and friction as of `erls.maths.contact_law`.
    shell_nodes, shell_frames, shell_built, shell_rises, shell_areas, shell_stiffness : arrays
        (q, 4) corners; (q, 48) frames of the surface at them, in their nodes; at each point of the quadrature (q, 48)
        slopes of the surface along both reference coordinates as built, (q, 16) of these coordinates along its local
        axes, (q, 4) area; (q, 9, 9). A shell stands in ``pairs`` six times, for each two of its corners.
    spring_nodes, springs : arrays
        (s, 2), and (s, 9): both points in their nodes, stiffness, damping, length without force.
    winding_nodes, winding_frames, windings : arrays
        Torsion springs: (w, 2), (w, 18) their axes in both nodes, and (w, 6): axis, stiffness, damping, rest.
    joint_nodes, joint_frames, joint_drives, joint_rows, conditions, pitches, released : arrays
        (j, 2), (j, 24), (j, 2) slide along z and turn about it per unit of the prescribed coordinate, (j + 1,) first
        conditions, (m, 12) c, C, (m,) of threads, 0 of conditions that are linear;
        (m,) 1 of conditions that are out of use for a while.
    metres, place, order : arrays
        (n,) metres per unit; (N,) number of each unknown in the elimination, and the unknown of each number.
    band, fronts, front_of, later, into : int, arrays
        Width of the band of the iteration matrix; where that is -1 its fronts, as of `erls.maths.front_plan`.
    """

    local: int
    gravity: Matrix
    pairs: Pairs
    beam_nodes: Pairs
    beam_frames: Matrix
    beam_built: Matrix
    beam_stiffness: Stack
    beam_inertia: Stack
    beam_moving: Indices
    body_nodes: Indices
    bodies: Stack
    load_nodes: Pairs
    load_positions: Matrix
    loads: Matrix
    load_dead: Indices
    actuator_nodes: Pairs
    actuator_frames: Matrix
    actuator_along: Indices
    actuator_active: Indices
    actuators: Matrix
    contact_nodes: Pairs
    contacts: Matrix
    shell_nodes: Pairs
    shell_frames: Matrix
    shell_built: Matrix
    shell_rises: Matrix
    shell_areas: Matrix
    shell_stiffness: Stack
    spring_nodes: Pairs
    springs: Matrix
    winding_nodes: Pairs
    winding_frames: Matrix
    windings: Matrix
    joint_nodes: Pairs
    joint_frames: Matrix
    joint_drives: Matrix
    joint_rows: Indices
    conditions: Matrix
    pitches: Vector
    released: Vector
    metres: Vector
    place: Indices
    order: Indices
    band: int
    fronts: Pairs
    front_of: Indices
    later: Indices
    into: Indices


class State(NamedTuple):
    """A configuration: poses (k, 12), twists of beams (e, 6), coordinates of actuators (a,), rotation vectors of
    torsion springs (w, 3).
    """

    poses: Matrix
    bent: Matrix
    turned: Vector
    wound: Matrix


class Work(NamedTuple):
    """Memory of an evaluation: the state that is tried, and sums over elements.

    Attributes
    ----------
    poses, bent, turned, wound : arrays
        As in `State`.
    v, a, multipliers, increment : arrays
        (n,) twice, (m,), (n,).
    twist, rate, force, reaction, violation : arrays
        (n,) in node axes twice, (n,) twice, (m,).
    blocks : (E, 3, 12, 12) array
        Mass, damping and stiffness of each element.
    whole : (E, 12, 12) array
        Their weighted sum, in the coordinates of the system.
    rows, shape, bends : (6, 12) arrays
        Of one beam.
    strained, corners : arrays
        Of one shell: (9, 24) its strains at a point by the twists of its nodes, (24, 24) its stiffness.
    gradient, drift, bias : arrays
        Of each condition: (m, 12) by the twists of both nodes, (m,) by time, (m,) Φ̈ − B a.
    factors : (k, 3, 6, 6) array
        What turns mass, damping and stiffness of a node into the weighted sum.
    turning : (k, 3, 3) array
        What a turn of a node does to the force on it in the world's axes.
    inertia : (n,) array
        Diagonal of the mass matrix.
    """

    poses: Matrix
    bent: Matrix
    turned: Vector
    wound: Matrix
    v: Vector
    a: Vector
    multipliers: Vector
    increment: Vector
    twist: Vector
    rate: Vector
    force: Vector
    reaction: Vector
    violation: Vector
    blocks: Pile
    whole: Stack
    rows: Matrix
    shape: Matrix
    bends: Matrix
    strained: Matrix
    corners: Matrix
    gradient: Matrix
    drift: Vector
    bias: Vector
    factors: Pile
    turning: Stack
    inertia: Vector


class Factors(NamedTuple):
    """The factored iteration matrix of N unknowns.

    Attributes
    ----------
    force, gap : (m,) arrays
        Metres per unit of β λ, and of Φ, of each condition.
    left, right, ordered : (N,) arrays
        Scales of equations and of unknowns, and memory.
    entries, stack, pivots : arrays
        A band of width w, (N, 3 w + 1) row by row, or fronts, and Schur complements between these; (N,).
    """

    force: Vector
    gap: Vector
    left: Vector
    right: Vector
    ordered: Vector
    entries: Vector
    stack: Vector
    pivots: Vector


class Layout(NamedTuple):
    """Where a system's records lie, at the place that the last of the integers says.

    Attributes
    ----------
    model, work, before, state, factors : int
        Tables of `Model`, of `Work` and `Before` in working memory, of `State` in a configuration, of `Factors`.
    forces, remember, knot, blocks, weighted : int
        Addresses of the functions of `erls.equations.nodal.sums`, `outputs` and `blocks`.
    beam_forces, bend_beams, beam_derivatives, beam_energies : int
        Those of `beam_forces` and `beam_derivatives`; of this and of the next three kinds -1, and nothing of them is
        compiled, where there are none.
    actuator_forces, turn_actuators, actuator_derivatives, actuator_energies, store_actuators : int
        Those of `actuator_forces`.
    contact_forces, contact_derivatives, contact_energies : int
        Those of `contact_forces`.
    shell_forces, shell_derivatives, shell_energies : int
        Those of `shell_forces` and `shell_derivatives`.
    spring_forces, wind_springs, spring_derivatives, spring_energies : int
        Those of `spring_forces`, for springs along a line and about an axis.
    samples : int
        Numbers that depend on time alone, with which working memory begins.
    reach : float
        Size of the mechanism [m].
    """

    model: int
    work: int
    before: int
    state: int
    factors: int
    forces: int
    remember: int
    knot: int
    blocks: int
    weighted: int
    beam_forces: int
    bend_beams: int
    beam_derivatives: int
    beam_energies: int
    actuator_forces: int
    turn_actuators: int
    actuator_derivatives: int
    actuator_energies: int
    store_actuators: int
    contact_forces: int
    contact_derivatives: int
    contact_energies: int
    shell_forces: int
    shell_derivatives: int
    shell_energies: int
    spring_forces: int
    wind_springs: int
    spring_derivatives: int
    spring_energies: int
    samples: int
    reach: float


class Before(NamedTuple):
    """The last knot (c,) as a configuration, and (1,) whether what poses do not tell is yet to be found for the one
    that is tried.
    """

    numbers: Vector
    behind: Vector


BEAMS_APART = 2
"""What blocks are asked for where those of beams come from elsewhere; 0 and 1 are with and without ``material``."""

FORCES: Any = None
REMEMBER: Any = None
CONDITIONS: Any = None
BLOCKS: Any = None
SUMMED: Any = None
ENERGIES: Any = None
KNOT: Any = None
ACTING: Any = None
COMPLEX_MATRIX: Any = None
TANGENTS: Any = None
if ENABLED:
    from numba import types as _t

    _memory = REALS, INTEGERS, REALS
    FORCES = REMEMBER = ENERGIES = _t.void(*_memory, REALS)
    CONDITIONS = _t.void(*_memory)
    BLOCKS = _t.void(*_memory, _t.int64)
    SUMMED = _t.void(*_memory, _t.float64, _t.float64, _t.float64)
    KNOT = ACTING = _t.void(*_memory, MATRIX)
    COMPLEX_MATRIX = _t.complex128[:, ::1]
    TANGENTS = _t.void(*_memory, COMPLEX_MATRIX, COMPLEX_MATRIX)

read_model, read_work, read_state = reader(Model), reader(Work), reader(State)
read_layout, read_before, read_factors = reader(Layout), reader(Before), reader(Factors)
call_forces, call_remember, call_knot = caller(FORCES), caller(REMEMBER), caller(KNOT)
call_blocks, call_weighted = caller(BLOCKS), caller(SUMMED)
call_beam_forces = caller(FORCES, "erls.equations.nodal.beam_forces:beam_forces")
call_bend_beams = caller(REMEMBER, "erls.equations.nodal.beam_forces:bend_beams")
call_beam_derivatives = caller(BLOCKS, "erls.equations.nodal.beam_derivatives:beam_derivatives")
call_beam_energies = caller(ENERGIES, "erls.equations.nodal.beam_forces:beam_energies")
call_actuator_forces = caller(FORCES, "erls.equations.nodal.actuator_forces:actuator_forces")
call_turn_actuators = caller(REMEMBER, "erls.equations.nodal.actuator_forces:turn_actuators")
call_actuator_derivatives = caller(BLOCKS, "erls.equations.nodal.actuator_forces:actuator_derivatives")
call_actuator_energies = caller(ENERGIES, "erls.equations.nodal.actuator_forces:actuator_energies")
call_store_actuators = caller(KNOT, "erls.equations.nodal.actuator_forces:store_actuators")
call_spring_forces = caller(FORCES, "erls.equations.nodal.spring_forces:spring_forces")
call_wind_springs = caller(REMEMBER, "erls.equations.nodal.spring_forces:wind_springs")
call_spring_derivatives = caller(BLOCKS, "erls.equations.nodal.spring_forces:spring_derivatives")
call_spring_energies = caller(ENERGIES, "erls.equations.nodal.spring_forces:spring_energies")
call_shell_forces = caller(FORCES, "erls.equations.nodal.shell_forces:shell_forces")
call_shell_derivatives = caller(BLOCKS, "erls.equations.nodal.shell_derivatives:shell_derivatives")
call_shell_energies = caller(ENERGIES, "erls.equations.nodal.shell_forces:shell_energies")
call_contact_forces = caller(FORCES, "erls.equations.nodal.contact_forces:contact_forces")
call_contact_derivatives = caller(BLOCKS, "erls.equations.nodal.contact_forces:contact_derivatives")
call_contact_energies = caller(ENERGIES, "erls.equations.nodal.contact_forces:contact_energies")
call_beam_tangents = caller(TANGENTS, "erls.equations.nodal.beam_tangents:beam_tangents")
call_actuator_tangents = caller(TANGENTS, "erls.equations.nodal.actuator_tangents:actuator_tangents")
