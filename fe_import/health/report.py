"""The check report of a reduction: what a careful engineer verifies before trusting a modal file.

All limits are relative. A model that fails is refused with the cause; there is no way around it, because a grounded
or indefinite link gives motions that look plausible and are wrong.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import scipy.sparse as sp

from fe_import.errors import Cause, FEImportError
from fe_import.health.rigid_motion import rigid_motion_as_eigenmodes, rigid_motion_by_stiffness
from fe_import.health.rotation_terms import rotation_departure
from fe_import.health.rounding import MOST, rounding_share
from fe_import.modal.inertia import InertiaInvariants, mass_properties
from fe_import.modal.model import NO_LIMIT, HealthCheck
from fe_import.model import Array, FEModel
from fe_import.models.measures import GROUNDING, asymmetry, grounding, negative_diagonal
from fe_import.reduction import Basis
from fe_import.reduction.base import HeldSolution
from fe_import.reduction.free_body import free_body
from fe_import.solver.sparse import modes_below

_ROUNDING = 1e-9  # symmetry, mass properties: sums of many terms of one sign in double precision
_RIGID = 1e-5  # or what rounding allows; a loose or grounded part gives 1
_RIGID_PRINTED = 1e-4  # the same with the 14 digits of exported text, which leave 1.2e-5 on the L of 100 hexahedra
_LOOSE = 0.3  # a part that moves alone departs by 1
_VALUES = 10_000_000  # of fields at a time
_MARGIN = 10  # of rounding: a motion found by solving departs by 0.3 to 2 times its share
_EIGEN = 1e-6
_TOO_SLENDER = (
    "the link is too slender for its elements: no solver finds its bending in double precision; use beams, or fewer, "
    "longer elements"
)
_EIGEN_PRINTED = 1e-5  # with the ten digits of DMIG entries, which leave 3.5e-6 on an L of 40 beams
ROUNDING = "rounding in the stiffness"
RIGID = "rigid-body"  # begin of checks that loose parts and hinges fail
_CAUSES = {
    "mass matrix": Cause.NOT_DEFINITE,
    "stiffness matrix": Cause.NOT_DEFINITE,
    "grounding": Cause.GROUNDED,
    RIGID: Cause.NOT_DEFINITE,
}


def check_model(model: FEModel, where: str) -> tuple[HealthCheck, ...]:
    """Checks of the full matrices.

    Raises
    ------
    FEImportError
        NOT_DEFINITE: asymmetric, or negative on the diagonal, or a mass matrix that gives some motion negative
        kinetic energy; GROUNDED: rigid-body motions cause forces.
    """
    symmetric = "export both triangles, or state that one is given"
    negative = "look at the signs, and at the units of masses and inertias"
    free = "a link must be free: remove supports, springs to ground and penalty stiffness from the export"
    checks = [
        (HealthCheck("mass matrix: asymmetry", asymmetry(model.mass), _ROUNDING), symmetric),
        (HealthCheck("stiffness matrix: asymmetry", asymmetry(model.stiffness), _ROUNDING), symmetric),
        (HealthCheck("mass matrix: negative diagonal", negative_diagonal(model.mass), 0.0), negative),
        (HealthCheck("stiffness matrix: negative diagonal", negative_diagonal(model.stiffness), 0.0), negative),
        (HealthCheck("grounding force of rigid-body motions", grounding(model), GROUNDING), free),
    ]
    _refuse(checks, where)
    if model.kind == "matrices":  # our own elements cannot give an indefinite mass
        count = HealthCheck("mass matrix: motions of negative kinetic energy", _negative_masses(model), 0.0)
        checks.append((count, negative))
        _refuse(checks[-1:], where)
    return tuple(check for check, _ in checks) + _massless(model) + _left_out(model)


def _massless(model: FEModel) -> tuple[HealthCheck, ...]:
    """Nodes of exported matrices that have stiffness and no mass: reported, as some are made like that."""
    if model.kind != "matrices":
        return ()
    rows = model.dof_map[(model.dof_map[:, :3] >= 0).all(axis=1), :3]
    rows = rows[np.isin(rows, model.independent).all(axis=1)]
    bare = (model.mass.diagonal()[rows] == 0).all(axis=1) & (model.stiffness.diagonal()[rows] > 0).any(axis=1)
    if not bare.any():
        return ()
    node = int(np.flatnonzero((model.dof_map[:, :3] == rows[bare][0]).all(axis=1))[0])
    place = "({:.4g}, {:.4g}, {:.4g})".format(*model.nodes[node])
    return (HealthCheck(f"nodes with stiffness and without mass, the first at {place}", float(bare.sum()), NO_LIMIT),)


def _left_out(model: FEModel) -> tuple[HealthCheck, ...]:
    """What stands in the mesh file and is not part of the link: reported, not judged."""
    if not model.left_out:
        return ()
    listed = ", ".join(f"{count} {name}" for name, count in model.left_out.items())
    return (HealthCheck(f"left out of the mesh file: {listed}", float(sum(model.left_out.values())), NO_LIMIT),)


def _negative_masses(model: FEModel) -> float:
    """Number of negative eigenvalues of the mass matrix beyond rounding; singular is legal."""
    mass, _ = model.reduced_matrices()
    diagonal = mass.diagonal()
    size = np.where(diagonal > 0, diagonal, diagonal.max(initial=0.0) or 1.0)
    return float(modes_below(mass, sp.diags_array(size).tocsc(), -1e-7) or 0)


def _refuse(checks: Iterable[tuple[HealthCheck, str]], where: str) -> None:
    """The first failed check, as an error with its cause and remedy."""
    for check, remedy in checks:
        if not check.ok:
            cause = next((c for start, c in _CAUSES.items() if check.name.startswith(start)), Cause.EIGENSOLVER)
            raise FEImportError(
                cause,
                f"{check.name} is not {'small' if check.name.startswith(ROUNDING) else 'zero'}",
                where=where,
                value=check.value,
                limit=check.limit,
                remedy=remedy,
            )


def check_basis(
    model: FEModel, basis: Basis, mass: Array, stiffness: Array, omega: Array, where: str
) -> tuple[HealthCheck, ...]:
    """Checks of the reduction basis: rigid-body motions in three ways, effective mass, completeness, conditioning.

    Parameters
    ----------
    model : FEModel
    basis : Basis
    mass, stiffness : (k, k) arrays
        Over the basis.
    omega : (m,) array
        Circular frequencies of the orthonormal modes [rad/s].
    where : str

    Raises
    ------
    FEImportError
        NOT_DEFINITE: a part of the link moves without strain, or something holds it.
    """
    least = _RIGID_PRINTED if model.kind == "matrices" else _RIGID
    rounding = rounding_share(model, float(omega[6]), where) if len(omega) > 6 else 0.0
    checks = [
        HealthCheck(f"{ROUNDING}, share of the first elastic ω²", rounding, MOST),
        HealthCheck(
            f"{RIGID} motion by stiffness against geometry",
            rigid_motion_by_stiffness(model, basis, stiffness),
            max(least, min(_MARGIN * rounding, _LOOSE)),
        ),
    ]
    _refuse([(checks[0], _TOO_SLENDER)], where)  # what follows may not have a solution then
    spent = _spent(model, rounding)
    if len(omega) > 6:
        frequency, departure = rigid_motion_as_eigenmodes(mass, stiffness, basis.rigid, float(omega[6]))
        checks += [
            HealthCheck(f"{RIGID} eigenvalues, per first elastic one", frequency, spent),
            HealthCheck(f"{RIGID} eigenmodes against geometry", departure, spent),
        ]
    carried = basis.fixed_interface.effective_mass
    if len(carried):
        least = float(carried.sum(axis=0)[:3].min())
        checks.append(HealthCheck("share of mass in fixed-interface modes, least direction", least, NO_LIMIT))
    remedy = (
        "look for loose parts, hinges, supports, matrices of another model, and for many small elements in a slender "
        "or very stiff part"
    )
    _refuse(((check, remedy) for check in checks), where)
    return (*checks, HealthCheck("condition of the basis", _condition(mass), NO_LIMIT))


def _spent(model: FEModel, rounding: float) -> float:
    """Limit of what rigid-body motions may cost, per first elastic ω²."""
    return max(_EIGEN_PRINTED if model.kind == "matrices" else _EIGEN, rounding)


def check_completeness(model: FEModel, omega: Array) -> tuple[HealthCheck, ...]:
    """How many free-free modes of the full model the basis lacks, up to a gap in the second quarter of its spectrum.

    It takes an elimination of its own: best when factors of the basis are needed no more. Frequencies of a basis are
    upper bounds, so a mode that it lacks shows in the count of the full model.
    """
    elastic = omega[6:]
    half = len(elastic) // 2
    if half < 1:
        return ()
    first = half // 2
    last = first + int(np.diff(np.log(elastic[first : half + 1])).argmax())
    limit = float(np.sqrt(elastic[last] * elastic[last + 1]))
    mass, stiffness = model.reduced_matrices()
    below = modes_below(stiffness, mass, limit**2, positions=model.dof_positions())
    if below is None:
        return ()
    name = f"free-free modes below {limit / (2 * np.pi):.5g} Hz that the basis lacks"
    return (HealthCheck(name, float(below - 6 - (last + 1)), NO_LIMIT),)


def _condition(mass: Array) -> float:
    """Of the mass matrix over the basis, its columns brought to one size; massless columns left out."""
    diagonal = np.diag(mass)
    massive = diagonal > _EIGEN**2 * diagonal.max()
    scale = 1 / np.sqrt(diagonal[massive])
    values = np.linalg.eigvalsh(mass[np.ix_(massive, massive)] * np.outer(scale, scale))
    return float(values[-1] / max(values[0], np.finfo(float).eps * values[-1]))


def mode_residuals(model: FEModel, shapes: Array, omega: Array, held: HeldSolution | None) -> Array:
    """(m,) by how much the frequencies of elastic modes are too high, as shares: ½ rᵀK⁺r / φᵀKφ, r = Kφ - ω²Mφ.

    Modes of a basis leave forces r that do no work in it, and ω² falls by the energy of what these move, as long as
    modes of the whole model that are missing lie far above; near them it falls by more. 0 for rigid-body modes.

    Parameters
    ----------
    model : FEModel
    shapes : (d, m) array
        Mass-orthonormal modes.
    omega : (m,) array
        [rad/s]
    held : HeldSolution or None
        Where there are factors already; forces in balance have the same energy in any support.
    """
    result = np.zeros(len(omega))
    held = held or free_body(model, model.source).held
    step = max(1, _VALUES // shapes.shape[0])
    for start in range(6, len(omega), step):  # fields of a large model are long
        some = slice(start, start + step)
        inertia = model.mass @ shapes[:, some] * omega[some] ** 2
        left = _independent(model, model.stiffness @ shapes[:, some] - inertia)
        result[some] = np.einsum("dk,dk->k", left, held(left, 0)) / (2 * omega[some] ** 2)
    return result.clip(min=0)


def _independent(model: FEModel, forces: Array) -> Array:
    return forces if model.coupling is None else np.asarray(model.coupling.T @ forces)


def check_reduction(
    model: FEModel,
    shapes: Array,
    stiffness: Array,
    omega: Array,
    invariants: InertiaInvariants,
    rounding: float,
    where: str,
) -> tuple[HealthCheck, ...]:
    """Checks of the reduced link against the full model; ``rounding``: the share of ω² that it may make up.

    Raises
    ------
    FEImportError
        EIGENSOLVER: rounding or a solver spoiled the modes.
    """
    rigid = model.rigid_body_modes()
    scale = np.abs(rigid).max(axis=0)
    reproduced = np.abs(shapes @ invariants.rigid - rigid).max(axis=0) / scale
    full = mass_properties(rigid.T @ (model.mass @ rigid))
    reduced = mass_properties(invariants.rigid_mass_matrix)
    size = np.linalg.norm(np.ptp(model.nodes, axis=0))
    distance = full.centre_of_mass @ full.centre_of_mass  # both inertias were moved here from the mesh origin
    inertia_scale = np.abs(full.inertia).max() + full.mass * distance
    elastic = omega[6:] ** 2
    identity, spent = np.eye(len(omega)), _spent(model, rounding)
    checks = [
        HealthCheck("modes: rigid-body motion of geometry reproduced", float(reproduced.max()), _ROUNDING),
        HealthCheck("mass against the full model", abs(reduced.mass / full.mass - 1), _ROUNDING),
        HealthCheck(
            "centre of mass against the full model, per size",
            float(np.abs(reduced.centre_of_mass - full.centre_of_mass).max() / size),
            _ROUNDING,
        ),
        HealthCheck(
            "inertia against the full model",
            float(np.abs(reduced.inertia - full.inertia).max() / inertia_scale),
            _ROUNDING,
        ),
        HealthCheck("orthonormality of the modes", float(np.abs(invariants.m - identity).max()), _ROUNDING),
    ]
    if len(elastic):
        strain = np.abs(np.diag(stiffness)[:6]).max() / elastic[0]
        spread = np.abs(np.diag(stiffness)[6:] / elastic - 1).max()
        checks += [
            HealthCheck(f"strain energy of {RIGID} modes, per first elastic mode", float(strain), spent),
            HealthCheck("Rayleigh quotients against squared frequencies", float(spread), max(_EIGEN, rounding)),
        ]
    if model.kind == "matrices":  # of a superelement only the kept nodes are known
        name = "centrifugal terms against those of a rigid body"
        checks.append(HealthCheck(name, rotation_departure(invariants), NO_LIMIT))
    _refuse(((check, "ask for fewer modes, or look for very stiff, light or heavy parts") for check in checks), where)
    return tuple(checks)
