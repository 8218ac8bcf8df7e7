"""Shells of links in the file of a nodal run, so that it can be read without their meshes."""

from __future__ import annotations

import h5py

from fe_import.elements.link_shells import LinkShells
from fe_import.files.hdf5.files import write_array, write_strings
from fe_import.files.hdf5.values import Reader


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
    cells = file.integers("cells", (None, 4), 0, nodes)
    mass_nodes = file.integers("mass_nodes", (None,), 0, nodes)
    return LinkShells(
        cells,
        file.integers("make", (len(cells),), 0, makes),
        stiffness,
        file.array("moments", (makes, 3)),
        file.array("directions", (makes, 3)),
        file.scalar("drilling"),
        file.array("masses", (len(mass_nodes), 13)),
        mass_nodes,
        file.names("others"),
    )
