"""A run with ``effects = "auto"``: choose, run, certify, and repeat with more where that is asked for."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

import msgspec

from erls.auto.certify import certify, following
from erls.auto.choice import Choice, choose_effects
from erls.equations.quasi_static.formulation import QuasiStatic
from erls.errors import Cause, SimulationError
from erls.maths.jit import announcing
from erls.mechanism.chain import Mechanism
from erls.mechanism.effects import SECOND_KINEMATICS, Certificate, in_order
from erls.mechanism.without_effects import present
from erls.run.all_modes import with_all_modes
from erls.run.chain.run import ChainRun
from erls.run.watches.spin_stability import UNSTABLE
from erls.run.watches.static_following import ABOVE, static_error
from erls.scene.chain import Scene

_KEPT = 0.1  # of the tolerance: what an estimate, scaled by what the certificate found, may take when a run is repeated


def automatic(
    scene: Scene,
    whole: Mechanism,
    integrate: Callable[[Scene, Mechanism], ChainRun],
    tell: Callable[[str], None],
    strict: bool,
) -> ChainRun:
    """Run a scene with the effects that matter.

    Parameters
    ----------
    scene : Scene
    whole : Mechanism
        With all effects among which to choose.
    integrate : callable
        Runs a scene whose effects are named, as the mechanism without the others.
    tell : callable
        Told what was left out, and what that changed.
    strict : bool
        Whether to repeat the run with effects whose absence passes the tolerance.

    Raises
    ------
    SimulationError
        The run failed with all effects, or was interrupted; BEYOND_TOLERANCE: with ``strict``, see `refuse_beyond`.
    """
    if whole.bandwidth is not None:
        return _with_bandwidth(scene, whole, integrate, tell, strict)
    begun = time.perf_counter()
    choice = choose_effects(scene, whole)
    spent = time.perf_counter() - begun
    tell(choice.note)
    while True:
        try:
            run = integrate(named(scene, whole, choice), choice.applied(whole))
        except SimulationError as problem:
            if problem.cause == Cause.INTERRUPTED:
                raise
            if not choice.cuts:
                raise
            tell(f"effects: the run failed without {_left(choice)} ({problem}); repeated with all")
            choice = Choice()
            continue
        begun = time.perf_counter()
        with announcing(tell):
            certificate = _certified(run, whole, choice)
        spent += time.perf_counter() - begun
        lost = any(UNSTABLE in text for text in run.warnings) and not choice.off.isdisjoint(SECOND_KINEMATICS)
        if not lost and (certificate.ok or not strict):
            break
        if lost:
            tell(f"effects: links lose their stability without {_left(choice)}; repeated with all")
            choice = Choice()
            continue
        choice = _less(choice, certificate)
        tell(f"effects: estimated error {certificate.error:.2g} m; repeated with {_on(choice)}")
    if certificate.ok and certificate.error:
        tell(f"effects: what was left out changes named points by about {certificate.error:.2g} m")
    warnings = [*run.warnings, *([] if certificate.ok else [_warning(certificate)]), *_links_warnings(run)]
    for text in warnings[len(run.warnings) :]:
        tell(f"warning: {text}")
    result = replace(run, warnings=tuple(warnings), certificate=replace(certificate, wall_s=spent))
    if strict:
        refuse_beyond(result)
    return result


def _with_bandwidth(
    scene: Scene,
    whole: Mechanism,
    integrate: Callable[[Scene, Mechanism], ChainRun],
    tell: Callable[[str], None],
    strict: bool,
) -> ChainRun:
    """The same, where modes above a bandwidth of the scene follow statically: effects are judged as if all modes moved,
    and what these would have done is added.
    """
    runs: list[ChainRun] = []

    def integrate_slow(scene: Scene, mechanism: Mechanism) -> ChainRun:
        runs.append(integrate(scene, replace(mechanism, bandwidth=whole.bandwidth)))
        return with_all_modes(runs[-1])

    found, own = automatic(scene, replace(whole, bandwidth=None), integrate_slow, tell, strict), runs[-1]
    known = static_error(own.formulation, own.solution) if isinstance(own.formulation, QuasiStatic) else None
    certificate = found.certificate
    if known is not None and certificate is not None:
        certificate = replace(certificate, error=certificate.error + known.stated)
    return replace(own, warnings=found.warnings, certificate=certificate)


def _links_warnings(run: ChainRun) -> list[str]:
    """That what the model of links leaves out passes the tolerance."""
    error, tolerance = run.second_order_error or 0.0, run.scene.record.simulation.effects_tolerance
    if error <= tolerance:
        return []
    return [
        f"effects: links are estimated to be off by about {error:.2g} m in all, bending further than they hold; the "
        f"tolerance is {tolerance:.2g} m ({_BEYOND})"
    ]


_BEYOND = "links of beams can take formulation nodal or substructures; or give a larger simulation.effects_tolerance"


def refuse_beyond(run: ChainRun) -> None:
    """Raise where a run estimates an error of its own beyond the tolerance, whatever effects are on.

    Raises
    ------
    SimulationError
        BEYOND_TOLERANCE; its ``run`` is this one.
    """
    settings = run.scene.record.simulation
    error, tolerance = run.second_order_error or 0.0, settings.effects_tolerance
    told = [text for text in run.warnings if UNSTABLE in text or text.startswith(ABOVE)]
    certificate = run.certificate
    if certificate is not None and not certificate.ok:
        told.append(_warning(certificate))
    if error <= tolerance and not told:
        return
    why = told[0] if told else "links deflect further than their model holds"
    problem = SimulationError(
        Cause.BEYOND_TOLERANCE,
        f"the run ended, with an estimated error beyond the tolerance that no effect cures: {why}",
        where="simulation.effects_tolerance",
        value=f"{error:.2g} m" if not told else None,
        limit=f"{tolerance:.2g} m",
        remedy=_BEYOND,
    )
    problem.run = run
    raise problem


def named(scene: Scene, whole: Mechanism, choice: Choice) -> Scene:
    """The scene with the names of what is on, so that a run file says what was computed."""
    record = scene.record
    effects, bandwidth = in_order(whole.effects - choice.off), choice.bandwidth or record.simulation.bandwidth
    settings = msgspec.structs.replace(record.simulation, effects=effects, bandwidth=bandwidth)
    links = [msgspec.structs.replace(k, flexible=k.flexible and k.name not in choice.rigid) for k in record.links]
    return replace(scene, record=msgspec.structs.replace(record, simulation=settings, links=links))


def _certified(run: ChainRun, whole: Mechanism, choice: Choice) -> Certificate:
    """The certificate; infinite where the error cannot be followed."""
    settings = run.scene.record.simulation
    tolerances = settings.effects_tolerance, settings.effects_effort_tolerance
    if not choice.rigid and not choice.bandwidth and choice.off.isdisjoint(present(whole)):
        return Certificate(0.0, None, *tolerances)
    try:
        return certify(run, following(run, whole))
    except SimulationError as problem:
        if problem.cause == Cause.INTERRUPTED:
            raise
        return Certificate(float("inf"), None, *tolerances)


def _less(choice: Choice, certificate: Certificate) -> Choice:
    """A choice to leave out less: what by its estimate, scaled to what was found, stays far below the tolerance."""
    together = sum(cut.error for cut in choice.cuts)
    scale = certificate.error / together if together else float("inf")
    bad_effort = (certificate.effort_error or 0.0) > certificate.effort_tolerance
    if bad_effort or not scale < float("inf"):
        return Choice()
    kept = tuple(cut for cut in choice.cuts if cut.error * scale <= _KEPT * certificate.tolerance)
    return Choice(kept if len(kept) < len(choice.cuts) else ())


def _left(choice: Choice) -> str:
    return ", ".join(cut.name for cut in choice.cuts)


def _on(choice: Choice) -> str:
    return f"all but {_left(choice)}" if choice.cuts else "all effects"


def _warning(certificate: Certificate) -> str:
    effort = certificate.effort_error or 0.0
    drives = f", drive forces by {100 * effort:.2g} %" if effort else ""
    return (
        f"effects: what auto left out changes named points by about {certificate.error:.2g} m{drives}; the tolerance "
        f"is {certificate.tolerance:.2g} m and {100 * certificate.effort_tolerance:.2g} % (use --strict, or "
        "effects = 'all')"
    )
