"""The mass matrix by composite inertias, from the tip inward; its cost grows with the square of its size."""

from __future__ import annotations

from erls.equations import compiled_system as contract
from erls.equations.compiled_system import Array, IntArray
from erls.equations.erls import layout as at
from erls.equations.erls.forces import deform_first_order, deform_second_order, vector
from erls.equations.erls.inertia import carry9_back, carry_inertia_back, joint_path, link_inertia
from erls.equations.erls.motion import place_frames
from erls.maths.jit import kernel, part


@part
def _elastic_pull(reals: Array, integers: IntArray, scratch: Array, record: int, mode: int) -> None:
    """PULL: force on (w, ω) of a link alone by unit acceleration of a mode; PASSED: what is borne takes of it."""
    memory, n = integers[record + at.MEMORY], 6 + integers[record + at.MODES]
    link = scratch[memory : memory + at.VECTORS]
    constant, axis = integers[record + at.MASS], integers[record + at.AXIS]
    column = integers[record + at.OUT] + 6 * mode
    for i in range(6):
        link[at.PULL + i] = reals[constant + (6 + mode) * n + i]
        link[at.PASSED + i] = 0.0
        for m in range(6):
            link[at.PASSED + i] += link[at.BORNE + 9 * i + m] * reals[column + m]
    for i in range(3):
        link[at.PULL + 6 + i] = 0.0
        if integers[at.FIRST_ORDER]:
            for a in range(integers[record + at.AXES]):
                turning = scratch[vector(memory, n, at.X_Q + a) + 6 + mode]
                link[at.PULL + 6 + i] += turning * reals[axis + 3 * a + i]


@part
def _fill(reals: Array, integers: IntArray, scratch: Array, k: int, place: int, out: Array) -> None:
    """Row and column of a coordinate of link k whose unit acceleration pulls at its (w, ω) with PULL.

    Its joint and all that stands before the link feel it.
    """
    start = integers[at.HEADER + k * at.RECORD + at.MEMORY]
    pull = scratch[start + at.PULL : start + at.PULL + 9]
    for before in range(k, -1, -1):
        record = at.HEADER + before * at.RECORD
        memory, joint = integers[record + at.MEMORY], integers[record + at.JOINT]
        link = scratch[memory : memory + at.VECTORS]
        if before < k:
            e, first = integers[record + at.MODES], integers[record + at.FIRST_MODE]
            outward = integers[record + at.OUT]
            for j in range(e):
                total = 0.0
                for m in range(6):
                    total += reals[outward + 6 * j + m] * pull[m]
                out[first + j, place] = out[place, first + j] = total
        if joint >= 0:
            if before < k:
                joint_path(reals, integers, record, link)
            total = 0.0
            for m in range(9):
                total += link[at.PATH + m] * pull[m]
            out[joint, place] = out[place, joint] = total
        carry9_back(link, pull, 0, 1, pull, 0, 1)


@kernel(contract.MASS_MATRIX, counted=False)
def mass_matrix(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, out: Array) -> None:
    """M; see `erls.equations.compiled_system`."""
    place_frames(reals, integers, scratch, t, y, y, scratch[0:0])
    links = integers[at.LINKS]
    out[:, :] = 0.0
    for k in range(links - 1, -1, -1):
        record = at.HEADER + k * at.RECORD
        e, first = integers[record + at.MODES], integers[record + at.FIRST_MODE]
        n = 6 + e
        memory, outward = integers[record + at.MEMORY], integers[record + at.OUT]
        link = scratch[memory : memory + at.VECTORS]
        deform_first_order(reals, integers, scratch, record)
        deform_second_order(reals, integers, scratch, record)
        link_inertia(reals, integers, scratch, record)
        joint_path(reals, integers, record, link)
        constant = integers[record + at.MASS]
        pull = link[at.PULL : at.PULL + 9]
        if k + 1 == links:
            link[at.BORNE : at.BORNE + 81] = 0.0
        for i in range(81):
            link[at.INERTIA + i] += link[at.BORNE + i]
        for j in range(e):
            column = reals[outward + 6 * j : outward + 6 * j + 6]
            _elastic_pull(reals, integers, scratch, record, j)
            for i in range(j + 1):
                total = reals[constant + (6 + j) * n + 6 + i]
                if k + 1 < links:
                    for m in range(6):
                        total += reals[outward + 6 * i + m] * link[at.PASSED + m]
                out[first + i, first + j] = out[first + j, first + i] = total
            if k + 1 < links:
                for i in range(9):
                    for m in range(6):
                        pull[i] += link[at.BORNE + 9 * i + m] * column[m]
            _fill(reals, integers, scratch, k, first + j, out)
        joint = integers[record + at.JOINT]
        if joint >= 0:
            for i in range(9):
                pull[i] = 0.0
                for m in range(9):
                    pull[i] += link[at.INERTIA + 9 * i + m] * link[at.PATH + m]
            _fill(reals, integers, scratch, k, joint, out)
            out[joint, joint] += reals[integers[record + at.FORCES] + at.ROTOR]
        if k > 0:
            start = integers[record - at.RECORD + at.MEMORY]
            carry_inertia_back(link, at.INERTIA, scratch[start : start + at.VECTORS], at.BORNE)
