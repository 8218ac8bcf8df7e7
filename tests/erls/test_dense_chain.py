"""The dense form of the paper in both gauges: against frozen values, and its derivatives by a complex step."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path
from typing import Any

import chain_cases
import frozen_values
import numpy as np
import pytest
import stiffened_cases

from erls.equations.erls.paper.dense_chain import DenseChain
from erls.maths.jit import any_scalar
from erls.mechanism.chain import Mechanism

SAME = 1e-10  # relative: sums in another order
GAUGES = ("joint-angle", "minimum-norm")
KNOWN = stiffened_cases.DENSE
PLAIN, STIFFENED = ("chains", [name for name in KNOWN if name in chain_cases.CASES]), ("stiffened", KNOWN)
MODAL = ("modal_inertia", stiffened_cases.SERIAL)


@cache
def _table(name: str) -> dict[str, Any]:
    return frozen_values.read(name)


def _mechanism(folder: Path, kind: str, case: str) -> Mechanism:
    cases = chain_cases if kind == "chains" else stiffened_cases
    found = cases.mechanism(folder, case, frozen_values.SOURCE)
    return frozen_values.with_effects(found, frozen_values.MODAL_INERTIA) if kind == "modal_inertia" else found


@pytest.mark.parametrize(
    ("kind", "case", "gauge"),
    [
        (kind, case, gauge)
        for kind, cases in (PLAIN, STIFFENED, MODAL)
        for case in cases
        for gauge in GAUGES
        # second-order displacements of the joint-angle gauge are anchored: `test_kernels_stiffened`
        if (kind == "chains" if gauge == "joint-angle" else case in stiffened_cases.SERIAL)
    ],
)
def test_equations_are_those_of_the_tables(kind: str, case: str, gauge: str, tmp_path: Path) -> None:
    """Residual, matrices, accelerations, states, energies, reactions: the recursion's too, in the joint-angle gauge."""
    chain = DenseChain(_mechanism(tmp_path, kind, case), gauge)
    for at, frozen in _table(kind if gauge == "joint-angle" else f"{kind}_minimum_norm")[case]:
        found = {**frozen_values.functions(chain, at), **frozen_values.outputs(chain, at)}
        assert ("acceleration" in found) == ("acceleration" in frozen)
        assert not frozen_values.compare(found, frozen, SAME, len(chain.free_joints))


STEP = 1e-30
AGREE = 1e-6
TOGETHER = 12  # constants
ROUNDING = 3e-11  # of a residual, through the square of C_r
DERIVED = [
    ("chains", "controllers", "minimum-norm"),
    ("stiffened", "branches", "minimum-norm"),
    ("chains", "joints of several coordinates", "minimum-norm"),
    ("chains", "slides before a turn", "joint-angle"),
    ("modal_inertia", "arms, mixed", "minimum-norm"),
    ("modal_inertia", "prescribed in the middle", "joint-angle"),
]


class _Derivatives:
    """Derivatives of a residual by one number, by a complex step and by central differences."""

    def __init__(self, chain: DenseChain, at: chain_cases.State) -> None:
        self.system, self.at = chain.compiled, at
        self.values = [self.system.reals, at.y, at.v, at.a]
        self.complexes = [x.astype(complex) for x in self.values]
        self.residual = any_scalar(self.system.residual)
        self.scratch = self.system.scratch.astype(complex)
        self.base = self.real()

    def real(self) -> np.ndarray:
        """At ``values``."""
        out, (reals, *state) = np.empty(self.system.size), self.values
        self.system.residual(reals, self.system.integers, self.system.scratch, self.at.t, *state, out)
        return out

    def complex(self) -> np.ndarray:
        """At ``complexes``."""
        out, (reals, *state) = np.empty(self.system.size, dtype=complex), self.complexes
        self.residual(reals, self.system.integers, self.scratch, self.at.t, *state, out)
        return out

    def agree(self, which: int, places: np.ndarray, moves: np.ndarray) -> bool:
        """When the numbers at these places move together; to 1e-6, beside what rounding makes of differences.

        They are Richardson's, of order 4.
        """
        numbers, whole = self.values[which], self.complexes[which]
        kept = numbers[places]
        whole[places] += 1j * STEP * moves
        found = self.complex().imag / STEP
        whole[places] = kept
        slopes = []
        for h in (1.0, 0.5):
            numbers[places] = kept + h * moves
            above = self.real()
            numbers[places] = kept - h * moves
            slopes.append((above - self.real()) / (2 * h))
        numbers[places] = kept
        expected = (4 * slopes[1] - slopes[0]) / 3
        limit = AGREE * np.abs(expected).max() + ROUNDING * np.abs(self.base).max()
        return bool(np.abs(found - expected).max() <= limit)


@pytest.mark.parametrize(("kind", "case", "gauge"), DERIVED)
def test_complex_steps_are_derivatives(kind: str, case: str, gauge: str, tmp_path: Path) -> None:
    """Of the residual, by each of y, ẏ, ÿ, and by every constant of the records, those of like size together."""
    chain = DenseChain(_mechanism(tmp_path, kind, case), gauge)
    cases = chain_cases if kind == "chains" else stiffened_cases
    by, rng = _Derivatives(chain, cases.states(chain, case)[0]), np.random.default_rng(5)
    np.testing.assert_allclose(by.complex().real, by.base, rtol=0, atol=1e-11 * np.abs(by.base).max())
    for which in (1, 2, 3):
        every = np.arange(len(by.values[which]))
        assert not [k for k in every if not by.agree(which, every[k : k + 1], np.array([1e-5]))]
    constants = np.flatnonzero(np.isfinite(by.values[0]))
    moves = 1e-3 * np.maximum(1e-2, np.abs(by.values[0][constants])) * rng.choice([-1, 1], len(constants))
    order = np.argsort(np.abs(moves))
    for some in np.array_split(order, math.ceil(len(order) / TOGETHER)):
        assert by.agree(0, constants[some], moves[some]), constants[some]
