"""(M + α C + β K) x = b of a chain solved link by link, from the tip inward and back; see
`erls.equations.ffr.ports`.
"""

from __future__ import annotations

from erls.equations.compiled_system import Array, IntArray
from erls.equations.erls.layout import ROTOR
from erls.equations.ffr import layout as at
from erls.equations.ffr.composite import shift_inertia
from erls.equations.ffr.ports import count, give_way, press, press_back, set_rows
from erls.equations.serial.linear import add_columns, carry, carry_back, rows_times
from erls.maths.jit import part

_SINGULAR = 1e-14  # inertia along a joint against what it was before the elimination of the rest


@part
def _copy_pose(given: bool, scratch: Array, start: int, own: Array, to: int) -> None:
    """A pose (12,), or that of what does not move."""
    for i in range(12):
        if given:
            own[to + i] = scratch[start + i]
        else:
            own[to + i] = 1.0 if i in (0, 4, 8) else 0.0


@part
def eliminate(reals: Array, integers: IntArray, scratch: Array, factors: Array, definite: bool) -> int:
    """From the tip inward; 0, or 1 + the number of a joint whose motion nothing resists.

    A matrix that should be positive ``definite`` has no joint whose motion the rest drives either.
    """
    links = integers[at.LINKS]
    for k in range(links - 1, -1, -1):
        record = at.HEADER + k * at.RECORD
        memory, start, screw = integers[record + at.MEMORY], integers[record + at.SHIFTED], integers[record + at.SCREW]
        own, bears, joint = factors[start:], k + 1 < links, integers[record + at.JOINT]
        ports, whole, spare = count(integers, record, bears), own[at.WHOLE : at.WHOLE + 36], own[at.REST : at.REST + 6]
        floats, bends = integers[record + at.INBOARD] >= 0, integers[record + at.OUTBOARD] >= 0
        _copy_pose(True, scratch, memory + at.STEP_POSE, own, at.POSE_STEP)
        _copy_pose(bends, scratch, memory + at.OUTER, own, at.POSE_OUTER)
        _copy_pose(floats, scratch, memory + at.INNER + at.BACK, own, at.POSE_INNER)
        for i in range(36):
            own[at.RESTING + i] = scratch[memory + at.OWN + i]
            whole[i] = own[at.HANGING + i] if bears else 0.0
        if bears:
            shift_inertia(own[at.POSE_OUTER : at.POSE_OUTER + 12], whole, spare)
        resisting = 0.0
        for i in range(36):
            whole[i] += own[at.RESTING + i]
        if joint >= 0:  # before the coordinates give way
            for i in range(36):
                resisting += abs(whole[i] * reals[screw + i // 6] * reals[screw + i % 6])
        if ports:
            set_rows(reals, integers, scratch, record, bears, own)
            give_way(integers, record, bears, ports, own)
        if floats:
            shift_inertia(own[at.POSE_INNER : at.POSE_INNER + 12], whole, spare)
        if joint >= 0:
            along = own[at.RESISTANCE] + reals[integers[record + at.FORCES] + ROTOR]
            resisting += abs(along)
            for i in range(6):
                own[at.PUSH + i] = 0.0
                for j in range(6):
                    own[at.PUSH + i] += whole[6 * i + j] * reals[screw + j]
            for i in range(6):
                along += own[at.PUSH + i] * reals[screw + i]
            if not (abs(along) > _SINGULAR * resisting and (along.real > 0.0 or not definite)):
                return int(joint + 1)
            own[at.ALONG] = along
            for i in range(6):
                for j in range(6):
                    whole[6 * i + j] -= own[at.PUSH + i] * (own[at.PUSH + j] / along)
        if k > 0:
            shift_inertia(own[at.POSE_STEP : at.POSE_STEP + 12], whole, spare)
            before = integers[record - at.RECORD + at.SHIFTED]
            for i in range(36):
                factors[before + at.HANGING + i] = whole[i]
    return 0


@part
def _collect(reals: Array, integers: IntArray, record: int, bears: bool, ports: int, own: Array, b: Array) -> None:
    """LOADED of a link by the forces on its coordinates, in ``b``, and by HANDED; FREE, what z is for g = 0."""
    e, first = integers[record + at.MODES], integers[record + at.FIRST_MODE]
    rows, forces = at.DIAGONAL + 2 * e, own[at.DIAGONAL + e : at.DIAGONAL + 2 * e]
    loaded, handed = own[at.LOADED : at.LOADED + 6], own[at.HANDED : at.HANDED + 6]
    given, free, spare = own[at.GIVEN_PORTS : at.OUTPUT], own[at.FREE : at.PRESSED], own[at.REST : at.REST + 6]
    forces[:] = 0.0
    add_columns(reals, integers[record + at.BASIS], e, b[first : first + e], e, 1.0, forces)
    place = 12 if integers[record + at.INBOARD] >= 0 else 6
    for i in range(ports):
        total = 0.0
        for m in range(e):
            total += own[rows + i * e + m] * own[at.DIAGONAL + m] * forces[m]
        if bears:
            for m in range(6):
                total -= own[at.FLEXIBILITY + i * ports + place + m] * handed[m]
        given[i] = total
    for i in range(ports):
        free[i] = 0.0
        for j in range(ports):
            free[i] += own[at.SOLVER + i * 2 * ports + ports + j] * given[j]
    press_back(integers, record, bears, free, own, loaded, spare)
    if bears:
        for i in range(6):
            spare[i] += handed[i]
        carry_back(own[at.POSE_OUTER : at.POSE_OUTER + 12], spare, 0, spare, 0)
        for i in range(6):
            loaded[i] += spare[i]


@part
def _answer(reals: Array, integers: IntArray, record: int, bears: bool, ports: int, own: Array, b: Array) -> None:
    """Elastic accelerations of a link whose ARRIVED is known, and their part in GONE."""
    e, first = integers[record + at.MODES], integers[record + at.FIRST_MODE]
    rows, forces = at.DIAGONAL + 2 * e, own[at.DIAGONAL + e : at.DIAGONAL + 2 * e]
    frame, node, free = own[at.ARRIVED : at.ARRIVED + 6], own[at.GONE : at.GONE + 6], own[at.FREE : at.PRESSED]
    pressed = own[at.PRESSED : at.PRESSED + ports]
    press(integers, record, bears, frame, node, own, pressed)
    for i in range(ports):
        for j in range(6):
            free[i] += own[at.OUTPUT + 6 * i + j] * frame[j]
    place = 12 if integers[record + at.INBOARD] >= 0 else 6
    for i in range(ports):
        for j in range(ports):
            pressed[i] += own[at.BOUND + i * ports + j] * free[j]
        if bears and place <= i < place + 6:
            pressed[i] += own[at.HANDED + i - place]
            node[i - place] += free[i]
        for m in range(e):
            forces[m] -= own[rows + i * e + m] * pressed[i]
    for m in range(e):
        forces[m] *= own[at.DIAGONAL + m]
    rows_times(reals, integers[record + at.BASIS], e, forces, b[first : first + e])


@part
def substitute(reals: Array, integers: IntArray, factors: Array, b: Array) -> None:
    """Replace ``b`` by the solution, after `eliminate`."""
    links = integers[at.LINKS]
    for k in range(links - 1, -1, -1):
        record = at.HEADER + k * at.RECORD
        own, bears, joint = factors[integers[record + at.SHIFTED] :], k + 1 < links, integers[record + at.JOINT]
        ports, screw = count(integers, record, bears), integers[record + at.SCREW]
        loaded = own[at.LOADED : at.LOADED + 6]
        if ports:
            _collect(reals, integers, record, bears, ports, own, b)
        elif bears:
            carry_back(own[at.POSE_OUTER : at.POSE_OUTER + 12], own, at.HANDED, own, at.LOADED)
        else:
            loaded[:] = 0.0
        if integers[record + at.INBOARD] >= 0:
            carry_back(own[at.POSE_INNER : at.POSE_INNER + 12], loaded, 0, loaded, 0)
        if joint >= 0:
            left = b[joint]
            for i in range(6):
                left -= loaded[i] * reals[screw + i]
            b[joint] = left
            for i in range(6):
                loaded[i] += own[at.PUSH + i] * (left / own[at.ALONG])
        if k > 0:
            before = integers[record - at.RECORD + at.SHIFTED]
            carry_back(own[at.POSE_STEP : at.POSE_STEP + 12], loaded, 0, factors[before:], at.HANDED)
    for k in range(links):
        record = at.HEADER + k * at.RECORD
        own, bears, joint = factors[integers[record + at.SHIFTED] :], k + 1 < links, integers[record + at.JOINT]
        ports, screw = count(integers, record, bears), integers[record + at.SCREW]
        frame = own[at.ARRIVED : at.ARRIVED + 6]
        if k == 0:
            frame[:] = 0.0
        else:
            before = factors[integers[record - at.RECORD + at.SHIFTED] :]
            carry(own[at.POSE_STEP : at.POSE_STEP + 12], before, at.GONE, frame, 0)
        if joint >= 0:
            left = b[joint]
            for i in range(6):
                left -= own[at.PUSH + i] * frame[i]
            left /= own[at.ALONG]
            b[joint] = left
            for i in range(6):
                frame[i] += left * reals[screw + i]
        if integers[record + at.INBOARD] >= 0:
            carry(own[at.POSE_INNER : at.POSE_INNER + 12], frame, 0, frame, 0)
        carry(own[at.POSE_OUTER : at.POSE_OUTER + 12], frame, 0, own, at.GONE)
        if ports:
            _answer(reals, integers, record, bears, ports, own, b)
