"""The reference of a study: positions that are better than what they judge, with an error of their own.

It is the nodal formulation wherever that can run. Elsewhere (loops, solid links, bare matrices) it is a tight run of a
modal one with all effects, those of the scene, and second-order displacements if every flexible link knows them: links
that are linear in their own frames would agree with each other, and be wrong together. Runs get finer and finer; the
distance of the last two says how far they can be trusted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Literal

import msgspec
import numpy as np

from erls.errors import Cause, SceneError
from erls.integrate.choice import INTEGRATION_SHARE
from erls.maths.so3 import Array
from erls.mechanism.effects import ALL, in_order
from erls.run.chain.run import ChainRun
from erls.scene.chain import Scene
from erls.studies.effect_sets import label_of
from erls.studies.refinement import Level, TooShort, refine
from fe_import.errors import ReportedError

Kind = Literal["nodal", "tight"]
_SAMPLES = 400
_LEVELS = range(4)
_DEARER: dict[Kind, float] = {"nodal": 4.0, "tight": 2.0}  # than the level before: twice as fine, ten times as tight
_WANTED = (0.3, 1e-3)  # of the tolerance: needed to judge by, and more than enough
SHARES = (0.7, 0.4)  # of the budget of a study that its reference may take: until it can be judged by, and then


@dataclass(frozen=True)
class Reference:
    """What settings are judged against.

    Attributes
    ----------
    times : (k,) array
        [s]
    positions : (k, points, 3) array
        [m]
    made_by : str
        How, in words.
    error : float
        Its own, estimated from its last runs [m].
    linear : bool
        Whether links are linear in their own frames; what that leaves out is not in the error.
    warnings : tuple of str
        Of its finest run.
    prepared_s : float
        Time before the first steps of its runs: reading, reducing, compiling [s].
    """

    times: Array
    positions: Array
    made_by: str
    error: float
    linear: bool = False
    warnings: tuple[str, ...] = ()
    prepared_s: float = 0.0


def default_reference(scene: Scene) -> Kind:
    """The nodal formulation is the judge wherever it can run."""
    from fe_import.description.link import load_link

    beams = all(
        link.rigid is not None
        or (link.model and load_link(scene.folder / link.model).description.frame is not None)
        for link in scene.record.links
    )
    return "nodal" if beams and not scene.record.loops else "tight"


def knows_second_order(scene: Scene) -> bool | None:
    """Whether all flexible links have second-order displacements; None when there is none."""
    from erls.scene.build import link_models

    flexible = [model for model in link_models(scene, lambda text: None) if model.elastic_modes]
    return all(model.second_order is not None for model in flexible) if flexible else None


def make_reference(scene: Scene, kind: Kind, points: tuple[str, ...], tolerance: float, budget: float) -> Reference:
    """Positions of points over the run that settings are judged against, with the error they have themselves.

    Parameters
    ----------
    scene : Scene
    kind : str
        ``nodal`` or ``tight``.
    points : tuple of str
        Names of points.
    tolerance : float
        Of the study [m]; a thousandth of it is enough.
    budget : float
        What the whole study may take [s]; all runs of the reference get `SHARES` of it, from their first steps on.

    Raises
    ------
    SceneError
        BUDGET: too small, and what would do.
    SceneError, FEImportError, SimulationError
        A run failed (its cause, with the remedy), or was interrupted.
    """
    s = scene.record.simulation
    known = knows_second_order(scene)
    stiffened = kind == "tight" and known is True
    # floating frames leave less out; links that are linear are judged by what the scene itself calls for
    formulation = "nodal" if kind == "nodal" else "ffr" if stiffened or s.formulation == "nodal" else s.formulation
    fixed: dict[str, Any] = {
        "formulation": formulation,
        "effects": in_order(ALL),
        "coordinates": "independent",
        "bandwidth": None,
    }
    levels = [Level(label, _with(scene, **fixed, **fields)) for label, fields in _levels(scene, kind, tolerance)]
    times = np.linspace(0.0, s.duration, _SAMPLES + 1)
    try:
        found = refine(
            levels,
            partial(sampled, points=points, times=times),
            partial(_own_error, kind),
            (_WANTED[0] * tolerance, _WANTED[1] * tolerance),
            (SHARES[0] * budget, SHARES[1] * budget),
            _DEARER[kind],
        )
    except TooShort as problem:
        whole = float(problem.args[0])
        message = f"the {kind} reference alone takes about {whole:.3g} s, and may take {SHARES[0]:.0%} of the budget"
        remedy = f"give {whole / SHARES[0]:.3g} s or more, a shorter simulation.duration, or another --reference"
        raise SceneError(Cause.BUDGET, message, where="budget", value=budget, remedy=remedy) from None
    except ReportedError as problem:
        if problem.cause == Cause.INTERRUPTED:
            problem.remedy = "nothing was kept"
        else:
            problem.remedy = f"this was the {kind} reference; choose another one (--reference), or: {problem.remedy}"
        raise
    finest, error = found.samples[-1], _own_error(kind, found.samples)
    runs = f"{found.labels[-1]} beside {found.labels[-2]}"
    warnings = tuple(text for text in found.warnings if text.startswith("link "))
    if kind == "nodal":  # second order in mesh and step, both halved
        extrapolated = finest + (finest - found.samples[-2]) / 3
        made_by = f"nodal formulation, {runs}, extrapolated"
        return Reference(times, extrapolated, made_by, error, False, warnings, found.prepared_s)
    made_by = f"{formulation} with all modes, effects {label_of(fixed['effects'])}, lobatto at {runs}"
    return Reference(times, finest, made_by, error, known is False, warnings, found.prepared_s)


def _levels(scene: Scene, kind: Kind, tolerance: float) -> list[tuple[str, dict[str, Any]]]:
    """What sets the accuracy, in words and as fields of the scene, from coarse to fine."""
    s = scene.record.simulation
    if kind == "tight":
        tight = [tolerance / 10 ** (k + 1) for k in _LEVELS]
        return [(f"{x:.1g} m", {"integrator": "lobatto", "tolerance": x / INTEGRATION_SHARE}) for x in tight]
    step = s.step or min(s.duration / 1000, 1e-3)
    return [
        (
            f"{(elements := 8 * 2**k)} elements per member with steps of {(own := 2 * step / 2**k):.3g} s",
            {"integrator": "generalized_alpha", "elements_per_member": elements, "step": own},
        )
        for k in _LEVELS
    ]


def _own_error(kind: Kind, samples: Sequence[Array]) -> float:
    """Estimate for the last of two or more samples: their change; of the nodal formulation what is left after it where
    changes fall as in second order (by 4) or more slowly (by 2 at least).
    """
    change = _distance(samples[-1], samples[-2])
    if kind == "tight":
        return change
    falls = _distance(samples[-2], samples[-3]) / change if len(samples) > 2 and change else 4.0
    return change / (min(max(falls, 2.0), 4.0) - 1)


def _distance(a: Array, b: Array) -> float:
    return float(np.linalg.norm(a - b, axis=2).max())


def _with(scene: Scene, **fields: Any) -> Scene:
    settings = msgspec.structs.replace(scene.record.simulation, **fields)
    return replace(scene, record=msgspec.structs.replace(scene.record, simulation=settings))


def sampled(run: ChainRun, points: Sequence[str], times: Array) -> Array:
    """Positions (k, points, 3) [m] of named points at k times [s]."""
    return np.stack([run.position(name, times) for name in points], axis=1)
