"""The part ``effects`` of a stated error: what physical effects that a run left out would have changed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from erls.accuracy.other_run import error_beside, mechanism_with
from erls.auto.certify import certify, following
from erls.equations.quasi_static.formulation import QuasiStatic
from erls.errors import Cause, SimulationError
from erls.mechanism.chain import Mechanism
from erls.mechanism.effects import LINEAR
from erls.mechanism.without_effects import present
from erls.run.chain.run import ChainRun
from erls.run.watches.static_following import static_error

NODAL_EFFECTS = frozenset({"gravity", "joint_stiffness", "joint_damping", "joint_friction", "motor_inertia", "payload"})
"""What may be left out of beam elements."""

_MOST_STATIC = 20_000  # evaluations of a run with all modes: what follows statically is meant to save them
_PER_STEP = 4  # evaluations by which an error is followed, of those that a run is counted in


def effects_error(run: ChainRun) -> tuple[float | None, str]:
    """Error of named points [m], or None, and why it is not known.

    Second-order displacements belong to the part ``links``, unless ``auto`` left them out: its certificate judges that.
    """
    if run.certificate is not None:
        if not np.isfinite(run.certificate.error):
            return None, "what auto left out could not be followed along the run; use effects = 'all'"
        return run.certificate.error, ""
    mechanism, settings = run.formulation.mechanism, run.scene.record.simulation
    missing = LINEAR - mechanism.effects
    if settings.formulation == "nodal":
        missing &= NODAL_EFFECTS
    static = isinstance(run.formulation, QuasiStatic)
    if not missing and not static:
        return 0.0, ""
    whole = replace(mechanism_with(run, LINEAR), bandwidth=None)
    if not static and missing.isdisjoint(present(whole)):
        return 0.0, ""
    if static:
        return _with_all_modes(run, whole)
    if settings.formulation == "nodal" or settings.coordinates == "absolute" or run.formulation.mechanism.loops:
        return error_beside(run, whole)
    try:
        followed = following(run, whole)
        evaluations = _PER_STEP * followed.steps
        if evaluations > run.solution.work.rhs_calls:  # vibrations too fast to pay for
            known = error_beside(run, whole, evaluations)
            if known[0] is not None:
                return known
        return certify(run, followed).error, ""
    except SimulationError as problem:
        if problem.cause == Cause.INTERRUPTED:
            raise
        return None, f"what the effects left out would have changed could not be followed ({problem})"


def _with_all_modes(run: ChainRun, whole: Mechanism) -> tuple[float | None, str]:
    """With what modes that follow statically leave out: from a run in which they move, and where that takes too long,
    from what their loads do.
    """
    found = error_beside(run, whole, _MOST_STATIC)
    if found[0] is not None:
        return found
    if isinstance(run.formulation, QuasiStatic) and not LINEAR - run.formulation.mechanism.effects:
        known = static_error(run.formulation, run.solution)
        if known is not None:
            return known.stated, ""
    return None, f"a run in which all modes move fails, or takes more than {_MOST_STATIC} evaluations"
