"""The part of the stated error that the model of links makes, against the distance from exact beams that is known.

Distances were measured with `benchmarks/links_error.py`: runs at a tolerance of 1e-6 m against elements of the nodal
formulation, extrapolated over their number (8 and 16, or 16 and 32 per member) and over the step; the third column says
what Young's modulus of the scene is multiplied by.
"""

from __future__ import annotations

import re
import shutil
from dataclasses import replace
from pathlib import Path

import pytest
import scenes

import erls
from erls.accuracy.links import MARGIN, links_error
from erls.run.chain.run import ChainRun

DATA = scenes.ROOT / "data"

MEASURED = [
    # scene, changes, modulus, distance from exact beams [m]
    ("l_shape/steel_tall.toml", ("effects=linear",), 0.1, 1.44e-2),
    ("l_shape/steel_tall.toml", ("effects=all",), 0.1, 6.7e-4),
    ("l_shape/steel_tall.toml", ("effects=linear",), 0.01, 0.75),
    ("l_shape/steel_tall.toml", ("effects=linear",), 1.0, 1.5e-4),
    ("l_shape/aluminium.toml", ("effects=linear",), 0.3, 4.1e-3),
    ("l_shape/aluminium.toml", ("effects=all",), 0.3, 1.3e-4),
    ("l_shape/aluminium.toml", ("effects=all", "formulation=ffr"), 0.3, 1.2e-4),
    ("l_shape/steel_soft.toml", ("effects=linear",), 0.3, 4.8e-3),
    ("l_shape/steel_soft.toml", ("effects=all",), 0.3, 3.3e-4),
    ("l_shape/steel_soft.toml", ("effects=linear",), 0.1, 0.32),
    ("l_shape/steel_soft.toml", ("effects=all",), 0.1, 3.0e-2),
    ("robot/two_link.toml", ("effects=linear",), 0.1, 8.8e-3),
    ("robot/two_link.toml", ("effects=all",), 0.1, 2.4e-3),
    ("robot/two_link.toml", ("effects=linear", "bandwidth=300"), 0.1, 8.8e-3),
    ("robot/two_link.toml", ("effects=all", "gauge=minimum-norm"), 0.3, 5.8e-4),
    ("robot/two_link.toml", ("effects=linear", "formulation=ffr"), 0.1, 8.8e-3),
    ("robot/three_link.toml", ("effects=linear",), 0.3, 1.24e-2),
    ("robot/three_link.toml", ("effects=linear", "formulation=ffr"), 0.3, 4.1e-3),
    ("robot/three_link.toml", ("effects=all",), 0.3, 1.03e-3),
    ("spin_up/beam.toml", ("effects=all",), 1.0, 1.35e-3),
    ("tree/two_arms.toml", ("effects=linear",), 0.1, 3.3e-3),
    ("parallel/three_legs.toml", ("effects=linear",), 0.1, 4.4e-4),
]


def softened(folder: Path, scene: str, factor: float) -> Path:
    """A copy of a shipped scene whose links have so many times their Young's modulus."""
    source = DATA / scene
    copy = folder / source.parent.name
    shutil.copytree(source.parent, copy)
    for path in copy.rglob("links/*.toml"):
        text = path.read_text(encoding="utf-8")
        changed = re.sub(r"(youngs_modulus = )(\S+)", lambda found: f"{found[1]}{float(found[2]) * factor!r}", text)
        path.write_text(changed, encoding="utf-8")
    return copy / source.name


def ran(folder: Path, scene: str, changes: tuple[str, ...], factor: float, *more: str) -> ChainRun:
    """A run of it."""
    settings = [f"simulation.{change}" for change in changes]
    run = erls.simulate(erls.load_scene(softened(folder, scene, factor), [*settings, *more]), verdict=False)
    assert isinstance(run, ChainRun)
    return run


@pytest.mark.parametrize(("scene", "changes", "factor", "known"), MEASURED)
def test_the_statement_covers_what_is_known(
    tmp_path: Path, scene: str, changes: tuple[str, ...], factor: float, known: float
) -> None:
    """At least the distance from exact beams, at most 15 times: linear links and second-order ones, in all formulations
    of modes, from steel to a link that falls limp.
    """
    stated, why = links_error(ran(tmp_path, scene, changes, factor))
    assert not why
    assert stated is not None
    assert known <= stated <= 15 * known


def test_substructures(tmp_path: Path) -> None:
    """Two pieces of each link of the robot are 2.0 mm off, four 0.5 mm; the statement follows."""
    for pieces, known in ((2, 1.98e-3), (4, 5.0e-4)):
        more = [f"links.{name}.substructures={pieces}" for name in ("upper_arm", "forearm")]
        run = ran(tmp_path / str(pieces), "robot/two_link.toml", ("effects=linear", "formulation=ffr"), 0.1, *more)
        stated, _ = links_error(run)
        assert stated is not None
        assert known <= stated <= 10 * known


def test_what_has_nothing_left_out(tmp_path: Path) -> None:
    """0 for nodal elements, whose mesh is another part, and for rigid links; not for any link that bends. There four
    times the stiffness makes it 16 or 64 times smaller, half of that where vibrations, twice as fast, lose their step.
    """
    short = ("duration=0.2",)
    assert links_error(ran(tmp_path / "n", "l_shape/steel_tall.toml", (*short, "formulation=nodal"), 1.0)) == (0.0, "")
    stiff = ran(tmp_path / "r", "l_shape/steel_tall.toml", short, 1.0, "links.l.flexible=false")
    assert links_error(stiff) == (0.0, "")
    for effects, least, most in (("linear", 6.0, 24.0), ("all", 16.0, 96.0)):
        soft, hard = (
            links_error(ran(tmp_path / f"{effects}{factor}", "robot/three_link.toml", (f"effects={effects}",), factor))[
                0
            ]
            for factor in (1.0, 4.0)
        )
        assert soft is not None
        assert hard
        assert least < soft / hard < most


def test_a_run_that_did_not_look_is_looked_at(tmp_path: Path) -> None:
    """A run from a file holds no estimate: the same is found again."""
    run = ran(tmp_path, "l_shape/aluminium.toml", ("duration=0.5",), 1.0)
    assert run.second_order_error is not None
    stated, _ = links_error(run)
    assert stated == MARGIN * run.second_order_error
    again, _ = links_error(replace(run, second_order_error=None))
    assert again == pytest.approx(stated, rel=1e-9)
