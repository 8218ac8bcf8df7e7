"""Stress and section forces of a link during a run.

They need a modal file with recovery maps (table ``[recovery]`` of the link description): see
`erls.run.chain.recovered`.
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from erls.errors import Cause, SceneError
from erls.files.output import replacing
from erls.maths.so3 import Array
from erls.mechanism.links import Link
from erls.run.chain.recovered import maps_of, recovered
from erls.run.chain.run import ChainRun
from erls.run.record import Run
from fe_import.modal.recovery_maps import UNITS, RecoveryMaps


def recovery_places(run: ChainRun, link: str) -> RecoveryMaps:
    """Where stress or section forces of a link are known: nodes, elements, axes.

    Raises
    ------
    SceneError
        No such link.
    FEImportError
        The link holds nothing to recover from.
    """
    return maps_of(_link(run, link)[1])


def stress(run: ChainRun, link: str, t: ArrayLike, *, static_correction: bool = True) -> Array:
    """Nodal stress of a solid link.

    Parameters
    ----------
    run : ChainRun
    link : str
    t : float or array
        Times within the run [s].
    static_correction : bool
        Add what the modes left out carry (mode acceleration).

    Returns
    -------
    (..., p, 6) array
        xx, yy, zz, xy, yz, zx [Pa] in mesh axes, at the nodes ``recovery_places(run, link).nodes``.

    Raises
    ------
    SceneError
        No such link, a frame link, a time outside the run.
    FEImportError
        The link holds nothing to recover from.
    """
    return _recovered(run, link, t, "stress", static_correction)


def section_forces(run: ChainRun, link: str, t: ArrayLike, *, static_correction: bool = True) -> Array:
    """Section forces of a frame link.

    Parameters and errors are those of `stress`.

    Returns
    -------
    (..., p, 6) array
        N, V_y, V_z [N], T, M_y, M_z [N m] in the local axes of the element, at the element ends of
        ``recovery_places(run, link)``: what the part at larger local x does to the part at smaller x.

    Examples
    --------
    >>> import erls
    >>> run = erls.simulate(erls.load_scene("data/l_shape/steel_tall.toml", ["simulation.duration=0.01"]))
    >>> erls.section_forces(run, "l", 0.01)
    Traceback (most recent call last):
    ...
    fe_import.errors.FEImportError: link 'l': this link holds nothing to recover stress or section forces from; add a \
table [recovery] to its link description and reduce it again
    """
    return _recovered(run, link, t, "section forces", static_correction)


def export_recovery(
    run: ChainRun, link: str, path: Path | str, t: ArrayLike, *, static_correction: bool = True
) -> None:
    """Write a CSV table: time, node, element (counted from 0; empty for nodal stress), position, six components.

    Parameters and errors are those of `stress`; NOT_WRITABLE.
    """
    times = np.asarray(t, dtype=float).ravel()
    maps, model = recovery_places(run, link), _link(run, link)[1].model
    values = _recovered(run, link, times, maps.quantity, static_correction)
    units = [f"{name} [{unit}]" for name, unit in zip(maps.components, UNITS[maps.quantity], strict=True)]
    with replacing(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file)  # numbers, below names of our own
        rows.writerow(["t [s]", "node", "element", "x [m]", "y [m]", "z [m]", *units])
        for time, places in zip(times.tolist(), values, strict=True):
            for node, element, row in zip(maps.nodes.tolist(), maps.elements.tolist(), places, strict=True):
                where = model.nodes[node].tolist()
                rows.writerow([time, node, "" if element < 0 else element, *where, *row.tolist()])


def _recovered(run: ChainRun, link: str, t: ArrayLike, quantity: str, static_correction: bool) -> Array:
    """(..., p, 6) components at the places of the link's recovery maps."""
    maps = recovery_places(run, link)
    if maps.quantity != quantity:
        other = "section_forces" if maps.quantity == "section forces" else "stress"
        raise SceneError(
            Cause.BAD_FIELD,
            f"this link has {maps.quantity}, not {quantity}",
            where=f"link {link!r}",
            remedy=f"ask for erls.{other}",
        )
    found = recovered(run.instants(t), _link(run, link)[0], static_correction)
    return found.reshape(*np.shape(t), *found.shape[1:])


def _link(run: Run, name: str) -> tuple[int, Link]:
    if not isinstance(run, ChainRun):
        message, remedy = "stress and section forces are those of links", "ask a run of a chain"
        raise SceneError(Cause.BAD_FIELD, message, where="run", value=type(run).__name__, remedy=remedy)
    number = run.link_number(name)
    return number, run.formulation.mechanism.links[number]
