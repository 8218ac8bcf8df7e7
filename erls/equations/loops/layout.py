"""Where the constants of loops and their working memory lie, behind those of the chain.

The last entry of ``integers`` says where their header starts. A header names where in ``integers``, ``reals`` and
``scratch`` each part starts; n coordinates, m conditions, of which r are in use.
"""

from __future__ import annotations

from erls.equations.compiled_system import Array, IntArray
from erls.maths.jit import part

# header
LOOPS = 0
CONDITIONS = 1  # m
KEPT = 2  # r
ACTIVE = 3  # whether forces or rotors act along closing joints
ROTORS = 4
RECORDS = 5  # in integers: of loops
ROWS = 6  # in integers: of conditions
FACTORS = 7  # in reals: of conditions, (m, 3)
METRES = 8  # in reals: (n,) per unit of each coordinate
NUMBERS = 9  # in reals, see below
# ... and starts in scratch
WORLD = 10  # (links, 12) poses of the links' frames
MOTIONS = 11  # of loops
VIOLATION = 12  # (m,) Φ, Φ̇ and Φ̈ at zero accelerations, one after another
GRADIENT = 13  # (r, n) Φ_y, row after row
EFFORTS = 14  # (loops, n + EFFORT)
MASS = 15  # (n, n)
FACTOR = 16  # (n, n) U
DAMPING = 17  # (n, n)
SPREAD = 18  # (r, n) Zᵀ
FLEXIBLE = 19  # (r, r) ZᵀZ and its factor
REDUCED = 20  # z; as MULTIPLIERS the larger of n and r
MULTIPLIERS = 21
HEADER = 22

# record of a loop in integers
OUTER, OUTER_AT = 0, 1  # link, -1 for the ground; constants in reals
INNER, INNER_AT = 2, 3
FIRST, COUNT = 4, 5  # conditions
PRESCRIBED = 6  # curve of the coordinate, -1 without
ALONG = 7  # component of the twist that the coordinate moves, -1 without
FREEDOM = 8  # in reals: zero, turns at the start, sign of each joint
ACTS = 9  # where the joint record of its forces starts (`erls.equations.erls.layout`), -1 without any
RECORD = 10

# record of a condition in integers, and its factors in reals
LINE = 0  # component of the translation, -1 for a turn: c₁ R[i₁, j₁] + c₂ R[i₂, j₂]
ENTRIES = 1  # i₁, j₁, i₂, j₂
PLACE = 5  # among those in use, -1 when left out
ROW = 6
SCALE = 2  # third factor: metres per unit of the condition

# constants of an end on a link in reals; on the ground its pose
POSITION = 0  # (3,) of the node
OFFSET = 3  # (12,) pose of the joint's frame there
SHAPES = 15  # (6, modes) translation and rotation, column after column

# numbers; the last one is what a loop that has come apart is open by [m]
REACH, DECAY, OPEN = 0, 1, 2

# motion of a frame: pose (rotation row after row, place), twist, its derivative
POSE, TWIST, BIAS = 0, 12, 18
LOCAL = 24  # pose of the node in the link
PHI, SIZE = 36, 39  # its rotation vector, 1 + φ²/4
END = 40
# motion of a loop: both ends, then what is between them: all of it, and less what is prescribed
OUTER_END, INNER_END, BETWEEN, LEFT = 0, 40, 80, 104
FORCE = 128  # (6,) a row of the conditions, and work with it
SPARE = 134  # (18,)
MOTION = 152

# efforts of a loop: the row, then
COORDINATE, RATE, TURNING, PUSH, WANTED = range(5)  # second derivative at zero accelerations; force, that of the drive
EFFORT = 5


@part
def place(integers: IntArray, name: int) -> int:
    """An entry of the header."""
    return int(integers[integers[len(integers) - 1] + name])


@part
def span(integers: IntArray, name: int, size: int) -> slice:
    """Where ``size`` numbers of a part lie."""
    start = integers[integers[len(integers) - 1] + name]
    return slice(start, start + size)


@part
def row_scale(reals: Array, integers: IntArray, condition: int) -> float:
    """Metres per unit of a condition."""
    return float(reals[place(integers, FACTORS) + 3 * condition + SCALE])


@part
def place_of(integers: IntArray, condition: int) -> int:
    """Number of a condition among those in use, -1 when left out."""
    return int(integers[place(integers, ROWS) + ROW * condition + PLACE])
