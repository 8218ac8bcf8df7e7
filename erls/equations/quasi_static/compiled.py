"""The constants of a chain whose fast modes follow statically, packed for `erls.equations.quasi_static`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from erls.equations.compiled_system import CompiledSystem
from erls.equations.erls import compiled_functions as equations
from erls.equations.erls import layout as flags

if TYPE_CHECKING:
    from erls.equations.quasi_static.formulation import QuasiStatic


def compile_quasi_static(inner: CompiledSystem, outer: QuasiStatic) -> CompiledSystem | None:
    """The compiled form around that of a chain with all modes.

    Parameters
    ----------
    inner : CompiledSystem
    outer : QuasiStatic

    Returns
    -------
    CompiledSystem or None
        None where ``inner`` is no chain of `erls.equations.erls`.
    """
    if inner.residual is not equations.residual:
        return None
    from erls.equations.quasi_static import chain, layout

    slow, static = outer.modes.slow, outer.modes.static
    n, s, h = outer.inner.size, slow.shape[1], static.shape[1]
    links = outer.mechanism.links
    joints = np.zeros(n - sum(link.elastic_modes for link in links))
    stiffness = np.concatenate([joints, *(link.stiffness for link in links)])
    damping = np.concatenate([joints, *(link.damping for link in links)])
    light = inner.integers.copy()
    light[[flags.FIRST_ORDER, flags.SECOND_ORDER, flags.CORIOLIS, flags.SOFTENING]] = 0
    constants = [
        slow.T,
        static.T,
        outer.modes.stiffness,
        slow.T @ (stiffness[:, None] * slow),
        slow.T @ (damping[:, None] * slow),
        outer.squares,
        np.array([outer.lapse, *outer.ends]),
    ]
    tail = [len(light), len(outer.ends), n, s, h, len(inner.reals), len(inner.scratch)]
    return CompiledSystem(
        size=s,
        reals=np.concatenate([inner.reals, *(block.ravel() for block in constants)]),
        integers=np.concatenate([inner.integers, light, np.array(tail, dtype=np.int64)]),
        scratch=np.zeros(len(inner.scratch) + layout.memory_size(n, s, h)),
        residual=chain.residual,
        mass_matrix=chain.mass_matrix,
        stiffness_and_damping=chain.stiffness_and_damping,
        load_acceleration=lambda: chain.acceleration,
    )
