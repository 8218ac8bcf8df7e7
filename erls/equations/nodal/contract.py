"""The arrays of a nodal system. Nodes k, velocities n = 6 k, conditions of joints m, unknowns N = n + m.

A pose is 12 numbers: position, then rotation, rows first. Pairs of frames are the poses of an element's or a joint's
frames in its first and its second node (for the ground, in the world). A node −1 is the ground, or none. A sample holds
what depends on time alone: of every joint the prescribed coordinate with two derivatives (0 unless prescribed), the
factor of every load, and of every actuator the wanted coordinate, the wanted rate and the torque besides.

The numbers of constants and of working memory may be complex; time, samples and integers are real.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from erls.equations.compiled_system import Array, IntArray, pointer
from erls.maths.jit import ENABLED


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
        (e, 2), (e, 24), (e, 6), (e, 6, 6) per length, (e, 6, 6) times length, (e,) whether it has inertia.
    body_nodes, bodies : arrays
        (b,), (b, 6, 6).
    load_nodes, loads, load_dead : arrays
        (l,), (l, 6), (l,) whether the load keeps its direction in the world.
    actuator_nodes, actuator_frames, actuator_along, actuator_active, actuators : arrays
        (a, 2), (a, 24), (a,) row of the twist, (a,), and (a, 9): rotor, stiffness, rest, damping, friction, transition
        rate, proportional and derivative gain, limit.
    spring_nodes, springs : arrays
        (s, 2), and (s, 9): both points in their nodes, stiffness, damping, length without force.
    winding_nodes, winding_frames, windings : arrays
        Torsion springs: (w, 2), (w, 18) their axes in both nodes, and (w, 6): axis, stiffness, damping, rest.
    joint_nodes, joint_frames, joint_driven, joint_sign, joint_rows, conditions : arrays
        (j, 2), (j, 24), (j,) row of the twist that is prescribed or −1, (j,), (j + 1,) first conditions, (m, 12) c, C.
    metres, place, order : arrays
        (n,) metres per unit; (N,) number of each unknown in the band, and the unknown of each number.
    """

    local: int
    gravity: Array
    pairs: IntArray
    beam_nodes: IntArray
    beam_frames: Array
    beam_built: Array
    beam_stiffness: Array
    beam_inertia: Array
    beam_moving: IntArray
    body_nodes: IntArray
    bodies: Array
    load_nodes: IntArray
    loads: Array
    load_dead: IntArray
    actuator_nodes: IntArray
    actuator_frames: Array
    actuator_along: IntArray
    actuator_active: IntArray
    actuators: Array
    spring_nodes: IntArray
    springs: Array
    winding_nodes: IntArray
    winding_frames: Array
    windings: Array
    joint_nodes: IntArray
    joint_frames: Array
    joint_driven: IntArray
    joint_sign: Array
    joint_rows: IntArray
    conditions: Array
    metres: Array
    place: IntArray
    order: IntArray


class State(NamedTuple):
    """A knot: poses (k, 12), twists of beams (e, 6), coordinates of actuators (a,), rotation vectors of torsion springs
    (w, 3), v, a and the algorithmic a (n,), multipliers (m,).
    """

    poses: Array
    bent: Array
    turned: Array
    wound: Array
    v: Array
    a: Array
    algorithmic: Array
    multipliers: Array


class Work(NamedTuple):
    """Memory of an evaluation: the state that is tried, sums over elements, and the factored iteration matrix.

    Attributes
    ----------
    poses, bent, turned, wound, v, a, multipliers, increment : arrays
        As in `State`; increment (n,).
    twist, rate, force, reaction, violation, correction, ordered : arrays
        (n,) in node axes twice, (n,) twice, (m,), (N,) twice.
    blocks : (E, 3, 12, 12) array
        Mass, damping and stiffness of each element.
    whole : (E, 12, 12) array
        Their weighted sum, in the coordinates of the system.
    rows, shape : (6, 12) arrays
        Of one beam.
    gradient, drift, bias : arrays
        Of each condition: (m, 12) by the twists of both nodes, (m,) by time, (m,) Φ̈ − B a.
    factors : (k, 3, 6, 6) array
        What turns mass, damping and stiffness of a node into the weighted sum.
    turning : (k, 3, 3) array
        What a turn of a node does to the force on it in the world's axes.
    inertia : (n,) array
        Diagonal of the mass matrix.
    band, pivots, left, right : arrays
        (N, 3 w + 1) row by row, (N,), (N,) scales of equations and of unknowns.
    """

    poses: Array
    bent: Array
    turned: Array
    wound: Array
    v: Array
    a: Array
    multipliers: Array
    increment: Array
    twist: Array
    rate: Array
    force: Array
    reaction: Array
    violation: Array
    correction: Array
    ordered: Array
    blocks: Array
    whole: Array
    rows: Array
    shape: Array
    gradient: Array
    drift: Array
    bias: Array
    factors: Array
    turning: Array
    inertia: Array
    band: Array
    pivots: IntArray
    left: Array
    right: Array


class Knots(NamedTuple):
    """Where accepted steps are written: what a run stores (s, 3, 12 k + a) with two derivatives, accelerations (s, n),
    multipliers (s, m).
    """

    states: Array
    accelerations: Array
    multipliers: Array


class Settings(NamedTuple):
    """Formulas and limits of steps of one size.

    Attributes
    ----------
    h, beta, gamma : float
        Step [s] and coefficients of Newmark's formulas.
    share, pull, keep : float
        Weights of v̇₁, v̇₀ and a₀ in a₁.
    to_v, to_a, period : float
        γ', β', and h √(β · share).
    tolerance, rounding, reach, balance : float
        Newton iterations end with an error below these [m] or a residual below ``balance`` times its terms.
    slowest, fastest, patience, tolerated : float
        Bounds on a rate of convergence carried over from earlier steps; cost of a fresh matrix in iterations;
        iterations beyond the fewest that do not call for one.
    error_limit, error_factor, growth : float
        Largest local error [m], 0 for no limit; what turns |v̇₁ − v̇₀| into it; ratio of steps worth a change.
    mode, iterations : int
        0 auto, 1 update, 2 frozen; largest number of iterations.
    predict : int
        1: steps start from the last acceleration and multipliers, 0: from zero.
    """

    h: float
    beta: float
    gamma: float
    share: float
    pull: float
    keep: float
    to_v: float
    to_a: float
    period: float
    tolerance: float
    rounding: float
    reach: float
    balance: float
    slowest: float
    fastest: float
    patience: float
    tolerated: float
    error_limit: float
    error_factor: float
    growth: float
    mode: int
    iterations: int
    predict: int


class Progress(NamedTuple):
    """What steps leave to each other and to whoever called for them.

    Attributes
    ----------
    rates : (6,) array
        Rate of convergence; last two corrections and their goal [m]; local error [m] of the last step; patience left.
    counts : (8,) array
        Whether there is an iteration matrix; fewest iterations with it, excess over them; evaluations, iterations,
        factorizations; reason of a failure; steps made.
    """

    rates: Array
    counts: IntArray


MODEL: Any = None
STATE: Any = None
WORK: Any = None
KNOTS: Any = None
SETTINGS: Any = None
PROGRESS: Any = None
ADVANCE: Any = None
FORCES: Any = None
REMEMBER: Any = None
CONDITIONS: Any = None
BLOCKS: Any = None
SUMMED: Any = None
ENERGIES: Any = None
KNOT: Any = None
ACTING: Any = None
FACTOR: Any = None
if ENABLED:
    from numba import types as _t

    _r1, _r2, _r3, _r4 = _t.float64[::1], _t.float64[:, ::1], _t.float64[:, :, ::1], _t.float64[:, :, :, ::1]
    _i1, _i2 = _t.int64[::1], _t.int64[:, ::1]
    _beams = (_i2, _r2, _r2, _r3, _r3, _i1)
    _others = (_i1, _r3, _i1, _r2, _i1, _i2, _r2, _i1, _i1, _r2, _i2, _r2, _i2, _r2, _r2)
    _joints = (_i2, _r2, _i1, _r1, _i1, _r2)
    MODEL = _t.NamedTuple((_t.int64, _r2, _i2, *_beams, *_others, *_joints, _r1, _i1, _i1), Model)
    _tried = (_r2, _r2, _r1, _r2, _r1, _r1)
    STATE = _t.NamedTuple((*_tried, _r1, _r1), State)
    _sums = (_r4, _r3, *(_r2,) * 3, _r1, _r1, _r4, _r3, _r1, _r2, _i1, _r1, _r1)
    WORK = _t.NamedTuple((*_tried, *(_r1,) * 9, *_sums), Work)
    KNOTS = _t.NamedTuple((_r3, _r2, _r2), Knots)
    SETTINGS = _t.NamedTuple((*(_t.float64,) * 20, *(_t.int64,) * 3), Settings)
    PROGRESS = _t.NamedTuple((_r1, _i1), Progress)
    FORCES = _t.void(MODEL, WORK, STATE, _r1)
    REMEMBER = _t.void(MODEL, WORK, STATE)
    CONDITIONS = _t.void(MODEL, WORK, _r1)
    BLOCKS = _t.void(MODEL, WORK, _r1, _t.int64)
    SUMMED = _t.void(MODEL, WORK, _t.float64, _t.float64, _t.float64)
    ENERGIES = _t.void(MODEL, WORK, _r1)
    KNOT = _t.void(MODEL, WORK, _r2)
    ACTING = _t.void(MODEL, WORK, _r1, _r2)
    FACTOR = _t.int64(MODEL, WORK, _r1, _t.float64, _t.float64, _t.float64)
    _steps = (MODEL, STATE, WORK, SETTINGS, PROGRESS, _r2, KNOTS, _t.int64)
    ADVANCE = _t.int64(pointer(FORCES), pointer(FACTOR), *_steps)
