"""Stress that pictures show: von Mises at every node, the largest over the thickness of a shell [MPa].

Links that hold recovery maps have it recovered, shells of the nodal formulation and of scenes of bodies tell their own;
what is not known is not a number, and drawn grey.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from erls.equations.nodal.shell_stress import SurfaceStress
from erls.errors import Cause, SceneError
from erls.maths.so3 import Array
from erls.run.bodies.run import BodyRun
from erls.run.chain.recovered import maps_of, recovered
from erls.run.chain.run import ChainRun
from erls.run.record import Run
from fe_import.modal.recovery_maps import von_mises

_MPA = 1e-6


def chain_stress(run: ChainRun, times: Sequence[float] | Array) -> list[Array | None]:
    """(k, n) at the nodes of each link at times (k,); None of links that do not hold it."""
    links, seen = run.formulation.mechanism.links, run.instants(np.asarray(times, dtype=float))
    found: list[Array | None] = [None] * len(links)
    for number in run.formulation.mechanism.bodies:
        link = links[number]
        if link.model.recovery is None or maps_of(link).quantity != "stress":
            continue
        each = _MPA * von_mises(recovered(seen, number))
        at = np.full((len(link.model.nodes), len(each)), np.nan)
        np.fmax.at(at, maps_of(link).nodes, each.T)
        found[number] = at.T
    return found


def surface_stress(run: BodyRun) -> list[SurfaceStress]:
    """Where to look for that of each shell of a scene of bodies."""
    built = run.assembly.system.start.poses
    every = run.assembly.shells.values()
    return [SurfaceStress(own.elements, built, own.cells, len(own.nodes)) for own in every]


def largest(stress: Array) -> Array:
    """(n,) of (n, 3, 6) at bottom, middle and top [Pa]."""
    return np.asarray(_MPA * von_mises(stress).max(axis=1))


def no_stress(run: Run) -> SceneError:
    """The error where nothing of a run holds any."""
    message = "no link or shell of this run holds stress"
    remedy = 'add "[recovery]" with "all = true" to the description of a solid or shell link, and simulate again'
    return SceneError(Cause.BAD_FIELD, message, where="stress", value=run.title, remedy=remedy)
