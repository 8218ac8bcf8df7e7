"""The report of a run: one page with what it did, what it states of its error, and how to repeat it."""

from __future__ import annotations

import json
import shlex
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import msgspec
import numpy as np
from numpy.typing import NDArray

from erls.auto.sizes import effect_forces
from erls.maths.so3 import Array
from erls.mechanism.effects import EFFECTS, in_order
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
from erls.run.tables import quantities
from erls.studies.outputs import run_outputs
from erls.studies.spectrum import amplitude_spectrum, peaks
from erls.view.figure import STRESS, PartMesh
from erls.view.figures import figure_of
from erls.view.histories import histories
from erls.view.stress import holds
from fe_import.files.versions import package_version

if TYPE_CHECKING:  # it imports nodal elements, which chains do not need
    from erls.run.bodies.rest import BodyPath

_TIMES = 1001
_LEAST_SHARE = 1e-12
_PROGRAMS = ("erls", "numpy", "scipy", "numba", "h5py")
_PARTS = {
    "integration": "steps and iterations, over the whole run",
    "modes": "modes of links that are left out",
    "effects": "physical effects that are left out",
    "links": "what links of small deformation leave out",
    "output": "interpolation between stored states",
}


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
    parts += histories(x, along.values, found, sensors, getattr(run, "conservative", False))
    if isinstance(run, ChainRun):
        parts += _modes(run, times) if len(times) > 2 else ()
        parts += _effects(run)
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


def _effects(run: ChainRun) -> Iterator[str]:
    """What acts, and how strongly."""
    sizes = effect_forces(run)
    if not sizes:
        return
    yield heading("Effects")
    told = "size: the largest generalized force that goes with it along the run, as one on all mass alike"
    yield paragraph(f"{told}; `erls effects` says what leaving it out changes.", "note")
    rows = [(name, f"{size:.3g}" if np.isfinite(size) else "-", EFFECTS[name].summary) for name, size in sizes.items()]
    yield table(("effect", "size [N]", "what it is"), rows)
    if left := in_order(EFFECTS.keys() - run.formulation.mechanism.effects):
        yield paragraph(f"Left out: {', '.join(left)}.", "note")


def _moving(run: Run) -> Iterator[str]:
    """The mechanism in space."""
    drawn = figure_of(run, color="stress" if holds(run, STRESS) else "deflection")
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
    told = [mesh.more.get(STRESS.array) for mesh in meshes]
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
    if (quads := by_kind.get("quad")) is not None:
        triangles = np.concatenate([triangles, quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
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
