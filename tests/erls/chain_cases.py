"""Chains at random states, evaluated by the kernels: ``python chain_cases.py FOLDER OUTPUT.npz`` saves the results."""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import scenes

from erls.equations.compiled_system import CompiledSystem
from erls.equations.erls.formulation import Erls
from erls.equations.erls.pack import pack_chain
from erls.mechanism.chain import Mechanism
from erls.mechanism.effects import EFFECTS
from fe_import.modal.thermal import ThermalExpansion

INERTIAL = [name for name, effect in EFFECTS.items() if effect.in_equations]
SINE = {"shape": "sine", "amplitude": 0.5, "frequency_hz": 1.0, "phase_deg": 30.0}
QUINTIC = {"shape": "polynomial", "degree": 5, "from": 0.1, "to": 0.7, "start": 0.1, "duration": 0.8}
PROFILES = [
    {"shape": "step", "start": 0.05, "value": 0.7},
    {"shape": "sine_burst", "start": 0.02, "amplitude": 0.3, "frequency_hz": 20.0, "cycles": 3},
]
TORQUE = {"type": "torque", "profiles": PROFILES}
PD: dict[str, Any] = {"type": "pd", "motion": QUINTIC, "proportional_gain": 30.0, "derivative_gain": 2.0}
FED = {**PD, "feed_forward": True}
SPRING: dict[str, Any] = {
    "stiffness": 3.0,
    "rest": 0.2,
    "damping": 0.4,
    "motor": {"rotor_inertia": 2e-4, "gear_ratio": 10.0},
    "friction": {"force": 0.3, "transition_rate": 0.05},
}


def _joint(name: str, kind: str = "revolute", alpha: float = 0.0, **more: Any) -> dict[str, Any]:
    dh = {"convention": "standard", "a": 0.4, "alpha_deg": alpha}
    if kind == "prismatic":
        dh["convention"] = "modified"
    return {"name": name, "type": kind, "dh": dh, **more}


def _driven(motion: dict[str, Any]) -> dict[str, Any]:
    return {"drive": {"type": "motion", "motion": motion}}


# joints; effects that are off; payload at the end
CASES: dict[str, tuple[list[dict[str, Any]], set[str], bool]] = {
    "one link": ([_joint("a", alpha=90.0)], set(), False),
    "one link, payload, spring": ([_joint("a", alpha=20.0, **SPRING)], set(), True),
    "one link that slides": ([_joint("a", "prismatic")], set(), False),
    "parallel axes": ([_joint("a"), _joint("b", **SPRING), _joint("c")], set(), True),
    "parallel axes with a slide": ([_joint("a"), _joint("b", "prismatic"), _joint("c", drive=TORQUE)], set(), False),
    "slides before a turn": ([_joint("a", "prismatic"), _joint("b", "prismatic", 50.0), _joint("c")], set(), True),
    "axes that part": ([_joint("a"), _joint("b", alpha=70.0), _joint("c", alpha=10.0, **SPRING)], set(), False),
    "all prescribed": ([_joint("a", alpha=30.0, **_driven(SINE)), _joint("b", **_driven(QUINTIC))], set(), True),
    "prescribed in the middle": ([_joint("a", alpha=40.0), _joint("b", **_driven(SINE)), _joint("c")], set(), False),
    "controllers": (
        [
            _joint("a", alpha=25.0, drive={**PD, "feed_forward": True}, **SPRING),
            _joint("b", "prismatic", 15.0, drive={**PD, "torque_limit": 2.0}),
            _joint("c", drive={**PD, "feed_forward": True, "torque_limit": 1.0}),
        ],
        set(),
        True,
    ),
    "five links": (
        [_joint(n, alpha=a) for n, a in zip("abcde", (20.0, 0.0, -60.0, 90.0, 0.0), strict=True)],
        set(),
        True,
    ),
    "branches": (
        [
            _joint("a", alpha=35.0),
            _joint("b", alpha=-20.0, **SPRING),
            _joint("c", "prismatic", 15.0, on="a", branch={"position": [0.3, 0.0, 0.1], "rotation_deg": [10, 20, 30]}),
            _joint("d", alpha=50.0, on="ground", branch={"position": [0.0, 0.5, 0.1]}, **_driven(SINE)),
            _joint("e", drive={**PD, "feed_forward": True}),
        ],
        set(),
        True,
    ),
    "joints of several coordinates": (
        [
            _joint("a", "cylindrical", 25.0, coordinates={"slide": SPRING, "turn": {"drive": FED}}),
            _joint("b", "universal", -15.0, coordinates={"y": _driven(SINE)}),
            _joint("c", "planar", 15.0, coordinates={"x": {"stiffness": 40.0}, "turn": SPRING}),
            _joint("d", "fixed", 50.0),
        ],
        set(),
        True,
    ),
    "screws": (
        [
            _joint("a", "screw", 25.0, pitch=0.05, **SPRING),
            _joint("b", alpha=-15.0, drive=FED),
            _joint("c", "screw", 15.0, pitch=-0.2),
        ],
        set(),
        True,
    ),
    "rotation vectors": (
        [
            _joint("a", "floating", 25.0, coordinates={"x": SPRING}),
            _joint("b", alpha=-15.0, drive={**PD, "feed_forward": True}),
            _joint("c", "spherical", 15.0),
        ],
        set(),
        True,
    ),
    **{
        f"without {name}": ([_joint("a", alpha=35.0), _joint("b", **_driven(SINE)), _joint("c")], {name}, True)
        for name in INERTIAL
    },
    **{f"only {name}": ([_joint("a"), _joint("b")], set(INERTIAL) - {name}, False) for name in INERTIAL},
    "no effects": ([_joint("a", alpha=35.0), _joint("b")], set(INERTIAL), True),
}

NOT_SERIAL = ("branches", "joints of several coordinates", "rotation vectors", "screws")
SERIAL = [name for name in CASES if name not in NOT_SERIAL]
"""Chains of joints of one coordinate in which every link stands on the one before."""
DENSE = [name for name in CASES if name != "rotation vectors"]
"""What the dense form of the paper knows."""


@dataclass(frozen=True)
class State:
    """A time and a state (n,) with accelerations."""

    t: float
    y: np.ndarray
    v: np.ndarray
    a: np.ndarray


def equations(folder: Path, name: str) -> Erls:
    """The ERLS equations of a case; files go to ``folder``."""
    return Erls(mechanism(folder, name))


def mechanism(folder: Path, name: str, source: dict[str, str] = scenes.ARM) -> Mechanism:
    """The mechanism of a case; ``source`` says where the model of its links comes from."""
    joints, off, payload = CASES[name]
    scenes.arm_link(folder)
    data: dict[str, Any] = {
        "simulation": {"duration": 1.0},
        "base": {"rotation_deg": [20.0, 30.0, -10.0]},
        "joints": joints,
        "links": [
            {"name": j["name"], **source, "mesh_pose": {"frame": "joint", "rotation_deg": [0, 5, 10 * k]}}
            for k, j in enumerate(joints)
        ],
        "points": [{"name": "end", "link": joints[-1]["name"], "node": "tip"}],
    }
    if payload:
        data["payloads"] = [{"point": "end", "mass": 0.2, "offset": [0.02, 0.0, 0.1]}]
    found = scenes.mechanism(scenes.write_toml(folder / "case.toml", data))
    return replace(found, effects=found.effects - off)


def warm(mechanism: Mechanism) -> Mechanism:
    """The mechanism with links that expand anyhow: random thermal forces, up to millimetres."""
    rng, links = np.random.default_rng(8), []
    for link in mechanism.links:
        force = np.concatenate([np.zeros(6), 1e-4 * link.stiffness * rng.uniform(-1, 1, link.elastic_modes)])
        thermal = ThermalExpansion(10.0, force, np.zeros((0, 6)), np.zeros((0, 6)))
        links.append(replace(link, model=replace(link.model, thermal=thermal)))
    return replace(mechanism, links=tuple(links))


def states(chain: Erls, name: str) -> list[State]:
    """Random states with deflections of some millimetres, seeded by the name of the case."""
    rng = np.random.default_rng(sum(map(ord, name)))
    result = []
    for t in (0.03, 0.35):
        y, v, a = rng.uniform(-1, 1, (3, chain.size))
        f = len(chain.free_joints)
        y[f:] *= 2e-3
        result.append(State(t, y, v, a))
    return result


def evaluate(system: CompiledSystem, at: State) -> dict[str, np.ndarray]:
    """All functions of a compiled system at a state."""
    n = system.size
    constants = system.reals, system.integers, system.scratch
    found = {"residual": np.empty(n), "acceleration": np.empty(n)}
    found.update({name: np.empty((n, n)) for name in ("mass", "stiffness", "damping")})
    system.residual(*constants, at.t, at.y, at.v, at.a, found["residual"])
    system.mass_matrix(*constants, at.t, at.y, found["mass"])
    system.stiffness_and_damping(*constants, at.t, at.y, at.v, found["stiffness"], found["damping"])
    status = system.acceleration(*constants, at.t, at.y, at.v, found["acceleration"])
    if status != 0:  # inertia linear in the deformation alone need not be positive
        found["acceleration"][:] = 0.0
    return found


SHIFTS = {"real": (3e-3, 8e-6), "complex": (3e-3 * (0.14 + 0.13j), (3e-3 * (0.14 + 0.13j)) ** 2)}


def solved(system: CompiledSystem | None, at: State) -> dict[str, np.ndarray]:
    """(M + α C + β K)⁻¹ a, link by link, after factors of other shifts and states in the same memory."""
    assert system is not None
    assert system.factoring is not None
    ways = {
        "real": (float, system.factoring.factor, system.factoring.solve),
        "complex": (complex, system.factoring.factor_complex, system.factoring.solve_complex),
    }
    result = {}
    for kind, (dtype, factor, solve) in ways.items():
        factors = np.zeros(system.factoring.size, dtype=dtype)
        for alpha, beta, y in ((0.0, 0.0, 0 * at.y), (*SHIFTS[kind], 0 * at.y), (*SHIFTS[kind], at.y)):
            state = at.t, y, at.v, dtype(alpha), dtype(beta)
            status = factor(system.reals, system.integers, system.scratch, *state, factors)
        assert status == 0
        result[kind] = at.a.astype(dtype)
        solve(system.reals, system.integers, factors, result[kind])
    return result


def solved_densely(
    matrices: dict[str, np.ndarray], damping: np.ndarray, at: State, kind: str
) -> tuple[np.ndarray, float]:
    """The same from the matrices of `evaluate` with this damping; and the rounding to expect, of its largest entry."""
    alpha, beta = SHIFTS[kind]
    matrix = matrices["mass"] + alpha * damping + beta * matrices["stiffness"]
    result = np.linalg.solve(matrix, at.a)
    return result, 100 * np.finfo(float).eps * float(np.linalg.cond(matrix) * np.abs(result).max())


def all_results(folder: Path) -> dict[str, np.ndarray]:
    """Every function in every case and state, by 'case/state/function'."""
    result = {}
    for name in CASES:
        chain = equations(folder, name)
        assert chain.compiled is not None
        for k, at in enumerate(states(chain, name)):
            for what, values in evaluate(chain.compiled, at).items():
                result[f"{name}/{k}/{what}"] = values
        for kind, x in solved(pack_chain(chain.mechanism, dense=0), states(chain, name)[1]).items():
            result[f"{name}/solved {kind}"] = x
    return result


if __name__ == "__main__":
    np.savez(sys.argv[2], **all_results(Path(sys.argv[1])))
