"""A nodal system's records in flat memory, as its functions take them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from erls.equations.nodal import contract
from erls.equations.nodal.contract import Before, Layout, Model, State, Work
from erls.equations.nodal.elimination import Elimination
from erls.equations.nodal.model import factor_room, room
from erls.equations.nodal.nodes import Nodes, numbers_of, rows_of
from erls.maths.calls import address_for, address_of
from erls.maths.records import Memory, python_reader
from erls.maths.so3 import Array
from fe_import.model import IntArray

_read_layout, _read_model, _read_work = python_reader(Layout), python_reader(Model), python_reader(Work)


class Functions(NamedTuple):
    """What computes all values: `erls.equations.nodal.sums`, `outputs` and `blocks`."""

    forces: Callable[..., None]
    remember: Callable[..., None]
    move: Callable[..., None]
    energies: Callable[..., None]
    knot: Callable[..., None]
    conditions: Callable[..., None]
    blocks: Callable[..., None]
    weighted: Callable[..., None]


@dataclass(frozen=True)
class Flat:
    """Memory that functions are given, and how many numbers a factored iteration matrix takes."""

    reals: Array
    integers: IntArray
    scratch: Array
    factors: int

    def model(self) -> Model:
        """Views of the constants."""
        return _read_model(self.reals, self.integers, self._layout().model)

    def work(self) -> Work:
        """Views of working memory."""
        return _read_work(self.scratch, self.integers, self._layout().work)

    def _layout(self) -> Layout:
        return _read_layout(self.reals, self.integers, int(self.integers[-1]))


def used_kinds(model: Model) -> list[str]:
    """Modules of elements that a system has and that are compiled for those alone."""
    has = {
        "beam_forces": len(model.beam_nodes),
        "actuator_forces": len(model.actuator_nodes),
        "contact_forces": len(model.contact_nodes),
        "shell_forces": len(model.shell_nodes),
        "spring_forces": len(model.spring_nodes) + len(model.winding_nodes),
    }
    return [name for name, count in has.items() if count]


def lay_out(model: Model, start: Nodes, samples: int, own: Elimination, functions: Functions) -> Flat:
    """Put a system into flat memory.

    Parameters
    ----------
    model : Model
    start : Nodes
        A configuration.
    samples : int
        Numbers that depend on time alone.
    own : Elimination
        Of the iteration matrix.
    functions : Functions
        What is called by address.
    """
    integers, used = list[int](), used_kinds(model)
    constants, scratch, factors = Memory(integers), Memory(integers, np.zeros(samples)), Memory(integers)
    state = State(rows_of(start.poses), start.bent, start.turned, start.wound)
    layout = Layout(
        model=constants.put(model),
        work=scratch.put(room(model)),
        before=scratch.put(Before(numbers_of(start), np.zeros(1))),
        state=Memory(integers).put(state),
        factors=factors.put(factor_room(model, own)),
        forces=address_of(functions.forces, contract.FORCES),
        remember=address_of(functions.remember, contract.REMEMBER),
        knot=address_of(functions.knot, contract.KNOT),
        blocks=address_of(functions.blocks, contract.BLOCKS),
        weighted=address_of(functions.weighted, contract.SUMMED),
        beam_forces=address_for(contract.call_beam_forces, "beam_forces" in used),
        bend_beams=address_for(contract.call_bend_beams, "beam_forces" in used),
        beam_derivatives=address_for(contract.call_beam_derivatives, "beam_forces" in used),
        beam_energies=address_for(contract.call_beam_energies, "beam_forces" in used),
        actuator_forces=address_for(contract.call_actuator_forces, "actuator_forces" in used),
        turn_actuators=address_for(contract.call_turn_actuators, "actuator_forces" in used),
        actuator_derivatives=address_for(contract.call_actuator_derivatives, "actuator_forces" in used),
        actuator_energies=address_for(contract.call_actuator_energies, "actuator_forces" in used),
        store_actuators=address_for(contract.call_store_actuators, "actuator_forces" in used),
        contact_forces=address_for(contract.call_contact_forces, "contact_forces" in used),
        contact_derivatives=address_for(contract.call_contact_derivatives, "contact_forces" in used),
        contact_energies=address_for(contract.call_contact_energies, "contact_forces" in used),
        shell_forces=address_for(contract.call_shell_forces, "shell_forces" in used),
        shell_derivatives=address_for(contract.call_shell_derivatives, "shell_forces" in used),
        shell_energies=address_for(contract.call_shell_energies, "shell_forces" in used),
        spring_forces=address_for(contract.call_spring_forces, "spring_forces" in used),
        wind_springs=address_for(contract.call_wind_springs, "spring_forces" in used),
        spring_derivatives=address_for(contract.call_spring_derivatives, "spring_forces" in used),
        spring_energies=address_for(contract.call_spring_energies, "spring_forces" in used),
        samples=samples,
        reach=float(model.metres.max(initial=1.0)),
    )
    integers.append(constants.put(layout))
    numbers = np.array(integers, dtype=np.int64)
    return Flat(constants.numbers, numbers, scratch.numbers, len(factors.numbers))
