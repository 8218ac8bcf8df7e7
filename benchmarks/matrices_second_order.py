"""Second-order fields of bare matrices, found along their line, beside those of the elements they came from.

    python benchmarks/matrices_second_order.py

The flat L of 100 hexahedra and connecting rods of tetrahedra with a bore at each end (gmsh, `erls[geometry]`), 18 modes
each. Differences of the terms of mass, by flexibility: each mode counts by 1/ω, as statics does. `modal` is the inertia
that modes have by the shortening of others.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import gmsh
import numpy as np

from fe_import.description.link import LinkFile, load_link
from fe_import.modal.second_order import SecondOrder
from fe_import.model import FEModel
from fe_import.models.model import build_model
from fe_import.reduction import REDUCTIONS
from fe_import.reduction.modes import mode_shapes, orthonormal_modes, reduced_matrices
from fe_import.second_order.compute import second_order

ROOT = Path(__file__).parents[1]
RODS = {  # length between the bores, width and thickness of the shank, radius of eyes and bores [mm]
    "rod 200 x 14 x 8, bores 8": (200.0, 14.0, 8.0, 10.0, 4.0),
    "rod 200 x 14 x 8, bores 16": (200.0, 14.0, 8.0, 14.0, 8.0),
    "rod 120 x 14 x 8, bores 16": (120.0, 14.0, 8.0, 14.0, 8.0),
    "rod 120 x 14 x 8, bores 24": (120.0, 14.0, 8.0, 18.0, 12.0),
}
LINK = """
[units]
length = "mm"
mass = "t"
[materials.steel]
youngs_modulus = 2.1e5
poissons_ratio = 0.3
density = 7.85e-9
[solid]
mesh = "rod.step"
size = 5.0
material = "steel"
faces = {{ left = [{left}, 0.0, 0.0], right = [{right}, 0.0, 0.0] }}
mesh_error = 1.0
[[interfaces]]
name = "root"
face = "left"
[[interfaces]]
name = "tip"
face = "right"
[reduction]
fixed_interface_modes = 12
elastic_modes = 18
"""


def rod(folder: Path, length: float, width: float, thickness: float, eye: float, bore: float) -> LinkFile:
    """A shank between two eyes, each with a bore across it."""
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    occ = gmsh.model.occ
    body = occ.addBox(0, -width / 2, -thickness / 2, length, width, thickness)
    eyes = [occ.addCylinder(x, 0, -thickness / 2, 0, 0, thickness, eye) for x in (0, length)]
    bores = [occ.addCylinder(x, 0, -thickness, 0, 0, 2 * thickness, bore) for x in (0, length)]
    whole = occ.fuse([(3, body)], [(3, e) for e in eyes])[0]
    occ.cut(whole, [(3, b) for b in bores])
    occ.synchronize()
    gmsh.write(str(folder / "rod.step"))
    gmsh.finalize()
    (folder / "rod.toml").write_text(LINK.format(left=bore, right=length - bore), encoding="utf-8")
    return load_link(folder / "rod.toml")


def reduced(model: FEModel, link: LinkFile) -> tuple[np.ndarray, np.ndarray]:
    """Modes (d, m), and their circular frequencies."""
    options, where = link.description.reduction, str(link.path)
    basis = REDUCTIONS[options.method](model, options, where)
    mass, stiffness = reduced_matrices(model, basis)
    found = orthonormal_modes(mass, stiffness, basis, options, basis.vectors[model.interface_dofs], where, 0)
    shapes, found = mode_shapes(model, basis, found)
    return shapes, found.omega


def off(found: SecondOrder, exact: SecondOrder, omega: np.ndarray) -> list[float]:
    """Differences of shortening, momenta, spin, modal inertia: shares of the terms, by flexibility."""
    w = 1 / omega[6:]
    pairs = np.outer(w, w)

    def share(one: np.ndarray, other: np.ndarray, weights: np.ndarray) -> float:
        return float(np.linalg.norm((one - other) * weights) / np.linalg.norm(other * weights))

    first, second = np.triu_indices(len(w))
    tips = share(found.translation, exact.translation, pairs[first, second])
    cut = np.s_[..., 6:, 6:]
    terms = [share(getattr(found, n)[cut], getattr(exact, n)[cut], pairs) for n in ("momentum", "spin")]
    return [tips, *terms, share(found.modal[cut], exact.modal[cut], w[:, None, None] * pairs)]


def cases(folder: Path) -> Iterator[tuple[str, LinkFile]]:
    yield "L 500 + 500 x 30 x 10, 100 hexahedra", load_link(ROOT / "data" / "l_shape" / "links" / "solid.toml")
    for name, sizes in RODS.items():
        yield name, rod(folder, *sizes)


def main() -> None:
    print("| link | dofs | sections | shortening | momenta | spin | modal inertia |")
    print("|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for name, link in cases(Path(folder)):
            model = build_model(link)
            shapes, omega = reduced(model, link)
            exact, _ = second_order(model, shapes, 0)
            bare = replace(model, kind="matrices", beams=None, stress=None, stiffness_parts={})
            found, statement = second_order(bare, shapes, 0)
            if exact is None or found is None:
                print(f"| {name} | {model.mass.shape[0]} | {statement} | | | | |")
                continue
            figures = " | ".join(f"{100 * value:.1f} %" for value in off(found, exact, omega))
            print(f"| {name} | {model.mass.shape[0]} | {statement.split()[1]} | {figures} |")


if __name__ == "__main__":
    main()
