"""Where the constants and working memory of second order lie, behind those of `erls.equations.erls.layout`.

``integers`` ends with a header and a record for each link. With e elastic modes and n = 6 + e, second-order tensors
hold the last m of these coordinates: e on the ground, 3 + e otherwise; l of them move: e on the ground, n otherwise. A
stack of matrices lies column after column: all first columns, all second ones and so on. A form lies as the numbers
that the products of `tensors.pairs` are multiplied with.
"""

from __future__ import annotations

from erls.equations.compiled_system import IntArray
from erls.maths.jit import part

# header
ORDER = 0  # start in integers of the places in y of all coordinates, link by link
MATRIX = 1  # start in scratch of a matrix, its lower triangle row after row
COLUMNS = 2  # start in scratch of rows over all coordinates, see below
HEADER = 3

# record of a link: numbers
CURVED = 0  # whether its inertia has second-order terms
BOWS = 1  # whether its outboard interface is displaced to second order
ARMED = 2  # whether d is not zero
KEPT = 3  # m
LEFT = 4  # l
START = 5  # number of its first coordinate, link by link: its joint when that is free, then its modes
# ... starts of constants in reals
MASS = 6  # (n, n)
X = 7  # three (n, l), for the axes of the link's frame
X_TOP = 8  # their first six rows: (18, l)
X_ODD = 9  # three (l, l): X - Xᵀ
X_FORMS = 10  # three forms over l: qᵀ X q
Z = 11  # six (l, l) for pairs of axes (00, 11, 22, 01, 02, 12), symmetric part
ROWS = 12  # 6 + 3 axes of (m, m): transposed momenta, and for each axis of rotation W along it
ODD = 13  # three (m, m): P - Pᵀ of the last three momenta
FORMS = 14  # six forms over m, of the momenta
BOW = 15  # six (m, m): of the outboard interface
BOW_FORMS = 16  # six forms over m
COMPLIANCE = 17  # (6, 6) M₀⁻¹
REACH = 18  # (6,) s and d₀
# ... starts in scratch
MEMORY = 19  # of the numbers below
ROWS_Q = 20  # (6 + 3 axes, m)
BOW_Q = 21  # (6, m)
PULLS = 22  # (6, m) M₀⁻¹ C
X_Q = 23  # (3, n)
Z_Q = 24  # (6, l)
VELOCITY = 25  # (n,) q̇ with the twist that inertia knows
PAIRS = 26  # products of velocities
RECORD = 27

# memory of a link: numbers
E, E_RATE, E_ACCELERATION = 0, 6, 12
CARRIED = 18  # (6,) T (e + ½ xᵀ P x) of the link before
LIFT, LIFT_RATE, LIFT_ACCELERATION = 24, 30, 36  # e + ½ xᵀ P x
PUSH = 42  # (6,) force on virtual e
FULL, FULL_RATE = 48, 54  # the twist that inertia knows
ADDED, ADDED_RATE = 60, 66  # C q̇ + H ν
MOMENTUM, MOMENTUM_RATE = 72, 78
SHARE, SHARE_RATE = 84, 90  # M₀⁻¹ times these
MOMENT, MOMENT_RATE = 96, 99  # S
SPIN, SPIN_RATE = 102, 111  # for each axis (3,): ½ qᵀ W q along it
TURN_MOMENTS, TURN_RATES = 120, 126  # qᵀ Z q and its rate for pairs of axes
WEIGHTS = 132  # (18,) of a stack in the modal forces
SPARE = 150  # (9,)
TURNING = 159  # (6, 3) M₀⁻¹ H on ω
INERTIA = 177  # (9, 9) over (w, ω)
NUMBERS = 258

# rows over all coordinates, from COLUMNS: motion of the present link per unit of each, link by link
TWISTS, LINEAR, CURVE, MOTION, PULL, SUM = 0, 6, 12, 18, 27, 36
ROW_COUNT = 37


# counts that functions are given: a number in their place would have them compiled for it alone
AXES, MOVES, BOTH = 3, 6, 9  # directions; of a rigid motion; (w, ω)
AXIS_PAIRS, TOP_ROWS, ONE = 6, 18, 1


@part
def header(integers: IntArray, links: int) -> int:
    """Where the header starts."""
    return len(integers) - HEADER - links * RECORD


def memory_sizes(modes: int, kept: int, left: int, axes: int) -> dict[int, int]:
    """Working memory of a link with e, m, l and so many axes of rotation, by place in its record."""
    n = 6 + modes
    return {
        MEMORY: NUMBERS,
        ROWS_Q: (6 + 3 * axes) * kept,
        BOW_Q: 6 * kept,
        PULLS: 6 * kept,
        X_Q: 3 * n,
        Z_Q: 6 * left,
        VELOCITY: n,
        PAIRS: left * (left + 1) // 2,
    }
