"""A run with ``effects = "auto"``: choose, run, certify, and repeat with more where that is asked for."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

import msgspec

from erls.effects import Certificate, in_order
from erls.errors import Cause, SimulationError
from erls.kernels.jit import announcing
from erls.mechanism.chain import Mechanism
from erls.mechanism.effects import present
from erls.run import Run
from erls.scene import Scene
from erls.selection.certify import certify
from erls.selection.choice import Choice, choose_effects

_KEPT = 0.1  # of the tolerance: what an estimate, scaled by what the certificate found, may take when a run is repeated


def automatic(
    scene: Scene,
    whole: Mechanism,
    integrate: Callable[[Scene, Mechanism], Run],
    tell: Callable[[str], None],
    strict: bool,
) -> Run:
    """Run a scene with the effects that matter.

    Parameters
    ----------
    scene : Scene
    whole : Mechanism
        With all effects.
    integrate : callable
        Runs a scene whose effects are named, as the mechanism without the others.
    tell : callable
        Told what was left out, and what that changed.
    strict : bool
        Whether to repeat the run with effects whose absence passes the tolerance.

    Raises
    ------
    SimulationError
        The run failed with all effects, or was interrupted.
    """
    begun = time.perf_counter()
    choice = choose_effects(scene, whole)
    spent = time.perf_counter() - begun
    tell(choice.note)
    while True:
        try:
            run = integrate(named(scene, whole, choice), choice.applied(whole))
        except SimulationError as problem:
            if not choice.cuts or problem.cause == Cause.INTERRUPTED:
                raise
            tell(f"effects: the run failed without {_left(choice)} ({problem}); repeated with all")
            choice = Choice()
            continue
        begun = time.perf_counter()
        with announcing(tell):
            certificate = _certified(run, whole, choice)
        spent += time.perf_counter() - begun
        if certificate.ok or not strict:
            break
        choice = _less(choice, certificate)
        tell(f"effects: estimated error {certificate.error:.2g} m; repeated with {_on(choice)}")
    if certificate.ok and certificate.error:
        tell(f"effects: what was left out changes named points by about {certificate.error:.2g} m")
    warnings = run.warnings if certificate.ok else (*run.warnings, _warning(certificate))
    for text in warnings[len(run.warnings) :]:
        tell(f"warning: {text}")
    return replace(run, warnings=warnings, certificate=replace(certificate, wall_s=spent))


def named(scene: Scene, whole: Mechanism, choice: Choice) -> Scene:
    """The scene with the names of what is on, so that a run file says what was computed."""
    record = scene.record
    effects, bandwidth = in_order(whole.effects - choice.off), choice.bandwidth or record.simulation.bandwidth
    settings = msgspec.structs.replace(record.simulation, effects=effects, bandwidth=bandwidth)
    links = [msgspec.structs.replace(k, flexible=k.flexible and k.name not in choice.rigid) for k in record.links]
    return replace(scene, record=msgspec.structs.replace(record, simulation=settings, links=links))


def _certified(run: Run, whole: Mechanism, choice: Choice) -> Certificate:
    """The certificate; infinite where the error cannot be followed."""
    settings = run.scene.record.simulation
    tolerances = settings.effects_tolerance, settings.effects_effort_tolerance
    if not choice.rigid and not choice.bandwidth and choice.off.isdisjoint(present(whole)):
        return Certificate(0.0, None, *tolerances)
    try:
        return certify(run, whole)
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
