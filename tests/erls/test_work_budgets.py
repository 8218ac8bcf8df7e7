"""Work that shipped scenes may take: a regression fails here without a clock."""

from __future__ import annotations

import pytest
import scenes

import erls

# scene, overrides, and at most: right-hand sides, iterations, factorizations; a tenth above what they took on the
# processor that asked for more: rounding differs between them, and decides over steps near their tolerance
BUDGETS = [
    ("l_shape/steel_flat.toml", ["simulation.duration=0.5"], (975, 325, 42)),
    ("l_shape/steel_tall.toml", ["simulation.duration=0.5", "simulation.integrator=lobatto"], (572, 190, 31)),
    ("l_shape/torque.toml", ["simulation.duration=0.2"], (439, 144, 36)),
    ("l_shape/steel_flat.toml", ["simulation.duration=0.1", "simulation.formulation=ffr"], (199, 66, 17)),
    (
        "l_shape/steel_flat.toml",
        ["simulation.duration=0.5", "simulation.formulation=ffr", "simulation.integrator=lobatto"],
        (978, 326, 41),
    ),
    (
        "l_shape/aluminium.toml",
        ["simulation.duration=0.2", "simulation.formulation=nodal", "simulation.step=5e-4"],
        (1655, 1655, 2),
    ),
    ("robot/two_link.toml", ["simulation.duration=0.5"], (1628, 542, 92)),
    ("robot/two_link.toml", ["simulation.duration=0.5", "simulation.integrator=lobatto"], (1628, 542, 92)),
    ("four_bar/flexible.toml", ["simulation.duration=0.02", "simulation.step=1e-4"], (675, 675, 3)),
]


@pytest.mark.parametrize(("scene", "overrides", "most"), BUDGETS)
def test_work(scene: str, overrides: list[str], most: tuple[int, int, int]) -> None:
    """Right-hand sides, iterations and factorizations."""
    work = erls.simulate(erls.load_scene(scenes.ROOT / "data" / scene, overrides), verdict=False).solution.work
    found = (work.rhs_calls, work.newton_iterations, work.factorizations)
    assert all(0 < have <= allowed for have, allowed in zip(found, most, strict=True)), found
