"""Power of all that does work on a mechanism and is no part of its energy, at states of a run."""

from __future__ import annotations

from typing import cast

import numpy as np

from erls.equations.compiled_system import function_in
from erls.equations.erls.paper.dense_chain import DenseChain
from erls.equations.formulation import Formulation, LoopFormulation
from erls.equations.loops.closed_chain import ClosedChain
from erls.equations.serial.formulation import SerialFormulation, contiguous, residual
from erls.equations.serial.records import JOINT_STATE, JointState, Serial
from erls.equations.serial.state_series import reaction_series, state_series
from erls.maths.records import python_reader
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.joints import Joint
from erls.mechanism.loops import LoopFreedom

_see_serial, _see_joint = python_reader(Serial), python_reader(JointState)


def moved(mechanism: Mechanism) -> list[int]:
    """Joints whose motors give them a motion, by their numbers."""
    return [k for k, joint in enumerate(mechanism.joints) if joint.drive.prescribed and not joint.fixed]


def in_angles(formulation: Formulation) -> SerialFormulation | None:
    """The tree of a formulation whose coordinates are the angles that drives act along; None where they are not."""
    tree = formulation.bare if isinstance(formulation, ClosedChain) else formulation
    return tree if isinstance(tree, SerialFormulation) and not isinstance(tree, DenseChain) else None


def known_power(tree: SerialFormulation, t: Array, y: Array, v: Array) -> Array:
    """(k,) power of drives, dampers and friction in the joints of a tree, of the damping of its modes and of loads [W].

    Motors that prescribe motions are left out.
    """
    system, out = tree.compiled, np.empty((len(t), 2))
    powers = function_in("erls.equations.serial.joint_powers", "joint_powers")()
    powers(system.reals, system.integers, system.scratch, contiguous(t), contiguous(y), contiguous(v), out)
    rubbed = 0.0 if tree.dry is None else tree.dry.power(v)
    return np.asarray(out.sum(axis=1)) + tree.load_power(t, y, v) + rubbed


def motor_power(tree: SerialFormulation, t: Array, y: Array, v: Array, a: Array) -> Array:
    """(k,) power of motors that prescribe motions of a tree, for accelerations (k, n) [W]."""
    return _along(tree, t, y, v, a)[1]


def tied_power(chain: ClosedChain, t: Array, y: Array, v: Array) -> tuple[Array, Array]:
    """(k,) power of motors and of what closes the loops on the tree [W]; (k,) largest force of a condition [N].

    With the accelerations of the equations of motion a virtual displacement along the motion itself says

        θ̇_p · F_p + v · r  =  power of all motors, in the tree and in closing joints, and of what acts in the latter,

    where r are the forces that the tree leaves out of balance and F_p those along its prescribed joints: the forces of
    conditions that do not move do no work. NaN where the loops lock.
    """
    system, a, largest = chain.exact, np.empty(v.shape), np.zeros(len(t))
    multipliers = system.room.multipliers
    metres = chain.row_metres[chain.kept]
    for i, at in enumerate(t.tolist() if chain.size else []):
        place, rate = contiguous(y[i]), contiguous(v[i])
        if system.acceleration(system.reals, system.integers, system.scratch, at, place, rate, a[i]):
            a[i] = np.nan
        largest[i] = np.abs(multipliers / metres).max(initial=0.0)
    left, motors = _along(cast(SerialFormulation, chain.bare), t, y, v, a)
    return left + motors, largest


def _along(tree: SerialFormulation, t: Array, y: Array, v: Array, a: Array) -> tuple[Array, Array]:
    """(k,) power of what a tree leaves out of balance, and that of its motors, for accelerations (k, n) [W]."""
    system, numbers, left, motors = tree.compiled, moved(tree.mechanism), np.empty(len(t)), np.zeros(len(t))
    first = _see_serial(system.reals, system.integers, int(system.integers[0])).joint_states
    states = [_see_joint(system.scratch, system.integers, first + k * JOINT_STATE) for k in numbers]
    views = [(state.forces, state.coordinate) for state in states]
    for i, at in enumerate(t.tolist()):
        left[i] = v[i] @ residual(system, at, y[i], v[i], a[i])
        for forces, coordinate in views:
            motors[i] += forces[0] * coordinate[1]
    return left, motors


def reported_power(formulation: Formulation, t: Array, y: Array, v: Array, a: Array) -> Array:
    """(k,) power of drives, dampers and friction in all joints, from the efforts that a run reports; of loads [W]."""
    mechanism, found = formulation.mechanism, reaction_series(formulation, t, y, v, a)
    states, result = state_series(formulation, t, y, v), formulation.load_power(t, y, v)
    for k, joint in enumerate(mechanism.joints):
        if not joint.fixed:
            result += _power(joint, found.effort[:, k], states.angles[:, k], states.rates[:, k])
    for number, loop in enumerate(mechanism.loops):
        if loop.bushing is not None and isinstance(formulation, ClosedChain):
            lost = [formulation.closure(*at).efforts[number].force for at in zip(t.tolist(), y, v, strict=True)]
            result += np.array(lost)
        if loop.freedom is None or not (loop.freedom.active or loop.prescribed):
            continue
        closed = cast(LoopFormulation, formulation)
        motion = np.array([closed.loop_motion(*at, number) for at in zip(t.tolist(), y, v, strict=True)])
        effort = np.array([closed.loop_effort(*at, number) for at in zip(t.tolist(), y, v, strict=True)])
        result += _power(loop.freedom, effort, motion[:, 0], motion[:, 1])
    tree = formulation.bare if isinstance(formulation, ClosedChain) else formulation
    if isinstance(tree, SerialFormulation):
        result -= v[:, tree.size - tree.elastic :] ** 2 @ tree.damping
    return result


def _power(joint: Joint | LoopFreedom, effort: Array, angle: Array, rate: Array) -> Array:
    """(k,) power along a joint, the spring's left out; the effort of a prescribed motion is that of its motor alone."""
    own = joint.forces
    spring = np.array([own.elastic_force(at) for at in angle.tolist()])
    if joint.drive.prescribed and own.active:
        passive = [own.force(*at) for at in zip(angle.tolist(), rate.tolist(), strict=True)]
        return np.asarray((effort + np.array(passive) - spring) * rate)
    return np.asarray((effort - spring) * rate)
