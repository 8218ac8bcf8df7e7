"""The standard set of shells, linear: meshes, loads and published figures.

R. H. MacNeal & R. L. Harder, Finite Elem. Anal. Des. 1 (1985) 3-20; T. Belytschko, H. Stolarski, W. K. Liu, N.
Carpenter & J. S.-J. Ong, Comput. Methods Appl. Mech. Eng. 51 (1985) 221-258; the thin twisted beam: T. Belytschko,
B. K. Wong & H. Stolarski, Int. J. Numer. Methods Eng. 28 (1989) 385-414.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from shell_meshes import ShellGrid, dofs, held, plate, shell_grid

TWISTED = {0.32: (5.424e-3, 1.754e-3), 0.0032: (5.256e-3, 1.294e-3)}  # by thickness: in plane, out of plane


Place = tuple[float, float, float]
ANGLE = np.radians(40)


def on_blade(a: float, b: float) -> Place:
    """The pre-twisted cantilever, over the unit square."""
    angle, y = np.pi / 2 * a, (b - 0.5) * 1.1
    return 12 * a, y * np.cos(angle), y * np.sin(angle)


def on_roof(a: float, b: float) -> Place:
    """A quarter of the Scordelis-Lo roof, along and across."""
    return 25 * np.sin(ANGLE * b), 25 * np.cos(ANGLE * b), 25 * a


def on_cylinder(a: float, b: float) -> Place:
    """An eighth of the pinched cylinder, along and around."""
    return 300 * np.sin(np.pi / 2 * b), 300 * np.cos(np.pi / 2 * b), 300 * a


def on_hemisphere(a: float, b: float) -> Place:
    """A quarter of the hemisphere, down and around."""
    down, along = np.radians(18 + 72 * a), np.pi / 2 * b
    return 10 * np.sin(down) * np.cos(along), 10 * np.sin(down) * np.sin(along), 10 * np.cos(down)


def on_annulus(a: float, b: float) -> Place:
    """The slit annulus, out and around; its lips are a little apart, so that their nodes are their own."""
    radius, along = 6 + 4 * a, 2 * np.pi * (1 - 1e-5) * b
    return radius * np.cos(along), radius * np.sin(along), 0.0


def twisted_grid(nx: int, ny: int, kind: str) -> ShellGrid:
    """The pre-twisted cantilever."""
    return shell_grid(nx, ny, on_blade, kind)


def twisted(nx: int, ny: int, thickness: float, kind: str, drilling: float = 0.01) -> list[float]:
    """Its tip under unit loads in plane and out of plane (1e-6 where it is thin)."""
    grid = twisted_grid(nx, ny, kind)
    _, stiffness = grid.matrices(plate(29e6, 0.22, thickness), drilling)
    share = np.ones(ny + 1)
    share[[0, -1]] = 0.5
    found = []
    for component in (2, 1):
        force = np.zeros(6 * len(grid.nodes))
        force[dofs(grid.at[-1], [component])] = share / share.sum() * (1.0 if thickness > 0.1 else 1e-6)
        moved = held(stiffness, force, dofs(grid.at[0]))
        found.append(float(moved[6 * grid.at[-1, ny // 2] + component]))
    return found


def roof(n: int, kind: str) -> float:
    """Scordelis-Lo roof, a quarter: deflection of the middle of its free edge."""
    grid = shell_grid(n, n, on_roof, kind)
    _, stiffness = grid.matrices(plate(4.32e8, 0.0, 0.25))
    corners = grid.nodes[grid.elements]
    ends = (corners[:, 1] - corners[:, 0], corners[:, -1] - corners[:, 0])
    if kind != "tri3":
        ends = (corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    areas = np.linalg.norm(np.cross(*ends), axis=1) / 2
    force = np.zeros(6 * len(grid.nodes))
    np.add.at(force, 6 * grid.elements + 1, -90 * areas[:, None] / grid.elements.shape[1])
    fixed = (dofs(grid.at[0], [0, 1]), dofs(grid.at[-1], [2, 3, 4]), dofs(grid.at[:, 0], [0, 4, 5]))
    return -float(held(stiffness, force, np.concatenate(fixed))[6 * grid.at[-1, -1] + 1])


def cylinder(n: int, kind: str) -> float:
    """Pinched cylinder with diaphragms, an eighth: deflection under a quarter of the load."""
    grid = shell_grid(n, n, on_cylinder, kind)
    _, stiffness = grid.matrices(plate(3e6, 0.3, 3.0))
    force = np.zeros(6 * len(grid.nodes))
    force[6 * grid.at[-1, 0] + 1] = -0.25
    fixed = (dofs(grid.at[0], [0, 1]), dofs(grid.at[-1], [2, 3, 4]), dofs(grid.at[:, 0], [0, 4, 5]),
             dofs(grid.at[:, -1], [1, 3, 5]))  # fmt: skip
    return -float(held(stiffness, force, np.concatenate(fixed))[6 * grid.at[-1, 0] + 1])


def hemisphere(n: int, kind: str) -> float:
    """Hemisphere with a hole of 18 degrees, a quarter, pulled and pushed at its equator."""
    grid = shell_grid(n, n, on_hemisphere, kind)
    _, stiffness = grid.matrices(plate(6.825e7, 0.3, 0.04))
    force = np.zeros(6 * len(grid.nodes))
    force[6 * grid.at[-1, 0]], force[6 * grid.at[-1, -1] + 1] = 1.0, -1.0
    fixed = (dofs(grid.at[:, 0], [1, 3, 5]), dofs(grid.at[:, -1], [0, 4, 5]), dofs(grid.at[-1, :1], [2]))
    return float(held(stiffness, force, np.concatenate(fixed))[6 * grid.at[-1, 0]])


PUBLISHED: dict[Callable[[int, str], float], float] = {roof: 0.3024, cylinder: 1.8248e-5, hemisphere: 0.0940}
