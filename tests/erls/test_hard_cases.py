"""The fast part of the hard cases: each row passes; and the table leaves nothing out in silence."""

from __future__ import annotations

import pytest
import scenes
from hard_cases import CASES, ROWS
from hard_cases.case import FORMULATIONS, Case, judged

FAST = [(case, formulation) for case, formulation in ROWS if formulation in case.fast]


@pytest.mark.parametrize(("case", "formulation"), FAST, ids=[f"{case.name}, {name}" for case, name in FAST])
def test_row(case: Case, formulation: str) -> None:
    """It ends as it should, and states an error that holds."""
    row = judged(case, formulation)
    assert not row["problem"], row


def test_nothing_is_left_out() -> None:
    """Every case has a row of each formulation, and what judges it or the cause with which it must end."""
    assert len(ROWS) == len(CASES) * len(FORMULATIONS)
    assert len({(case.subject, case.name) for case in CASES}) == len(CASES)
    for case in CASES:
        named = {*case.not_here, *case.also, *case.fast, *(name for name in case.ends if name != "all")}
        assert named <= set(FORMULATIONS), case.name
        assert case.truth is not None or all(case.end(name) or name in case.not_here for name in FORMULATIONS), (
            case.name
        )
        assert all(len(reason) > 5 for reason in case.not_here.values()), case.name


def test_the_table_of_the_documentation_is_whole() -> None:
    """Each row stands on the page, in this order, and none fails there."""
    page = (scenes.ROOT / "docs/trust.md").read_text(encoding="utf-8").partition("\n## Hard cases\n")[2]
    lines = [line.strip("| ").split(" | ") for line in page.splitlines() if line.startswith("| ")]
    rows = [(line[0], line[1]) for line in lines if line[0] not in ("case", "---")]
    assert rows == [(case.name, formulation) for case, formulation in ROWS]
    assert not [line for line in lines if "FAILS" in line[2]]
