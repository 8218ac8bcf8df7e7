"""Studies: sampling, spectra, runs on several cores, mode counts, comparisons, and their reports."""

from __future__ import annotations

import json
import pickle
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scenes
from pool_work import square

import erls
from erls.errors import Cause, SceneError, SimulationError
from erls.report.compare_page import comparison_csv, comparison_page, comparison_text
from erls.report.html import Curve, Plot, figure, page
from erls.report.mode_page import beside, mode_study_page, mode_study_text, read_printed
from erls.studies.compare import compare
from erls.studies.compare_result import comparison_summary, distance, pair
from erls.studies.mode_count import study_modes
from erls.studies.mode_overrides import default_counts
from erls.studies.mode_result import Change, Tolerances, changed, relative_change, study_summary
from erls.studies.outputs import Outputs, run_outputs
from erls.studies.pool import run_all
from erls.studies.spectrum import amplitude_spectrum, peaks

# ----- spectra


def test_spectrum_of_sines() -> None:
    """Frequency to a twentieth of a line; amplitude within the 4 % that a Hann window leaves between lines."""
    t = np.linspace(0.0, 2.0, 2001)
    for f, a in ((40.0, 3.0), (40.25, 2.0), (61.6, 0.5)):
        (peak,) = peaks(amplitude_spectrum(t, 7.0 + a * np.sin(2 * np.pi * f * t)), 1)
        assert peak.frequency == pytest.approx(f, abs=0.025)
        assert peak.amplitude == pytest.approx(a, rel=0.04)


def test_spectrum_of_a_vector_does_not_depend_on_axes() -> None:
    t = np.linspace(0.0, 1.0, 501)
    signal = np.stack([np.sin(200 * t), 2 * np.cos(333 * t), 0 * t], axis=1)
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    np.testing.assert_allclose(
        amplitude_spectrum(t, signal).amplitudes, amplitude_spectrum(t, signal @ turn.T).amplitudes, atol=1e-12
    )


def test_no_peaks() -> None:
    t = np.linspace(0.0, 1.0, 100)
    assert peaks(amplitude_spectrum(t, 0 * t)) == []
    assert peaks(amplitude_spectrum(np.zeros(1), np.ones(1))) == []


# ----- sampling


def test_accelerations_of_a_pendulum(tmp_path: Path) -> None:
    """A rigid pendulum: sampled acceleration of its end is θ̈ and θ̇² of the closed equation to 1e-6."""
    rod = {"mass": 2.0, "points": {"a": [0.0, 0.0, 0.0], "b": [0.4, 0.0, 0.0]}, "centre_of_mass": [0.2, 0.0, 0.0],
           "inertia": [1e-3, 0.03, 0.03]}  # fmt: skip
    path = scenes.write_toml(
        tmp_path / "scene.toml",
        {
            "simulation": {"duration": 0.5, "integrator": "dop853"},
            "base": {"rotation_deg": [90.0, 0.0, 0.0]},
            "joints": [{"name": "j", "dh": {"convention": "standard"}}],
            "links": [{"name": "rod", "rigid": rod}],
            "points": [{"name": "end", "link": "rod", "node": "b"}],
        },
    )
    run = erls.simulate(path)
    t = np.linspace(0.0, 0.5, 21)
    o = run_outputs(run, t)
    theta, rate = o.angles["j"], run.joint_rate("j", t)
    rotation = -2.0 * 9.81 * 0.2 * np.cos(theta) / (0.03 + 2.0 * 0.04)
    radial, across = np.stack([np.cos(theta), 0 * t, np.sin(theta)]), np.stack([-np.sin(theta), 0 * t, np.cos(theta)])
    expected = 0.4 * (rotation * across - rate**2 * radial).T
    assert abs(run.joint_angle("j", 0.5)) > 0.3
    np.testing.assert_allclose(o.accelerations["end"], expected, atol=1e-5)
    assert o.deflection == pytest.approx(0.0, abs=1e-12)


# ----- runs on several cores


@pytest.mark.parametrize("workers", [1, 2])
def test_pool_keeps_order_and_errors(workers: int) -> None:
    seen: list[tuple[float, float]] = []
    finished, complete = run_all(square, [3, 13, 4], lambda done, total: seen.append((done, total)), workers)
    assert complete
    assert [f.result for f in finished] == [9, None, 16]
    problem = finished[1].error
    assert isinstance(problem, SimulationError)
    assert (problem.cause, problem.where, problem.value, problem.remedy) == (
        Cause.NOT_FINITE, "t = 1 s", 13.0, "try another",
    )  # fmt: skip
    assert seen == [(1, 3), (2, 3), (3, 3)]


def test_pool_survives_a_dead_process() -> None:
    finished, _ = run_all(square, [99, 99], workers=2)
    assert [f.error.cause for f in finished if f.error] == [Cause.OUT_OF_MEMORY] * 2


@pytest.mark.parametrize("workers", [1, 2])
def test_pool_keeps_what_was_finished_before_an_interrupt(workers: int) -> None:
    def interrupt(done: float, total: float) -> None:
        if done == 2:
            raise KeyboardInterrupt

    finished, complete = run_all(square, [1, 2, 3, 4, 5], interrupt, workers)
    assert not complete
    assert len(finished) == 2


def test_errors_travel() -> None:
    problem = SceneError(Cause.BAD_FIELD, "no", where="here", value=3, limit=2, remedy="less")
    again = pickle.loads(pickle.dumps(problem))
    assert (str(again), again.cause, type(again)) == (str(problem), problem.cause, SceneError)


# ----- mode counts


def synthetic(amplitude: float, modes: int = 3) -> Outputs:
    """A point that moves on a line, a joint that turns and pushes."""
    t = np.linspace(0.0, 1.0, 401)  # holds the peaks of the wave
    wave = np.sin(2 * np.pi * 20 * t)
    x = np.stack([amplitude * wave, 0 * t, 0 * t], axis=1)
    return Outputs(
        times=t,
        points={"p": x},
        accelerations={"p": -((2 * np.pi * 20) ** 2) * x},
        angles={"j": amplitude * wave},
        coordinates={"j": amplitude * wave},
        forces={"j": x},
        moments={"j": 0 * x},
        efforts={"j": 0 * t},
        energy=t,
        conservative=False,
        deflection=0.01,
        size=2.0,
        mode_energy={"l": np.linspace(0.0, 1.0, modes)},
        mode_kinds={"l": tuple("abcdefgh"[:modes])},
        mode_frequencies={"l": np.arange(1.0, modes + 1)},
        summary={"wall_s": 1.0, "steps": 1, "rhs_calls": 1, "energy": {"max_drift": None}, "warnings": []},
    )


def test_changes_are_what_they_say() -> None:
    """Peaks of |1.1 s - s|, relative to the peak 1.1; angles held to position over size."""
    found = {c.output: c for c in changed(synthetic(1.0), synthetic(1.1), Tolerances(1e-2, 0.1, 0.01))}
    assert found["point p"].value == pytest.approx(0.1)
    assert found["point p"].ratio == pytest.approx(10)
    assert found["angle j"].ratio == pytest.approx(0.1 * 2 / 1e-2)
    assert found["force j"].value == pytest.approx(0.1 / 1.1)
    assert found["moment j"].value == found["effort j"].value == 0
    assert found["spectrum p"].value == pytest.approx(0, abs=1e-9)
    assert relative_change(np.ones(3), np.ones(3)) == 0


def test_default_counts() -> None:
    assert default_counts(1) == [0, 1]
    assert default_counts(18) == [0, 1, 2, 3, 4, 6, 8, 12, 16, 18]
    counts = default_counts(500)
    assert counts[-1] == 500
    assert len(counts) < 22
    assert (np.diff(counts) > 0).all()


@pytest.fixture(scope="module")
def l_scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("l")
    scenes.l_link(folder)
    return scenes.l_scene(folder, simulation={"duration": 0.1, "step": 1e-3})


def test_mode_study(l_scene: Path) -> None:
    """Rows are the single runs; loose tolerances converge at the first count, tight ones nowhere, and it says why."""
    counts = [1, 2, 6, 12, 18]
    study = study_modes(l_scene, counts, tolerances=Tolerances(0.1, 10.0, 10.0), workers=1)
    assert [p.modes for p in study.points] == counts
    assert study.converged == 1
    run = erls.simulate(erls.load_scene(l_scene, ["links.l.elastic_modes=6"]))
    outputs = study.points[2].outputs
    assert outputs is not None
    np.testing.assert_allclose(outputs.points["tip"][-1], run.position("tip", run.end), atol=1e-12)
    assert "converged at 1 elastic modes" in mode_study_text(study)

    strict = study_modes(l_scene, counts, tolerances=Tolerances(1e-9, 1e-9, 1e-9), workers=1)
    assert strict.converged is None
    kind, share = strict.remaining[0]
    assert kind in {k for p in strict.points if p.outputs for k in p.outputs.mode_kinds["l"]}
    assert 0 < share < 1
    text = mode_study_text(strict)
    assert strict.exhausted
    assert "complete: all 18 elastic modes" in text
    assert max(map(len, text.split("\n\n")[1].splitlines())) <= 100
    assert kind in text


def test_ranked_modes_are_counted_in_their_order(tmp_path: Path, l_scene: Path) -> None:
    """Rows are runs of links that keep as many of their ranking, which ends the study; links that rank nothing, and
    other ways to say how many, are refused.
    """
    ranking = {"driving": ["root.rx"], "observed": ["tip.uz"], "count": 6}
    scenes.l_link(tmp_path, reduction={"selection": "ranking", "ranking": ranking})
    path = scenes.l_scene(tmp_path, simulation={"duration": 0.1, "step": 1e-3})
    study = study_modes(path, ranked=True, workers=1)
    assert [p.modes for p in study.points] == [1, 2, 3, 4, 6]
    assert study.exhausted
    two = 'links.l.reduction.ranking={driving=["root.rx"], observed=["tip.uz"], count=2}'
    run, outputs = erls.simulate(erls.load_scene(path, [two])), study.points[1].outputs
    assert outputs is not None
    assert len(outputs.mode_energy["l"]) == run.elastic_coordinates("l", 0.0).size == 2 + 12 - 6
    np.testing.assert_allclose(outputs.points["tip"][-1], run.position("tip", run.end), atol=1e-12)
    text = mode_study_text(study)
    assert "complete: all 6 ranked fixed-interface modes" in text.replace("\n", " ")
    assert "ranked_modes" in study_summary(study)["points"][0]
    for faulty, arguments, message in (
        (l_scene, {}, "ranks its fixed-interface modes"),
        (path, {"counts": [0, 2]}, "ranked modes"),
        (path, {"frequencies": [100.0]}, "two ways to say the same"),
    ):
        with pytest.raises(SceneError, match=message):
            study_modes(faulty, ranked=True, **arguments)  # type: ignore[arg-type]


def test_the_table_of_a_mode_study_fits_a_terminal(l_scene: Path) -> None:
    """Of 100 columns, whatever links recover, and however long names are."""
    study = study_modes(l_scene, [1, 2], workers=1)
    kinds = ("section-force l near the root", "section-moment l near the root", "stress l", "spectrum tip")
    more = tuple(Change(f"{kind} {'and so on' * 9}", 1e-3, "of peak", 1e9) for kind in kinds)
    last = study.points[-1]
    wide = replace(study, points=(*study.points[:-1], replace(last, changes=(*more, *last.changes))))
    lines = mode_study_text(wide).splitlines()
    [head] = [line for line in lines if line.startswith("modes")]
    for kind in ("points", "angles", "forces", "moments", "efforts", "sections", "stress", "peaks", "worst", "ok"):
        assert kind in head
    assert max(map(len, lines)) <= 100


def test_three_successive_changes_are_asked_for(l_scene: Path) -> None:
    """Two small changes are not enough."""
    study = study_modes(l_scene, [2, 3, 6], tolerances=Tolerances(0.1, 10.0, 10.0), workers=1)
    assert all(p.unchanged for p in study.points[1:])
    assert study.converged is None


FAULTY_STUDIES: list[tuple[dict[str, Any], Cause, str]] = [
    ({"counts": [1, 19]}, Cause.BAD_FIELD, "elastic modes"),
    ({"counts": [-1]}, Cause.BAD_FIELD, "elastic modes"),
    ({"link": "m"}, Cause.BAD_REFERENCE, "m"),
    ({"overrides": ["links.l.flexible=false"]}, Cause.BAD_FIELD, "no link of this scene has elastic modes"),
]


@pytest.mark.parametrize(("arguments", "cause", "message"), FAULTY_STUDIES)
def test_faulty_studies(l_scene: Path, arguments: dict[str, Any], cause: Cause, message: str) -> None:
    with pytest.raises(SceneError, match=message) as caught:
        study_modes(l_scene, **arguments)
    assert str(caught.value.cause) == str(cause)


# ----- published figures


def test_published_figures_stand_beside_ours(l_scene: Path, tmp_path: Path) -> None:
    path = tmp_path / "printed.csv"
    path.write_text("# From a paper\nelastic_modes,t,joint shoulder,point tip z\n2,0.1,1.5,-0.25\n9,0.1,1.6,-0.26\n")
    printed = read_printed(path)
    study = study_modes(l_scene, [2], workers=1)
    header, rows = beside(study, printed)
    columns = ("joint shoulder", "point tip z")
    assert header == ("elastic modes", *(f"{c} {kind}" for c in columns for kind in ("printed", "here")))
    outputs = study.points[0].outputs
    assert outputs is not None
    angle, height = np.degrees(outputs.coordinates["shoulder"][-1]), outputs.points["tip"][-1, 2]
    assert rows[0] == ("2", "1.5", f"{angle:.4f}", "-0.25", f"{height:.6f}")
    assert rows[1] == ("9", "1.6", "", "-0.26", "")
    assert "From a paper" in mode_study_page(study, printed)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "not a table"),
        ("modes,t,x\n", "not a table"),
        ("elastic_modes,t,joint a\n1,0.5\n", "row 2 does not fit"),
        ("elastic_modes,t,joint a\n1.5,0.5,1\n", "row 2 does not fit"),
        ("elastic_modes,t,joint a\n1,0.5,nan\n", "row 2 does not fit"),
        ("elastic_modes,t,joint a\n1,0.5,1\n2,0.6,1\n", "at one time"),
        ("elastic_modes,t,joint a\n1,0.5,1\n1,0.5,2\n", "row 3 does not fit"),
        ("elastic_modes,t,joint a\n1,0.5,1_0\n", "row 2 does not fit"),
        ("elastic_modes,t,point a\n1,0.5,1\n", "names no joint or axis"),
        ("#" * 1_000_001, "too large"),
    ],
)
def test_faulty_published_tables(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "printed.csv"
    path.write_text(text)
    with pytest.raises(SceneError, match=message):
        read_printed(path)
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(SceneError):
        read_printed(path)
    with pytest.raises(SceneError):
        read_printed(tmp_path / "none.csv")


def test_unknown_columns_of_a_published_table(l_scene: Path, tmp_path: Path) -> None:
    path = tmp_path / "printed.csv"
    path.write_text("elastic_modes,t,joint knee\n2,0.1,1.5\n")
    study = study_modes(l_scene, [2], workers=1)
    with pytest.raises(SceneError, match="no joint or point"):
        beside(study, read_printed(path))


# ----- comparisons


def test_distance() -> None:
    a = np.array([[3.0, 4.0, 0.0], [0.0, 0.0, 0.0]])
    d = distance(a, 0 * a)
    assert (d.largest, d.peak) == (5.0, 5.0)
    assert d.rms == pytest.approx(5 / np.sqrt(2))


def test_verdicts() -> None:
    """Within (10 + 20 periods) δ²/L = 1.5e-3 m is second order, beyond is not."""
    one = synthetic(1.0)
    assert pair("a", one, "b", synthetic(1.0 + 1e-4)).as_expected
    far = pair("a", one, "b", synthetic(1.01))
    assert not far.as_expected
    assert "NOT as expected" in far.verdict
    gauge = replace(synthetic(1.0), summary={**one.summary, "gauge": "minimum-norm"})
    assert "different gauges" in pair("a", one, "b", gauge).verdict


def test_comparison(l_scene: Path) -> None:
    """The two gauges and the unreduced links agree as they should; text, CSV and page say the same as the JSON."""
    result = compare(l_scene, ["erls", "erls-minimum-norm", "erls-fem"], workers=1)
    assert list(result.outputs) == ["erls", "erls-minimum-norm", "erls-fem"]
    assert [p.as_expected for p in result.pairs] == [True] * 3
    summary = comparison_summary(result)
    fem = next(p for p in summary["pairs"] if (p["a"], p["b"]) == ("erls", "erls-fem"))
    assert fem["points"]["tip"]["max"] < 1e-8  # 18 elastic modes of the 24 there are; the others are far above gravity
    gauges = summary["pairs"][0]
    assert gauges["coordinates"]["shoulder"]["max"] > 3 * gauges["joints"]["shoulder"]["max"]

    text, document = comparison_text(result), comparison_page(result)
    shown = f"{gauges['points']['tip']['max']:.3g}"
    assert shown in text
    assert f"<td>{shown}</td>" in document
    assert not re.search(r'(src|href)="(?!data:|#)', document.partition("<script>")[0])  # nothing from a network
    header, first, *_ = comparison_csv(result).splitlines()
    assert len(header.split(",")) == len(first.split(","))
    assert "erls-fem: position tip z [m]" in header


@pytest.mark.parametrize(("names", "cause"), [(["erls"], Cause.BAD_FIELD), (["erls", "elrs"], Cause.BAD_REFERENCE)])
def test_faulty_comparisons(l_scene: Path, names: list[str], cause: Cause) -> None:
    with pytest.raises(SceneError) as caught:
        compare(l_scene, names)
    assert str(caught.value.cause) == str(cause)


def test_a_failed_column_is_reported(tmp_path: Path) -> None:
    """A link too large to keep all its dofs: the other column stands, the failed one says why."""
    scenes.l_link(tmp_path, 200)
    scene = scenes.l_scene(tmp_path, simulation={"duration": 0.002, "step": 1e-3})
    result = compare(scene, ["erls", "erls-fem"], workers=1)
    assert list(result.outputs) == ["erls"]
    assert "too many dofs" in str(result.errors["erls-fem"])
    assert result.pairs == ()
    assert "erls-fem failed" in comparison_text(result)
    assert "too many dofs" in comparison_page(result)


# ----- pages


def test_pages_are_well_formed() -> None:
    """Numbers as they are, text escaped, ids unique over several drawings."""
    x = np.linspace(1.0, 2.0, 5)
    plot = Plot("a < b", "x & y", "z", [Curve("<c>", x, x), Curve("d", x, x**2, dashed=True)], "xy", 1.5, "note")
    text = page("T & U", [figure(plot), figure(plot)])
    body = text[text.index("<body") : text.index("<script>")]
    ids = re.findall(r'\bid="([^"]+)"', body)
    assert len(ids) == len(set(ids)) == 4
    told = json.loads(re.findall(r'<script type="application/json"[^>]*>(.*?)</script>', body)[0])
    assert told["curves"][1] == {"label": "d", "x": x.tolist(), "y": (x**2).tolist(), "dashed": True, "mode": "lines"}
    assert (told["logarithmic"], told["limit"], told["x"]) == ("xy", 1.5, "x & y")
    assert "a &lt; b" in body
    assert "<c>" not in body
    assert Change("x", 1.0, "m", 0.5).ratio < 1
