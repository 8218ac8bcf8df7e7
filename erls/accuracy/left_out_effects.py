"""The part ``effects`` of a stated error: what physical effects that a run left out would have changed."""

from __future__ import annotations

from dataclasses import replace

import msgspec
import numpy as np

from erls.accuracy.judged_places import judged_nodes
from erls.accuracy.other_run import distance_from, other_run
from erls.auto.certify import certify, following
from erls.equations.quasi_static.formulation import QuasiStatic
from erls.equations.registry import formulate
from erls.equations.substructures import solved
from erls.errors import Cause, SimulationError
from erls.integrate.choice import options_of
from erls.mechanism.chain import Mechanism
from erls.mechanism.effects import LINEAR, in_order
from erls.mechanism.without_effects import present
from erls.run.chain.run import ChainRun
from erls.run.watches.static_following import static_error
from erls.scene.build import build_mechanism

NODAL_EFFECTS = frozenset({"gravity", "joint_stiffness", "joint_damping", "joint_friction", "motor_inertia", "payload"})
"""What may be left out of beam elements."""

_SHARE = 1.2  # of the distance from a run with all effects, which has an error of integration, too
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
    wanted = in_order(mechanism.effects | LINEAR)
    record = run.scene.record
    every = msgspec.structs.replace(record.simulation, effects=wanted)
    whole = build_mechanism(replace(run.scene, record=msgspec.structs.replace(record, simulation=every))).mechanism
    whole = replace(whole, bandwidth=None)
    if not static and missing.isdisjoint(present(whole)):
        return 0.0, ""
    if static:
        return _with_all_modes(run, whole)
    if settings.formulation == "nodal" or settings.coordinates == "absolute" or run.formulation.mechanism.loops:
        return _from_a_run(run, whole)
    try:
        followed = following(run, whole)
        evaluations = _PER_STEP * followed.steps
        if evaluations > run.solution.work.rhs_calls:  # vibrations too fast to pay for
            known = _from_a_run(run, whole, evaluations)
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
    found = _from_a_run(run, whole, _MOST_STATIC)
    if found[0] is not None:
        return found
    if isinstance(run.formulation, QuasiStatic) and not LINEAR - run.formulation.mechanism.effects:
        known = static_error(run.formulation, run.solution)
        if known is not None:
            return known.stated, ""
    return None, f"a run in which all modes move fails, or takes more than {_MOST_STATIC} evaluations"


def _from_a_run(run: ChainRun, whole: Mechanism, most: float = 0.0) -> tuple[float | None, str]:
    """From a run with all effects, which may take so many evaluations."""
    formulation = solved(formulate(whole, run.scene.record.simulation))
    options = replace(options_of(run.scene.record.simulation), output_step=None)
    found = other_run(run, formulation, options, most)
    if found is None:
        return None, "a run with all effects fails; use effects = 'all'"
    return float(_SHARE * distance_from(run, judged_nodes(run), formulation, found)[1][-1]), ""
