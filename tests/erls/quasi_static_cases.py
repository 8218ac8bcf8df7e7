"""Chains with static modes at random states: ``python quasi_static_cases.py FOLDER OUTPUT.npz`` saves the results."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import chain_cases
import numpy as np
import scenes

from erls.equations.erls.formulation import Erls
from erls.equations.quasi_static.formulation import QuasiStatic, quasi_static
from erls.mechanism.chain import Mechanism

BANDWIDTHS = {
    "one link": 100.0,
    "one link, payload, spring": 60.0,
    "parallel axes with a slide": 80.0,
    "prescribed in the middle": 80.0,
    "controllers": 40.0,
    "without inertia_first_order": 60.0,
}


def equations(folder: Path, name: str, static: bool = True) -> QuasiStatic:
    """A case of `chain_cases` whose modes above a bandwidth follow statically."""
    found = quasi_static(Erls, mechanism(folder, name, static), 1.0)
    assert isinstance(found, QuasiStatic)
    return found


def mechanism(folder: Path, name: str, static: bool = True, source: dict[str, str] = scenes.ARM) -> Mechanism:
    """The mechanism of a case; ``source`` says where the model of its links comes from."""
    found = replace(chain_cases.mechanism(folder, name, source), bandwidth=BANDWIDTHS[name])
    return found if static else replace(found, effects=found.effects - {"static_correction"})


def states(system: QuasiStatic, name: str) -> list[chain_cases.State]:
    """Random states with slow deflections of some millimetres, seeded by the name of the case."""
    rng = np.random.default_rng(sum(map(ord, name)))
    result = []
    for t in (0.03, 0.35):
        y, v, a = rng.uniform(-1, 1, (3, system.size))
        f = system.size - len(system.modes.frequencies_hz)
        y[f:] *= 2e-3
        v[f:] *= 0.1
        result.append(chain_cases.State(t, y, v, a))
    return result


def all_results(folder: Path) -> dict[str, np.ndarray]:
    """Every function in every case and state, by 'case/state/function'."""
    result = {}
    for name in BANDWIDTHS:
        system = equations(folder, name)
        assert system.compiled is not None
        for k, at in enumerate(states(system, name)):
            for what, values in chain_cases.evaluate(system.compiled, at).items():
                result[f"{name}/{k}/{what}"] = values
    return result


if __name__ == "__main__":
    np.savez(sys.argv[2], **all_results(Path(sys.argv[1])))
