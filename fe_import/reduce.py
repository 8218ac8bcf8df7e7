"""The one door of the package: a link description in, a modal model (and file) out."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from fe_import.description.link import LinkFile, load_link
from fe_import.description.records import Material
from fe_import.errors import FEImportError
from fe_import.files.toml import choose
from fe_import.files.versions import package_version
from fe_import.health.materials import check_materials
from fe_import.health.matrix_scale import speed_of_sound
from fe_import.health.mechanisms import NOT_CLEAR, mechanism
from fe_import.health.plausibility import (
    SOUND_IN_CONDENSED,
    SOUND_IN_MATRICES,
    plausible_link,
    plausible_masses,
    plausible_materials,
    refuse_slips,
)
from fe_import.health.report import (
    RIGID,
    ROUNDING,
    check_basis,
    check_completeness,
    check_model,
    check_reduction,
    mode_residuals,
)
from fe_import.health.static_flexibility import check_static
from fe_import.health.thermal_expansion import check_expansion
from fe_import.health.thickness import plausible_thickness
from fe_import.modal.damping import damping_ratios
from fe_import.modal.equal_frequencies import KEPT_WHOLE
from fe_import.modal.inertia import inertia_invariants, mass_properties
from fe_import.modal.model import NO_LIMIT, HealthCheck, ModalModel
from fe_import.model import Array, FEModel, IntArray
from fe_import.models.model import build_model, unit_factors
from fe_import.recovery.recover import recovery_maps, thermal_expansion
from fe_import.reduction import REDUCTIONS, Basis
from fe_import.reduction.modes import mode_kinds, mode_shapes, orthonormal_modes, reduced_matrices
from fe_import.reduction.thermal import with_thermal_shape
from fe_import.second_order.compute import second_order
from fe_import.solver import chosen_solver
from fe_import.solver.dense import MECHANISM, singular_matrix
from fe_import.solver.watch import say, telling

_FEW = 300  # rows that a condensed matrix may have, however sparse it is
_CONDENSED = 0.5  # share of entries from which on a matrix is a condensed one


def reduce_link(link: LinkFile | Path | str, tell: Callable[[str], None] | None = None) -> ModalModel:
    """Reduce the finite-element model of a link.

    Parameters
    ----------
    link : LinkFile, Path or str
        A link description, or its file.
    tell : callable, optional
        Gets a message when a long computation begins, with the memory and time that it takes, and on its way.

    Returns
    -------
    ModalModel

    Raises
    ------
    FEImportError
        A faulty description, mesh or model.

    Examples
    --------
    >>> from fe_import import reduce_link
    >>> modal = reduce_link("data/l_shape/links/steel_tall.toml")
    >>> modal.elastic_modes
    18
    >>> round(modal.mass_properties.mass, 6)
    2.34
    """
    if not isinstance(link, LinkFile):
        link = load_link(link)
    with telling(tell):
        return reduce_model(build_model(link), link)


def reduce_model(model: FEModel, link: LinkFile) -> ModalModel:
    """Reduce a model as the description of its link says. See `reduce_link`."""
    try:
        return _reduced(model, link)
    except FEImportError as problem:
        slender, loose = problem.message.startswith(ROUNDING), problem.message.startswith(RIGID)
        if (slender or loose or MECHANISM in problem.message) and (found := mechanism(model)):
            if slender and found != NOT_CLEAR:  # a mechanism has the frequency 0, so that rounding is all of it
                raise singular_matrix(f"stiffness of the link, {found}") from None
            problem.message += "" if slender else f" ({found})"
        raise


def _reduced(model: FEModel, link: LinkFile) -> ModalModel:
    where, options, wanted = str(link.path), link.description.reduction, link.description.recovery
    choose(options.method, REDUCTIONS, f"{where}: reduction.method")
    units = unit_factors(link.description, where)
    materials = {**link.description.materials, **{name: Material(*m) for name, m in model.materials.items()}}
    unusual = link.description.units.unusual
    size = float(np.linalg.norm(np.ptp(model.nodes, axis=0)))
    checks = (*plausible_materials(materials, *units, where), *check_materials(materials, *units))
    checks += plausible_thickness(link.description, size, units[0], where)
    checks = refuse_slips(checks, unusual, where) + check_model(model, where)
    refuse_slips(_unit_checks(model, np.zeros(0), where), unusual, where)  # named before the work is done
    basis = with_thermal_shape(model, REDUCTIONS[options.method](model, options, where))
    held, basis = basis.held, replace(basis, held=None)
    mass, stiffness = reduced_matrices(model, basis)
    interfaces, inboard = basis.vectors[model.interface_dofs], _inboard(model, options.inboard)
    modes = orthonormal_modes(mass, stiffness, basis, options, interfaces, where, inboard)
    basis_checks = check_basis(model, basis, mass, stiffness, modes.omega, where)
    rounding = basis_checks[0].value
    checks += basis_checks
    shapes, modes = mode_shapes(model, basis, modes)
    counts = [text for text in ((basis.selection or {}).get("whole", ""), modes.told) if text]
    for text in counts:
        say(text)
    told = {KEPT_WHOLE: "; ".join(counts)} if counts else {}
    invariants = inertia_invariants(model.mass, shapes, model.dof_map, modes.rigid)
    reduced_stiffness = shapes.T @ (model.stiffness @ shapes)
    reference = modes.flexibility if basis.flexibility is None else basis.flexibility
    promised = options.static_correction or basis.flexibility is not None
    checks += check_static(reference, shapes[model.interface_dofs], modes.omega, promised)
    thermal = thermal_expansion(model, shapes, wanted, where)
    checks += check_expansion(model, None if thermal is None else thermal.force, modes.omega)
    checks += check_reduction(model, shapes, reduced_stiffness, modes.omega, invariants, rounding, where)
    checks += refuse_slips(_unit_checks(model, modes.omega, where), unusual, where)
    checks += _mesh_checks(model, link, shapes, modes.omega)
    residuals = mode_residuals(model, shapes, modes.omega, held)
    kinds = mode_kinds(model, shapes, basis, modes.coordinates, stiffness)
    field, statement = None, "not available in physical form"
    if options.form == "physical":
        shapes, reduced_stiffness = basis.vectors, stiffness
        invariants = inertia_invariants(model.mass, shapes, model.dof_map, basis.rigid)
        omega, kinds = _physical_table(basis)
        damping, residuals = np.zeros(len(omega)), np.zeros(len(omega))
    else:
        omega = modes.omega
        reduced_stiffness = np.diag(omega**2)
        damping = damping_ratios(link.description.damping, omega, where)
        field, statement = second_order(model, shapes, inboard, held)
    del held  # and the factors with it
    checks += check_completeness(model, modes.omega)
    rigid = model.rigid_body_modes()
    turning = np.flatnonzero(model.dof_map[:, 3] >= 0)
    return ModalModel(
        name=model.name,
        form=options.form,
        nodes=model.nodes,
        node_names=model.node_names,
        translation_shapes=_nodal(shapes, model.dof_map[:, :3]),
        rotation_nodes=turning,
        rotation_shapes=_nodal(shapes, model.dof_map[turning, 3:]),
        interface_nodes=model.interface_nodes,
        stiffness=reduced_stiffness,
        invariants=invariants,
        frequencies_hz=omega / (2 * np.pi),
        kinds=kinds,
        damping_ratios=damping,
        residuals=residuals,
        full_mass_properties=mass_properties(rigid.T @ (model.mass @ rigid)),
        fixed_interface=basis.fixed_interface,
        health=checks,
        lines=model.lines,
        triangles=model.triangles,
        heights=_heights(model),
        provenance={**provenance(link, model, basis.selection), "second_order": statement, **told},
        second_order=field,
        recovery=None if wanted is None else recovery_maps(model, shapes, wanted, where),
        thermal=thermal,
    )


def _heights(model: FEModel) -> Array:
    """(n, 2) of shells above the nodes; nodes that couplings add have none."""
    if model.kind != "shell":
        return np.zeros((0, 2))
    from fe_import.elements.shell_stress import ShellStress  # frames have no use for it

    assert isinstance(model.stress, ShellStress)
    found = np.zeros((len(model.nodes), 2))
    own = model.stress.heights
    found[: len(own)] = own
    return found


def _mesh_checks(model: FEModel, link: LinkFile, shapes: Array, omega: Array) -> tuple[HealthCheck, ...]:
    if model.kind == "matrices":
        return (HealthCheck("error by the mesh: not judged, as matrices have no elements", 1.0, NO_LIMIT),)
    solid, shell = link.description.solid, link.description.shell
    if solid is None and shell is None:
        return ()
    from fe_import.elements.mixed_stress import MixedStress  # frames have no use for it
    from fe_import.elements.shell_stress import ShellStress
    from fe_import.elements.solid_stress import SolidStress
    from fe_import.health.incompressible import check_incompressible
    from fe_import.health.mesh_error import check_mesh_error
    from fe_import.health.mesh_shape import check_mesh_shape

    sources = model.stress.parts if isinstance(model.stress, MixedStress) else (model.stress,)
    known = [source for source in sources if isinstance(source, (SolidStress, ShellStress))]
    checks: tuple[HealthCheck, ...] = ()
    if isinstance(known[0], SolidStress):
        checks = (*check_mesh_shape(known[0].mesh), *check_incompressible(known[0]))
    asked = solid or shell
    assert asked is not None
    return (*checks, *check_mesh_error(model, known, shapes, omega, asked.mesh_error, str(link.path)))


def _unit_checks(model: FEModel, omega: Array, where: str) -> tuple[HealthCheck, ...]:
    rigid = model.rigid_body_modes()
    mass = mass_properties(rigid.T @ (model.mass @ rigid)).mass
    first = float(omega[6] / (2 * np.pi)) if len(omega) > 6 else None
    checks = plausible_link(model.nodes, mass, first, model.kind == "matrices", where)
    if model.added_mass is not None and (added := float(rigid[:, 0] @ (model.added_mass @ rigid[:, 0]))):
        checks += (plausible_masses(added, mass - added),)
    if model.kind != "matrices" or (speed := speed_of_sound(model)) is None:
        return checks
    rows = np.count_nonzero(model.dof_map >= 0)
    whole = rows > _FEW and model.stiffness.nnz < _CONDENSED * rows**2
    kind = SOUND_IN_MATRICES if whole else SOUND_IN_CONDENSED
    return (*checks, kind.check(speed, f"{where}: units"))


def _nodal(shapes: Array, rows: IntArray) -> Array:
    """(nodes, 3, m) from rows of the shapes."""
    return np.ascontiguousarray(shapes[rows.ravel()].reshape(len(rows), 3, shapes.shape[1]))


def _inboard(model: FEModel, name: str) -> int:
    """Number of the inboard interface; the first unless named."""
    return [i.name for i in model.interface_nodes].index(name) if name else 0


def _physical_table(basis: Basis) -> tuple[Array, tuple[str, ...]]:
    """Frequencies [rad/s] and kinds of the columns of the basis."""
    fixed = 2 * np.pi * basis.fixed_interface.frequencies_hz
    count = basis.vectors.shape[1] - len(fixed)
    kind = "interface displacement" if basis.interface_columns else "nodal displacement"
    return np.concatenate([np.zeros(count), fixed]), (kind,) * count + ("fixed-interface",) * len(fixed)


def provenance(link: LinkFile, model: FEModel, selection: dict[str, Any] | None = None) -> dict[str, str]:
    """Where a modal file came from: source, content hash, versions, method, options, how modes were selected."""
    packages = ("erls", "numpy", "scipy", "scikit-fem", "meshio")
    options = msgspec.to_builtins(link.description.reduction)
    return {
        "source": link.path.name,
        "sha256": link.content_hash(),
        "dofs": str(len(model.independent)),
        "interface_dofs": str(len(model.interface_dofs)),
        "kind": model.kind,
        "method": options["method"],
        "solver": chosen_solver().name,
        "options": json.dumps(options, sort_keys=True),
        **({"selection": json.dumps(selection, sort_keys=True)} if selection else {}),
        **{f"source: {key}": text for key, text in model.notes.items()},
        **({"left out": json.dumps(model.left_out)} if model.left_out else {}),
        "versions": ", ".join(f"{p} {package_version(p)}" for p in packages),
    }


def reduction_summary(model: ModalModel) -> dict[str, Any]:
    """The JSON of ``erls reduce`` without what only the command knows."""
    properties = model.mass_properties
    return {
        "link": model.name,
        "method": model.provenance.get("method", ""),
        "solver": model.provenance.get("solver", ""),
        "form": model.form,
        "dofs": int(model.provenance.get("dofs", 0)),
        "interface_dofs": int(model.provenance.get("interface_dofs", 0)),
        "elastic_modes": model.elastic_modes if model.form == "orthonormal" else None,
        "frequencies_hz": model.frequencies_hz[6:].tolist() if model.form == "orthonormal" else [],
        "mass": properties.mass,
        "centre_of_mass": properties.centre_of_mass.tolist(),
        "inertia": properties.inertia.tolist(),
        "recovery": None
        if model.recovery is None
        else {
            "quantity": model.recovery.quantity,
            "places": len(model.recovery.nodes),
            "megabytes": model.recovery.megabytes,
        },
        "health": {
            "ok": all(c.ok for c in model.health),
            "checks": [
                {"name": c.name, "value": c.value, "limit": c.limit if c.judged else None, "ok": c.ok}
                for c in model.health
            ],
        },
    }
