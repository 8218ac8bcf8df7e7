"""Where the constants of a chain and its working memory lie: offsets into ``integers``, ``reals`` and ``scratch``.

``integers`` starts with a header, then holds a record for each link, then curves. A record names where in ``reals``
each constant of its link starts. With e elastic coordinates, matrices (6, e) lie row after row, matrices (e, e) column
after column.
"""

from __future__ import annotations

# header of integers
LINKS = 0
SIZE = 1  # n, of independent coordinates
FIRST_ORDER = 2  # effects, 0 or 1
SECOND_ORDER = 3
CORIOLIS = 4
CENTRIFUGAL = 5
SOFTENING = 6
WEIGHT = 7  # gravity acts
FEED_FORWARD = 8
MATRIX = 9  # room in scratch for (n, n) and (n,), or for the factors of `link_by_link`
HEADER = 10

# record of a link in integers: numbers
MODES = 0  # e
FIRST_MODE = 1  # place of its first elastic coordinate in y
JOINT = 2  # place of its joint coordinate in y, -1 when prescribed
AXES = 3  # of rotation: 1 when its frame turns about one constant axis, 0 when it only slides, otherwise 3
SLIDES = 4  # 1 for a prismatic joint
MOTION = 5  # curve of the prescribed or wanted coordinate in integers, -1 without
LOAD = 6  # curve of the torque, -1 without
FEED = 7  # whether the drive feeds forward
EFFORT = 8  # whether drive, spring, damper or friction act
MEMORY = 9  # of the link in scratch
# ... and starts of constants in reals
STEP = 10  # pose from node to node: rotation (9) and place (3), each as constant, cosine, sine part
SCREW = 11  # (6,) of the joint in the inboard node
RIGID_STEP = 12  # pose of the undeformed link's frame in that before, in the same form
RIGID_SCREW = 13  # (6,) in that frame
OUTBOARD = 14  # undeformed place (3), then rows of u and φ (6, e); -1 where the coordinates move nothing
INBOARD = 15
AXIS = 16  # (AXES, 3) unit vectors
RIGID = 17  # (6, 6) M₀
MOMENT = 18  # mass, then first moment (3,)
COUPLING = 19  # (6, e) C₀
ELASTIC = 20  # (e, e) M_e
HALF = 21  # for each axis (6, e): half of M₁
TURNED = 22  # for each axis (e, e): C₁
GYROSCOPIC = 23  # the same less its transpose
SQUARE = 24  # for each pair of axes (e, e), symmetric: M₂; 1, or (00, 11, 22, 01, 02, 12)
STIFFNESS = 25  # (e,)
DAMPING = 26  # (e,)
FORCES = 27  # of the joint, in the order of `erls.equations.erls.layout`
BEND = 28  # per coordinate (rows, e): second-order momentum (6), then the outboard and the inboard node (6 each); or -1
SPIN = 29  # per coordinate (9, e): W
SKEW = 30  # per coordinate (3, e): second-order angular momentum less its transpose
PER_MASS = 31  # (6, 6) M₀⁻¹
BENT = 32  # rows of BEND
# ... and of coordinates z with η̇ = V z in which M_e is 1 and the stiffness is diagonal, for `link_by_link`
BASIS = 33  # (e, e) V, row after row
BASIS_STIFFNESS, BASIS_DAMPING = 34, 35  # (e,) diagonals of Vᵀ K V, Vᵀ C V
SHIFTED = 36  # memory of the link in its factors
RECORD = 37

GRAVITY = 0  # (3,) in reals: world axes

# memory of a node in scratch: a frame that moves against the one before
POSE = 0  # rotation (9), row after row, and place (3)
TANGENT = 12  # (9,) T(φ), which turns φ̇ into the angular velocity
PHI = 21  # (3,)
TWIST = 24  # (6,) ξ, in its own axes
RATE = 30  # (6,) of that
BACK = 36  # (12,) the inverse pose
SLOPE_A, FACTOR_B, SLOPE_B = 48, 49, 50  # da/ds, b, db/ds of the turn, see `erls.equations.ffr.nodes`
NODE = 51

# memory of a link in scratch
STEP_POSE = 0
ANGLE = 12  # θ, θ̇, θ̈
FRAME = 15  # twist (6), its rate (6), gravity (3), of the link's frame in its axes
NEXT = 30  # the same of its displaced outboard node
WRENCH = 45  # (6,) on the frame
PASSED = 51  # (6,) on the outboard node, from the links after it
MOMENTUM = 57
POINT, OTHER = 63, 69  # (6,) for passing on
EFFECTIVE = 75  # torque that feeds forward
OUTER = 76  # memory of the outboard node
INNER = OUTER + NODE  # of the inboard node
INERTIA = INNER + NODE  # (6, 6) of the link, and of what it bears
OWN = INERTIA + 36  # (6, 6) of the link alone
BORNE = OWN + 36  # (6, 6) of the links after it, at the outboard node
# of a link with second-order displacements
LINEAR = BORNE + 36  # (12,) twist and rate of its frame, while corrected ones take their place
BLOCK = LINEAR + 12  # S (3,) and ½ ηᵀ W η (9,) of H, then their rates
SHARE = BLOCK + 24  # (6,) M₀⁻¹ p and its rate
FACTOR = SHARE + 12  # (6, 6) 1 + M₀⁻¹ H
VECTORS = FACTOR + 36  # from here, vectors of e
# each of e
TURNED_Q, TURNED_RATE, SQUARE_Q = 0, 3, 6
COUPLED, MOVES, CARRIED = 7, 13, 19  # rows (6, e): C(η), motion of the outboard node and of the frame per η̇
OUTER_ROWS, INNER_ROWS = 25, 31  # u and φ of nodes per η̇
VECTOR_COUNT = 37
# with second-order displacements
BENDING, BENDING_RATE = 37, 55  # BEND times η, and η̇
SPUN = 73  # SPIN times η
CHANGE, CHANGED, UNCHANGED = 82, 88, 94  # rows (6, e): M₀⁻¹ C₂, M of that and C, C
BENT_COUNT = 100


def memory_size(modes: int, bent: bool) -> int:
    """Working memory of a link with so many elastic coordinates, with second-order displacements or without."""
    return VECTORS + (BENT_COUNT if bent else VECTOR_COUNT) * modes


# memory of a link in the factors of `link_by_link`
POSE_STEP, POSE_OUTER, POSE_INNER = 0, 12, 24  # of the step, the outboard node, and from the inboard one back
PUSH = 36  # (6,) inertia times the joint's screw
ALONG, RESISTANCE = 42, 43  # inertia along the joint, and what stiffness and damping add to it
LOADED, HANDED = 44, 50  # (6,) forces on the frame, and on the outboard node from the links after it
GONE, ARRIVED = 56, 62  # (6,) accelerations of the outboard node and of the frame
RESTING, HANGING, WHOLE = 68, 104, 140  # (6, 6) inertia of the link alone, of the links after it, of both
REST = 176  # (6,) for passing on
MOST_PORTS = 30
FREE, PRESSED, GIVEN_PORTS = 182, 212, 242  # (ports,)
OUTPUT = 272  # (ports, 6)
FLEXIBILITY, BOUND = 452, 1352  # (ports, ports)
SOLVER = 2252  # (ports, 2 ports)
DIAGONAL = 4052  # (e,) D⁻¹, then (e,) forces on z, then (ports, e) rows


def factor_size(modes: int) -> int:
    """Memory of a link in the factors."""
    return DIAGONAL + (2 + MOST_PORTS) * modes
