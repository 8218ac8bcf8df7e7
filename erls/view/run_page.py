"""The report of a run: one page with what it did, what it states of its error, and how to repeat it."""

from __future__ import annotations

import json
import shlex
from collections.abc import Collection, Iterator, Sequence
from typing import TYPE_CHECKING, TypeAlias

import msgspec
import numpy as np
from numpy.typing import NDArray

from erls.maths.so3 import Array
from erls.report.html import (
    Curve,
    Plot,
    Shape,
    code,
    figure,
    folded,
    frames_of,
    heading,
    page,
    paragraph,
    table,
    view,
)
from erls.report.runs import run_report
from erls.run.chain.run import ChainRun
from erls.run.record import Run, plain
from erls.run.tables import Quantity, quantities
from erls.studies.outputs import run_outputs
from erls.studies.spectrum import amplitude_spectrum, peaks
from erls.view.figure import PartMesh
from erls.view.figures import figure_of, holds_stress
from fe_import.files.versions import package_version

if TYPE_CHECKING:  # it imports nodal elements, which chains do not need
    from erls.run.bodies.rest import BodyPath

_TIMES = 1001
_NOTHING = 1e-9  # of the largest load of a kind: what rounding leaves
_LEAST_SHARE = 1e-12
_TWICE = ("angle", "coordinate")
_PROGRAMS = ("erls", "numpy", "scipy", "numba", "h5py")
_PARTS = {
    "integration": "steps and iterations, over the whole run",
    "modes": "modes of links that are left out",
    "effects": "physical effects that are left out",
    "links": "what links of small deformation leave out",
    "output": "interpolation between stored states",
}
_GROUPS = {
    "angle": "Joint angles",
    "coordinate": "Joint coordinates",
    "rate": "Joint rates",
    "effort": "Joint efforts",
}


_Quantities: TypeAlias = Sequence[tuple[str, Quantity]]


def run_page(run: Run, repeat: Sequence[str] = ()) -> str:
    """One self-contained HTML page.

    Parameters
    ----------
    run : Run
    repeat : sequence of str
        Words of the command that made it.
    """
    times = run.spread(_TIMES)
    (axis, along), *found = quantities(run.columns(times))
    x = f"{axis} [{along.unit}]"
    parts = [*_verdict(run), *_moving(run)]
    if not isinstance(run, ChainRun):
        from erls.run.bodies.rest import BodyPath

        parts += _path(run) if isinstance(run, BodyPath) else ()
    sensors = {plain(sensor.name) for sensor in getattr(run, "sensors", ())}
    parts += _histories(x, along.values, found, sensors)
    if isinstance(run, ChainRun) and len(times) > 2:
        parts += _modes(run, times)
    parts += _solver(run, repeat)
    return page(run.title, parts)


def _verdict(run: Run) -> Iterator[str]:
    """What it states of its error, and its warnings."""
    yield heading("Result")
    if run.failure is not None:
        yield paragraph(f"The run ended at {run.axis.text(f'{run.end:.6g}')}: {run.failure}", "bad")
    if run.accuracy is None or run.trust is None:
        yield paragraph("The run was not judged: its error is not known.", "note")
    else:
        total, good = run.accuracy.total, run.trust.verdict == "good"
        stated = "no bound is known" if total is None else f"named points are off by at most {total:.2g} m"
        yield paragraph(f"{run.trust.verdict}: {stated}", "good" if good else "bad")
        yield from (paragraph(reason, "note") for reason in run.trust.reasons)
        summary = run.accuracy.summary()
        rows = [(name, _metres(summary.get(name)), words) for name, words in _PARTS.items()]
        places = ", ".join(summary.get("judged_at") or ["named points"])
        rows.append(("total", _metres(total), f"their sum, at {places}"))
        yield table(("part of the error", "at most [m]", "of what"), rows)
    yield from (paragraph(text, "bad") for text in run.warnings)


def _metres(value: object) -> str:
    return f"{value:.3g}" if isinstance(value, float | int) else "not judged"


def _moving(run: Run) -> Iterator[str]:
    """The mechanism in space."""
    drawn = figure_of(run, stress=holds_stress(run))
    first = drawn.poses([run.start])[0].meshes(0.0)
    kept = [_cells(mesh.cells, len(mesh.points)) for mesh in first]
    carried = [
        _carried(mesh.points, nodes) if mesh.rigid else (nodes, None)
        for mesh, (nodes, _, _) in zip(first, kept, strict=True)
    ]
    times = run.spread(frames_of(sum(len(nodes) for nodes, _ in carried)))
    poses = [pose.meshes(0.0) for pose in drawn.poses(times)]
    stress = [_stress([pose[k] for pose in poses], nodes) for k, (nodes, _, _) in enumerate(kept)]
    shapes = [
        Shape(
            mesh.name,
            lines,
            triangles,
            np.array([pose[k].points[nodes] for pose in poses]),
            np.array([pose[k].displacement[nodes] for pose in poses]),
            weights,
            stress[k],
        )
        for k, (mesh, (_, lines, triangles), (nodes, weights)) in enumerate(zip(first, kept, carried, strict=True))
    ]
    yield heading("Motion" if run.axis.unit == "s" else "Path")
    colours = "how far links are bent" if all(one is None for one in stress) else "how far links are bent, or stress"
    title = f"Turn it by dragging; colours show {colours}"
    yield view(title, run.axis.symbol, run.axis.unit, times, shapes)


def _stress(meshes: Sequence[PartMesh], nodes: NDArray[np.int64]) -> Array | None:
    """(f, n) at the nodes that are drawn; None of a part that tells none."""
    told = [mesh.more.get("von_mises_MPa") for mesh in meshes]
    return None if any(one is None for one in told) else np.array([one[nodes] for one in told if one is not None])


def _path(run: BodyPath) -> Iterator[str]:
    """Load over displacement, with what is unstable and where that changes."""
    loads, places = run.loads(run.times), run.displacements()
    unstable = np.array([e.unstable > 0 for e in run.statics.path])
    kinds = dict.fromkeys(turn.kind for turn in run.statics.turns)
    yield heading("Load and displacement")
    for name, moved in places.items():
        curves = [Curve("equilibria", moved, loads, marked=True)]
        if unstable.any():
            curves.append(Curve("unstable ones", moved[unstable], loads[unstable], points=True))
        for kind in kinds:
            at = [turn for turn in run.statics.turns if turn.kind == kind]
            x = np.interp([turn.arc for turn in at], run.times, moved)
            words = "limit points" if kind == "limit" else "bifurcations"
            curves.append(Curve(words, x, np.array([turn.t for turn in at]), points=True))
        yield figure(Plot(name, "displacement [m]", "load parameter", curves, note="from where it is built"))


def _cells(
    cells: Sequence[tuple[str, Array]], count: int
) -> tuple[NDArray[np.int64], list[list[int]], list[list[int]]]:
    """Nodes that are drawn, and lines and triangles of these."""
    by_kind = {kind: np.asarray(found, dtype=int) for kind, found in cells}
    triangles, lines = (by_kind.get(kind, np.zeros((0, n), dtype=int)) for kind, n in (("triangle", 3), ("line", 2)))
    nodes = np.unique(np.concatenate([triangles.ravel(), lines.ravel()])) if len(triangles) or len(lines) else None
    if nodes is None:
        return np.arange(count), [], []
    number = np.full(count, -1)
    number[nodes] = np.arange(len(nodes))
    return nodes, number[lines].tolist(), number[triangles].tolist()


def _carried(points: Array, nodes: NDArray[np.int64]) -> tuple[NDArray[np.int64], Array]:
    """Up to four of the nodes of a rigid body that span it, each the farthest from the span of those before, and the
    weights (n, 4) by which they place all nodes.
    """
    places = np.column_stack([points[nodes], np.ones(len(nodes))])
    places[:, :3] -= places[:, :3].mean(axis=0)
    left, chosen = places[:, :3].copy(), list[int]()
    for _ in range(4):
        far = int(np.linalg.norm(left, axis=1).argmax())
        if not chosen:
            left -= left[far]
        else:
            along = left[far] / max(float(np.linalg.norm(left[far])), 1e-300)
            left -= np.outer(left @ along, along)
        chosen.append(far)
    chosen = list(dict.fromkeys(chosen))
    weights = np.linalg.lstsq(places[chosen].T, places.T, rcond=None)[0].T
    return nodes[chosen], weights


def _histories(x: str, along: Array, found: _Quantities, sensors: Collection[str]) -> Iterator[str]:
    """Plots of all columns: vectors by themselves, scalars of a kind together, and what sensors read."""
    read = [one for one in found if one[0] in sensors or one[0].rpartition(".")[0] in sensors]
    known = [one for one in found if one not in read]
    vectors = [(name, q) for name, q in known if q.values.ndim == 2]
    yield from _vectors("Places", x, along, [(name, q) for name, q in vectors if q.unit == "m"])
    yield from _scalars(x, along, [(name, q) for name, q in known if q.values.ndim == 1])
    yield from _vectors("Forces and moments", x, along, [(name, q) for name, q in vectors if q.unit != "m"])
    if read:
        yield heading("Sensors")
    for name, q in read:
        parts = [("", q.values)] if q.values.ndim == 1 else list(zip("xyz", q.values.T, strict=True))
        yield figure(Plot(name, x, f"reading [{q.unit}]", [Curve(part, along, values) for part, values in parts]))


def _scalars(x: str, along: Array, found: _Quantities) -> Iterator[str]:
    """A plot for each kind and unit; angles that are the coordinates are not shown twice."""
    grouped: dict[tuple[str, str], list[Curve]] = {}
    for name, q in found:
        base, _, last = name.rpartition(".")
        kind = "Energy" if base == "energy" else _GROUPS.get(last, "Further readings")
        label = last if kind == "Energy" else base if kind in _GROUPS.values() else name
        grouped.setdefault((kind, q.unit), []).append(Curve(label, along, q.values))
    angles, coordinates = ([c for (kind, _), own in grouped.items() if kind == _GROUPS[of] for c in own] for of in _TWICE)
    same = _alike(angles, coordinates)
    for kind in dict.fromkeys(kind for kind, _ in grouped):
        if same and kind == _GROUPS["angle"]:
            continue
        yield heading(kind)
        if same and kind == _GROUPS["coordinate"]:
            yield paragraph("Joint angles are the same.", "note")
        for (one, unit), curves in grouped.items():
            if one != kind:
                continue
            if any(_largest(curve.y) > 0 for curve in curves):
                yield figure(Plot("", x, f"{kind.lower()} [{unit}]", curves))
            else:
                yield paragraph(f"{', '.join(curve.label for curve in curves)}: 0 {unit} all along.", "note")


def _alike(some: Sequence[Curve], others: Sequence[Curve]) -> bool:
    """Whether curves of the same names are there, and the same but for rounding."""
    known = {curve.label: curve.y for curve in others}
    return len(some) == len(known) > 0 and all(
        curve.label in known and np.allclose(curve.y, known[curve.label], rtol=1e-12, atol=1e-12, equal_nan=True)
        for curve in some
    )


def _vectors(title: str, x: str, along: Array, found: _Quantities) -> Iterator[str]:
    """A plot for each; those that are nothing beside the largest of their unit are named."""
    if not found:
        return
    yield heading(title)
    largest = {q.unit: max(_largest(one.values) for _, one in found if one.unit == q.unit) for _, q in found}
    small: dict[str, list[str]] = {}
    for name, q in found:
        if _largest(q.values) <= _NOTHING * largest[q.unit]:
            small.setdefault(q.unit, []).append(name)
            continue
        curves = [Curve(axis, along, q.values[:, k]) for k, axis in enumerate("xyz")]
        what = "coordinate" if q.unit == "m" else name.rpartition(".")[2]
        yield figure(Plot(name, x, f"{what} [{q.unit}]", curves, note="world axes"))
    for unit, names in small.items():
        least = _NOTHING * largest[unit]
        bound = f"at most {least:.1g} {unit}, which is rounding" if least else f"0 {unit} all along"
        yield paragraph(f"{', '.join(names)}: {bound}.", "note")


def _largest(values: Array) -> float:
    return float(np.abs(values[np.isfinite(values)]).max(initial=0.0))


def _modes(run: ChainRun, times: Array) -> Iterator[str]:
    """Spectra, and which modes take part."""
    outputs = run_outputs(run, times)
    spectra = {name: amplitude_spectrum(times, values) for name, values in outputs.accelerations.items()}
    if spectra:
        yield heading("Spectra")
        curves = [Curve(name, s.frequencies[1:], s.amplitudes[1:]) for name, s in spectra.items()]
        yield figure(Plot("Accelerations of points", "frequency [Hz]", "amplitude [m/s²]", curves, "xy"))
        found = [(name, peak) for name, s in spectra.items() for peak in peaks(s)]
        highest = [(name, f"{peak.frequency:.5g}", f"{peak.amplitude:.4g}") for name, peak in found]
        if highest:
            yield table(("point", "peak at [Hz]", "amplitude [m/s²]"), highest)
    rows = [
        (link, str(k), f"{frequency:.5g}", kind, f"{100 * share:.3g}")
        for link, shares in outputs.mode_energy.items()
        for k, (share, kind, frequency) in enumerate(
            zip(shares, outputs.mode_kinds[link], outputs.mode_frequencies[link], strict=True), 1
        )
        if share > _LEAST_SHARE
    ]
    if rows:
        yield heading("Modes")
        told = "Share of each elastic mode in the elastic energy of its link, mean over time"
        yield paragraph(f"{told}; modes without a row take no part but rounding.", "note")
        yield table(("link", "mode", "frequency of the free link [Hz]", "kind", "share [%]"), rows)


def _solver(run: Run, repeat: Sequence[str]) -> Iterator[str]:
    """What it took, and what it was."""
    yield heading("Summary")
    yield code(run_report(run))
    yield heading("Repeat it")
    if repeat:
        yield code("erls " + " ".join(shlex.quote(word) for word in repeat))
    rows = [(name, package_version(name)) for name in _PROGRAMS]
    yield table(("program", "version"), rows)
    settings = json.dumps(json.loads(msgspec.json.encode(run.scene.record)), indent=1)
    yield folded("The scene, with all defaults", code(settings))
