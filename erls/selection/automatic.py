"""A run with ``effects = "auto"``: choose, run, certify, and repeat with more where that is asked for."""

from __future__ import annotations

import time
from collections.abc import Callable, Set
from dataclasses import replace

import msgspec

from erls.effects import Certificate, in_order
from erls.errors import Cause, SimulationError
from erls.mechanism.chain import Mechanism
from erls.mechanism.effects import present, without
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
    for note in choice.notes:
        tell(note)
    off = choice.off
    while True:
        try:
            run = integrate(_named(scene, whole, off), without(whole, off))
        except SimulationError as problem:
            if not off or problem.cause == Cause.INTERRUPTED:
                raise
            tell(f"effects: the run failed without {', '.join(in_order(off))} ({problem}); repeated with all")
            off = frozenset()
            continue
        begun = time.perf_counter()
        certificate = _certified(run, whole, off)
        spent += time.perf_counter() - begun
        if certificate.ok or not strict:
            break
        off = _less(choice, off, certificate)
        tell(f"effects: estimated error {certificate.error:.2g} m; repeated with {_on(whole, off)}")
    warnings = run.warnings if certificate.ok else (*run.warnings, _warning(certificate))
    for text in warnings[len(run.warnings) :]:
        tell(f"warning: {text}")
    return replace(run, warnings=warnings, certificate=replace(certificate, wall_s=spent))


def _named(scene: Scene, whole: Mechanism, off: Set[str]) -> Scene:
    """The scene with the names of the effects that are on, so that a run file says what was computed."""
    settings = msgspec.structs.replace(scene.record.simulation, effects=in_order(whole.effects - off))
    return replace(scene, record=msgspec.structs.replace(scene.record, simulation=settings))


def _certified(run: Run, whole: Mechanism, off: Set[str]) -> Certificate:
    """The certificate; infinite where the error cannot be followed."""
    settings = run.scene.record.simulation
    tolerances = settings.effects_tolerance, settings.effects_effort_tolerance
    if off.isdisjoint(present(whole)):
        return Certificate(0.0, None, *tolerances)
    try:
        return certify(run, whole)
    except SimulationError as problem:
        if problem.cause == Cause.INTERRUPTED:
            raise
        return Certificate(float("inf"), None, *tolerances)


def _less(choice: Choice, off: Set[str], certificate: Certificate) -> frozenset[str]:
    """Fewer effects to leave out: those whose estimates, scaled to what was found, stay far below the tolerance."""
    estimates = choice.estimates
    together = sum(estimates[name] for name in off & estimates.keys())
    scale = certificate.error / together if together else float("inf")
    bad_effort = (certificate.effort_error or 0.0) > certificate.effort_tolerance
    if "flexibility" in off or bad_effort or not scale < float("inf"):
        return frozenset()
    kept = [n for n in off if estimates.get(n, 0.0) * scale <= _KEPT * certificate.tolerance]
    return frozenset(kept) if len(kept) < len(off) else frozenset()


def _on(whole: Mechanism, off: Set[str]) -> str:
    return f"all but {', '.join(in_order(off))}" if off else "all effects"


def _warning(certificate: Certificate) -> str:
    effort = certificate.effort_error or 0.0
    drives = f", drive forces by {100 * effort:.2g} %" if effort else ""
    return (
        f"effects: what auto left out changes named points by about {certificate.error:.2g} m{drives}; the tolerance "
        f"is {certificate.tolerance:.2g} m and {100 * certificate.effort_tolerance:.2g} % (use --strict, or "
        "effects = 'all')"
    )


