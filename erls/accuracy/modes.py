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

In loops all of this comes back through the other links, which makes more of it near dead centres, and vibrations drive
joints: there a run with all modes says what they change, where it takes no more than a moment.
"""

from __future__ import annotations

import msgspec
import numpy as np

from erls.accuracy.compared_links import compared_links
from erls.accuracy.configurations import configurations
from erls.accuracy.finer_links import finer_links, lumped
from erls.accuracy.integration import sudden
from erls.accuracy.judged import Judged
from erls.accuracy.left_out_vibrations import left_out_vibrations
from erls.accuracy.other_run import distance_beside, following_tolerance
from erls.accuracy.slow_answer import slow_answer, start_of_loops
from erls.accuracy.slow_motion import parted
from erls.equations.registry import TREES
from erls.equations.substructures import solved
from erls.mechanism.chain import Mechanism
from erls.run.chain.run import ChainRun
from fe_import.errors import FEImportError

_TWICE = 2.0  # of what follows vibrations, where these come suddenly
_MARGIN, _MARGIN_DRIFT = 2.0, 3.0
_MARGIN_RUN = 2.0  # of the distance from a run with all modes, both of which have errors of integration
_WORK = 3e7  # evaluations times squared coordinates that it may take: most of a second
_RESOLVED = 0.1  # of the estimate, to which it is integrated
_MORE_SUDDEN = 1.25  # times as much where friction, contacts and limits of motors act, which errors set off


def modes_error(run: ChainRun) -> Judged:
    """Error by modes left out of links, and by the mesh of links made of beams.

    Parameters
    ----------
    run : ChainRun

    Returns
    -------
    Judged
        Largest over named points and the run [m]; None where it cannot be judged. Why, or what is not in it.
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
    notes = "; ".join(finer.notes)
    if compared.tied is not None and len(finer.kept) == len(finer.run):  # links from modal files have no more modes
        most = _WORK / compared.whole.size**2
        if run.solution.work.rhs_calls <= most and (known := _of_a_run(run, finer.mechanism, error, most)) is not None:
            return Judged(known, notes, grown=True)
    return Judged(error, notes) if np.isfinite(error) else Judged(None, "motion without bound")


def _of_a_run(run: ChainRun, whole: Mechanism, estimate: float, most: float) -> float | None:
    """From a run with all modes, whose integration leaves the estimate visible [m]; None where it takes too long."""
    own = run.scene.record.simulation
    settings = following_tolerance(own) or own
    if np.isfinite(estimate):
        settings = msgspec.structs.replace(settings, tolerance=max(own.tolerance, _RESOLVED * estimate))
    distance = distance_beside(run, whole, settings, most)
    return None if distance is None else _MARGIN_RUN * distance
