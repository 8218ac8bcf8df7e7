"""Damaged runs, scenes and tables: refused with an error of the package, or read for what they still say."""

from __future__ import annotations

import pytest
from fuzz_scene_readers import GROUPS
from fuzzing import check_reports, fuzz_group

CASES = {"run files": 60, "scenes": 150, "tables": 200}


@pytest.mark.parametrize("group", GROUPS)
def test_damaged_files(group: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """See `fuzzing` for what a reader may do."""
    monkeypatch.setattr("erls.run.file._OUTPUT_TIMES", 11)
    check_reports(fuzz_group(GROUPS[group](), CASES[group]), CASES[group])
