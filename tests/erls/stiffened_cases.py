"""Chains with geometric stiffening at random states, evaluated by the kernels: ``python stiffened_cases.py FOLDER
OUTPUT.npz`` saves the results.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import chain_cases
import numpy as np
import scenes

from erls.equations.erls.formulation import Erls
from erls.mechanism.chain import Mechanism
from erls.mechanism.effects import LINEAR
from erls.mechanism.without_effects import with_rigid

STIFFENED = LINEAR | {"geometric_stiffening", "foreshortening"}
SOFT = 1e-4  # of the links' stiffness is left: otherwise it hides what second order adds
DEFLECTION = 2.0  # times that of `chain_cases`: a centimetre
ARMS = {f"arms, {kind}": kind for kind in ("revolute", "mixed", "prescribed")}  # joints away from interfaces
MIXED: dict[str, set[int]] = {  # links without second-order data
    "bare first link": {0},
    "bare middle link": {1},
    "bare last link": {2},
}
RIGID = {"rigid first link": {"a"}, "rigid middle link": {"b"}, "rigid last link": {"c"}}
CASES = (*chain_cases.CASES, *ARMS, *MIXED, *RIGID)
DENSE = tuple(name for name in CASES if name != "rotation vectors")
SERIAL = tuple(name for name in CASES if name not in chain_cases.CASES or name in chain_cases.SERIAL)


def _bare(mechanism: Mechanism, which: set[int]) -> Mechanism:
    """The mechanism with links as they come from matrices."""
    links = [
        replace(link, model=replace(link.model, second_order=None)) if k in which else link
        for k, link in enumerate(mechanism.links)
    ]
    return replace(mechanism, links=tuple(links))


def equations(folder: Path, name: str) -> Erls:
    """The ERLS equations of a case; files go to ``folder``."""
    return Erls(mechanism(folder, name))


def mechanism(folder: Path, name: str, source: dict[str, str] = scenes.ARM) -> Mechanism:
    """The mechanism of a case; ``source`` says where the model of its links comes from."""
    off: set[str] = set()
    if name in chain_cases.CASES:
        off = chain_cases.CASES[name][1]
        found = chain_cases.mechanism(folder, name, source)
    else:
        payload = {"point": "end", "mass": 0.3, "offset": [0.02, 0.0, 0.01], "inertia": [1e-3, 2e-3, 3e-3]}
        found = scenes.mechanism(scenes.three_links(folder, ARMS.get(name, "mixed"), source, payloads=[payload]))
        found = with_rigid(_bare(found, MIXED.get(name, set())), RIGID.get(name, set()))
    links = tuple(replace(link, stiffness=SOFT * link.stiffness) for link in found.links)
    return replace(found, links=links, effects=STIFFENED - off)


def states(chain: Erls, name: str) -> list[chain_cases.State]:
    """Random states with deflections of some centimetres, and undeformed ones that move."""
    result = []
    for at in chain_cases.states(chain, name):
        f = len(chain.free_joints)
        result += [replace(at, y=np.concatenate([at.y[:f], size * at.y[f:]])) for size in (DEFLECTION, 0.0)]
    return result


def all_results(folder: Path) -> dict[str, np.ndarray]:
    """Every function in every case and state, by 'case/state/function'."""
    result = {}
    for name in CASES:
        chain = equations(folder, name)
        assert chain.compiled is not None
        for k, at in enumerate(states(chain, name)[:2]):
            for what, values in chain_cases.evaluate(chain.compiled, at).items():
                result[f"{name}/{k}/{what}"] = values
    return result


if __name__ == "__main__":
    np.savez(sys.argv[2], **all_results(Path(sys.argv[1])))
