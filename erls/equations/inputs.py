"""Inputs of a mechanism: efforts of drives and factors of loads that somebody sets while it moves.

In a mechanism with inputs, what drives with a given torque, drives of free joints and factors of loads say is a
constant, held in memory that is written to: in the mechanism itself, and in every packed form of its equations.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from erls.equations.compiled_system import CompiledSystem
from erls.equations.formulation import Formulation
from erls.equations.loops.closed_chain import ClosedChain
from erls.equations.loops.records import CLOSING_JOINT, ClosingJoint, Loops
from erls.equations.serial.formulation import SerialFormulation
from erls.equations.serial.loads import LOAD
from erls.equations.serial.loads import Load as LoadRecord
from erls.equations.serial.records import JOINT, Serial
from erls.equations.serial.records import Joint as JointRecord
from erls.equations.serial.time_curves import CurvePart
from erls.maths.records import python_reader
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.curves import Curve, Piecewise
from erls.mechanism.joints import Joint
from erls.mechanism.loops import LoopFreedom

_see_serial, _see_joint, _see_load = python_reader(Serial), python_reader(JointRecord), python_reader(LoadRecord)
_see_loops, _see_closing, _see_part = python_reader(Loops), python_reader(ClosingJoint), python_reader(CurvePart)

GIVEN = ("free", "torque")
"""Kinds of drives whose effort is an input; the others follow their own law."""

_Moved = TypeVar("_Moved", Joint, LoopFreedom)


@dataclass(frozen=True)
class Input:
    """An effort of a drive, or a factor of a load.

    Attributes
    ----------
    name : str
        Of the joint, or ``loads[k]``.
    own : Curve or None
        What the scene says; None for nothing.
    neutral : float
        What it is without: 0 of an effort, 1 of a factor.
    held : Piecewise
        The constant in its place.
    """

    name: str
    own: Curve | None
    neutral: float
    held: Piecewise

    def at(self, t: float, left: bool) -> float:
        """What the scene says at a time; ``left``: before a jump there."""
        return self.neutral if self.own is None else self.own.value(t, left)


def with_inputs(mechanism: Mechanism) -> tuple[Mechanism, tuple[Input, ...]]:
    """The mechanism with all of its inputs, and these."""
    inputs: dict[str, Input] = {}

    def held(name: str, own: Curve | None, neutral: float) -> Curve:
        if name not in inputs:
            constant = Piecewise((), np.array([[neutral]]), ())
            inputs[name] = Input(name, own, neutral, constant)
        return inputs[name].held

    def driven(moved: _Moved, name: str) -> _Moved:
        drive = moved.drive
        if drive.kind not in GIVEN or (isinstance(moved, Joint) and (moved.fixed or moved.freedom.vector)):
            return moved
        return replace(moved, drive=replace(drive, kind="torque", load=held(name, drive.load, 0.0)))

    joints = tuple(driven(joint, joint.name) for joint in mechanism.joints)
    loops = tuple(
        loop if loop.freedom is None or loop.coupling else replace(loop, freedom=driven(loop.freedom, loop.name))
        for loop in mechanism.loops
    )
    loads = tuple(
        replace(load, factor=held(f"loads[{load.number}]", load.factor, 1.0)) for load in mechanism.loads
    )
    return replace(mechanism, joints=joints, loops=loops, loads=loads), tuple(inputs.values())


class Inputs:
    """The inputs of a formulation, to be set.

    Parameters
    ----------
    formulation : Formulation
        Of a mechanism of `with_inputs`, in independent coordinates, loops closed or not.
    inputs : tuple of Input
    """

    def __init__(self, formulation: Formulation, inputs: tuple[Input, ...]) -> None:
        self.every = inputs
        places: dict[int, list[Array]] = {id(known.held): [known.held.coefficients] for known in inputs}
        for curve, view in _views(formulation):
            if id(curve) in places:
                places[id(curve)].append(view)
        self._places = [places[id(known.held)] for known in inputs]

    @property
    def values(self) -> Array:
        """(i,) as they are set."""
        return np.array([views[0][0, 0] for views in self._places])

    def set(self, values: Array) -> None:
        """Let them be (i,) values from now on."""
        for views, value in zip(self._places, values.tolist(), strict=True):
            for view in views:
                view[0, 0] = value


def _views(formulation: Formulation) -> Iterator[tuple[Curve | None, Array]]:
    """Curves of a mechanism, and views (1, 1) of their constants in all packed forms of its equations."""
    if isinstance(formulation, ClosedChain):
        for system in (formulation.loops, formulation.exact, formulation.whole):
            yield from _of_tree(system, formulation.mechanism)
            yield from _of_loops(system, formulation.mechanism)
        yield from _views(formulation.bare)
    elif isinstance(formulation, SerialFormulation):
        for packed in (formulation.compiled, formulation.complete):
            yield from _of_tree(packed, formulation.mechanism)


def _of_tree(system: CompiledSystem, mechanism: Mechanism) -> Iterator[tuple[Curve | None, Array]]:
    """Of drives of joints, and of loads."""
    reals, integers = system.reals, system.integers
    serial = _see_serial(reals, integers, int(integers[0]))
    for k, joint in enumerate(mechanism.joints):
        yield joint.drive.load, _constant(system, _see_joint(reals, integers, serial.joints + k * JOINT).load)
    for k, load in enumerate(mechanism.loads):
        record = _see_load(reals, integers, serial.load_records + k * LOAD)
        yield load.factor, _constant(system, record.factor)


def _of_loops(system: CompiledSystem, mechanism: Mechanism) -> Iterator[tuple[Curve | None, Array]]:
    """Of drives of closing joints."""
    reals, integers = system.reals, system.integers
    loops = _see_loops(reals, integers, int(integers[-1]))
    for k, loop in enumerate(mechanism.loops):
        place = _see_closing(reals, integers, loops.first + k * CLOSING_JOINT).joint
        if loop.freedom is not None and place >= 0:
            yield loop.freedom.drive.load, _constant(system, _see_joint(reals, integers, place).load)


def _constant(system: CompiledSystem, place: int) -> Array:
    """View (1, 1) of a constant at the place of its curve; of the first part of another curve, which nobody sets."""
    return np.zeros((1, 1)) if place < 0 else _see_part(system.reals, system.integers, place + 1).pieces
