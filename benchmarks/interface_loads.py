"""Interface loads and stress at the clamp of a step-loaded L: how many modes they need, corrected and not.

    python benchmarks/interface_loads.py [--solid]

The L (data/l_shape/links/steel_tall.toml; with --solid also links/solid.toml) is clamped at its root; a force on its
tip jumps from zero to (1, 1, 1) N and stays. Damping is proportional to the stiffness, 1 % at the first frequency.
Every model is linear here, so that its motion is a sum of decaying oscillations, exact in time. The reference is the
full finite-element model. Errors: largest value over time against that of the reference, of the force and the moment
that the clamp exerts (their size) and of the stress near it (frame: N / A + |M_y| / W_y + |M_z| / W_z at the clamped
end; solid: von Mises stress at all nodes of the clamped face).

    free               lowest free modes; stress of the kept modes, uncorrected
    free + others      the same motion; the modes left out add their static stress under the loads of clamp and tip
    clamped            truncation = "clamped"; stress of the kept modes
    clamped + others   the same motion; the modes left out add theirs
    static             static_correction = true: the kept modes span the static response to interface loads

The clamp's loads follow from equilibrium, so recovery cannot better them: what is left in "free + others" is the error
of the motion.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray

from fe_import.description.link import LinkFile, load_link
from fe_import.description.records import Recovery
from fe_import.modal.model import ModalModel
from fe_import.modal.recovery_maps import von_mises
from fe_import.model import FEModel
from fe_import.models.model import build_model
from fe_import.recovery.recover import chosen_sites, mode_acceleration
from fe_import.reduce import reduce_model

Array = NDArray[np.float64]
Fibre = Callable[[Array], Array]  # (times, places, 6) components -> (times, places) stress

LINKS = Path(__file__).parents[1] / "data" / "l_shape" / "links"
FORCE = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
MODES = (4, 6, 8, 10, 12, 14, 16, 18, 24)
FIXED_MODES = 30  # of the Craig-Bampton basis from which all models are truncated


@dataclass(frozen=True)
class Case:
    """A link, where its stress is looked at, and what of it."""

    link: LinkFile
    fibre: Fibre


@dataclass(frozen=True)
class History:
    """What the clamp exerts (times, 6) and the components of stress or section forces (times, places, 6)."""

    clamp: Array
    components: Array


def frame_case() -> Case:
    """The tall L: stress in the outermost fibre of its 0.01 m x 0.03 m section at the root."""
    width, height = 0.01, 0.03
    area = width * height

    def fibre(c: Array) -> Array:
        bending = np.abs(c[..., 4]) / (area * height / 6) + np.abs(c[..., 5]) / (area * width / 6)
        return np.asarray(np.abs(c[..., 0]) / area + bending)

    return Case(_with(load_link(LINKS / "steel_tall.toml"), nodes=["root"]), fibre)


def solid_case() -> Case:
    """The flat L of hexahedra: von Mises stress on the clamped face."""
    return Case(_with(load_link(LINKS / "solid.toml"), sets=["IFA"]), von_mises)


def _with(link: LinkFile, **recovery: list[str]) -> LinkFile:
    return LinkFile(link.path, msgspec.structs.replace(link.description, recovery=Recovery(**recovery)))


def reduced(model: FEModel, link: LinkFile, modes: int, truncation: str, static_correction: bool) -> ModalModel:
    """The link with so many elastic modes."""
    options = msgspec.structs.replace(
        link.description.reduction,
        elastic_modes=modes,
        fixed_interface_modes=FIXED_MODES,
        truncation=truncation,
        static_correction=static_correction,
    )
    return reduce_model(model, LinkFile(link.path, msgspec.structs.replace(link.description, reduction=options)))


def oscillations(omega: Array, forces: Array, beta: float, times: Array) -> tuple[Array, Array, Array]:
    """Displacement, velocity and acceleration (times, n) of η̈ + β ω² η̇ + ω² η = p, from rest at time 0."""
    zeta = beta * omega / 2
    with np.errstate(invalid="ignore", divide="ignore"):
        root = np.sqrt((zeta**2 - 1).astype(complex))  # imaginary when it oscillates
        s1, s2 = omega * (-zeta + root), omega * (-zeta - root)
        static = forces / omega**2
        e1, e2 = np.exp(np.outer(times, s1)), np.exp(np.outer(times, s2))
        a, b = s2 / (s1 - s2) * static, -s1 / (s1 - s2) * static
    y = static + a * e1 + b * e2
    v = a * s1 * e1 + b * s2 * e2
    acceleration = a * s1**2 * e1 + b * s2**2 * e2
    return y.real, v.real, acceleration.real


def full_history(model: FEModel, recovery: Recovery, beta: float, times: Array) -> History:
    """The full model with its first interface clamped."""
    mass, stiffness = model.reduced_matrices()
    place = np.full(model.mass.shape[0], -1)
    place[model.independent] = np.arange(len(model.independent))
    clamped, loaded = place[model.interface_dofs[:6]], place[model.interface_dofs[6:12]]
    free = np.setdiff1d(np.arange(len(place[model.independent])), clamped)
    m, k = mass.toarray(), stiffness.toarray()
    squared, modes = la.eigh(k[np.ix_(free, free)], m[np.ix_(free, free)])
    shapes = np.zeros((len(m), len(squared)))
    shapes[free] = modes
    y, v, a = oscillations(np.sqrt(squared), shapes[loaded].T @ FORCE, beta, times)
    held_mass, held_stiffness = m[clamped] @ shapes, k[clamped] @ shapes
    clamp = a @ held_mass.T + (y + beta * v) @ held_stiffness.T
    fields = shapes if model.coupling is None else np.asarray(model.coupling @ shapes)
    assert model.stress is not None
    sites = chosen_sites(model, model.stress, recovery, model.source)
    maps = model.stress.evaluate(fields, model.dof_map, sites)
    return History(clamp, np.tensordot(y, maps, (1, 2)))


def modal_history(modal: ModalModel, beta: float, times: Array, corrected: bool) -> History:
    """A reduced model with its first interface clamped: Φ_A q = 0."""
    maps = modal.recovery
    assert maps is not None
    interfaces = np.vstack([part for i in modal.interface_nodes for part in modal.node_shape(i.node)])
    held, loaded = interfaces[:6], interfaces[6:12]
    basis = la.null_space(held / np.linalg.norm(held, axis=1)[:, None])
    squared, turn = la.eigh(basis.T @ modal.stiffness @ basis, basis.T @ modal.invariants.m @ basis)
    shapes = basis @ turn
    y, _, a = oscillations(np.sqrt(squared), shapes.T @ (loaded.T @ FORCE), beta, times)
    # the six rigid-body equations: nothing but the loads accelerates them
    rigid = modal.invariants.m[:6] @ shapes
    clamp = np.linalg.solve(held[:, :6].T, rigid @ a.T - (loaded[:, :6].T @ FORCE)[:, None]).T
    if not corrected:
        return History(clamp, np.tensordot(y @ shapes.T, maps.modes, (1, 2)))
    modes, per_load, _, _ = mode_acceleration(modal)
    loads = np.hstack([clamp, np.tile(FORCE, (len(times), 1))])
    return History(clamp, np.tensordot(y @ shapes.T, modes, (1, 2)) + np.tensordot(loads, per_load, (1, 2)))


def peaks(history: History, fibre: Fibre) -> Array:
    """(3,) largest force [N], moment [N m] and stress [Pa] over time."""
    clamp = history.clamp
    return np.array(
        [
            np.linalg.norm(clamp[:, :3], axis=1).max(),
            np.linalg.norm(clamp[:, 3:], axis=1).max(),
            fibre(history.components).max(),
        ]
    )


def first_frequency(model: FEModel, link: LinkFile) -> float:
    """Lowest circular frequency with the first interface clamped [rad/s]."""
    modal = reduced(model, link, 24, "clamped", False)
    held = np.vstack(modal.node_shape(modal.interface_nodes[0].node))
    basis = la.null_space(held / np.linalg.norm(held, axis=1)[:, None])
    return float(np.sqrt(la.eigh(basis.T @ modal.stiffness @ basis, basis.T @ modal.invariants.m @ basis)[0][0]))


WAYS = {  # truncation, static correction of the reduction, of the recovery
    "free": ("free-free", False, False),
    "free + others": ("free-free", False, True),
    "clamped": ("clamped", False, False),
    "clamped + others": ("clamped", False, True),
    "static": ("free-free", True, False),
}


def errors(case: Case, modes: Sequence[int] = MODES) -> dict[str, dict[int, Array]]:
    """Relative errors (force, moment, stress) of each way for each number of elastic modes it can have."""
    model = build_model(case.link)
    omega = first_frequency(model, case.link)
    beta, times = 0.02 / omega, np.linspace(0.0, 6 * np.pi / omega, 6001)
    wanted = case.link.description.recovery
    assert wanted is not None
    reference = peaks(full_history(model, wanted, beta, times), case.fibre)
    result: dict[str, dict[int, Array]] = {way: {} for way in WAYS}
    for way, (truncation, static_correction, corrected) in WAYS.items():
        for count in modes:
            if static_correction and count < 12:  # the static responses alone are six per interface
                continue
            modal = reduced(model, case.link, count, truncation, static_correction)
            found = peaks(modal_history(modal, beta, times, corrected), case.fibre)
            result[way][count] = np.abs(found / reference - 1)
    return result


def main() -> None:
    """Print one table for each link."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--solid", action="store_true", help="the solid L as well")
    cases = {"steel_tall": frame_case}
    if parser.parse_args().solid:
        cases["solid"] = solid_case
    for name, make in cases.items():
        found = errors(make())
        print(f"{name}: error of the largest clamp force, moment and stress [%]")
        print("modes  " + "  ".join(f"{way:>22s}" for way in found))
        for count in MODES:
            cells = [
                " ".join(f"{100 * e:7.2f}" for e in row[count]) if count in row else "-" for row in found.values()
            ]
            print(f"{count:5d}  " + "  ".join(f"{cell:>22s}" for cell in cells), flush=True)


if __name__ == "__main__":
    main()
