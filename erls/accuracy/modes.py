"""What modes left out of links, and the mesh of frames, change at the points of a run.

Beside the mechanism that was run stands one whose links hold what their reduction leaves out as further coordinates
(`erls.accuracy.finer_links`). Three things follow from its equations along the motion that was run:

- What is left out follows slow loads statically, and moves points (`slow_answer`); where loads come suddenly it
  vibrates, by as much again. Other loads are those of vibrations (`left_out_vibrations`).
- Links are softer than they were taken to be: vibrations run out of step, which usually counts most.
- Under slow loads they have another shape, and vibrations of a sudden start another mean force
  (`mean_vibration_forces`), which makes free joints drift.

Vibrations, what follows them and what follows slow loads have nothing to do with each other: their squares add up.
Drift comes on top, of which errors of first order tell less, since joints that go astray bear other loads. All have a
margin (`benchmarks/random_scenes.py`).

That is what can be foretold. Where it takes no more than a moment the whole mechanism is run as well, and its distance
tells between which bounds the error lies (`erls.accuracy.judged`): what is foretold misses dead centres of loops, and
can be far too large.
"""

from __future__ import annotations

import math

import msgspec
import numpy as np

from erls.accuracy.compared_links import compared_links
from erls.accuracy.configurations import configurations
from erls.accuracy.finer_links import FinerLinks, finer_links, lumped
from erls.accuracy.integration import sudden
from erls.accuracy.judged import Judged
from erls.accuracy.left_out_vibrations import left_out_vibrations
from erls.accuracy.other_run import distance_beside, following_tolerance
from erls.accuracy.slow_answer import slow_answer, start_of_loops
from erls.accuracy.slow_motion import parted
from erls.equations.formulation import Formulation
from erls.equations.quasi_static.formulation import QuasiStatic
from erls.equations.registry import TREES
from erls.equations.substructures import solved
from erls.run.chain.run import ChainRun
from fe_import.errors import FEImportError

_TWICE = 2.0  # of what follows vibrations, where these come suddenly
_MARGIN, _MARGIN_DRIFT = 2.0, 3.0
_WORK = 3e7  # evaluations times squared coordinates that a run with all modes may take: mostly less than a second
_SMALL = 0.1  # of the tolerance, what the integration may take
_RESOLVED = 0.1  # of what is foretold, for which it is integrated
_MORE_SUDDEN = 1.25  # times as much where friction, contacts and limits of motors act, which errors set off


def modes_error(run: ChainRun) -> Judged:
    """Error by modes left out of links, and by the mesh of links made of beams.

    Parameters
    ----------
    run : ChainRun

    Returns
    -------
    Judged
        Largest over named points and the run [m]; None where it cannot be judged. Why, or what is not in it. Of a run
        with all modes, where one is made, the distance: the error of the integration has a part in that.
    """
    moving = solved(run.formulation)
    if not any(link.elastic_modes or lumped(link) for link in moving.mechanism.links):
        return Judged(0.0)
    try:
        if run.scene.record.simulation.formulation not in TREES:
            from erls.accuracy.mesh_of_beams import mesh_error  # here: it imports nodal elements

            return Judged(*mesh_error(run))
        finer = finer_links(run.scene, run.formulation.mechanism, moving.mechanism)
    except FEImportError as problem:
        return Judged(None, f"the finite-element model of a link is not at hand: {problem}")
    foretold = _foretold(run, moving, finer)
    return foretold._replace(apart=_distance(run, finer, foretold.error)).grown(1.0, math.inf)


def _distance(run: ChainRun, finer: FinerLinks, foretold: float | None) -> float | None:
    """From a run with all modes, whose integration leaves visible what is foretold [m].

    None where that is small and there are no loops, in which it may miss more than it tells; where the run would take
    too long; of links from modal files, which have no more modes; where modes follow statically, since what that leaves
    out is another part; and where loads may press links, which makes what is left out softer, by data that nobody has.
    """
    own = run.scene.record.simulation
    more = sum(link.elastic_modes for link in finer.mechanism.links) - len(finer.run)
    most = _WORK / (run.solution.y.shape[1] + more) ** 2
    small = foretold is not None and foretold <= _SMALL * own.tolerance and not run.formulation.mechanism.loops
    unlike = isinstance(run.formulation, QuasiStatic) or len(finer.kept) < len(finer.run) or finer.mechanism.loads
    if small or unlike or run.solution.work.rhs_calls > most:
        return None
    settings = following_tolerance(own) or own
    if foretold is not None:
        settings = msgspec.structs.replace(settings, tolerance=max(own.tolerance, _RESOLVED * foretold))
    return distance_beside(run, finer.mechanism, settings, most)


def _foretold(run: ChainRun, moving: Formulation, finer: FinerLinks) -> Judged:
    """From the equations of the whole mechanism along the motion that was run."""
    compared = compared_links(run, moving, finer)
    motion = parted(run, moving, compared)
    if motion is None:
        return Judged(None, "no states to judge")
    duration = run.end - float(run.solution.t[0])
    places = configurations(compared, motion)
    at_rest, jumps = run.formulation.mechanism.static_start, sudden(run)
    static, drift = slow_answer(compared, motion, places, duration, at_rest, jumps)
    if compared.tied is not None and at_rest:
        static = static + start_of_loops(compared, motion.start)
    off, follows = left_out_vibrations(compared, motion, places, duration)
    moved = _MARGIN * np.sqrt(static**2 + (_TWICE * follows) ** 2 + off**2) + _MARGIN_DRIFT * drift
    error = float((_MORE_SUDDEN if jumps else 1.0) * moved.max(initial=0.0))
    if not np.isfinite(error):
        return Judged(None, "motion without bound")
    return Judged(error, "; ".join(finer.notes))
