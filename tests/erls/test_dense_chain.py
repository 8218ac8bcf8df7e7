"""The dense form of the paper in both gauges: against frozen values, and its derivatives by a complex step."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import chain_cases
import frozen_values
import pytest
import stiffened_cases

from erls.equations.erls.paper.dense_chain import DenseChain
from erls.mechanism.chain import Mechanism

SAME = 1e-10  # relative: sums in another order
GAUGES = ("joint-angle", "minimum-norm")
PLAIN, STIFFENED = ("chains", chain_cases.CASES), ("stiffened", stiffened_cases.CASES)
MODAL = ("modal_inertia", stiffened_cases.CASES)


@cache
def _table(name: str) -> dict[str, Any]:
    return frozen_values.read(name)


def _mechanism(folder: Path, kind: str, case: str) -> Mechanism:
    cases = chain_cases if kind == "chains" else stiffened_cases
    found = cases.mechanism(folder, case, frozen_values.SOURCE)
    return frozen_values.with_effects(found, frozen_values.MODAL_INERTIA) if kind == "modal_inertia" else found


@pytest.mark.parametrize("gauge", GAUGES)
@pytest.mark.parametrize(
    ("kind", "case"), [(kind, case) for kind, cases in (PLAIN, STIFFENED, MODAL) for case in cases]
)
def test_equations_are_those_of_the_tables(kind: str, case: str, gauge: str, tmp_path: Path) -> None:
    """Residual, matrices, accelerations, states, energies, reactions: the recursion's too, in the joint-angle gauge."""
    chain = DenseChain(_mechanism(tmp_path, kind, case), gauge)
    for at, frozen in _table(kind if gauge == "joint-angle" else f"{kind}_minimum_norm")[case]:
        found = {**frozen_values.functions(chain, at), **frozen_values.outputs(chain, at)}
        assert ("acceleration" in found) == ("acceleration" in frozen)
        assert not frozen_values.compare(found, frozen, SAME, len(chain.free_joints))
