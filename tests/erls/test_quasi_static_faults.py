"""Modes that follow statically: what is refused."""

from __future__ import annotations

import pytest
import scenes

import erls
from erls.errors import Cause, SceneError

FLAT, ROBOT = scenes.ROOT / "data/l_shape/steel_flat.toml", scenes.ROOT / "data/robot/two_link.toml"


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        (["simulation.bandwidth=0"], "bandwidth must be positive"),
        (["simulation.bandwidth=-1.0"], "bandwidth must be positive"),
        (["simulation.bandwidth=nan"], "not a finite number"),
        (["simulation.bandwidth=inf"], "not a finite number"),
        (['simulation.bandwidth="high"'], "expected"),
        (["simulation.bandwidth=50.0", 'simulation.formulation="nodal"'], "does not go with formulation = 'nodal'"),
        (
            ["simulation.bandwidth=50.0", 'simulation.formulation="ffr"', 'simulation.coordinates="absolute"'],
            "does not go with coordinates = 'absolute'",
        ),
        (
            ["simulation.bandwidth=50.0", 'simulation.formulation="ffr"', "links.l.substructures=2"],
            "does not go with substructures",
        ),
    ],
)
def test_faults(overrides: list[str], message: str) -> None:
    """One message that names the field."""
    with pytest.raises(SceneError, match=message) as caught:
        erls.load_scene(FLAT, overrides)
    assert caught.value.cause == Cause.BAD_FIELD
    assert "simulation.bandwidth" in str(caught.value.where)


def test_loops_are_refused() -> None:
    """The fast modes of a closed chain are held by its loops."""
    with pytest.raises(SceneError, match="does not go with loops") as caught:
        erls.load_scene(scenes.ROOT / "data/four_bar/flexible.toml", ["simulation.bandwidth=50.0"])
    assert caught.value.cause == Cause.BAD_FIELD
