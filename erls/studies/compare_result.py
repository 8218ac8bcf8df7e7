"""What a comparison found: distances of pairs of columns, what second order explains of them, the JSON."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from erls.maths.so3 import Array
from erls.studies.outputs import Outputs
from erls.studies.spectrum import Peak, amplitude_spectrum, peaks
from fe_import.errors import ReportedError

_FELT = 0.05  # of the deflection: vibrations below drift apart by less than it matters
_SECOND_ORDER = 10.0  # times δ²/L, and once more per vibration period; the shipped scenes stay below 70 % of it


@dataclass(frozen=True)
class Distance:
    """Largest and root-mean-square distance of two histories, and the peak of the first."""

    largest: float
    rms: float
    peak: float


@dataclass(frozen=True)
class Pair:
    """Two columns against each other.

    Attributes
    ----------
    a, b : str
    points, accelerations, angles, coordinates, forces, moments, efforts : dict of Distance
        By name of point or joint.
    energy : Distance
        Of the change of total energy since the start.
    spectrum : dict of tuple of (Peak, Peak)
        Peaks of each point's acceleration that both have, strongest first.
    expected : float
        What second order in the deflection explains at named points [m].
    verdict : str
    as_expected : bool
    """

    a: str
    b: str
    points: dict[str, Distance]
    accelerations: dict[str, Distance]
    angles: dict[str, Distance]
    coordinates: dict[str, Distance]
    forces: dict[str, Distance]
    moments: dict[str, Distance]
    efforts: dict[str, Distance]
    energy: Distance
    spectrum: dict[str, tuple[tuple[Peak, Peak], ...]]
    expected: float
    verdict: str
    as_expected: bool


@dataclass(frozen=True)
class Comparison:
    """The result of `compare`: outputs or error of every column, pairs of those that ran."""

    scene: str
    outputs: dict[str, Outputs]
    errors: dict[str, ReportedError]
    pairs: tuple[Pair, ...]
    complete: bool


def pair(a: str, one: Outputs, b: str, other: Outputs) -> Pair:
    """Distances of two columns that were sampled alike."""
    deflection = max(one.deflection, other.deflection)
    expected = (_SECOND_ORDER + _periods(one)) * deflection**2 / max(one.size, 1e-300)
    points = _distances(one.points, other.points)
    found = max((d.largest for d in points.values()), default=0.0)
    verdict, fine = _verdict(found, expected, deflection)
    gauges = {o.summary.get("gauge", "joint-angle") for o in (one, other)}
    if len(gauges) > 1 and fine:
        verdict += "; coordinates theta belong to different gauges and differ more, joint angles are comparable"
    return Pair(
        a,
        b,
        points,
        _distances(one.accelerations, other.accelerations),
        _distances(one.angles, other.angles),
        _distances(one.coordinates, other.coordinates),
        _distances(one.forces, other.forces),
        _distances(one.moments, other.moments),
        _distances(one.efforts, other.efforts),
        distance(one.energy - one.energy[0], other.energy - other.energy[0]),
        {name: _common_peaks(one, other, name) for name in one.accelerations if name in other.accelerations},
        expected,
        verdict,
        fine,
    )


def _periods(outputs: Outputs) -> float:
    """Periods in the run of the fastest vibration that moves points by a share of the deflection. Frequencies differ to
    first order in the deflection, so that phases drift apart.
    """
    felt = [
        p.frequency
        for a in outputs.accelerations.values()
        for p in peaks(amplitude_spectrum(outputs.times, a))
        if p.amplitude >= _FELT * outputs.deflection * (2 * np.pi * p.frequency) ** 2
    ]
    return max(felt, default=0.0) * float(outputs.times[-1] - outputs.times[0])


def _verdict(found: float, expected: float, deflection: float) -> tuple[str, bool]:
    if found <= expected:
        return (
            f"as expected: points differ by up to {found:.2g} m, second order in the deflection of "
            f"{deflection:.2g} m, phase drift included, explains {expected:.2g} m",
            True,
        )
    return (
        f"NOT as expected: points differ by up to {found:.2g} m, second order in the deflection of "
        f"{deflection:.2g} m explains only {expected:.2g} m; look at step and tolerances, at the number of modes, "
        "and at speeds near loss of stability",
        False,
    )


def _distances(one: dict[str, Array], other: dict[str, Array]) -> dict[str, Distance]:
    return {name: distance(history, other[name]) for name, history in one.items() if name in other}


def distance(one: Array, other: Array) -> Distance:
    """Of two histories (k,) or (k, c)."""
    a, b = (x.reshape(len(x), -1) for x in (one, other))
    apart = np.linalg.norm(a - b, axis=1)
    return Distance(float(apart.max()), float(np.sqrt((apart**2).mean())), float(np.linalg.norm(a, axis=1).max()))


def _common_peaks(one: Outputs, other: Outputs, name: str) -> tuple[tuple[Peak, Peak], ...]:
    first, second = (peaks(amplitude_spectrum(o.times, o.accelerations[name]), 8) for o in (one, other))
    line = 1 / (one.times[-1] - one.times[0]) if one.times[-1] > one.times[0] else 0.0
    result = []
    for p in sorted(first, key=lambda p: -p.amplitude):
        near = [q for q in second if abs(q.frequency - p.frequency) <= max(line, 0.05 * p.frequency)]
        if near:
            result.append((p, min(near, key=lambda q: abs(q.frequency - p.frequency))))
    return tuple(result)


def comparison_summary(comparison: Comparison) -> dict[str, Any]:
    """The JSON of ``erls compare``."""

    def table(found: dict[str, Distance]) -> dict[str, Any]:
        return {name: {"max": d.largest, "rms": d.rms, "peak": d.peak} for name, d in found.items()}

    return {
        "scene": comparison.scene,
        "complete": comparison.complete,
        "formulations": {
            name: {
                **{key: o.summary[key] for key in ("wall_s", "steps", "rhs_calls", "energy")},
                "elastic_coordinates": o.summary.get("elastic_coordinates"),
                "deflection": o.deflection,
                "peaks": {
                    point: [
                        {"frequency_hz": p.frequency, "amplitude": p.amplitude}
                        for p in peaks(amplitude_spectrum(o.times, o.accelerations[point]))
                    ]
                    for point in o.accelerations
                },
                "warnings": o.summary["warnings"],
            }
            for name, o in comparison.outputs.items()
        },
        "errors": {name: error.as_dict() for name, error in comparison.errors.items()},
        "pairs": [
            {
                "a": p.a,
                "b": p.b,
                "points": table(p.points),
                "joints": table(p.angles),
                "coordinates": table(p.coordinates),
                "accelerations": table(p.accelerations),
                "forces": table(p.forces),
                "moments": table(p.moments),
                "efforts": table(p.efforts),
                "energy": {"max": p.energy.largest, "rms": p.energy.rms, "peak": p.energy.peak},
                "spectrum": {
                    name: [
                        {
                            "a_hz": x.frequency,
                            "b_hz": y.frequency,
                            "a_amplitude": x.amplitude,
                            "b_amplitude": y.amplitude,
                        }
                        for x, y in common
                    ]
                    for name, common in p.spectrum.items()
                },
                "expected": p.expected,
                "verdict": p.verdict,
                "as_expected": p.as_expected,
            }
            for p in comparison.pairs
        ],
    }
