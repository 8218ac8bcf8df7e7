"""Inverse dynamics on nodal elements: against modes, by forward runs, and what is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scenes
from scipy.sparse.linalg import splu

import erls
from erls.cli.main import main
from erls.errors import SceneError
from erls.inverse.inversion import Inversion
from erls.tracking.confirm import confirmed

INVERSE = scenes.ROOT / "data" / "inverse"
NODAL = "simulation.formulation=nodal"


def found(name: str, *changes: str) -> Inversion:
    """Of a scene of `data/inverse`."""
    return erls.invert(erls.load_scene(INVERSE / f"{name}.toml", changes))


def missed(inversion: Inversion) -> float:
    """By a forward run on its own model."""
    return confirmed(inversion, inversion.efforts, inversion.start).largest[0]


def test_passive_arm_is_that_of_modes() -> None:
    """Two rigid links: both rules are of second order, β = 0 here and 1/4 there, so that torques differ by the square
    of the step, and forward runs miss as much.
    """
    short = ("servo.0.motion.start=0.4", "simulation.duration=2.2")
    apart, errors = [], []
    for step in (0.02, 0.01):
        both = [found("passive_arm", f"simulation.step={step}", *short, *more) for more in ((NODAL,), ())]
        one, other = (each.efforts["hub"] for each in both)
        apart.append(float(np.abs(one - other).max() / np.abs(other).max()))
        errors.append(missed(both[0]))
    assert apart[0] / apart[1] == pytest.approx(4.0, rel=0.1)
    assert apart[1] < 5e-3
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)
    assert errors[1] < 1e-4
    np.testing.assert_allclose(both[0].angles["passive"], both[1].angles["passive"], atol=1e-3)


def test_arm_that_bends_far_follows_on_its_own_elements() -> None:
    """By the 150 mm that its tip lags, modes leave millimetres; elements what the step leaves. The torque is that of
    the linear model, 7.39 N m, to 1 %.
    """
    step = ("simulation.step=0.008", "simulation.elements_per_member=4", "links.0.elastic_modes=4")
    short = ("servo.0.motion.start=0.2", "simulation.duration=1.0")
    own, modal = (found("arm", *step, *short, *more) for more in ((NODAL,), ()))
    assert missed(own) < 2e-4
    assert confirmed(modal, modal.efforts, modal.start, "nodal").error > 10 * missed(own)
    assert np.abs(own.efforts["hub"]).max() == pytest.approx(7.39, rel=0.01)
    assert own.deflection.max() == pytest.approx(0.15, abs=0.005)
    assert own.method == "collocation"


@pytest.mark.parametrize(
    ("words", "names"),
    [
        (["--method", "shooting"], "collocation"),
        (["--correct"], "--correct"),
        (["--set", "simulation.duration=1.0"], "moves at an end"),
        (["--set", "simulation.step=1e-7"], "too many steps"),
    ],
)
def test_what_nodal_elements_cannot_do_is_refused(
    words: list[str], names: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """One message, exit code 2."""
    assert main(["invert", str(INVERSE / "passive_arm.toml"), "--set", NODAL, *words]) == 2
    assert names in capsys.readouterr().err


def test_more_steps_than_memory_are_refused() -> None:
    """Of many elements, although modes have room."""
    with pytest.raises(SceneError, match="elements_per_member"):
        found("arm", NODAL, "simulation.elements_per_member=200", "links.0.elastic_modes=1", "simulation.step=0.04")


def test_factors_that_are_kept_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Newton's method with factors of its own in each step, and with those of a step before: the same to rounding, and
    one factorization for all steps where the first guess is as near as that of rigid links.
    """
    factored: list[int] = []

    def counted(matrix: Any) -> Any:
        factored[-1] += 1
        return splu(matrix)

    monkeypatch.setattr("erls.inverse.nodal.two_point.splu", counted)
    ran = []
    for slow in (0.0, 0.1):
        monkeypatch.setattr("erls.inverse.nodal.two_point._SLOW", slow)
        factored.append(0)
        ran.append(found("passive_arm", NODAL, "simulation.step=0.05"))
    np.testing.assert_allclose(ran[1].efforts["hub"], ran[0].efforts["hub"], atol=1e-9)
    assert factored[0] == ran[0].iterations
    assert factored[1] < ran[1].iterations
