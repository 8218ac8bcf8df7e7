"""How the integration of a chain's run is judged: by the error equation, by a second run, or by a companion.

The error equation (`erls.accuracy.integration`) costs less than a second run, and errs to the large side where steps
are coarse or leave vibrations unresolved. A second run (`erls.accuracy.second_run`) costs half of one, and is made
where the equation cannot be followed, or where its estimate would decide over the total. Generalized-alpha has
companions with larger steps (`erls.accuracy.constrained_integration`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from erls.accuracy.error_over_time import ErrorOverTime
from erls.accuracy.integration import SUDDEN, IntegrationError, expected, integration_error, sudden
from erls.accuracy.second_run import second_run_error
from erls.accuracy.vibrations import wrong_table
from erls.auto.outputs import Watched
from erls.equations.registry import system_of
from erls.maths.so3 import Array
from erls.run.chain.run import ChainRun
from erls.scene.integrators import FIXED_STEP

CONSTRAINED = ("nodal", "absolute")
"""Kinds of systems whose integration is generalized-α with conditions."""

_CHAOTIC = 3.0  # e-folds of the error over the second half of a run: more than drift makes
_ADDED_UP = 3.0  # growth over the second half of errors that add up: by 2 what runs out of step, by 4 what drifts
_EARLY = 2.0  # times the error up to which a horizon is given: when an error passes a bound is less sure than its size


class Integrated(NamedTuple):
    """What is known of the integration of a run.

    Attributes
    ----------
    times, error : (k,) arrays
        Largest error of a point up to each time [s], [m].
    efforts, reactions : mapping of str to float or None
        By joint, relative to their peaks.
    note : str
        Why nothing is known, or up to when it is.
    """

    times: Array
    error: Array
    efforts: Mapping[str, float | None]
    reactions: Mapping[str, float | None]
    note: str = ""

    def horizon(self, tolerance: float, others: float) -> float | None:
        """Last time up to which all parts together stay within the tolerance, where the integration passes it."""
        if not len(self.error) or self.error[-1] + others <= tolerance or others > tolerance:
            return None
        beyond = np.flatnonzero(~(_EARLY * self.error + others <= tolerance))
        return float(self.times[max(int(beyond[0]) - 1, 0)])

    def amplified(self) -> float:
        """By how much disturbances of the motion grow beyond what errors that add up do: at least 1.

        Errors of other parts are found where they arise; the motion takes them on as it does those of the integration.
        """
        if not len(self.error):
            return 1.0
        half = float(np.interp((self.times[0] + self.times[-1]) / 2, self.times, self.error))
        return max(1.0, float(self.error[-1]) / max(_ADDED_UP * half, 1e-300)) if half > 0 else 1.0

    def growth(self) -> float:
        """Rate at which errors grow exponentially over the second half of a run [1/s]; 0 where they only add up.

        The largest finite-time Lyapunov exponent, as the error itself shows it, which is followed with nothing
        linearized.
        """
        half = len(self.times) // 2
        if half < 4:
            return 0.0
        t, error = self.times[half:], np.maximum(self.error[half:], 1e-300)
        folds = float(np.log(error[-1] / error[0]))
        return folds / float(t[-1] - t[0]) if folds > _CHAOTIC and t[-1] > t[0] else 0.0


def judged_integration(run: ChainRun, watched: Watched, others: float) -> Integrated:
    """By the error equation where it can be followed, by a second run elsewhere.

    Parameters
    ----------
    run : ChainRun
    watched : tuple of (int, int)
        Link and node of each judged point.
    others : float
        Sum of the other parts of the error [m]: an estimate below it need not be sharpened.
    """
    none: dict[str, float | None] = dict.fromkeys(run.joint_names)
    settings, s = run.scene.record.simulation, run.solution
    if not s.y.shape[1] or len(s.t) < 2:  # nothing is integrated
        zero: dict[str, float | None] = dict.fromkeys(run.joint_names, 0.0)
        return Integrated(s.t[[0, -1]], np.zeros(2), zero, zero)
    if system_of(run.formulation.mechanism, settings) in CONSTRAINED or settings.integrator == FIXED_STEP:
        return _of_companion(run, none)
    found: IntegrationError | None = None
    mechanism = run.formulation.mechanism
    elastic = any(link.elastic_modes for link in mechanism.links)
    followed = settings.output_step is None and wrong_table(s, settings.integrator) is not None
    smooth = not elastic and not sudden(run)  # then nothing is unresolved, and the equation right
    tied = mechanism.loops or mechanism.sticks  # it knows neither loops nor switches
    astray = mechanism.touches or (elastic and sudden(run))  # by sudden forces
    astray = astray or (smooth and bool(mechanism.rotation_vectors))  # what a fast top gathers is too even for it
    if followed and not tied and not astray:
        found = integration_error(run, watched)
    if found is not None and found.whole and (smooth or found.total <= max(expected(run), others)):
        return _with_forces(run, found)
    second = second_run_error(run, watched)
    if found is None or not found.whole:
        if second is None:
            return Integrated(np.zeros(0), np.zeros(0), none, none, "second runs at other tolerances fail")
        return _with_forces(run, second)
    if second is None or not second.total < found.total:
        return _with_forces(run, found)
    return _with_forces(run, found)._replace(times=second.times, error=second.error)


def _of_companion(run: ChainRun, none: dict[str, float | None]) -> Integrated:
    """Of generalized-α, from a run with larger steps."""
    from erls.accuracy.constrained_integration import constrained_integration_error  # here: it imports nodal elements

    known = constrained_integration_error(run)
    if isinstance(known, str):
        return Integrated(np.zeros(0), np.zeros(0), none, none, known)
    efforts, reactions = (none if values is None else _named(run, values) for values in (known.effort, known.reaction))
    return Integrated(known.times, (SUDDEN if sudden(run) else 1.0) * known.error, efforts, reactions)


def _with_forces(run: ChainRun, found: ErrorOverTime) -> Integrated:
    """With errors of efforts and reactions."""
    return Integrated(found.times, found.error, _named(run, found.effort), _named(run, found.reaction))


def _named(run: ChainRun, values: Array) -> dict[str, float | None]:
    """By the names of joints; None in place of what is not finite."""
    pairs = zip(run.joint_names, values.tolist(), strict=True)
    return {name: value if math.isfinite(value) else None for name, value in pairs}
