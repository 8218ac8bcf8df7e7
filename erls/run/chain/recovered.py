"""Stress and section forces of links during a motion, from their recovery maps.

Shells of the nodal formulation tell their own. What the modes of the scene carry is corrected by the static answer of
all others to the loads of the motion (mode acceleration): see `fe_import.modal.recovery_maps`.
"""

from __future__ import annotations

import numpy as np

from erls.equations.formulation import SurfaceStressed
from erls.maths.so3 import Array
from erls.mechanism.links import Link
from erls.run.chain.instants import Instants
from erls.run.chain.link_loads import link_loads
from fe_import.modal.model import ModalModel
from fe_import.modal.recovery_maps import RecoveryMaps, spin_products
from fe_import.recovery.recover import mode_acceleration, mode_displacement, required_maps


def maps_of(link: Link) -> RecoveryMaps:
    """Where stress or section forces of a link are known.

    Raises
    ------
    FEImportError
        The link holds nothing to recover from.
    """
    return required_maps(link.model, f"link {link.name!r}")


def recovered(seen: Instants, number: int, static_correction: bool = True) -> Array:
    """(k, p, 6) components at the places of a link's recovery maps.

    Parameters
    ----------
    seen : Instants
    number : int
        Of the link.
    static_correction : bool
        Add what the modes left out carry.

    Raises
    ------
    FEImportError
        The link holds nothing to recover from.
    """
    link = seen.formulation.mechanism.links[number]
    maps = maps_of(link)
    if isinstance(seen.formulation, SurfaceStressed) and maps.quantity == "stress":
        own = seen.formulation.surface_stress(number, seen.y, seen.v)
        if own is not None:  # places are bottom, middle and top of each node
            return own[:, maps.nodes, np.arange(len(maps.nodes)) % own.shape[2]]
    if link.pieces:
        return _of_pieces(seen, link, static_correction)
    if static_correction:
        found = link_loads(seen, number)
        modes, loads, spin, warm = mode_acceleration(link.model)
        values = np.tensordot(found.modal, modes, (1, 2)) + np.tensordot(found.interfaces, loads, (1, 2))
        values += np.tensordot(spin_products(found.omega), spin, (1, 2))
    else:
        modes, warm = mode_displacement(link.model)
        values = np.tensordot(seen.motion.states.modal[number], modes, (1, 2))
    return np.asarray((values + warm).reshape(len(seen.t), len(maps.nodes), 6))


def _of_pieces(seen: Instants, link: Link, static_correction: bool) -> Array:
    """(k, p, 6) components at the places of a split link."""
    numbers = {own.name: k for k, own in enumerate(seen.inside.formulation.mechanism.links)}
    parts = [recovered(seen.inside, numbers[piece.name], static_correction) for piece in link.pieces]
    return np.stack([parts[piece][:, at, :] for piece, at in _places_in_pieces(link)], axis=1)


def _places_in_pieces(link: Link) -> list[tuple[int, int]]:
    """Piece and place in its maps of each place of a split link: at the same node, along the same element."""
    maps = maps_of(link)
    names = {number: name for name, number in link.model.node_names.items()}
    known: dict[str, list[tuple[Array, tuple[int, int]]]] = {}
    for number, piece in enumerate(link.pieces):
        own = required_maps(piece.model, piece.name)
        own_names = {k: name for name, k in piece.model.node_names.items()}
        for at, (node, element) in enumerate(zip(own.nodes.tolist(), own.elements.tolist(), strict=True)):
            away = _direction(piece.model, node, element)
            known.setdefault(own_names[node], []).append((away, (number, at)))
    result = []
    for node, element in zip(maps.nodes.tolist(), maps.elements.tolist(), strict=True):
        away = _direction(link.model, node, element)
        candidates = known[names[node]]
        result.append(candidates[int(np.argmax([way @ away for way, _ in candidates]))][1])
    return result


def _direction(model: ModalModel, node: int, element: int) -> Array:
    """(3,) unit vector from a node along an element of a frame that ends there."""
    first, second = model.lines[element].tolist()
    along = model.nodes[second if first == node else first] - model.nodes[node]
    return np.asarray(along / np.linalg.norm(along))
