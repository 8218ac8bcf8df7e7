"""Values of all equations of motion at the random states of the tests, frozen in ``tests/data/frozen``.

They were computed by the NumPy equations in the notation of the papers, before kernels took their place, on one modal
model (``arm.h5``, that of `scenes.arm_link`), so that they depend on no reduction. A table of `TABLES` is one file; its
entries are called ``CASE/STATE/QUANTITY``. Inputs are t, y, v and a; of mass matrices the lower triangle is stored.

``PYTHONPATH=. python tests/erls/frozen_values.py [TABLE ...]`` freezes the values of the present code.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import chain_cases
import ffr_cases
import loop_cases
import numpy as np
import quasi_static_cases
import stiffened_cases
from chain_cases import State

from erls.equations.formulation import TreeFormulation
from erls.equations.loops.closed_chain import ClosedChain
from erls.equations.quasi_static.formulation import QuasiStatic, quasi_static
from erls.equations.quasi_static.static_modes import StaticModes
from erls.equations.registry import TREES
from erls.errors import SimulationError
from erls.mechanism.chain import Mechanism
from erls.mechanism.loops import Loop, loop_ends
from erls.scene.chain import Simulation

FOLDER = Path(__file__).parents[1] / "data" / "frozen"
SOURCE = {"modal_file": str(FOLDER / "arm.h5")}
_DIFFERENCES = {"loop violation": "frame pose", "loop rate": "frame twist"}
INPUTS = ("t", "y", "v", "a")
STIFFENED = {"geometric_stiffening", "foreshortening"}
MODAL_INERTIA = STIFFENED | {"modal_inertia"}
Values = dict[str, np.ndarray]


@dataclass(frozen=True)
class Table:
    """Cases in one file.

    Attributes
    ----------
    cases : tuple of str
    build : callable
        ``build(folder, case)``: a formulation.
    states : callable
        ``states(formulation, case)``: where it is evaluated.
    """

    cases: tuple[str, ...]
    build: Callable[[Path, str], Any]
    states: Callable[[Any, str], Iterable[State]]


def _tree(mechanism: Mechanism, formulation: str = "erls", **settings: Any) -> TreeFormulation:
    return TREES[formulation](mechanism, Simulation(duration=1.0, formulation=formulation, **settings))


def with_effects(mechanism: Mechanism, effects: Iterable[str]) -> Mechanism:
    return replace(mechanism, effects=mechanism.effects | frozenset(effects))


def _chains(cases: Any, names: Iterable[str], which: slice, effects: Iterable[str] = (), **settings: Any) -> Table:
    """Open chains of a file of cases."""

    def build(folder: Path, name: str) -> TreeFormulation:
        chosen = {"body_frame": cases.body_frame(name)} if cases is ffr_cases else {}
        return _tree(with_effects(cases.mechanism(folder, name, SOURCE), effects), **settings, **chosen)

    at = chain_cases if cases is ffr_cases else cases
    return Table(tuple(names), build, lambda system, name: at.states(system, name)[which])


def _loops(effects: Iterable[str] = (), names: Iterable[str] = loop_cases.CASES, **settings: Any) -> Table:
    """Closed chains."""

    def build(folder: Path, name: str) -> ClosedChain:
        return ClosedChain(_tree(with_effects(loop_cases.mechanism(folder, name, SOURCE), effects), **settings))

    return Table(tuple(names), build, lambda system, name: loop_cases.states(system, name)[1:])


def _static(static: bool, **settings: Any) -> Table:
    """Chains whose fast modes follow statically."""

    def build(folder: Path, name: str) -> QuasiStatic:
        mechanism = quasi_static_cases.mechanism(folder, name, static, SOURCE)
        found = quasi_static(lambda given: _tree(given, **settings), mechanism, 1.0)
        assert isinstance(found, QuasiStatic)
        return found

    return Table(
        tuple(quasi_static_cases.BANDWIDTHS), build, lambda system, name: quasi_static_cases.states(system, name)[1:]
    )


FIRST, LAST, BOTH = slice(1), slice(1, 2), slice(2)
BENT = slice(2, 3)  # of `stiffened_cases`: deflected, at the later time
_FEEL_MODAL = tuple(n for n in ffr_cases.CASES if "stiffened" in n and "all rigid" not in n)
_SOME_LOOPS = ("controlled turn", "driven slide", "spherical", "two loops")
TABLES = {
    "chains": _chains(chain_cases, chain_cases.CASES, BOTH),
    "chains_minimum_norm": _chains(chain_cases, chain_cases.SERIAL, LAST, gauge="minimum-norm"),
    "stiffened": _chains(stiffened_cases, stiffened_cases.CASES, BENT),
    "stiffened_minimum_norm": _chains(stiffened_cases, stiffened_cases.SERIAL, BENT, gauge="minimum-norm"),
    "modal_inertia": _chains(stiffened_cases, stiffened_cases.SERIAL, BENT, MODAL_INERTIA),
    "modal_inertia_minimum_norm": _chains(
        stiffened_cases, stiffened_cases.SERIAL, BENT, MODAL_INERTIA, gauge="minimum-norm"
    ),
    "ffr": _chains(ffr_cases, ffr_cases.CASES, LAST, formulation="ffr"),
    "ffr_modal_inertia": _chains(ffr_cases, _FEEL_MODAL, LAST, MODAL_INERTIA, formulation="ffr"),
    "loops": _loops(),
    "loops_minimum_norm": _loops(gauge="minimum-norm", names=_SOME_LOOPS),
    "loops_stiffened": _loops(STIFFENED),
    "loops_ffr": _loops(formulation="ffr"),
    "loops_ffr_mean_axis": _loops(formulation="ffr", body_frame="mean-axis", names=_SOME_LOOPS),
    "quasi_static": _static(True),
    "quasi_static_left_out": _static(False),
    "quasi_static_ffr": _static(True, formulation="ffr"),
}


def functions(system: Any, at: State) -> Values:
    """Residual, matrices and acceleration by the methods of a formulation."""
    stiffness, damping = system.stiffness_and_damping(at.t, at.y, at.v)
    found = {
        "residual": system.residual(at.t, at.y, at.v, at.a),
        "mass": system.mass_matrix(at.t, at.y),
        "stiffness": stiffness,
        "damping": damping,
    }
    with suppress(SimulationError):  # inertia linear in the deformation alone need not be positive
        found["acceleration"] = system.acceleration(at.t, at.y, at.v)
    return found


def outputs(system: Any, at: State) -> Values:
    """What runs report: energies, poses, modal coordinates, joints, reactions; of loops also frames and forces."""
    state, energy = system.state(at.t, at.y, at.v), system.energy(at.t, at.y, at.v)
    found = {
        "energies": np.array([energy.kinetic, energy.elastic, energy.gravity, energy.springs]),
        "poses": np.array(state.poses),
        "modal coordinates": np.concatenate(state.modal),
        "joint coordinates": state.coordinates,
        "joint angles": state.angles,
        "joint rates": state.rates,
    }
    if isinstance(system, ClosedChain | QuasiStatic):
        reactions = system.reactions(at.t, at.y, at.v)
    else:
        reactions = system.reactions_at(at.t, at.y, at.v, at.a)
    for kind in ("force", "moment", "effort"):
        found[f"reaction {kind}s"] = np.array([getattr(reaction, kind) for reaction in reactions])
    if isinstance(system, ClosedChain):
        found.update(_of_loops(system, at))
    return found


def _of_loops(system: ClosedChain, at: State) -> Values:
    """Conditions of loops, frames that they tie, forces that they carry."""
    closure = system.closure(at.t, at.y, at.v)
    found = {f"loop {name}": getattr(closure, name) for name in ("violation", "rate", "bias", "rows")}
    order = _inner_first(system.mechanism.loops)
    for part in ("pose", "rows", "twist", "bias"):
        frames = system.bare.frames(at.t, at.y, at.v)
        found[f"frame {part}"] = np.array([getattr(frames[k], part) for k in order])
    forces = system.loop_forces(at.t, at.y, at.v)
    for part in ("force", "moment"):
        found[f"loop {part}s"] = np.array([getattr(force, part) for force in forces])
    return found


def _inner_first(loops: Iterable[Loop]) -> list[int]:
    """Places among `loop_ends`, which has the outer end of a loop first, in the order of the tables."""
    order: list[int] = []
    for loop in loops:
        here = [len(order) + k for k in range(len(loop_ends([loop])))]
        order += reversed(here)
    return order


def closed(at: State, frozen: Values) -> State:
    """Where `outputs` are stored: the loops closed, which else loses twice the digits of their condition."""
    return replace(at, y=frozen["closed y"], v=frozen["closed v"]) if "closed y" in frozen else at


def in_frozen_modes(system: QuasiStatic, frozen: Values) -> QuasiStatic:
    """The same equations in the slow and static modes of a table: those of another eigensolver differ."""
    modes = StaticModes(**{field.name: frozen[f"modes {field.name}"] for field in fields(StaticModes)})
    return QuasiStatic(system.mechanism, system.inner, system.light, modes, 1.0)


_DISTURBANCES = 12  # where rows of a loop depend on others, few of them show how far its forces move


def disturbed(system: Any, at: State) -> Values:
    """Ten times what disturbances of a state by 1e-14 of its largest entry do to `outputs`: what closing a loop makes of
    rounding, which sums of terms leave to entries that are zero, too.
    """
    rng, reference = np.random.default_rng(1), outputs(system, at)
    result = dict.fromkeys(reference, 0.0)
    for _ in range(_DISTURBANCES):
        y, v = (x + 1e-14 * np.abs(x).max(initial=0.0) * rng.uniform(-1, 1, len(x)) for x in (at.y, at.v))
        for name, values in outputs(system, replace(at, y=y, v=v)).items():
            result[name] = max(result[name], 10 * float(np.abs(values - reference[name]).max(initial=0.0)))
    return {name: np.array(size) for name, size in result.items()}


def compare(
    found: Values, frozen: Values, limit: float, free: int, rounding: Values | None = None
) -> list[str]:
    """What differs from a table, by name.

    Parameters
    ----------
    found, frozen : dict
        Quantities of a state; those in ``found`` are compared.
    limit : float
        Of the largest entry of a quantity, in the residual that of joints and modes each, of conditions of closed
        loops that of the frames that they compare. An acceleration may differ
        by more where the mass matrix makes no more than that share of its forces of the difference: a matter of the
        matrix's condition.
    free : int
        Coordinates of joints, which come first.
    rounding : dict, optional
        See `disturbed`; what quantities may differ by besides.
    """
    wrong: list[str] = []
    for name, values in found.items():
        if name not in frozen:
            wrong.append(f"{name}: is not in the table")
            continue
        expected = frozen[name]
        if values.shape != expected.shape:
            wrong.append(f"{name}: shape {values.shape} instead of {expected.shape}")
            continue
        if name == "acceleration" and np.abs(values - expected).max(initial=0.0) > limit * np.abs(expected).max():
            mass = frozen["mass"]
            pairs = [(mass @ (values - expected), np.abs(mass) @ np.abs(expected), 0)]
        elif name == "residual":
            pairs = [(part - other, other, k) for k, part, other in _halves(values, expected, free)]
        else:
            pairs = [(values - expected, frozen[_DIFFERENCES.get(name, name)], 0)]
        for difference, scale, start in pairs:
            size = float(np.abs(scale).max(initial=0.0))
            if np.abs(difference).max(initial=0.0) <= limit * size + float((rounding or {}).get(name, 0.0)):
                continue
            place = np.unravel_index(int(np.nanargmax(np.abs(difference))), difference.shape)
            at = (int(place[0]) + start, *(int(k) for k in place[1:]))
            share = float(np.abs(difference[place])) / (size or 1.0)
            pair = f"{values[at]:.17g} instead of {expected[at]:.17g}"
            wrong.append(f"{name}{list(at)}: {pair}, {share:.1e} of its scale")
    return wrong


def _halves(values: np.ndarray, expected: np.ndarray, free: int) -> Iterator[tuple[int, np.ndarray, np.ndarray]]:
    yield 0, values[:free], expected[:free]
    yield free, values[free:], expected[free:]


def freeze(table: Table, folder: Path) -> Values:
    """The entries of a table by the present equations."""
    result: Values = {}
    for case in table.cases:
        system = table.build(folder, case)
        for k, at in enumerate(table.states(system, case)):
            found = {**{name: np.array(getattr(at, name)) for name in INPUTS}, **functions(system, at)}
            if isinstance(system, ClosedChain):
                found["closed y"], found["closed v"] = system.closed(at.t, at.y, at.v)
                at = closed(at, found)
            found.update(outputs(system, at))
            rows = np.tril_indices(len(found["mass"]))
            found["mass"] = found["mass"][rows]
            if isinstance(system, QuasiStatic):
                found.update({f"modes {f.name}": getattr(system.modes, f.name) for f in fields(StaticModes)})
            result.update({f"{case}/{k}/{name}": values for name, values in found.items()})
    return result


def read(table: str) -> dict[str, list[tuple[State, Values]]]:
    """The states of every case of a table, with what was found there."""
    result: dict[str, list[tuple[State, Values]]] = {}
    with np.load(FOLDER / f"{table}.npz") as file:
        for case in TABLES[table].cases:
            states = sorted({name.split("/")[1] for name in file.files if name.startswith(f"{case}/")})
            for k in states:
                start = f"{case}/{k}/"
                found = {name[len(start) :]: file[name] for name in file.files if name.startswith(start)}
                t, y, v, a = (found.pop(name) for name in INPUTS)
                mass = np.zeros((len(y), len(y)))
                mass[np.tril_indices(len(y))] = found["mass"]
                found["mass"] = mass + np.tril(mass, -1).T
                result.setdefault(case, []).append((State(float(t), y, v, a), found))
    return result


if __name__ == "__main__":
    for chosen in sys.argv[1:] or TABLES:
        with tempfile.TemporaryDirectory() as place:
            np.savez_compressed(FOLDER / f"{chosen}.npz", **freeze(TABLES[chosen], Path(place)))
