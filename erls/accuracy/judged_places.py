"""Places of the points that errors are judged at: named ones, or else the ends of links."""

from __future__ import annotations

import numpy as np

from erls.auto.outputs import Watched, watched_nodes
from erls.equations.formulation import Formulation
from erls.equations.serial.state_series import state_series
from erls.equations.substructures import Substructured
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.run.chain.places import node_positions
from erls.run.chain.run import ChainRun


def judged_nodes(run: ChainRun) -> Watched:
    """Link and node of each point, among the links that were integrated: pieces, where links are split."""
    watched = watched_nodes(run.formulation.mechanism)
    if not isinstance(run.formulation, Substructured):
        return watched
    pieces = run.formulation.parts.places
    return tuple((int(pieces[link][node, 0]), int(pieces[link][node, 1])) for link, node in watched)


def judged_places(
    formulation: Formulation, watched: Watched, t: Array, y: Array, v: Array, placing: Mechanism | None = None
) -> Array:
    """(k, p, 3) places of nodes in the world at k times [m].

    Parameters
    ----------
    formulation : Formulation
        What was integrated.
    watched : tuple of (int, int)
        Link and node of each.
    t : (k,) array
        [s]
    y, v : (k, n) arrays
    placing : Mechanism, optional
        That by whose effects displacements are found, of the formulation unless given.
    """
    mechanism = placing or formulation.mechanism
    series = state_series(formulation, t, y, v)
    places = [node_positions(mechanism, series, link, np.array([node])) for link, node in watched]
    return np.stack([own[..., 0, :] for own in places], axis=1) if places else np.zeros((len(t), 0, 3))
