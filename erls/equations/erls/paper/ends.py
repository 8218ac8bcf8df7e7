"""Motion of the frames that loops hold, in the dense form of the paper; see `erls.equations.compiled_system`.

Rows come from (ν, q̇) of the link per rates of (θ, q_d) (paper, eq. 69).
"""

from __future__ import annotations

from erls.equations import compiled_system as contract
from erls.equations.erls.paper.functions import call_move
from erls.equations.erls.paper.records import BODY_STATE, Paper, read_body_state, read_paper
from erls.equations.serial.ends import END, END_STATE, column_of, move_end, read_end, read_end_state
from erls.equations.serial.records import Serial, read_serial
from erls.maths.jit import kernel, part
from erls.maths.products import copy
from erls.maths.so3 import Array
from erls.maths.spatial import compose_poses, transform_motion
from fe_import.model import IntArray


@part
def _put_end(
    serial: Serial, paper: Paper, reals: Array, integers: IntArray, scratch: Array, number: int, n: int, found: Array
) -> None:
    """Pose, twist, its derivative and rows."""
    end = read_end(reals, integers, paper.ends + number * END)
    moved = read_end_state(scratch, integers, paper.end_states + number * END_STATE)
    state = read_body_state(scratch, integers, paper.body_states + end.link * BODY_STATE)
    move_end(
        end, moved, state.q, state.velocity[6:], state.acceleration[6:], state.velocity[:6], state.acceleration[:6],
        found[:24],
    )  # fmt: skip
    copy(found[:12], moved.spare)
    compose_poses(state.world, moved.spare, found[:12])
    size, column = (len(found) - 24) // 6, moved.force
    for j in range(size):
        transform_motion(moved.pose, state.moves[:6, j], column)
        for i in range(6):
            for m in range(len(state.q)):
                column[i] += moved.rows[i, m] * state.moves[6 + m, j]
        transform_motion(end.offset, column, column)
        at = column_of(serial, reals, integers, j, n) if j < serial.links else paper.free + j - serial.links
        for i in range(6):
            found[24 + i * size + at] = column[i]


@kernel(contract.FRAMES, counted=False)
def frames(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, out: Array) -> None:
    """Motion of the frames that loops hold."""
    serial = read_serial(reals, integers, integers[0])
    paper = read_paper(reals, integers, serial.own)
    call_move(paper.move, reals, integers, scratch, t, y, v, y[:0])
    for number in range(paper.end_count):
        _put_end(serial, paper, reals, integers, scratch, number, len(y), out[number])
