"""A bracket, a sheet of 5 mm of aluminium folded by a right angle: free frequencies of shells, solids, CalculiX."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import scipy.sparse.linalg as sla
from calculix import calculix_frequencies
from link_files import write_toml
from numpy.typing import NDArray
from shell_meshes import Array, IntArray, ShellGrid, shell_grid, write_deck

from fe_import.description.link import load_link
from fe_import.mesh.read import Wanted, read_mesh
from fe_import.models.model import build_model

ALU = {"youngs_modulus": 70e9, "poissons_ratio": 0.33, "density": 2700.0}
THICKNESS = 0.005


def bracket(turns: int) -> ShellGrid:
    """A foot of 0.2 by 0.1 m and an upright of 0.15 m."""
    half = 8 * turns

    def place(a: float, b: float) -> tuple[float, float, float]:
        s = 14 * turns * a
        if s <= half + 1e-9:
            return 0.2 - 0.2 * s / half, 0.1 * b, 0.0
        return 0.0, 0.1 * b, 0.15 * (s - half) / (6 * turns)

    return shell_grid(14 * turns, 4 * turns, place, "quad4")


def _frequencies(path: Path) -> NDArray[np.float64]:
    """Of the whole model, not reduced."""
    mass, stiffness = build_model(load_link(path)).reduced_matrices()
    shift = (2 * np.pi * 50.0) ** 2
    squares = sla.eigsh(stiffness, 12, mass, sigma=-shift, return_eigenvectors=False)
    return np.asarray(np.sqrt(np.sort(squares)[6:]) / (2 * np.pi))


def shell_bracket(folder: Path, turns: int) -> NDArray[np.float64]:
    """The first six [Hz]; 8, 6 and 4 elements times ``turns`` along its sides."""
    grid = bracket(turns)
    write_deck(folder / f"shells{turns}.inp", grid, ends=False)
    shell = {"mesh": f"shells{turns}.inp", "material": "m", "thickness": THICKNESS,
             "nodes": {"c": grid.nodes[grid.at[0, 2 * turns]].tolist()}}  # fmt: skip
    return _frequencies(write_toml(folder / f"shells{turns}.toml", {
        "materials": {"m": ALU}, "shell": shell, "interfaces": [{"name": "hub", "node": "c"}],
    }))  # fmt: skip


def calculix_bracket(folder: Path, turns: int) -> NDArray[np.float64]:
    """The same of CalculiX's S8R."""
    grid = bracket(turns)
    nodes, middles, rows = grid.nodes.tolist(), dict[tuple[int, int], int](), []
    for row in grid.elements.tolist():
        own = []
        for a, b in zip(row, [*row[1:], row[0]], strict=True):
            pair = (min(a, b), max(a, b))
            if pair not in middles:
                middles[pair] = len(nodes)
                nodes.append(((grid.nodes[a] + grid.nodes[b]) / 2).tolist())
            own.append(middles[pair])
        rows.append([*row, *own])
    deck = ["*NODE", *(f"{k + 1}, {x:.12g}, {y:.12g}, {z:.12g}" for k, (x, y, z) in enumerate(nodes))]
    deck += ["*ELEMENT, TYPE=S8R, ELSET=E", *(", ".join(str(n + 1) for n in [k, *row]) for k, row in enumerate(rows))]
    deck += ["*MATERIAL, NAME=M", "*ELASTIC", "7e10, .33", "*DENSITY", "2700.,"]
    deck += ["*SHELL SECTION, ELSET=E, MATERIAL=M", f"{THICKNESS}"]
    return calculix_frequencies(folder, deck, 12)[6:]


def deck_bracket(folder: Path) -> NDArray[np.float64]:
    """The same from the deck that CalculiX was given: its elements of eight nodes, its section and its material."""
    shell = {"mesh": "judge.inp", "nodes": {"c": [0.2, 0.05, 0.0]}}
    return _frequencies(write_toml(folder / "deck.toml", {
        "shell": shell, "interfaces": [{"name": "hub", "node": "c"}],
    }))  # fmt: skip


def solid_bracket(folder: Path, turns: int) -> NDArray[np.float64]:
    """The same of hexahedra of 20 nodes about the same middle surface, mitred at the fold."""
    grid = bracket(turns)
    return _thickened(folder, grid.nodes, [grid.elements])


def gmsh_brackets(folder: Path) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The first six of the shipped bracket, meshed by gmsh and with its holes, in the same thickness: its shells, and
    hexahedra of 20 nodes, with a few wedges of 15, about them.
    """
    path = Path(__file__).parents[2] / "data/shells/meshes/bracket.msh"
    mesh = read_mesh(path, (), Wanted(solids=False, shells=True))
    corner = mesh.nodes[int(np.argmin(np.linalg.norm(mesh.nodes, axis=1)))]
    shell = {"mesh": str(path), "material": "m", "thickness": THICKNESS, "nodes": {"c": corner.tolist()}}
    described = write_toml(folder / "gmsh.toml", {
        "materials": {"m": ALU}, "shell": shell, "interfaces": [{"name": "hub", "node": "c"}],
    })  # fmt: skip
    return _frequencies(described), _thickened(folder, mesh.nodes, [cells.elements for cells in mesh.shells])


def _thickened(folder: Path, surface: Array, cells: list[IntArray]) -> NDArray[np.float64]:
    """Of a solid of one element across, over quadrangles and triangles of a bracket."""
    half, count = THICKNESS / 2, len(surface)
    x, z = surface[:, 0], surface[:, 2]
    fold = (np.abs(x) < 1e-9) & (np.abs(z) < 1e-9)
    away = np.where((z > 1e-9)[:, None], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0])
    away[fold] = [1.0, 0.0, 1.0]
    corners = np.vstack([surface - half * away, surface + half * away])
    every, middles, rows = corners.tolist(), dict[tuple[int, int], int](), list[list[int]]()
    for row in (row for own in cells for row in own.tolist()):
        upper = [n + count for n in row]
        frame = corners[[row[1], row[-1], upper[0]]] - corners[row[0]]
        prism, sides = ([*row, *upper] if np.linalg.det(frame) > 0 else [*upper, *row]), len(row)
        around = [(k, (k + 1) % sides) for k in range(sides)]
        edges = [*around, *((a + sides, b + sides) for a, b in around), *((k, k + sides) for k in range(sides))]
        for a, b in edges:
            pair = (min(prism[a], prism[b]), max(prism[a], prism[b]))
            if pair not in middles:
                middles[pair] = len(every)
                every.append(((corners[pair[0]] + corners[pair[1]]) / 2).tolist())
        rows.append([*prism, *(middles[min(prism[a], prism[b]), max(prism[a], prism[b])] for a, b in edges)])
    lines = ["*NODE", *(f"{k + 1}, {p[0]:.12g}, {p[1]:.12g}, {p[2]:.12g}" for k, p in enumerate(every))]
    for size in (20, 15):
        own = [(k, row) for k, row in enumerate(rows) if len(row) == size]
        lines += [f"*ELEMENT, TYPE=C3D{size}, ELSET=E"] if own else []
        for k, row in own:
            given = [str(n + 1) for n in [k, *row]]
            lines += [", ".join(given[:11]) + ",", ", ".join(given[11:])]
    end = np.flatnonzero(x > x.max() - 1e-9)
    lines += ["*NSET, NSET=ROOT", *(f"{n + 1}," for n in [*end, *(end + count)])]
    (folder / "solid.inp").write_text("\n".join(lines) + "\n")
    return _frequencies(write_toml(folder / "solid.toml", {
        "materials": {"m": ALU}, "solid": {"mesh": "solid.inp", "material": "m"},
        "interfaces": [{"name": "hub", "face": "ROOT", "coupling": "averaged", "weights": "uniform"}],
    }))  # fmt: skip
