"""Links that only follow statically: what that leaves out are the vibrations that prescribed motions set off."""

from __future__ import annotations

import numpy as np

from erls.auto.cuts import Cut
from erls.auto.forced import Forced, all_prescribed
from erls.auto.outputs import driven_joints, reacting
from erls.equations.formulation import Formulation
from erls.equations.quick import quick
from erls.equations.registry import formulate
from erls.equations.system import metre_scales
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.substructures import is_split
from erls.scene.chain import Scene
from erls.scene.settings import Simulation

_BELOW = 0.5  # of the lowest frequency along the run
_PEAKS = 64  # times at which drive forces are looked at


def may_follow(mechanism: Mechanism, settings: Simulation) -> bool:
    """Whether links can follow statically, with nothing left to integrate: chains whose joints all follow prescribed
    motions, of links that are not split, in a scene that has no bandwidth of its own.
    """
    if settings.formulation == "nodal" or settings.coordinates == "absolute" or settings.bandwidth is not None:
        return False
    flexible = any(link.elastic_modes for link in mechanism.links) and "static_correction" in mechanism.effects
    return flexible and all_prescribed(mechanism) and not is_split(mechanism)


def static_cut(scene: Scene, formulation: Formulation, forced: Forced) -> Cut | None:
    """All links following statically, with the vibrations that this leaves out as its error.

    Parameters
    ----------
    scene : Scene
    formulation : Formulation
        With all modes.
    forced : Forced
        What they vibrate.

    Returns
    -------
    Cut or None
        None where drive forces cannot be foretold, or loads make a mode unstable.
    """
    lowest = float(forced.omega.min())
    efforts = vibrating_efforts(scene, formulation, forced)
    if lowest <= 0 or efforts is None:
        return None
    scales = metre_scales(formulation)  # type: ignore[arg-type]
    error = float(forced.metres(scales).sum())
    bandwidth = float(f"{_BELOW * lowest / (2 * np.pi):.3g}")
    return Cut(bandwidth=bandwidth, error=error, effort_error=efforts)


def vibrating_efforts(scene: Scene, formulation: Formulation, forced: Forced) -> float | None:
    """What vibrations add to drive forces, relative to their peak: from the accelerations of modes, ω² times their
    amplitudes, all added up. None where joints cannot be freed to tell.
    """
    driven = driven_joints(formulation.mechanism)
    if not driven:
        return 0.0
    mechanism = reacting(formulation.mechanism, scene.record.simulation)
    if mechanism is None:
        return None
    freed, joints = quick(formulate(mechanism, scene.record.simulation)), len(mechanism.joints)
    peak = largest = 0.0
    moving = formulation.mechanism
    for t in forced.t[np.linspace(0, len(forced.t) - 1, _PEAKS).astype(int)].tolist():
        peak = max(peak, float(np.abs(freed.residual(t, *_led(freed.size, moving, t))[driven]).max(initial=0.0)))
    swing = forced.omega**2 * forced.amplitude
    for t, shapes, a in zip(forced.at.tolist(), forced.shapes, swing, strict=True):
        coupling = freed.mass_matrix(t, _led(freed.size, moving, t)[0])[driven, joints:] @ shapes
        largest = max(largest, float((np.abs(coupling) @ a).max(initial=0.0)))
    return largest / peak if peak else (np.inf if largest else 0.0)


def _led(size: int, mechanism: Mechanism, t: float) -> Array:
    """(3, n) coordinates, rates and accelerations of undeformed links that follow their motions."""
    state = np.zeros((3, size))
    for k, joint in enumerate(mechanism.joints):
        reference = joint.drive.reference(t)
        state[:, k] = (joint.position, 0.0, 0.0) if reference is None else reference
    return state
