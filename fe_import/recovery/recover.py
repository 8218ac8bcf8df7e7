"""Recovery maps of a reduction, and mode acceleration with them (see `fe_import.modal.recovery_maps`)."""

from __future__ import annotations

import numpy as np

from fe_import.description.records import Recovery
from fe_import.errors import Cause, FEImportError
from fe_import.files.toml import as_spelt, choose
from fe_import.modal.inertia import turned
from fe_import.modal.model import ModalModel
from fe_import.modal.recovery_maps import SPIN_PAIRS, RecoveryMaps
from fe_import.modal.thermal import ThermalExpansion
from fe_import.model import Array, FEModel, IntArray, StressSource
from fe_import.reduction.free_body import inertia_relief


def recovery_maps(model: FEModel, shapes: Array, wanted: Recovery, where: str) -> RecoveryMaps:
    """Stress or section forces per unit modal coordinate, interface load and squared angular velocity.

    Parameters
    ----------
    model : FEModel
    shapes : (d, m) array
        Mass-orthonormal modes over all nodal components, six rigid-body ones first.
    wanted : Recovery
        Table ``recovery`` of the link description.
    where : str
        Name of its file, for messages.

    Raises
    ------
    FEImportError
        BAD_FIELD: the model has no elements, or nothing is chosen; BAD_REFERENCE: an unknown node or set.
    """
    source = model.stress
    if source is None:
        raise FEImportError(
            Cause.BAD_FIELD,
            "a link of bare matrices has no elements, so stress cannot be recovered",
            where=f"{where}: recovery",
            remedy="remove the table, or give the link as 'frame' or 'solid'",
        )
    sites = chosen_sites(model, source, wanted, where)
    loads = np.zeros((len(shapes), len(model.interface_dofs)))
    loads[model.interface_dofs, np.arange(loads.shape[1])] = 1.0
    modal = model.mass @ shapes[:, 6:]
    static = inertia_relief(model, np.hstack([modal, loads, _centrifugal_loads(model)]))
    found = source.evaluate(np.hstack([shapes[:, 6:], static]), model.dof_map, sites)
    count = shapes.shape[1] - 6
    elastic, inertia, forces, spin = np.split(found, np.cumsum([count, count, loads.shape[1]]), axis=2)
    none = np.zeros((len(sites), 6, 6))
    return RecoveryMaps(
        quantity=source.quantity,
        nodes=source.site_nodes[sites],
        elements=source.site_elements(sites),
        axes=source.site_axes(sites),
        modes=np.concatenate([none, elastic], axis=2),
        inertia=np.concatenate([none, inertia], axis=2),
        loads=np.ascontiguousarray(forces),
        spin=np.ascontiguousarray(spin),
    )


def chosen_sites(model: FEModel, source: StressSource, wanted: Recovery, where: str) -> IntArray:
    """(p,) rising sites that the description asks for."""
    count = len(source.site_nodes)
    if wanted.all:
        return np.arange(count, dtype=np.int64)
    asked = np.zeros(count, dtype=bool)
    for k, name in enumerate(wanted.nodes):
        choose(name, model.node_names, f"{where}: recovery.nodes[{k}]")
        asked |= source.site_nodes == model.node_names[name]
    for k, name in enumerate(wanted.sets):
        spelt = as_spelt(name, source.sets)
        choose(spelt, source.sets, f"{where}: recovery.sets[{k}]")
        asked[source.sets[spelt]] = True
    if not asked.any():
        raise FEImportError(
            Cause.BAD_FIELD,
            "nothing to recover",
            where=f"{where}: recovery",
            remedy="name nodes or sets, give all = true, or remove the table",
        )
    return np.flatnonzero(asked)


def _centrifugal_loads(model: FEModel) -> Array:
    """(d, 6) loads per unit spin product (see `SPIN_PAIRS`): minus A_a M R_b, as in the inertia invariants."""
    momentum = model.mass @ model.rigid_body_modes()[:, 3:]
    along = [turned(momentum, model.dof_map, a) for a in range(3)]
    columns = [-along[a][:, b] if a == b else -along[a][:, b] - along[b][:, a] for a, b in SPIN_PAIRS]
    return np.stack(columns, axis=1)


def thermal_expansion(model: FEModel, shapes: Array, wanted: Recovery | None, where: str) -> ThermalExpansion | None:
    """Generalized force and section forces of expansion; None without a temperature change.

    Parameters
    ----------
    model, shapes, wanted, where
        See `recovery_maps`; without ``wanted`` there are no places.
    """
    load, source = model.thermal, model.stress
    if load is None or source is None:
        return None
    force = shapes.T @ load.force
    force[:6] = 0.0  # in balance but for rounding
    sites = np.zeros(0, dtype=np.int64) if wanted is None else chosen_sites(model, source, wanted, where)
    strained = source.evaluate(inertia_relief(model, load.force[:, None]), model.dof_map, sites)[:, :, 0]
    restrained = load.restrained[sites]
    return ThermalExpansion(load.change, force, restrained, strained + restrained)


def mode_displacement(model: ModalModel) -> tuple[Array, Array]:
    """Map (p, 6, m) of modal coordinates by mode displacement, and what temperature adds, (p, 6).

    Parameters and errors are those of `mode_acceleration`.
    """
    maps, thermal = required_maps(model, model.name), model.thermal
    warm = np.zeros(maps.modes.shape[:2]) if thermal is None else thermal.change * thermal.restrained
    return maps.modes, warm


def mode_acceleration(model: ModalModel) -> tuple[Array, Array, Array, Array]:
    """Maps of mode acceleration: (p, 6, m) of modal coordinates, (p, 6, 6 i) of loads, (p, 6, 6) of spin products; and
    what temperature adds, (p, 6).

    Parameters
    ----------
    model : ModalModel
        With recovery maps; truncated or not.

    Raises
    ------
    FEImportError
        BAD_FIELD: it holds no recovery maps.
    """
    maps = required_maps(model, model.name)
    squared = (2 * np.pi * model.frequencies_hz) ** 2
    shapes = [model.node_shape(i.node) for i in model.interface_nodes]
    interfaces = np.vstack([part for both in shapes for part in both if part is not None])
    rho = model.invariants.rigid[:, 3:]
    pull = [model.invariants.X[a].T @ rho for a in range(3)]  # modal loads of ω_a ω_b
    spin = [pull[a][:, b] if a == b else pull[a][:, b] + pull[b][:, a] for a, b in SPIN_PAIRS]
    loads = maps.loads - maps.inertia @ interfaces.T
    warm, thermal = np.zeros(maps.modes.shape[:2]), model.thermal
    if thermal is not None:
        warm = thermal.change * (thermal.relaxed - maps.inertia @ thermal.force)
    return maps.inertia * squared, loads, maps.spin - maps.inertia @ np.stack(spin, axis=1), warm


def required_maps(model: ModalModel, where: str) -> RecoveryMaps:
    """The recovery maps of a model; a model without any is refused."""
    if model.recovery is None:
        raise FEImportError(
            Cause.BAD_FIELD,
            "this link holds nothing to recover stress or section forces from",
            where=where,
            remedy="add a table [recovery] to its link description and reduce it again",
        )
    return model.recovery
