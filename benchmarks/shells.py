"""Shells beside published figures, and a bracket beside solids and CalculiX.

    python benchmarks/shells.py [--json FILE]

The standard set on three meshes, quadrangles and triangles of links and geometrically exact shells (`exact`, of small
displacements), and the pre-twisted cantilever, thick and thin, with the drilling factors stated: ours / published.
Then the first six free frequencies of a folded bracket (0.2 and 0.15 m by 0.1 m, 5 mm of aluminium, a twentieth of the
width): shells of two meshes, hexahedra of 20 nodes about the same middle surface, CalculiX's S8R on the mesh of the
shells where `ccx` is there.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "fe_import"))
import shell_meshes
from shell_benchmarks import PUBLISHED, TWISTED, twisted
from shell_brackets import calculix_bracket, shell_bracket, solid_bracket
from shell_meshes import ShellGrid

from erls.equations.nodal.assembly import NodalSystem
from erls.equations.nodal.scenes.shell_mesh import corner_frames
from erls.equations.nodal.shell import Shell, Shells
from fe_import.elements.laminates import Laminate

MESHES = {"standard": (8, 16, 32), "twisted": ((12, 2), (24, 4), (48, 8))}


def exact_stiffness(grid: ShellGrid, make: Laminate, drilling: float) -> sp.csc_array:
    """Of geometrically exact shells where they are built, row 6 * node + component."""
    poses = np.tile(np.eye(4), (len(grid.nodes), 1, 1))
    poses[:, :3, 3] = grid.nodes
    frames = corner_frames(grid.nodes, grid.elements, 25.0, "mesh")
    made = [
        Shell(tuple(map(int, cell)), frame, make.stiffness(), make.moments(), drilling)
        for cell, frame in zip(grid.elements, frames, strict=True)
    ]
    system = NodalSystem(poses, [Shells(made, poses)])
    rest = np.zeros(system.size)
    return sp.csc_array(system.stiffness_and_damping(0.0, system.start, rest, rest, None, material=True)[0])


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path, help="write the figures to a file, too")
    asked = parser.parse_args()
    shell_meshes.EXACT.append(exact_stiffness)
    found: dict[str, Any] = {}
    print(f"{'standard set':<34}" + "".join(f"{f'{n} x {n}':>10}" for n in MESHES["standard"]))
    for of, published in PUBLISHED.items():
        for kind in ("quad4", "tri3", "exact"):
            row = [of(n, kind) / published for n in MESHES["standard"]]
            found[f"{of.__name__} {kind}"] = row
            print(f"{of.__name__ + ' ' + kind + f' ({published:g})':<34}" + "".join(f"{x:10.4f}" for x in row))
    print(f"\n{'pre-twisted cantilever':<34}" + "".join(f"{f'{a} x {b}':>20}" for a, b in MESHES["twisted"]))
    for thickness, published in TWISTED.items():
        for kind, drilling in (("quad4", 0.01), ("quad4", 1.0), ("tri3", 0.01), ("exact", 1.0)):
            rows = [twisted(*mesh, thickness, kind, drilling) for mesh in MESHES["twisted"]]
            ratios = [[a / b for a, b in zip(row, published, strict=True)] for row in rows]
            name = f"{kind}, {thickness:g} thick, drilling {drilling:g}"
            found[f"twisted {name}"] = ratios
            print(f"{name:<34}" + "".join(f"{a:12.4f}{b:8.4f}" for a, b in ratios))
    with tempfile.TemporaryDirectory() as folder:
        shells = {f"shells, {turns}": shell_bracket(Path(folder), turns) for turns in (1, 2)}
        judges = {f"hex20, {turns}": solid_bracket(Path(folder), turns) for turns in (2, 3, 4)}
        if shutil.which("ccx"):
            judges["S8R of CalculiX"] = calculix_bracket(Path(folder), 2)
        else:
            print("\nCalculiX (ccx) is not installed: no S8R")
    print("\nfirst six free frequencies of the bracket [Hz]")
    for name, values in {**judges, **shells}.items():
        found[f"bracket {name}"] = values.tolist()
        print(f"{name:<22}" + "".join(f"{v:10.2f}" for v in values))
    for name in list(judges)[2:]:
        values = judges[name]
        off = np.abs(shells["shells, 2"] / values - 1).max()
        print(f"finer shells against {name}: {100 * off:.2f} % at most")
    if asked.json:
        asked.json.write_text(json.dumps(found, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
