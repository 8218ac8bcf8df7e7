"""Energies and states of a chain whose links have second-order displacements."""

from __future__ import annotations

from erls.equations import compiled_system as contract
from erls.equations.erls.energy import add_energies
from erls.equations.erls.states import put_states
from erls.maths.jit import kernel
from erls.maths.so3 import Array
from fe_import.model import IntArray


@kernel(contract.ENERGY, counted=False)
def energy(reals: Array, integers: IntArray, scratch: Array, t: float, y: Array, v: Array, out: Array) -> None:
    """Kinetic (rotors included), elastic, gravity, springs [J]."""
    add_energies(reals, integers, scratch, t, y, v, out, True)


@kernel(contract.STATES, counted=False)
def states(reals: Array, integers: IntArray, scratch: Array, t: Array, y: Array, v: Array, out: Array) -> None:
    """As `erls.equations.erls.states.states`."""
    put_states(reals, integers, scratch, t, y, v, out, True)
