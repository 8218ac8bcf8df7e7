"""The first random scenes: each is accepted or refused in one typed message, ends typed, and states errors that hold.

Seeds are the first ones, not chosen by cost; a run may take a share of the work that `random_references` allows, and
one that takes more than all of it, by the stored references, a small share: it ends with a budget either way.
Stored errors come from ``benchmarks/random_scenes.py --seeds 0:300 --write-references``.
"""

from __future__ import annotations

import csv
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest
from random_references import judge
from random_scenes import KINDS, MECHANISMS, random_scene
from random_statements import DOUBTFUL, FLOOR, PARTS, judged, reference_row, row_of, up_to
from scenes import ROOT

from erls.errors import Cause
from erls.scene import build
from fe_import.cache import reduce_cached
from fe_import.description.link import LinkFile
from fe_import.modal import left_out_file
from fe_import.modal.model import ModalModel

SEEDS = range(300)
FAULTY = (879, 1216)
"""Of the benchmark's 2,000, those that once ended in a traceback."""

MENDED = (1725, 1834, 2116, 2118, 2261, 2288, 2348)
"""Once stated too low: modes foretold without a run with all of them, near dead centres of loops and where friction
acts; rigid mechanisms with friction, set beside a run at a larger tolerance."""

WORK, ENDLESS = 0.1, 0.03
STORED = ROOT / "tests/data/random_scenes.csv"
UNCOVERED = frozenset({95, 285})
"""Seeds whose stated total is below the actual one: friction decides what becomes of a small disturbance."""


def _stored() -> Mapping[int, dict[str, str]]:
    if not STORED.exists():
        return {}
    with STORED.open(encoding="utf-8", newline="") as stream:
        return {int(row["seed"]): row for row in csv.DictReader(stream)}


REFERENCES = _stored()
OUT_OF_WORK = {seed for seed, row in REFERENCES.items() if row["outcome"] == f"failed: {Cause.BUDGET}"}


@pytest.fixture
def links_that_pass(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing else meets their links: files of them would take a seventh of the time."""

    def reduced(link: LinkFile, folder: Path, tell: Callable[[str], None], passing: bool) -> tuple[ModalModel, bool]:
        return reduce_cached(link, folder, tell, passing=True)

    monkeypatch.setattr(build, "reduce_cached", reduced)
    monkeypatch.setattr(left_out_file, "write_left_out_file", lambda *_: None)


@pytest.mark.usefixtures("links_that_pass")
@pytest.mark.parametrize("seed", [*SEEDS, *FAULTY, *MENDED])
def test_scene_ends_typed_and_stated_error_holds(seed: int) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # of numbers that overflow where a motion runs away
        row = judge(seed, parts="none", work=ENDLESS if seed in OUT_OF_WORK else WORK)
    assert not row["outcome"].startswith("BUG"), row["message"]
    if row["outcome"] != "ran":
        assert row["message"].strip()
        assert "\n" not in row["message"]
        return
    _check_statement(row)


def _check_statement(row: dict[str, Any]) -> None:
    """The stated total is at least the stored actual one, up to the stated horizon."""
    stated, stored = row.get("stated"), REFERENCES.get(row["seed"])
    error = judged(row)
    if not stated or error is None or stored is None or not stored["total"] or row["seed"] in UNCOVERED:
        return
    kept, until = row_of(stored), (float(stored["end"]), stated["horizon"])
    actual = up_to(kept["actual"]["total"], *until)
    if "doubt" in kept and up_to(kept["doubt"]["total"], *until) > DOUBTFUL * max(actual, FLOOR):
        return  # without a second reference it is judged all the same
    assert max(error, FLOOR) >= actual


def test_few_statements_are_too_low() -> None:
    assert len(UNCOVERED) <= len(SEEDS) / 100


def test_stored_errors_are_read_as_they_were_written() -> None:
    """By the benchmark, which holds statements against them."""
    for stored in REFERENCES.values():
        again = reference_row(row_of(stored))
        assert all(again[name] == stored[name] for name in ("outcome", *PARTS))
        doubts = again["doubt"], again["doubt"].partition(" ")[0]  # older rows keep one
        assert stored["doubt"] in doubts or not stored["total"]


def test_a_seed_gives_the_same_scene() -> None:
    """Of another process and machine, too: what is drawn comes from the seed and a text alone."""
    assert random_scene(7) == random_scene(7)
    assert random_scene(7).tables != random_scene(8).tables


def test_every_kind_of_scene_is_drawn() -> None:
    """All values of the table in `random_scenes` among a thousand seeds."""
    drawn = [random_scene(seed) for seed in range(1000)]
    assert {scene.labels["kind"] for scene in drawn} == set(KINDS)
    assert {*MECHANISMS} - {"loop"} < {scene.labels["mechanism"] for scene in drawn}
    assert {scene.labels["links"] for scene in drawn} == {"1", "2", "3", "4", "5", "6"}
    text = " ".join(str(scene.tables) for scene in drawn)
    words = "standard modified polynomial waypoints sine spin_up table constant step trapezoid sine_burst cubic hold"
    words += " free torque motion pd feed_forward torque_limit friction rotor_inertia stiffness damping payloads events"
    words += " prismatic screw cylindrical universal spherical planar floating fixed minimum-norm mean-axis absolute"
    words += " substructures nodal lobatto generalized_alpha rk45 dop853 radau bdf lsoda bandwidth output_step static"
    words += " temperature_change mass rotation_deg auto linear line revolute to_link"
    missing = [word for word in words.split() if f"'{word}'" not in text]
    assert missing == ["free"]  # the default is not written
