"""Controllers whose feed-forward is found by an inversion of their scene."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import scenes
from msgspec.structs import replace

import erls
from erls.cli.main import main
from erls.errors import SceneError
from erls.inverse.feed import fed
from erls.inverse.inversion import Inversion
from erls.inverse.invert import invert
from erls.scene.chain import Scene
from erls.tracking.confirm import confirmed, missed

LED = scenes.ROOT / "data" / "inverse" / "led_arm.toml"
MOTION = 'motion={shape="polynomial", from_deg=0.0, to_deg=60.0, start=0.3, duration=0.6, degree=9}'
RIGID = 'joints.0.drive={type="pd", proportional_gain=%g, derivative_gain=%g, feed_forward=true, ' + MOTION + "}"


@pytest.fixture(scope="module")
def found() -> Inversion:
    """By the inversion alone."""
    return invert(erls.load_scene(LED))


@pytest.fixture(scope="module")
def led() -> Any:
    """A run with feed-forward."""
    return erls.simulate(LED, verdict=False)


def test_tip_error_falls_as_the_inversion_says(found: Inversion, led: Any) -> None:
    """On the mechanism that was inverted a controller has little to correct: without gains it misses what the open runs
    of the inversion miss, with the elastic effort as with that of rigid links; with gains no more, and less than a
    hundredth of what those of rigid links do.
    """
    says = [confirmed(found, *each).error for each in ((found.efforts, found.start), (found.rigid_efforts, {}))]
    joint = led.scene.record.joints[0]
    open_ = replace(joint, drive=replace(joint.drive, proportional_gain=0.0, derivative_gain=0.0))
    elastic = [led, erls.simulate(Scene(LED, replace(led.scene.record, joints=[open_])), verdict=False)]
    rigid = [erls.simulate(erls.load_scene(LED, [RIGID % gains]), verdict=False) for gains in ((20.0, 2.0), (0.0, 0.0))]
    (own, own_open), (other, other_open) = (
        [missed(found.problem, run)[2].max() for run in runs] for runs in (elastic, rigid)
    )
    assert own_open == pytest.approx(says[0], rel=0.02)
    assert other_open == pytest.approx(says[1], rel=0.02)
    assert other_open / own_open == pytest.approx(says[1] / says[0], rel=0.04)
    assert own < says[0] < other / 100


def test_runs_hold_their_tables(tmp_path: Path, found: Inversion, led: Any) -> None:
    """A run that was saved needs no inversion to be read; its torque at the hub is that of the inversion."""
    erls.save_run(tmp_path / "run.h5", led)
    drive: Any = erls.load_run(tmp_path / "run.h5").scene.record.joints[0].drive
    assert drive.feed_forward is False
    assert drive.profiles[0].values == pytest.approx(found.efforts["hub"], abs=1e-9)
    assert drive.motion.values == pytest.approx(found.angles["hub"], abs=1e-9)


def test_starts_elsewhere_are_told() -> None:
    """Where the joint begins beside its set point, and by how much."""
    turned = erls.load_scene(LED, ["joints.0.initial={position_deg=1.0}", "inverse.step=0.02"])
    assert any("hub starts at 0.0174533, and is wanted at" in text for text in fed(turned).warnings)


@pytest.mark.parametrize(
    ("changes", "names"),
    [
        ((f"joints.0.drive.{MOTION}",), "hub.drive.motion"),
        (("servo=[]",), "nothing is demanded"),
        (("inverse.step=-1.0",), "inverse.step"),
        (("joints.0.drive.feed_forward=bending",), "known: True, False, elastic"),
        (("joints.0.drive.feed_forward=true",), "motion: missing"),
        (('joints.0.drive.profiles=[{shape="step", start=0.1, value=1.0}]',), "hub.drive.profiles"),
        (('inverse.drives=["other"]',), "inverse.drives"),
    ],
)
def test_what_cannot_be_led_is_refused(changes: tuple[str, ...], names: str) -> None:
    """By the field."""
    with pytest.raises(SceneError, match=names):
        erls.simulate(erls.load_scene(LED, changes))


def test_other_commands_name_who_finds_it(capsys: pytest.CaptureFixture[str]) -> None:
    """A linear model of a controller that waits for an inversion: exit code 2."""
    assert main(["linearize", str(LED)]) == 2
    assert "erls simulate" in capsys.readouterr().err
