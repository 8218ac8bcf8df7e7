"""What leaving out effects has changed in a run: an estimate after the fact, along the computed motion."""

from __future__ import annotations

import numpy as np

from erls.effects import Certificate
from erls.formulations import formulate
from erls.formulations.substructures import solved
from erls.integrators.base import Array, hermite
from erls.mechanism.chain import Mechanism
from erls.run import Run
from erls.selection.coordinates import embedded, kept_places
from erls.selection.error_motion import Knots, error_motion
from erls.selection.outputs import Outputs, effort_error, largest_distance, watched_nodes
from erls.selection.quick import quick

STEPS = 1000
FEWEST = 100  # knots of a run; with fewer of them, states between are taken
_PLACES, _EFFORTS = 120, 40  # knots at which points and drive forces are compared


def certify(run: Run, whole: Mechanism) -> Certificate:
    """Estimate the error of a run that left out effects.

    Parameters
    ----------
    run : Run
    whole : Mechanism
        With all effects.

    Raises
    ------
    SimulationError
        The error cannot be followed.
    """
    settings = run.scene.record.simulation
    formulation = formulate(whole, settings)
    system, reduced = quick(solved(formulation)), quick(solved(run.formulation))
    kept = kept_places(whole, run.formulation.mechanism, system.size)

    def widened(values: Array) -> Array:
        return embedded(values, kept, system.size)

    def balance(t: float, y: Array, v: Array, a: Array) -> Array:
        return widened(reduced.residual(t, y[kept], v[kept], a[kept]))

    legs = [Knots(k.t, widened(k.y), widened(k.v), widened(k.a)) for k in _legs(run)]
    begin, begun = formulation.initial_state(), run.formulation.initial_state()
    start = (begin[0] - widened(begun[0]), begin[1] - widened(begun[1]))
    stride = max(1, round(sum(len(k.t) for k in legs) / STEPS))
    found = error_motion(system, legs, start, balance, stride, 1e-2 * settings.effects_tolerance)
    watched = watched_nodes(whole)
    ours = Outputs(run.scene, run.formulation, watched)
    others = Outputs(run.scene, formulation, watched)
    places = [found[k] for k in np.unique(np.linspace(0, len(found) - 1, _PLACES).astype(int))]
    here = [ours.positions(run.formulation.state(d.t, d.y[kept], d.v[kept])) for d in places]
    there = [others.positions(formulation.state(d.t, d.other_y, d.other_v)) for d in places]
    efforts: tuple[list[Array], list[Array]] = ([], [])
    if ours.driven:
        for d in found[:: max(1, len(found) // _EFFORTS)]:
            efforts[0].append(others.efforts(d.t, d.other_y, d.other_v))
            efforts[1].append(ours.efforts(d.t, d.y[kept], d.v[kept]))
    return Certificate(
        largest_distance(here, there),
        effort_error(*efforts),
        settings.effects_tolerance,
        settings.effects_effort_tolerance,
    )


def _legs(run: Run) -> list[Knots]:
    """Knots of a run between jumps; where they are few, states between them with accelerations of their own."""
    s, system = run.solution, quick(solved(run.formulation))
    jumps = np.flatnonzero(np.diff(s.t) == 0) + 1
    result = []
    for part in np.split(np.arange(len(s.t)), jumps):
        t = s.t[part]
        if len(part) < 2:
            continue
        if len(s.t) >= FEWEST:
            result.append(Knots.inside(t, s.y[part], s.v[part], s.a[part]))
            continue
        wanted = int(np.ceil(STEPS * (t[-1] - t[0]) / (s.t[-1] - s.t[0])))
        times = np.linspace(t[0], t[-1], max(wanted, 2) + 1)
        y, v = hermite(t, s.y[part], s.v[part], s.a[part], times)
        knots = Knots.inside(times, y, v, np.zeros_like(y))
        states = zip(knots.t.tolist(), y, v, strict=True)
        accelerations = np.array([system.acceleration(*state) for state in states]).reshape(y.shape)
        result.append(Knots(knots.t, y, v, accelerations))
    return result
