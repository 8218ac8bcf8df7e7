"""A chain whose fast modes follow statically, as records behind those of the chain with all modes."""

from __future__ import annotations

from typing import Any

import numpy as np

from erls.equations.compiled_system import CompiledSystem, function_in
from erls.equations.erls.formulation import Erls
from erls.equations.erls.records import Chain
from erls.equations.quasi_static.records import Reduced, reduced_state
from erls.equations.serial.records import Serial
from erls.maths.records import Memory, python_reader


def compile_quasi_static(inner: CompiledSystem, outer: Any) -> CompiledSystem | None:
    """The compiled form around that of a chain with all modes.

    Parameters
    ----------
    inner : CompiledSystem
    outer : QuasiStatic
        See `erls.equations.quasi_static.formulation`.

    Returns
    -------
    CompiledSystem or None
        None where ``inner`` is no chain of `erls.equations.erls` in the joint-angle gauge.
    """
    if not isinstance(outer.inner, Erls):
        return None
    name = f"erls.equations.quasi_static.{'stiffened_' if outer.inner.stiffened else ''}chain"
    slow, static = outer.modes.slow, outer.modes.static
    n, s, h = outer.inner.size, slow.shape[1], static.shape[1]
    links = outer.mechanism.links
    joints = np.zeros(n - sum(link.elastic_modes for link in links))
    stiffness = np.concatenate([joints, *(link.stiffness for link in links)])
    damping = np.concatenate([joints, *(link.damping for link in links)])
    integers = inner.integers.tolist()
    constants, scratch = Memory(integers, inner.reals), Memory(integers, inner.scratch)
    serial = python_reader(Serial)(inner.reals, inner.integers, integers[0])
    light = python_reader(Chain)(inner.reals, inner.integers, serial.own)._replace(
        first_order=0, second_order=0, coriolis=0, softening=0
    )
    at = constants.put(serial._replace(own=constants.put(light)))
    state = scratch.put(reduced_state(n, s, h))
    constants.put(
        Reduced(
            state=state,
            light=at,
            slow=slow.T,
            static=static.T,
            kappa=outer.modes.stiffness,
            stiffness=slow.T @ (stiffness[:, None] * slow),
            damping=slow.T @ (damping[:, None] * slow),
            squares=outer.squares,
            lapse=outer.lapse,
            ends=np.array(outer.ends),
        )
    )
    return CompiledSystem(
        size=s,
        reals=constants.numbers,
        integers=np.array(integers, dtype=np.int64),
        scratch=scratch.numbers,
        residual=function_in(name, "residual")(),
        mass_matrix=function_in(name, "mass_matrix")(),
        stiffness_and_damping=function_in("erls.equations.quasi_static.stiffness", "stiffness_and_damping")(),
        load_acceleration=function_in(name, "acceleration"),
    )
