"""Slips in a scene or on the command line: each is refused at once, with a message that leads to what was meant."""

from __future__ import annotations

from typing import Any

import pytest
import scenes

import erls
from erls.errors import Cause, SceneError
from erls.mechanism.effects import ALL, named_effects
from fe_import.errors import Cause as LinkCause
from fe_import.errors import FEImportError

FLAT = scenes.ROOT / "data/l_shape/steel_flat.toml"
EFFECTS = [
    ("-all", "not 'all'"),
    ("all,-all", "not 'all'"),
    ("-auto", "not 'auto'"),
    (["all", "gravity", "-gravity"], "'gravity' both on and off"),
    ("gravity,-gravity", "'gravity' both on and off"),
    ("gravity,-coriolis", "either names of what is on, or"),
]


@pytest.mark.parametrize(("value", "words"), EFFECTS, ids=[str(value) for value, _ in EFFECTS])
def test_effects_that_cannot_be_meant(value: Any, words: str) -> None:
    """They would all have meant ``all``."""
    with pytest.raises(SceneError, match=words) as caught:
        erls.load_scene(FLAT, [f"effects={value}"])
    assert caught.value.cause is Cause.BAD_FIELD
    assert "simulation.effects" in str(caught.value)


def test_no_effect_and_all_but_one() -> None:
    assert named_effects([], "effects") == frozenset()
    assert named_effects("-gravity", "effects") == named_effects("all,-gravity", "effects") == ALL - {"gravity"}


FIELDS = [
    ("duration=1", "did you mean 'simulation.duration'?"),
    ("deformation=1", "did you mean 'initial.deformation'?"),
    ("simulation.durration=1", "did you mean 'duration'?"),
    ("gravitty=1", "did you mean 'gravity'?"),
]


@pytest.mark.parametrize(("change", "words"), FIELDS, ids=[change for change, _ in FIELDS])
def test_a_field_of_a_table_further_in(change: str, words: str) -> None:
    """A field of the same name is likelier than one of a similar name."""
    with pytest.raises(SceneError) as caught:
        erls.load_scene(FLAT, [change])
    assert caught.value.cause == Cause.UNKNOWN_FIELD
    assert caught.value.remedy == words


@pytest.mark.parametrize("duration", [1e-300, 1e-12, 9e-10])
def test_runs_that_are_too_short(duration: float) -> None:
    with pytest.raises(SceneError, match="shorter than any run") as caught:
        erls.load_scene(FLAT, [f"simulation.duration={duration!r}"])
    assert caught.value.where == f"{FLAT}: simulation.duration"


@pytest.mark.parametrize("settings", [[], ["simulation.integrator=lobatto"], ["simulation.bandwidth=50"]], ids=str)
def test_the_shortest_run(settings: list[str]) -> None:
    run = erls.simulate(erls.load_scene(FLAT, ["simulation.duration=1e-9", *settings]), verdict=False)
    assert run.failure is None
    assert run.end == 1e-9


def test_more_pieces_than_elements() -> None:
    """40 elements on the load path; a thousand pieces would take minutes to reduce."""
    settings = ["simulation.formulation=ffr", "links.l.substructures=41"]
    with pytest.raises(FEImportError, match="too many substructures for a load path of 40 elements") as caught:
        erls.simulate(erls.load_scene(FLAT, settings), verdict=False)
    assert caught.value.cause == LinkCause.BAD_FIELD
    assert (caught.value.where, caught.value.value, caught.value.limit) == (f"{FLAT}: links[0].substructures", 41, 40)
