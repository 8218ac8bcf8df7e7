"""Chains of floating frames, evaluated by the kernels: ``python ffr_cases.py FOLDER OUTPUT.npz`` saves the results."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import chain_cases
import numpy as np
import scenes

from erls.equations.ffr.formulation import Ffr
from erls.equations.ffr.pack import pack_frames
from erls.mechanism.chain import Mechanism

SOME = ("one link, payload, spring", "parallel axes with a slide", "axes that part", "controllers")
ON_MEAN_AXES = (*chain_cases.NOT_SERIAL, *SOME)
PARTLY_RIGID = {"rigid in the middle": (1,), "rigid at the ends": (0, 2), "all rigid": (0, 1, 2)}
FEW = ("one link, payload, spring", "axes that part", "prescribed in the middle", "no effects")
STIFFENED = (*chain_cases.NOT_SERIAL, *FEW, *PARTLY_RIGID)
CASES = [
    *(f"tangent: {name}" for name in (*chain_cases.CASES, *PARTLY_RIGID)),
    *(f"mean-axis: {name}" for name in (*ON_MEAN_AXES, *PARTLY_RIGID)),
    *(f"tangent stiffened: {name}" for name in STIFFENED),
    *(f"mean-axis stiffened: {name}" for name in STIFFENED),
]


def equations(folder: Path, case: str) -> Ffr:
    """The FFR equations of a case; files go to ``folder``."""
    return Ffr(mechanism(folder, case), body_frame(case))


def body_frame(case: str) -> str:
    """Name of a case's body frame."""
    return case.partition(": ")[0].split()[0]


def mechanism(folder: Path, case: str, source: dict[str, str] = scenes.ARM) -> Mechanism:
    """The mechanism of a case; ``source`` says where the model of its links comes from."""
    kind, _, name = case.partition(": ")
    part = _partly_rigid if name in PARTLY_RIGID else chain_cases.mechanism
    found = part(folder, name, source)
    return replace(found, effects=found.effects | {"geometric_stiffening"}) if "stiffened" in kind else found


def _partly_rigid(folder: Path, name: str, source: dict[str, str]) -> Mechanism:
    data = scenes.read_toml(scenes.three_links(folder, "mixed", source, payloads=[{"point": "end", "mass": 0.2}]))
    data["joints"][1]["drive"] = {**chain_cases.PD, "feed_forward": True}
    data["joints"][2].update(chain_cases.SPRING)
    for k in PARTLY_RIGID[name]:
        data["links"][k]["flexible"] = False
    return scenes.mechanism(scenes.write_toml(folder / "case.toml", data))


def all_results(folder: Path) -> dict[str, np.ndarray]:
    """Every function at one state, by 'case/function', in all cases but those of single effects."""
    result = {}
    for case in CASES:
        if ": only" in case or ": without" in case:
            continue
        chain = equations(folder, case)
        assert chain.compiled is not None
        for what, values in chain_cases.evaluate(chain.compiled, chain_cases.states(chain, case)[1]).items():
            result[f"{case}/{what}"] = values
        solved = chain_cases.solved(pack_frames(chain.given, dense=0), chain_cases.states(chain, case)[1])
        result.update({f"{case}/solved {kind}": x for kind, x in solved.items()})
    return result


if __name__ == "__main__":
    np.savez(sys.argv[2], **all_results(Path(sys.argv[1])))
