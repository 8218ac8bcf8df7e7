"""Shells of links in the file of a nodal run, so that it can be read without their meshes."""

from __future__ import annotations

import h5py
import numpy as np
from numpy.typing import NDArray

from erls.maths.own_units import in_own_units
from fe_import.elements.link_shells import LinkShells
from fe_import.files.hdf5.files import write_array, write_strings
from fe_import.files.hdf5.values import Reader
from fe_import.model import Array

_EXACT = 1e-9  # symmetry and signs, in shares of what stands on the diagonal


def write_shells(group: h5py.Group, shells: LinkShells) -> None:
    """Into a group of their own."""
    write_array(group, "cells", shells.cells, "1", "nodes of the link's model; the last of a triangle twice")
    write_array(group, "make", shells.make, "1", "row of stiffness, moments and directions of each")
    write_array(group, "stiffness", shells.stiffness, "N/m, N, N m", "of the thickness")
    write_array(group, "moments", shells.moments, "kg/m^2, kg/m, kg", "of the density over the thickness")
    write_array(group, "directions", shells.directions, "1", "nearest to first axes; zeros where all are alike")
    write_array(group, "drilling", shells.drilling, "1", "stiffness against drilling, in shares of that against shear")
    write_array(group, "masses", shells.masses, "kg, m, kg m^2", "mass, place from the node, inertia about it")
    write_array(group, "mass_nodes", shells.mass_nodes, "1", "nodes of the link's model")
    write_array(group, "surfaces", shells.surfaces, "Pa, Pa m", "stress at bottom, middle and top by strains")
    write_strings(group, "others", shells.others, "what else the mesh file attached")


def read_shells(file: Reader, nodes: int) -> LinkShells:
    """Of a link with so many nodes.

    Raises
    ------
    SceneError
        Anything wrong inside.
    """
    stiffness = file.array("stiffness", (None, 8, 8))
    makes = len(stiffness)
    _check(file, "stiffness", _indefinite(stiffness) | ~stiffness.any(axis=(1, 2)), "not symmetric and positive")
    moments = file.array("moments", (makes, 3))
    mass, first, second = moments.T
    _check(file, "moments", (mass < 0) | (second < 0) | (first**2 > (1 + _EXACT) * mass * second), "of no density")
    cells = file.integers("cells", (None, 4), 0, nodes)
    ordered = np.sort(cells, axis=1)
    twice = (ordered[:, 1:] == ordered[:, :-1]).sum(axis=1)
    _check(file, "cells", (twice > 1) | ((twice == 1) & (cells[:, 2] != cells[:, 3])), "no quadrangle or triangle")
    drilling = file.scalar("drilling")
    if drilling < 0:
        raise file.fail("drilling", "a stiffness is not negative", drilling, "at least 0")
    mass_nodes = file.integers("mass_nodes", (None,), 0, nodes)
    masses = file.array("masses", (len(mass_nodes), 13))
    _check(file, "masses", masses[:, 0] < 0, "negative")
    _check(file, "masses", _indefinite(masses[:, 4:].reshape(-1, 3, 3)), "not of a symmetric and positive inertia")
    surfaces = np.zeros((0, 3, 5, 8))
    if "surfaces" in file.names_inside():  # files of earlier versions tell no stress
        surfaces = file.array("surfaces", (makes, 3, 5, 8))
    return LinkShells(
        cells,
        file.integers("make", (len(cells),), 0, makes),
        stiffness,
        moments,
        file.array("directions", (makes, 3)),
        drilling,
        masses,
        mass_nodes,
        surfaces,
        file.names("others"),
    )


def _indefinite(matrices: Array) -> NDArray[np.bool_]:
    """Whether each of (k, n, n) is not symmetric, or resists something by less than nothing."""
    own, scaled = np.diagonal(matrices, axis1=1, axis2=2), in_own_units(matrices)
    turned = np.swapaxes(scaled, 1, 2)
    skewed = np.abs(scaled - turned).max(axis=(1, 2), initial=0.0) > _EXACT
    return np.asarray(skewed | (own < 0).any(axis=1) | (np.linalg.eigvalsh((scaled + turned) / 2)[:, 0] < -_EXACT))


def _check(file: Reader, name: str, bad: NDArray[np.bool_], what: str) -> None:
    if bad.any():
        row = int(np.argmax(bad))
        raise file.fail(name, f"row {row} is {what}", limit="as written by a run")
