"""Where the constants of a chain and its working memory lie: offsets into ``integers``, ``reals`` and ``scratch``.

``integers`` starts with a header, then holds a record for each link, then curves. A record names where in ``reals``
each constant of its link starts. With e elastic modes, n = 6 + e counts the modes [ρ Ψ] of a link. Matrices (n, n) lie
column after column, in the order X q needs them.
"""

from __future__ import annotations

from erls.maths.jit import part

# header of integers
LINKS = 0
FIRST_ORDER = 1  # effects, 0 or 1
SECOND_ORDER = 2
CORIOLIS = 3
CENTRIFUGAL = 4
SOFTENING = 5
WEIGHT = 6  # gravity acts
FEED_FORWARD = 7
HEADER = 8

# record of a link in integers: numbers
MODES = 0  # e
FIRST_MODE = 1  # place of its first elastic coordinate in y
JOINT = 2  # place of its joint coordinate in y, -1 when prescribed
AXES = 3  # of rotation: 1 when the link turns about one constant axis, otherwise 3
SLIDES = 4  # 1 for a prismatic joint
MOTION = 5  # curve of the prescribed or wanted coordinate in integers, -1 without
LOAD = 6  # curve of the torque, -1 without
FEED = 7  # whether the drive feeds forward
EFFORT = 8  # whether drive, spring, damper, friction or rotor act
MEMORY = 9  # of the link in scratch
# ... and starts of constants in reals
STEP = 10  # pose of the link's frame in that before: rotation (9) and place (3), each as constant, cosine, sine part
SCREW = 11  # (6,) S
AXIS = 12  # (AXES, 3) unit vectors
MASS = 13  # (n, n) [ρ Ψ]ᵀ m [ρ Ψ]
X = 14  # for each axis (n, n), projected like the mass
Z = 15  # for each pair of axes (n, n), symmetric part: 1, or (00, 11, 22, 01, 02, 12)
OUT = 16  # (e, 6) C, column after column
STIFFNESS = 17  # (e,)
DAMPING = 18  # (e,)
BASIS = 19  # (e, e) V, row after row: Vᵀ M_ee V = 1 and Vᵀ K V is diagonal
OUT_BASIS = 20  # (e, 6) C V, column after column
RIGID_BASIS = 21  # (e, 6) M_re V, column after column
BASIS_STIFFNESS = 22  # (e,) of Vᵀ K V
BASIS_DAMPING = 23  # (e,) of Vᵀ C V
BLOCK = 24  # what belongs to the elastic block of the mass matrix, see below
FORCES = 25  # of the joint, see below
# ... and in the memory of `erls.equations.erls.shifted`
SHIFTED = 26  # the same for the mass matrix with stiffness and damping
RECORD = 27

# joint forces in reals
SPRING, REST, DAMPER, FRICTION, TRANSITION, ROTOR, GAIN, RATE_GAIN, LIMIT, HELD = range(10)
JOINT_REALS = 10

GRAVITY = 0  # (3,) in reals: world axes

# memory of a link in scratch
TURN = 0  # (9,) rotation of the link's frame against that of the link before, row after row
ARM = 9  # (3,) its place there
U, U_RATE, U_ACCELERATION = 12, 18, 24  # of the frame's displacement
TWIST, TWIST_RATE = 30, 36
W, W_RATE = 42, 48  # w = ν + u̇ and its derivative
DOWN = 54  # (3,) gravity in link axes
WRENCH = 57  # (6,) on virtual ν
FORCE = 63  # (6,) on virtual u
TURN_MOMENTS = 69  # (6,) qᵀ Z q for each pair of axes
POINT = 75  # (6,) for passing motions and forces on
ANGLE = 81  # θ, θ̇, θ̈
INERTIA = 84  # (9, 9) of what hangs on the link, over (w, ω)
BORNE = 165  # (9, 9) the same of the links after it, as carried to this one
PATH = 246  # (9,) s: motion of (w, ω) per unit of θ̇
PULL = 255  # (9,) inertia times s
LOADING = 264  # (9,) force on (w, ω) that is left
PASSED = 273  # (9,) the same of the links after it
MOVE = 282  # (9,) acceleration of (w, ω)
EFFECTIVE = 291  # inertia along the joint
OUTPUT = 292  # (6, 9) and (6,): C q̈ = OUTPUT (ẇ, ω̇) + OUTPUT_FREE
OUTPUT_FREE = 346
SQUARE = 352  # (6, 12) of the equations for those, and the inverse
BOUND = 424  # (6, 9) C V D⁻¹ B
PRODUCT = 478  # (9, 9)
GIVEN = 559  # (6,) right side for OUTPUT_FREE
RESISTANCE = 565  # what stiffness and damping add to the inertia along the joint; 0 in scratch
VECTORS = 566  # from here, vectors of n: see motion and forces
# each of n
Q, Q_RATE, Q_ACCELERATION, MODAL, X_Q, X_RATE, Z_Q, RELAXED, COLUMN = 0, 1, 2, 3, 4, 7, 10, 16, 19
VECTOR_COUNT = 28


def memory_size(modes: int) -> int:
    """Working memory of a link with so many elastic modes."""
    return VECTORS + VECTOR_COUNT * (6 + modes)


# what belongs to a diagonal D of the elastic block, from the place that BLOCK or SHIFTED names: (e,) D⁻¹, and then
@part
def towards(modes: int) -> int:
    """(6, e) M_re V D⁻¹."""
    return modes


@part
def out_towards(modes: int) -> int:
    """(6, e) C V D⁻¹."""
    return 7 * modes


@part
def rigid_share(modes: int) -> int:
    """(6, 6) M_re V D⁻¹ (M_re V)ᵀ."""
    return 13 * modes


@part
def cross_share(modes: int) -> int:
    """(6, 6) C V D⁻¹ (M_re V)ᵀ."""
    return 13 * modes + 36


@part
def out_share(modes: int) -> int:
    """(6, 6) C V D⁻¹ (C V)ᵀ."""
    return 13 * modes + 72


def block_size(modes: int) -> int:
    """Numbers of all of these."""
    return 13 * modes + 108
