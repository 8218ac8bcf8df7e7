"""From a link description to its finite-element model (SI, free, with interface nodes)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from fe_import.description.link import LinkFile
from fe_import.description.records import LinkDescription, PointMass
from fe_import.errors import Cause, FEImportError
from fe_import.files.toml import choose
from fe_import.model import Array, FEModel, IntArray
from fe_import.models.frame import frame_model, node_number
from fe_import.models.inertia import inertia_matrix

_LENGTH = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254, "ft": 0.3048}
_POUND = 0.45359237
_POUND_FORCE = _POUND * 9.80665
_MASS = {
    "kg": 1.0,
    "g": 1e-3,
    "t": 1e3,
    "lb": _POUND,
    "slug": _POUND_FORCE / 0.3048,
    "lbf*s2/in": _POUND_FORCE / 0.0254,
}
_TIME = {"s": 1.0, "ms": 1e-3}


def build_model(link: LinkFile) -> FEModel:
    """Assemble the model that a description states, in SI units.

    Raises
    ------
    FEImportError
        A faulty section, node, set, interface or mesh.
    """
    description, where = link.description, str(link.path)
    if description.frame is not None:
        model = frame_model(description, description.frame, where)
    elif description.matrices is not None:
        from fe_import.models.matrices import matrices_model

        model = matrices_model(link)
    else:
        from fe_import.models.meshed import meshed_model  # scikit-fem and meshio are heavy

        model = meshed_model(link)
    model = add_masses(model, description.masses, where)
    return to_si(model, description, where)


def add_masses(model: FEModel, masses: list[PointMass], where: str) -> FEModel:
    """Point masses and inertias on nodes or interfaces.

    Raises
    ------
    FEImportError
        An unknown node, an inertia on a node without rotations, or an inertia that is not positive semidefinite.
    """
    if not masses:
        return model
    names = {**{i.name: i.node for i in model.interface_nodes}, **model.node_names}
    rows: list[IntArray] = []
    blocks: list[Array] = []
    for k, point in enumerate(masses):
        place = f"{where}: masses[{k}]"
        node = node_number(names, point.node, f"{place}.node")
        interface = next((i for i in model.interface_nodes if i.name == point.node), None)
        if interface is not None and interface.node != node:
            raise FEImportError(
                Cause.BAD_REFERENCE,
                "both a node and an interface elsewhere have this name",
                where=f"{place}.node",
                value=point.node,
                remedy="rename one of the two",
            )
        inertia = inertia_matrix(point.inertia, f"{place}.inertia")
        dofs = model.dof_map[node]
        if inertia.any() and (dofs < 0).any():
            raise FEImportError(
                Cause.BAD_FIELD,
                "this node has no rotations, so it cannot carry an inertia",
                where=f"{place}.inertia",
                value=point.inertia,
                remedy="put the inertia on an interface",
            )
        block = np.zeros((6, 6))
        block[:3, :3] = point.mass * np.eye(3)
        block[3:, 3:] = inertia
        keep = dofs >= 0
        rows.append(dofs[keep])
        blocks.append(block[np.ix_(keep, keep)])
    i = np.concatenate([np.repeat(r, len(r)) for r in rows])
    j = np.concatenate([np.tile(r, len(r)) for r in rows])
    added = sp.coo_array((np.concatenate([b.ravel() for b in blocks]), (i, j)), shape=model.mass.shape).tocsc()
    return replace(model, mass=(model.mass + added).tocsc(), added_mass=added)


def unit_factors(link: LinkDescription, where: str) -> tuple[float, float, float]:
    """The description's units of length, mass and time in m, kg and s.

    Raises
    ------
    FEImportError
        An unknown unit.
    """
    u = link.units
    for name, value, table in (("length", u.length, _LENGTH), ("mass", u.mass, _MASS), ("time", u.time, _TIME)):
        choose(value, table, f"{where}: units.{name}")
    return _LENGTH[u.length], _MASS[u.mass], _TIME[u.time]


def to_si(model: FEModel, link: LinkDescription, where: str) -> FEModel:
    """Convert a model from the units of its description.

    Displacements scale with the length unit, rotations do not; forces with mass · length / time². Modal coordinates of
    a superelement count as displacements: their scale is free, and energies come out in joules.
    """
    length, mass, time = unit_factors(link, where)
    if length == mass == time == 1:
        return model
    force = mass * length / time**2
    scale = np.ones(model.mass.shape[0])
    turning = model.dof_map[:, 3:]
    scale[turning[turning >= 0]] = length
    d = sp.diags_array(scale).tocsc()
    inverse = sp.diags_array(1 / scale).tocsc()

    def convert(matrix: sp.csc_array, factor: float) -> sp.csc_array:
        return (d @ matrix @ d * factor).tocsc()

    # coupling: displacement per rotation is a length
    coupling = model.coupling
    if coupling is not None:
        coupling = (inverse @ coupling @ sp.diags_array(scale[model.independent])).tocsc()
    return replace(
        model,
        nodes=model.nodes * length,
        mass=convert(model.mass, mass),
        stiffness=convert(model.stiffness, mass / time**2),
        stiffness_parts={k: convert(p, mass / time**2) for k, p in model.stiffness_parts.items()},
        interface_nodes=tuple(replace(i, position=i.position * length) for i in model.interface_nodes),
        coupling=coupling,
        stress=None if model.stress is None else model.stress.converted(length, mass / (length * time**2)),
        beams=None if model.beams is None else model.beams.converted(length, mass),
        added_mass=None if model.added_mass is None else convert(model.added_mass, mass),
        thermal=None
        if model.thermal is None
        else replace(
            model.thermal,
            force=model.thermal.force * scale * force,
            restrained=model.thermal.restrained * np.repeat([1.0, length], 3) * force,
        ),
    )
