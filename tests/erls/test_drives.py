"""Drives: what the formulations see of them, and refused records."""

import math
import tomllib
from pathlib import Path

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from erls.errors import Cause, SceneError
from erls.mechanism.drives import DriveRecord, build_drive
from fe_import.files.toml import convert

MOVE = "motion = { shape = 'polynomial', from = 0.0, to_deg = 90, start = 0.5, duration = 1.0 }"
PD = f"type = 'pd'\nproportional_gain = 200\nderivative_gain = 5\n{MOVE}"

DRIVES = {
    "free": "type = 'free'",
    "torque": """
type = 'torque'
profiles = [
    { shape = 'trapezoid', start = 0.0, rise = 0.1, hold = 0.3, fall = 0.1, value = 2.0 },
    { shape = 'step', start = 0.4, value = -0.5 },
]""",
    "motion": f"type = 'motion'\n{MOVE}",
    "pd": PD,
}
EVERY = pytest.mark.parametrize("kind", DRIVES)


class Joint(msgspec.Struct, forbid_unknown_fields=True):
    drive: DriveRecord


class Scene(msgspec.Struct, forbid_unknown_fields=True):
    joints: list[Joint]


def decode(text):
    data = {"joints": [{"drive": tomllib.loads(text)}]}
    return convert(data, Scene, "arm.toml", SceneError).joints[0].drive


def build(text, revolute=True):
    return build_drive(decode(text), Path(), "arm.toml: joints[0].drive", revolute)


@EVERY
def test_kind_and_breakpoints(kind):
    drive = build(DRIVES[kind])
    assert drive.kind == kind
    assert drive.prescribed == (kind == "motion")
    assert (drive.reference(0.0) is not None) == (kind in ("motion", "pd"))
    expected = {"free": (), "torque": (0.0, 0.1, 0.4, 0.5)}.get(kind, (0.5, 1.5))
    assert drive.breakpoints == pytest.approx(expected)
    assert not drive.feed_forward
    assert drive.limited(-1e9) == -1e9


@EVERY
@settings(derandomize=True, deadline=None, max_examples=40)
@given(t=st.floats(-1.0, 3.0), angle=st.floats(-3.0, 3.0), rate=st.floats(-9.0, 9.0))
def test_gains_are_derivatives_of_the_torque(kind, t, angle, rate):
    drive = build(DRIVES[kind])
    h = 1e-3
    by_angle = (drive.torque(t, angle + h, rate) - drive.torque(t, angle - h, rate)) / (2.0 * h)
    by_rate = (drive.torque(t, angle, rate + h) - drive.torque(t, angle, rate - h)) / (2.0 * h)
    assert drive.gains == pytest.approx((-by_angle, -by_rate), abs=1e-8)


def test_torques_add_and_show_both_limits_at_a_jump():
    drive = build(DRIVES["torque"])
    assert drive.torque(0.05, 1.0, 1.0) == pytest.approx(1.0)
    assert drive.torque(0.4, 1.0, 1.0, left=True) == pytest.approx(2.0)
    assert drive.torque(0.4, 1.0, 1.0) == pytest.approx(1.5)
    assert drive.torque(9.0, 1.0, 1.0) == pytest.approx(-0.5)


def test_free_and_prescribed_joints_have_no_torque_of_their_own():
    assert build(DRIVES["free"]).torque(1.0, 2.0, 3.0) == 0.0
    assert build(DRIVES["motion"]).torque(1.0, 2.0, 3.0) == 0.0
    assert build(DRIVES["motion"]).reference(1.5) == pytest.approx((0.5 * math.pi, 0.0, 0.0))
    assert build(DRIVES["motion"]).reference(1.0) == pytest.approx(
        (0.25 * math.pi, 2.1875 * 0.5 * math.pi, 0.0)
    )


def test_pd_vanishes_on_its_reference_and_pulls_back_towards_it():
    drive = build(PD)
    q, qd, _ = drive.reference(0.9)
    assert drive.torque(0.9, q, qd) == 0.0
    assert drive.torque(0.9, q + 0.01, qd + 0.1) == pytest.approx(-200 * 0.01 - 5 * 0.1)


def test_limit_holds_for_the_total_torque():
    drive = build(PD + "\ntorque_limit = 12\nfeed_forward = true")
    assert drive.feed_forward
    assert abs(drive.torque(0.0, 1.0, 0.0)) > 12.0
    assert [drive.limited(x) for x in (-50.0, -3.0, 12.5)] == [-12.0, -3.0, 12.0]


PLACE = "arm.toml: joints[0].drive"
FAULTY = [
    ("type = 'torque'\nprofiles = []", "profiles", "empty"),
    ("type = 'torque'\nprofiles = [{shape = 'constant', value = inf}]", "profiles[0].value", "inf"),
    (PD.replace("200", "-1"), "proportional_gain", "-1.0"),
    (PD.replace("gain = 5", "gain = nan"), "derivative_gain", "nan"),
    (PD + "\ntorque_limit = 0", "torque_limit", "0.0"),
    (PD.replace("1.0 }", "-1.0 }"), "motion.duration", "-1.0"),
    (PD.replace("from = 0.0,", ""), "motion.from", "missing"),
]


@pytest.mark.parametrize(("text", "field", "value"), FAULTY)
def test_refuses_bad_fields(text, field, value):
    with pytest.raises(SceneError) as caught:
        build(text)
    error = caught.value
    assert error.cause == Cause.BAD_FIELD
    assert error.where == f"{PLACE}.{field}"
    assert value in str(error)
    assert error.remedy


def test_refuses_degrees_at_a_prismatic_joint():
    assert build(PD.replace("to_deg = 90", "to = 0.2"), revolute=False).reference(9.0) == (0.2, 0.0, 0.0)
    with pytest.raises(SceneError, match="prismatic") as caught:
        build(PD, revolute=False)
    assert caught.value.where == f"{PLACE}.motion.to_deg"
    assert caught.value.remedy


UNDECODABLE = [
    (PD + "\ntorque_limt = 3", Cause.UNKNOWN_FIELD, f"{PLACE}.torque_limt", "'torque_limit'"),
    (PD.replace("duration", "durations"), Cause.UNKNOWN_FIELD, f"{PLACE}.motion.durations", "'duration'"),
    (
        "type = 'torque'\nprofiles = [{shape = 'constant', valeu = 1.0, value = 1.0}]",
        Cause.UNKNOWN_FIELD,
        f"{PLACE}.profiles[0].valeu",
        "'value'",
    ),
    ("type = 'motor'", Cause.BAD_FIELD, f"{PLACE}.type", "motor"),
    ("profiles = []", Cause.BAD_FIELD, PLACE, "type"),
    (PD.replace("polynomial", "polynom"), Cause.BAD_FIELD, f"{PLACE}.motion.shape", "polynom"),
    (PD.replace("200", "'stiff'"), Cause.BAD_FIELD, f"{PLACE}.proportional_gain", "stiff"),
    (PD.replace("proportional_gain = 200", ""), Cause.BAD_FIELD, PLACE, "proportional_gain"),
]


@pytest.mark.parametrize(("text", "cause", "where", "words"), UNDECODABLE)
def test_faulty_records_are_named(text, cause, where, words):
    with pytest.raises(SceneError) as caught:
        decode(text)
    assert caught.value.cause == cause
    assert caught.value.where == where
    assert words in str(caught.value)
