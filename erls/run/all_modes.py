"""A run whose fast modes follow statically, seen as one in which all modes moved."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from erls.equations.quasi_static.formulation import QuasiStatic
from erls.integrate.base import legs
from erls.run.chain.run import ChainRun


def with_all_modes(run: ChainRun) -> ChainRun:
    """The same motion in the coordinates of all modes; the run itself where none follows statically.

    Parameters
    ----------
    run : ChainRun

    Returns
    -------
    ChainRun
        Its formulation is that of all modes, its knots hold their places, rates and, of the slow motion, accelerations.
    """
    formulation, s = run.formulation, run.solution
    if not isinstance(formulation, QuasiStatic):
        return run
    inside = s.t.copy()  # at which side of a jump forces are
    for leg in legs(formulation, (float(s.t[0]), float(s.t[-1]))):
        inside[np.searchsorted(s.t, leg.start, side="right") - 1] = leg.first
        inside[np.searchsorted(s.t, leg.end, side="left")] = leg.last
    knots = [formulation.all_modes(*knot) for knot in zip(inside.tolist(), s.y, s.v, s.a, strict=True)]
    y, v, a = (np.array([knot[k] for knot in knots]) for k in range(3))
    return replace(run, formulation=formulation.inner, solution=replace(s, y=y, v=v, a=a))
