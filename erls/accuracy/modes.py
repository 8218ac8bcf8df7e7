"""What modes left out of links, and the mesh of frames, change at the points of a run.

Beside the mechanism that was run stands one whose links hold what their reduction leaves out as further coordinates
(`erls.accuracy.finer_links`). Three things follow from its equations along the motion that was run:

- What is left out follows its loads nearly statically and moves points (`left_out_forces`). Where loads come suddenly
  it vibrates, by as much again.
- Links are softer than they were taken to be: vibrations run out of step (`out_of_step`), which usually counts most.
- Under slow loads they have another shape, which makes free joints drift (`slow_drift`).

Their sum, largest over points, is stated with a margin: all three are of first order in what is left out.
"""

from __future__ import annotations

import numpy as np

from erls.accuracy.compared_links import averaged, compared_links, sampled
from erls.accuracy.finer_links import finer_links
from erls.accuracy.left_out_forces import static_answer
from erls.accuracy.mesh_of_beams import mesh_error
from erls.accuracy.out_of_step import out_of_step
from erls.accuracy.slow_drift import slow_drift
from erls.equations.registry import TREES
from erls.equations.substructures import solved
from erls.run.chain.run import ChainRun
from fe_import.errors import FEImportError

_SUDDEN = 2.0  # of the static answer, where loads come suddenly
_MARGIN = 2.0


def modes_error(run: ChainRun) -> tuple[float | None, str]:
    """Error by modes left out of links, and by the mesh of links made of beams.

    Parameters
    ----------
    run : ChainRun

    Returns
    -------
    error : float or None
        Largest over named points and the run [m]; None where it cannot be judged.
    note : str
        Why, or what is not in it; may be empty.
    """
    moving = solved(run.formulation)
    if not any(link.elastic_modes for link in moving.mechanism.links):
        return 0.0, ""
    try:
        if run.scene.record.simulation.formulation not in TREES:
            return mesh_error(run), ""  # of the size of whole deflections: margin enough
        finer = finer_links(run.scene, run.formulation.mechanism, moving.mechanism)
    except FEImportError as problem:
        return None, f"the finite-element model of a link is not at hand: {problem}"
    compared = compared_links(run, moving, finer)
    motion = sampled(run, moving, compared)
    if not len(motion.t):
        return None, "no states to judge"
    parts = _SUDDEN * static_answer(compared, motion)
    parts = parts + out_of_step(compared, motion, run.end - float(run.solution.t[0]))
    parts = parts + slow_drift(compared, averaged(run, moving, compared))
    error = float(_MARGIN * parts.max(initial=0.0))
    return (error, "; ".join(finer.notes)) if np.isfinite(error) else (None, "motion without bound")
