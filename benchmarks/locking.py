"""How far elements are off in bending: a cantilever and a plate, a tenth to a thousandth as thick as long.

    python benchmarks/locking.py [--quick]

Steel, one layer of cells: a bar of 10 x 1 x 1 with a square section, a square plate of 8 x 8 x 1, both held at one
side. Wedges are half a cell, pyramids a sixth with a node at its centre, tetrahedra a sixth. Columns: error of the
first frequency against hex27 elements four times as fine (beside it that of half as fine ones), estimated error as the
health report of a link has it (worst of the first three free modes), and whether the link is warned of (beyond 5 %).
Ends with those cases that are off by more than 5 % and pass without a word: there should be none.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
import scipy.sparse.linalg as sla
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "fe_import"))
from solid_meshes import box

from fe_import.elements.solid import SolidMaterial, assemble_solid
from fe_import.elements.solid_elements import SOLID_ELEMENTS
from fe_import.elements.solid_mesh import SolidMesh
from fe_import.elements.solid_stress import solid_stress
from fe_import.health.mesh_error import frequency_errors

Array = NDArray[np.float64]
STEEL = SolidMaterial(2.1e11, 0.3, 7850.0)
LIMIT = 0.05  # the default of solid.mesh_error
THIN = (1e-1, 1e-2, 1e-3)
BODIES = {"cantilever": (10, 1), "plate": (8, 8)}


def meshed(kind: str, body: str, thickness: float, fine: int = 1) -> SolidMesh:
    """A body of one layer of cells; ``fine`` times as many along each of its long sides."""
    along, across = BODIES[body]
    width = thickness if body == "cantilever" else 1.0
    divisions = (along * fine, across * (fine if across > 1 else max(1, fine // 2)), max(1, fine // 2))
    return box(kind, divisions, (1.0, width, thickness))


def clamped(mesh: SolidMesh) -> float:
    """First frequency [Hz], held at x = 0."""
    mass, stiffness = assemble_solid(mesh, [STEEL])
    free = np.setdiff1d(np.arange(len(mesh.nodes)), mesh.node_sets["x0"])
    rows = (3 * free[:, None] + np.arange(3)).ravel()
    k, m = stiffness[rows][:, rows].tocsc(), mass[rows][:, rows].tocsc()
    squares = sla.eigsh(k, 1, m, sigma=0.0, which="LM", return_eigenvectors=False)
    return float(np.sqrt(squares[0]) / (2 * np.pi))


def estimated(mesh: SolidMesh) -> float:
    """Error of the first three free frequencies, the worst, as jumps of stress tell."""
    mass, stiffness = assemble_solid(mesh, [STEEL])
    shift = 1e-2 * (2 * np.pi * clamped(mesh)) ** 2
    shifted = sla.splu((stiffness + shift * mass).tocsc())
    solve = sla.LinearOperator(mass.shape, matvec=shifted.solve, dtype=np.float64)
    squares, shapes = sla.eigsh(stiffness, 9, mass, sigma=-shift, OPinv=solve, which="LM")
    shapes = shapes[:, np.argsort(squares)][:, 6:]
    error, energy = solid_stress(mesh, [STEEL]).energy_of_error(shapes, np.arange(len(shapes)).reshape(-1, 3))
    return float(frequency_errors(error, energy).max())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="references only twice as fine")
    fine = 2 if parser.parse_args().quick else 4
    silent = []
    for body in BODIES:
        for thickness in THIN:
            reference = clamped(meshed("hex27", body, thickness, fine))
            change = clamped(meshed("hex27", body, thickness, fine // 2)) / reference - 1
            print(f"\n{body}, thickness {thickness:g}: {reference:.6g} Hz (half as fine: {100 * change:+.2f} %)")
            print(f"{'element':10s}{'dofs':>7s}{'error %':>10s}{'estimate %':>12s}  warned")
            for kind in SOLID_ELEMENTS:
                mesh = meshed(kind, body, thickness)
                error, estimate = clamped(mesh) / reference - 1, estimated(mesh)
                warned = estimate > LIMIT
                shown = f"{100 * estimate:.2f}" if estimate < 10 else "> 1000"
                word = "yes" if warned else "no"
                print(f"{kind:10s}{3 * len(mesh.nodes):7d}{100 * error:10.2f}{shown:>12s}  {word}")
                if abs(error) > LIMIT and not warned:
                    silent.append(f"{kind}, {body}, {thickness:g}: {100 * error:.1f} %, estimated {shown} %")
    print("\nbeyond 5 % without a warning: " + ("; ".join(silent) or "none"))


if __name__ == "__main__":
    main()
