"""The equations in complex numbers: derivatives by complex steps, of states and of every constant.

A complex step of 1e-30 has no error but rounding; central differences of the same source in real numbers have one of
their own, about 1e-10 of the terms of the residual for the steps taken here, so 1e-6 asks for agreement of formulas.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import chain_cases
import ffr_cases
import loop_cases
import loop_scenes
import numpy as np
import pytest
import stiffened_cases
from chain_cases import State

from erls.equations.compiled_system import MASS_MATRIX, CompiledSystem
from erls.equations.erls.formulation import Erls
from erls.equations.erls.pack import pack_chain
from erls.equations.ffr.formulation import Ffr
from erls.equations.loops import actuated
from erls.equations.loops.closed_chain import ClosedChain
from erls.equations.loops.compiled import CompiledLoops
from erls.equations.loops.records import call_mass_matrix
from erls.maths.jit import any_scalar, kernel, plain
from erls.mechanism.thermal import elastic_rest

CASES: list[tuple[Any, str]] = [
    (chain_cases, "controllers"),
    (stiffened_cases, "arms, mixed"),
    (ffr_cases, "tangent: controllers"),
    (ffr_cases, "mean-axis stiffened: prescribed in the middle"),
]
STEP = 1e-30
AGREE = 1e-6


def _complex(
    system: CompiledSystem, residual: Any, t: float, arguments: list[np.ndarray], reals: np.ndarray
) -> np.ndarray:
    out = np.zeros(system.size, dtype=complex)
    residual(reals, system.integers, system.scratch.astype(complex), t, *arguments, out)
    return out.imag / STEP


def _real(system: CompiledSystem, t: float, arguments: list[np.ndarray], reals: np.ndarray) -> np.ndarray:
    out = np.zeros(system.size)
    system.residual(reals, system.integers, system.scratch, t, *arguments, out)
    return out


def _loops(folder: Path, name: str, form: str) -> tuple[CompiledSystem, State]:
    closed = ClosedChain(loop_scenes.tree(loop_cases.mechanism(folder, name), form))
    assert closed.compiled is not None
    return closed.compiled, loop_cases.states(closed, name)[1]


@pytest.mark.parametrize(("form", "name"), [("erls", "controlled turn"), ("erls", "screw"), ("ffr", "two loops")])
def test_complex_steps_through_loops(form: str, name: str, tmp_path: Path) -> None:
    """Of a residual whose tree is called by address; to 1e-6 along random directions of all states together.

    In Python: to compile a tree and its loops for complex numbers takes half a minute, for half a dozen evaluations.
    """
    system, at = _loops(tmp_path, name, form)
    assert isinstance(system, CompiledLoops)
    residual = plain(system.residual, called=system.called)
    arguments, rng = [at.y, at.v, at.a], np.random.default_rng(4)
    whole = system.reals.astype(complex)
    for _ in range(3):
        ways = [scale * rng.uniform(-1, 1, system.size) for scale in (1e-3, 1.0, 1.0)]
        shifted = [x + 1j * STEP * way for x, way in zip(arguments, ways, strict=True)]
        found = _complex(system, residual, at.t, shifted, whole)
        size, sides = 1e-4, []
        for k in (2, 1, -1, -2):
            moved = [x + k * size * way for x, way in zip(arguments, ways, strict=True)]
            sides.append(_real(system, at.t, moved, system.reals))
        slope = (8 * (sides[1] - sides[2]) - sides[0] + sides[3]) / (12 * size)
        assert np.abs(found - slope).max() <= AGREE * np.abs(slope).max()


@kernel(MASS_MATRIX, counted=False)
def _constants(
    reals: np.ndarray, integers: np.ndarray, scratch: np.ndarray, t: float, y: np.ndarray, out: np.ndarray
) -> None:
    for i in range(len(out)):
        for j in range(len(out)):
            out[i, j] = t * reals[i] * y[j]


def test_complex_steps_through_addresses(tmp_path: Path) -> None:
    """What a kernel calls by address is compiled for complex numbers with it: another tree's than that of the loops."""
    system, at = _loops(tmp_path, "controlled turn", "erls")
    masses = any_scalar(actuated.masses, called={call_mass_matrix: _constants})
    reals, place = system.reals.astype(complex), at.y.astype(complex)
    place[1] += 1j * STEP
    out = np.zeros((2, 2), dtype=complex)
    masses(reals, system.integers, system.scratch.astype(complex), 3.0, place[:2], out)
    np.testing.assert_array_equal(out.imag / STEP, [[0, 3 * reals[0].real], [0, 3 * reals[1].real]])


@pytest.mark.parametrize(("cases", "name"), CASES, ids=[name for _, name in CASES])
def test_complex_steps_agree_with_differences(cases: Any, name: str, tmp_path: Path) -> None:
    """Of the source in Python, in a tenth of the time that compilation takes: `test_dense_chain` has compiled ones."""
    chain: Any = cases.equations(tmp_path, name)
    warm = chain_cases.warm(chain.mechanism)
    chain = Ffr(warm, ffr_cases.body_frame(name)) if isinstance(chain, Ffr) else Erls(warm)
    system = chain.compiled if isinstance(chain, Ffr) else pack_chain(chain.mechanism)
    residual = plain(system.residual)
    at = (chain_cases if isinstance(chain, Ffr) else cases).states(chain, name)[0]
    arguments = [at.y, at.v, at.a]
    base = _real(system, at.t, arguments, system.reals)
    unmoved = np.zeros(system.size, dtype=complex)
    complexes = [x.astype(complex) for x in arguments]
    whole = system.reals.astype(complex)
    residual(whole, system.integers, system.scratch.astype(complex), at.t, *complexes, unmoved)
    np.testing.assert_allclose(unmoved.real, base, rtol=1e-9, atol=1e-11 * np.abs(base).max())
    for number, values in enumerate(arguments):
        for place in range(len(values)):
            size = 1e-5 * max(1e-3, abs(values[place]))
            shifted = [x.copy() for x in complexes]
            shifted[number][place] += 1j * STEP
            found = _complex(system, residual, at.t, shifted, whole)
            sides = []
            for sign in (1, -1):
                moved = [x.copy() for x in arguments]
                moved[number][place] += sign * size
                sides.append(_real(system, at.t, moved, system.reals))
            _close(found, (sides[0] - sides[1]) / (2 * size), base, size, (number, place))
    active = np.flatnonzero(np.isfinite(system.reals))
    rng = np.random.default_rng(3)
    rest = np.concatenate([elastic_rest(link) for link in warm.links])
    for place in [*rng.permutation(active)[:150], *np.flatnonzero(np.isin(system.reals, rest[rest != 0]))]:
        size = 1e-5 * max(1e-6, abs(system.reals[place]))
        shifted = whole.copy()
        shifted[place] += 1j * STEP
        found = _complex(system, residual, at.t, complexes, shifted)
        sides = []
        for sign in (1, -1):
            moved = system.reals.copy()
            moved[place] += sign * size
            sides.append(_real(system, at.t, arguments, moved))
        _close(found, (sides[0] - sides[1]) / (2 * size), base, size, place)


def _close(found: np.ndarray, expected: np.ndarray, base: np.ndarray, size: float, where: Any) -> None:
    """To 1e-6 of the derivative, and of what rounding in the residual makes of a difference."""
    noise = 1e-12 * np.abs(base).max() / size
    limit = AGREE * np.abs(expected).max() + noise
    assert np.abs(found - expected).max() <= limit, (where, found, expected)
