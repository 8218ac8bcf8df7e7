"""Profiles: derivatives against differences, limits at breakpoints, closed forms, and refused input."""

import math
import tomllib
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from erls.errors import Cause, SceneError
from erls.mechanism.curves import Sum, merged, tolerance
from erls.mechanism.motions import Motion
from erls.mechanism.place import Place
from erls.mechanism.profiles import Load, build_loads
from fe_import.files.toml import convert

SCENE = "arm.toml"

LOADS = {
    "constant": "shape = 'constant'\nvalue = 2",
    "step": "shape = 'step'\nstart = 0.1\nvalue = -3.0",
    "pulse": "shape = 'step'\nstart = 0.1\nend = 0.4\nvalue = -3.0",
    "trapezoid": "shape = 'trapezoid'\nstart = -0.1\nrise = 0.2\nhold = 0.3\nfall = 0.5\nvalue = 4.0",
    "sawtooth": "shape = 'trapezoid'\nstart = 0.1\nrise = 0\nhold = 0\nfall = 0.5\nvalue = 4.0",
    "burst": "shape = 'sine_burst'\nstart = 0.2\namplitude = 2\nfrequency_hz = 5\ncycles = 3.25"
    "\nphase_deg = 40",
    "linear": "shape = 'table'\ntimes = [0, 0.2, 0.7]\nvalues = [1, -1, 3]",
    "cubic": "shape = 'table'\ntimes = [0, 0.2, 0.7, 0.9]\nvalues = [1, -1, 3, 2]\ninterpolation = 'cubic'",
    "hold": "shape = 'table'\ntimes = [0, 0.2, 0.7]\nvalues = [1, -1, 3]\ninterpolation = 'hold'",
}

MOTIONS = {
    "degree 3": "shape = 'polynomial'\nfrom = 0.2\nto_deg = 90\nstart = 0.1\nduration = 0.7\ndegree = 3",
    "degree 5": "shape = 'polynomial'\nfrom = 0.2\nto_deg = 90\nstart = 0.1\nduration = 0.7\ndegree = 5",
    "degree 7": "shape = 'polynomial'\nfrom = 0.2\nto_deg = 90\nstart = 0.1\nduration = 0.7",
    "waypoints": "shape = 'waypoints'\ntimes = [0, 0.3, 0.5, 0.9]\nvalues_deg = [0, 40, 40, -10]\ndegree = 5",
    "sine": "shape = 'sine'\namplitude_deg = 9\nfrequency_hz = 1.5\noffset = 1\nstart = 0.2\nphase_deg = 90",
    "spin up": "shape = 'spin_up'\nrate_deg = 90\nfrom = 0.2\nstart = 0.1\nduration = 0.7",
    "spin up, degree 3": "shape = 'spin_up'\nrate = -2\nduration = 0.7\ndegree = 3",
    "spin up, sine": "shape = 'spin_up'\nrate = 2\nfrom_deg = 9\nstart = 0.1\nduration = 0.7\nramp = 'sine'",
    "spline": "shape = 'table'\ntimes = [0, 0.2, 0.5, 0.9]\nvalues = [0, 1, 1.5, 0.5]",
    "rates": "shape = 'table'\ntimes = [0, 0.2, 0.5, 0.9]\nvalues = [0, 1, 1.5, 0.5]\nrates = [1, -2]",
}

ALL = [(Load, t) for t in LOADS.values()] + [(Motion, t) for t in MOTIONS.values()]
EVERY = pytest.mark.parametrize(("kind", "text"), ALL, ids=[*LOADS, *MOTIONS])


def build(kind, text, folder=Path(), revolute=True):
    record = convert(tomllib.loads(text), kind, f"{SCENE}: drive", SceneError)
    return record.build(Place(folder, f"{SCENE}: drive", revolute))


def load(text, folder=Path()):
    return build(Load, text, folder)


def motion(text, folder=Path()):
    return build(Motion, text, folder)


# All shapes


@EVERY
@settings(derandomize=True, deadline=None, max_examples=60)
@given(t=st.floats(-0.5, 1.5))
def test_derivatives_agree_with_differences(kind, text, t):
    curve = build(kind, text)
    h = 1e-5
    if any(abs(t - b) < 2.0 * h for b in curve.breakpoints):
        return
    low, here, high = (curve.derivatives(s) for s in (t - h, t, t + h))
    scale = 1.0 + max(map(abs, here))
    assert here[0] == curve.value(t) == pytest.approx(curve.value(t, left=True), rel=0, abs=1e-15 * scale)  # a knot
    assert (high[0] - low[0]) / (2.0 * h) == pytest.approx(here[1], abs=1e-6 * scale)
    assert (high[1] - low[1]) / (2.0 * h) == pytest.approx(here[2], abs=1e-4 * scale + 1e-3)


@EVERY
def test_left_and_right_limits_at_breakpoints(kind, text):
    curve = build(kind, text)
    h = 1e-9
    assert list(curve.breakpoints) == sorted(set(curve.breakpoints))
    for b in curve.breakpoints:
        slack = 1e-5 * (1.0 + max(map(abs, curve.derivatives(b) + curve.derivatives(b, left=True))))
        assert curve.derivatives(b) == pytest.approx(curve.derivatives(b + h), abs=slack)
        assert curve.derivatives(b, left=True) == pytest.approx(curve.derivatives(b - h), abs=slack)
        assert curve.value(b, left=True) == curve.derivatives(b, left=True)[0]


@EVERY
def test_smooth_between_breakpoints(kind, text):
    curve = build(kind, text)
    times = np.linspace(-0.3, 1.3, 40_001)
    rows = np.array([curve.derivatives(t) for t in times])
    jumps = np.abs(np.diff(rows, axis=0))
    inside = np.ones(len(jumps), dtype=bool)
    for b in curve.breakpoints:
        inside &= (times[1:] < b - 1e-9) | (times[:-1] > b + 1e-9)
    assert np.all(jumps[inside] <= 5e-3 * (1.0 + np.abs(rows).max(axis=0)))


@EVERY
def test_end_values_hold(kind, text):
    curve = build(kind, text)
    if not curve.breakpoints:
        return
    first, last = curve.breakpoints[0], curve.breakpoints[-1]
    assert curve.derivatives(first - 5.0) == (curve.value(first, left=True), 0.0, 0.0)
    if "spin_up" in text:
        value, rate, acceleration = curve.derivatives(last + 5.0)
        assert (value, rate, acceleration) == pytest.approx((curve.value(last) + 5.0 * rate, rate, 0.0))
    elif kind is Motion and "sine" not in text:
        assert curve.derivatives(last + 5.0) == (curve.value(last), 0.0, 0.0)


@pytest.mark.parametrize("text", MOTIONS.values(), ids=list(MOTIONS))
def test_motions_are_continuous(text):
    curve = motion(text)
    for b in curve.breakpoints:
        assert curve.value(b) == pytest.approx(curve.value(b, left=True), abs=1e-13)


# Closed forms


def test_jumps_are_seen_from_both_sides():
    step = load(LOADS["pulse"])
    assert [step.value(t, left) for t in (0.1, 0.4) for left in (True, False)] == [0.0, -3.0, -3.0, 0.0]
    held = load(LOADS["hold"])
    assert [held.value(0.2, left) for left in (True, False)] == [1.0, -1.0]
    rounded = load("shape = 'step'\nstart = 0.3\nvalue = 1.0")
    assert rounded.value(0.1 + 0.2, left=True) == 0.0
    assert rounded.value(0.1 + 0.2) == 1.0


@settings(derandomize=True, deadline=None, max_examples=60)
@given(
    spans=st.tuples(*[st.floats(0.01, 2.0) | st.just(0.0)] * 3).filter(any),
    start=st.floats(-3.0, 3.0),
    value=st.floats(-9.0, 9.0),
)
def test_area_of_trapezoid(spans, start, value):
    rise, hold, fall = spans
    curve = load(
        f"shape = 'trapezoid'\nstart = {start}\nrise = {rise}\nhold = {hold}\nfall = {fall}\nvalue = {value}"
    )
    area = sum(
        0.5 * (b - a) * (curve.value(a) + curve.value(b, left=True)) for a, b in pairwise(curve.breakpoints)
    )
    assert area == pytest.approx(value * (0.5 * rise + hold + 0.5 * fall), abs=1e-12)


def test_burst_of_whole_cycles_has_zero_mean_and_starts_with_its_phase():
    text = "shape = 'sine_burst'\nstart = 0.3\namplitude = 2\nfrequency_hz = 4\ncycles = 3\nphase_deg = 30"
    curve = load(text)
    start, end = curve.breakpoints
    assert end - start == pytest.approx(0.75)
    times = start + (np.arange(600) + 0.5) * (end - start) / 600
    assert sum(curve.value(t) for t in times) == pytest.approx(0.0, abs=1e-10)
    assert curve.value(start) == pytest.approx(1.0)
    assert curve.value(end, left=True) == pytest.approx(1.0)
    assert curve.value(start, left=True) == curve.value(end) == 0.0


@pytest.mark.parametrize(("degree", "vanishing", "peak"), [(3, 1, 1.5), (5, 2, 1.875), (7, 2, 2.1875)])
def test_rest_to_rest(degree, vanishing, peak):
    curve = motion(
        f"shape = 'polynomial'\nfrom_deg = -90\nto = 2.0\nstart = 1\nduration = 4\ndegree = {degree}"
    )
    travel = 2.0 + 0.5 * math.pi
    for t, left, end in ((1.0, False, -0.5 * math.pi), (5.0, True, 2.0)):
        row = curve.derivatives(t, left)
        assert row[0] == pytest.approx(end)
        assert row[1 : 1 + vanishing] == pytest.approx((0.0,) * vanishing, abs=1e-12)
    assert curve.value(3.0) == pytest.approx(-0.5 * math.pi + 0.5 * travel)
    assert curve.derivatives(3.0)[1] == pytest.approx(peak * travel / 4.0)  # slope of s at 1/2
    jerk = (curve.derivatives(1.0 + 1e-5)[2] - curve.derivatives(1.0)[2]) / 1e-5
    assert (abs(jerk) < 1e-3) == (degree == 7)


def test_spin_up_reaches_its_rate():
    """Degree 7, by integration; a sine, psi = (w/T)(t^2/2 + (T/2pi)^2 (cos(2 pi t/T) - 1))."""
    smooth = motion("shape = 'spin_up'\nrate = 150\nduration = 0.02")
    for x in (0.0, 0.3, 0.8, 1.0):
        wanted = 3.0 * (7 * x**5 - 14 * x**6 + 10 * x**7 - 2.5 * x**8)
        assert smooth.value(0.02 * x) == pytest.approx(wanted, abs=1e-14)
    assert smooth.derivatives(0.05) == pytest.approx((150 * 0.04, 150.0, 0.0))
    wave = motion("shape = 'spin_up'\nrate = 6\nduration = 15\nramp = 'sine'")
    for t in (0.0, 2.0, 7.5, 14.0, 15.0):
        wanted = 6 / 15 * (t**2 / 2 + (15 / (2 * math.pi)) ** 2 * (math.cos(2 * math.pi * t / 15) - 1))
        assert wave.value(t) == pytest.approx(wanted, abs=1e-13)
    assert wave.derivatives(20.0) == pytest.approx((6 * 20 - 6 * 15 / 2, 6.0, 0.0))


def test_waypoints_stop_at_each_point():
    curve = motion(MOTIONS["waypoints"])
    for t, degrees in zip((0.0, 0.3, 0.5, 0.9), (0.0, 40.0, 40.0, -10.0), strict=True):
        assert curve.derivatives(t) == pytest.approx((math.radians(degrees), 0.0, 0.0), abs=1e-12)
    assert curve.breakpoints == (0.0, 0.3, 0.5, 0.9)


@pytest.mark.parametrize(("name", "rates"), [("spline", (0.0, 0.0)), ("rates", (1.0, -2.0))])
def test_motion_spline_meets_samples_and_rates(name, rates):
    curve = motion(MOTIONS[name])
    samples = zip((0.0, 0.2, 0.5, 0.9), (0.0, 1.0, 1.5, 0.5), strict=True)
    assert all(curve.value(t) == pytest.approx(v) for t, v in samples)
    assert curve.derivatives(0.0)[1] == pytest.approx(rates[0])
    assert curve.derivatives(0.9, left=True)[1] == pytest.approx(rates[1])
    for t in (0.2, 0.5):  # C2 at the inner knots, which need no stop
        assert curve.derivatives(t) == pytest.approx(curve.derivatives(t, left=True), abs=1e-12)
    assert curve.breakpoints == (0.0, 0.9)


def test_not_a_knot_spline_reproduces_a_cubic():
    times = [0.0, 0.3, 0.4, 1.0, 1.7]
    values = [1.0 - t + 2.0 * t**3 for t in times]
    curve = load(f"shape = 'table'\ntimes = {times}\nvalues = {values}\ninterpolation = 'cubic'")
    assert curve.derivatives(0.8) == pytest.approx((1.0 - 0.8 + 2.0 * 0.512, -1.0 + 6.0 * 0.64, 9.6))


def test_sum_adds_values_and_merges_breakpoints():
    texts = [LOADS["step"], LOADS["sawtooth"], LOADS["burst"]]
    records = tuple(convert(tomllib.loads(t), Load, SCENE, SceneError) for t in texts)
    total = build_loads(records, Place(Path(), SCENE), "profiles")
    assert isinstance(total, Sum)
    assert total.breakpoints == pytest.approx((0.1, 0.2, 0.6, 0.85))
    for t in (0.0, 0.1, 0.2, 0.3, 0.6, 0.7, 1.0):
        for left in (False, True):
            rows = [load(text).derivatives(t, left) for text in texts]
            assert total.derivatives(t, left) == pytest.approx(tuple(map(sum, zip(*rows, strict=True))))
            assert total.value(t, left) == pytest.approx(sum(r[0] for r in rows))


def test_times_that_differ_by_rounding_are_one_event():
    assert merged([0.3, 0.1 + 0.2, 1.0]) == (0.3, 1.0)
    assert merged([1.0, 1.0 + 3.0 * tolerance(1.0)]) == (1.0, 1.0 + 3.0 * tolerance(1.0))


# Tables


CSV = {
    "commas": "0,1,5\n0.5,2,6\n1,3,7\n2,5,9\n",
    "semicolons, header": "time [s]; a, in N; b\n0;1;5\n0.5;2;6\n1;3;7\n2;5;9\n",
    "decimal commas": "0;1,0;5\n0,5;2,0;6\n1;3;7\n2;5,0e0;9\n",
    "blanks and comments": "# exported\n\n  0 1\t5 # first\n0.5 2 6\n\n1 3 7\n2 5 9",
    "byte order mark, CRLF": "\ufefft,a,b\r\n0,1,5\r\n0.5,2,6\r\n1,3,7\r\n2,5,9\r\n",
}


@pytest.mark.parametrize("content", CSV.values(), ids=list(CSV))
def test_reads_csv(content, tmp_path):
    (tmp_path / "t.csv").write_text(content, encoding="utf-8", newline="")
    second = load("shape = 'table'\nfile = 't.csv'\ncolumn = 2", tmp_path)
    assert [second.value(t) for t in (-1.0, 0.25, 1.0, 9.0)] == pytest.approx([5.0, 5.5, 7.0, 9.0])
    in_degrees = motion("shape = 'table'\nfile = 't.csv'\ndegrees = true\nrates_deg = [0, 90]", tmp_path)
    assert in_degrees.value(1.0) == pytest.approx(math.radians(3.0))
    assert in_degrees.derivatives(2.0, left=True)[1] == pytest.approx(0.5 * math.pi)


FAULTY_CSV = {
    "text in the middle": ("0,1\n1,x\n", "line 2, column 1", "'x'"),
    "second header": ("t,a\ns,N\n0,1\n1,2\n", "line 2, column 0", "'s'"),
    "half a header": ("0,torque\n1,2\n", "line 1, column 1", "'torque'"),
    "not finite": ("# c\n0 1\n1 nan\n", "line 3, column 1", "'nan'"),
    "nothing but nan first": ("nan,nan\n0,1\n1,1\n", "line 1, column 0", "'nan'"),
    "overflow": ("0 1\n1 1e400\n", "line 2, column 1", "'1e400'"),
    "underscore": ("0 1\n1 1_0\n", "line 2, column 1", "'1_0'"),
    "empty field": ("0;1\n1;\n", "line 2, column 1", "''"),
    "columns": ("0,1\n1,2,3\n", "line 2", "got 3, limit 2"),
    "falling": ("0,1\n1,2\n0.5,3\n", "line 3, column 0", "0.5"),
    "repeated": ("0,1\n0,2\n", "line 2, column 0", "0.0"),
    "one row": ("0,1\n", "t.csv", "got 1, limit 2"),
    "empty": ("# nothing\n", "t.csv", "no numbers"),
    "comment in a number": ("0 1 # c\n1 2.#5\n", "line 2", "comment begins within"),
}


@pytest.mark.parametrize(("content", "spot", "value"), FAULTY_CSV.values(), ids=list(FAULTY_CSV))
def test_refuses_faulty_csv(content, spot, value, tmp_path):
    (tmp_path / "t.csv").write_text(content)
    with pytest.raises(SceneError) as caught:
        load("shape = 'table'\nfile = 't.csv'", tmp_path)
    error = caught.value
    assert error.cause == Cause.TABLE
    assert "t.csv" in error.where
    assert error.where.endswith(spot)
    assert value in str(error)
    assert error.remedy


def test_refuses_files_that_are_none(tmp_path, monkeypatch):
    (tmp_path / "binary.csv").write_bytes(b"\xff\xfe\x00")
    (tmp_path / "large.csv").write_text("0 1\n1 2\n")
    cases = {
        "missing.csv": Cause.FILE_NOT_FOUND,
        "binary.csv": Cause.NOT_READABLE,
        ".": Cause.NOT_READABLE,
        "a\\u0000b": Cause.NOT_READABLE,
        "large.csv": Cause.NOT_READABLE,
    }
    monkeypatch.setattr("erls.mechanism.tables.MAX_BYTES", 7)
    for name, cause in cases.items():
        with pytest.raises(SceneError) as caught:
            load(f'shape = "table"\nfile = "{name}"', tmp_path)
        assert caught.value.cause == cause
        assert caught.value.where == f"{SCENE}: drive.file"
        assert caught.value.remedy


# Bad fields


T3 = "shape = 'table'\ntimes = [0, 1, 2]\n"
FAULTY = [
    (Load, "shape = 'constant'\nvalue = nan", "value", "nan"),
    (Load, "shape = 'constant'\nvalue = -1e40", "value", "-1e+40"),
    (Load, "shape = 'step'\nstart = inf\nvalue = 1", "start", "inf"),
    (Load, "shape = 'step'\nstart = 1\nend = 1\nvalue = 1", "end", "1.0"),
    (Load, LOADS["trapezoid"].replace("rise = 0.2", "rise = -0.2"), "rise", "-0.2"),
    (Load, LOADS["trapezoid"].replace("fall = 0.5", "fall = 1e-12"), "fall", "1e-12"),
    (Load, LOADS["sawtooth"].replace("fall = 0.5", "fall = 0"), "hold", "0.0"),
    (Load, LOADS["burst"].replace("3.25", "0"), "cycles", "0.0"),
    (Load, LOADS["burst"].replace("3.25", "-1"), "cycles", "-1.0"),
    (Load, LOADS["burst"].replace("hz = 5", "hz = 0"), "frequency_hz", "0.0"),
    (Load, LOADS["burst"].replace("hz = 5", "hz = 1e20"), "cycles", "3.25e-20"),
    (Load, LOADS["linear"] + "\ninterpolation = 'spline'", "interpolation", "'spline'"),
    (Load, LOADS["linear"] + "\ninterpolation = 'cubic'", "times", "got 3, limit 4"),
    (Load, LOADS["linear"] + "\nfile = 'a.csv'", "file", "'a.csv'"),
    (Load, T3 + "values = [0, 1]", "times", "got 2, limit 3"),
    (Load, T3 + "values = [0, 1, nan]", "values[2]", "nan"),
    (Load, T3, "values", "missing"),
    (Load, "shape = 'table'", "times", "missing"),
    (Load, "shape = 'table'\ntimes = [0, 2, 1]\nvalues = [0, 0, 0]", "times[2]", "1.0"),
    (Load, "shape = 'table'\nfile = 'ok.csv'\ncolumn = 2", "column", "got 2, limit 1 to 1"),
    (Load, "shape = 'table'\nfile = 'ok.csv'\ncolumn = 0", "column", "got 0"),
    (Motion, MOTIONS["degree 7"] + "\nfrom_deg = 1", "from", "0.2"),
    (Motion, MOTIONS["degree 7"].replace("from = 0.2\n", ""), "from", "missing"),
    (Motion, MOTIONS["degree 7"].replace("to_deg = 90", "to_deg = inf"), "to_deg", "inf"),
    (Motion, MOTIONS["degree 7"].replace("0.7", "-0.7"), "duration", "-0.7"),
    (Motion, MOTIONS["degree 7"].replace("0.7", "0"), "duration", "0.0"),
    (Motion, MOTIONS["degree 3"].replace("degree = 3", "degree = 4"), "degree", "4"),
    (Motion, MOTIONS["waypoints"].replace("0.3,", "0,"), "times[1]", "0.0"),
    (Motion, "shape = 'waypoints'\ntimes = [0]\nvalues = [0]", "times", "got 1, limit 2"),
    (Motion, "shape = 'waypoints'\ntimes = [0, 1]", "values", "missing"),
    (Motion, MOTIONS["sine"] + "\noffset_deg = 2", "offset", "1.0"),
    (Motion, MOTIONS["sine"].replace("1.5", "-1.5"), "frequency_hz", "-1.5"),
    (Motion, MOTIONS["spline"] + "\ndegrees = true", "degrees", "True"),
    (Motion, MOTIONS["spline"] + "\nrates = [0, nan]", "rates[1]", "nan"),
    (Motion, T3 + "values = [0, 1, 2]", "times", "got 3, limit 4"),
]


@pytest.mark.parametrize(("kind", "text", "field", "value"), FAULTY)
def test_refuses_bad_fields(kind, text, field, value, tmp_path):
    (tmp_path / "ok.csv").write_text("0,1\n1,2\n")
    with pytest.raises(SceneError) as caught:
        build(kind, text, tmp_path)
    error = caught.value
    assert error.cause == Cause.BAD_FIELD
    assert error.where == f"{SCENE}: drive.{field}"
    assert value in str(error)
    assert error.remedy


IN_DEGREES = {
    "from_deg": "shape = 'polynomial'\nfrom_deg = 0\nto = 1\nduration = 1",
    "values_deg": "shape = 'waypoints'\ntimes = [0, 1]\nvalues_deg = [0, 1]",
    "amplitude_deg": "shape = 'sine'\namplitude_deg = 1\nfrequency_hz = 1",
    "degrees": "shape = 'table'\nfile = 'a.csv'\ndegrees = true",
    "rates_deg": MOTIONS["spline"] + "\nrates_deg = [0, 0]",
}


@pytest.mark.parametrize("field", IN_DEGREES)
def test_refuses_degrees_where_the_joint_slides(field):
    with pytest.raises(SceneError, match="prismatic") as caught:
        build(Motion, IN_DEGREES[field], revolute=False)
    assert caught.value.cause == Cause.BAD_FIELD
    assert caught.value.where == f"{SCENE}: drive.{field}"
    assert "metres" in caught.value.remedy
