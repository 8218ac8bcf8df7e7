"""What double precision leaves of slender solids: eigenvalues of their matrices, solved beyond it.

    python benchmarks/slender_solids.py [--elements 30]

A square bar of 1 m, one row of hexahedra of 20 nodes, free. Its stiffness is integrated in extended precision (64 bits,
where the machine has them), rounded entry by entry to double precision, and assembled in double precision; of each the
lowest eigenvalues are found in extended precision, so that only the matrix tells. Columns: how far ω² of the first
bending pair is off that of the extended matrix, and the largest one of a rigid-body motion, per that ω²; the same
as a reduction finds them, with the share that it says rounding may make up.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "fe_import"))
from link_files import SOLID
from solid_meshes import box
from test_sound_extremes import RHO, E, bar, bending, rounding

from fe_import.elements.solid import SolidMaterial, assemble_solid
from fe_import.elements.solid_mesh import SolidMesh
from fe_import.errors import FEImportError
from fe_import.reduce import reduce_link

NU = SOLID["materials"]["m"]["poissons_ratio"]
Long = np.longdouble
Array = np.ndarray


def slopes(corners: Array, at: tuple[Long, ...]) -> Array:
    """(20, 3) derivatives of the shape functions of nodes at ``corners`` (20, 3), of -1, 0 and 1."""
    result = np.zeros((20, 3), Long)
    for k, node in enumerate(corners):
        middle = np.flatnonzero(node == 0)
        f = [1 - t * t if n == 0 else 1 + n * t for n, t in zip(node, at, strict=True)]
        d = [-2 * t if n == 0 else n for n, t in zip(node, at, strict=True)]
        rest = 1.0 if len(middle) else sum(n * t for n, t in zip(node, at, strict=True)) - 2
        for i in range(3):
            j, m = (i + 1) % 3, (i + 2) % 3
            grown = d[i] if len(middle) else d[i] * rest + f[i] * node[i]
            result[k, i] = grown * f[j] * f[m] / (4 if len(middle) else 8)
    return result


def extended_stiffness(mesh: SolidMesh) -> Array:
    """(3 n, 3 n) with 3 x 3 x 3 points."""
    element = mesh.only.element
    corners = np.rint(2 * np.asarray(element.reference_nodes) - 1).astype(Long)
    far = np.sqrt(Long(3) / 5)
    points, weights = (-far, Long(0), far), (Long(5) / 9, Long(8) / 9, Long(5) / 9)
    shear = Long(E) / (2 * (1 + Long(NU)))
    moduli = np.diag(np.array([2, 2, 2, 1, 1, 1], Long)) * shear
    moduli[:3, :3] += Long(E) * Long(NU) / ((1 + Long(NU)) * (1 - 2 * Long(NU)))
    total = np.zeros((3 * len(mesh.nodes),) * 2, Long)
    own = np.zeros((60, 60), Long)
    first = mesh.nodes[mesh.only.elements[0]].astype(Long)  # all elements are alike
    size = np.ptp(first, axis=0)
    for i, j, k in np.ndindex(3, 3, 3):
        along = slopes(corners, (points[i], points[j], points[k])) * (2 / size)
        strain = np.zeros((6, 60), Long)
        for c in range(3):
            strain[c, c::3] = along[:, c]
            a, b = c, (c + 1) % 3
            strain[3 + c, a::3], strain[3 + c, b::3] = along[:, b], along[:, a]
        own += strain.T @ (moduli @ strain) * (weights[i] * weights[j] * weights[k] * np.prod(size) / 8)
    for nodes in mesh.only.elements:
        rows = (3 * nodes[:, None] + np.arange(3)).ravel()
        total[np.ix_(rows, rows)] += own
    return total


def cholesky(matrix: Array, band: int) -> Array:
    """(n, band + 1) columns of the factor of a banded matrix, from the diagonal down."""
    left, size = matrix.copy(), len(matrix)
    factor = np.zeros((size, band + 1), Long)
    for i in range(size):
        column = left[i : i + band + 1, i] / np.sqrt(left[i, i])
        factor[i, : len(column)] = column
        left[i + 1 : i + band + 1, i + 1 : i + band + 1] -= np.outer(column[1:], column[1:])
    return factor


def solved(factor: Array, right: Array) -> Array:
    found, (size, width) = right.copy(), factor.shape
    for i in range(size):
        found[i] /= factor[i, 0]
        rest = min(width, size - i)
        found[i + 1 : i + rest] -= np.outer(factor[i, 1:rest], found[i])
    for i in range(size - 1, -1, -1):
        rest = min(width, size - i)
        found[i] = (found[i] - factor[i, 1:rest] @ found[i + 1 : i + rest]) / factor[i, 0]
    return found


def turned(matrix: Array) -> tuple[Array, Array]:
    """Eigenvalues, rising, and eigenvectors of a small symmetric matrix, by Jacobi's turns."""
    matrix, vectors = matrix.copy(), np.eye(len(matrix), dtype=Long)
    for _ in range(30):
        for p, q in zip(*np.triu_indices(len(matrix), 1), strict=True):
            if abs(matrix[p, q]) > 1e-25 * np.sqrt(abs(matrix[p, p] * matrix[q, q])):
                angle = np.arctan2(2 * matrix[p, q], matrix[q, q] - matrix[p, p]) / 2
                turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
                matrix[:, [p, q]] = matrix[:, [p, q]] @ turn
                matrix[[p, q]] = turn.T @ matrix[[p, q]]
                vectors[:, [p, q]] = vectors[:, [p, q]] @ turn
    order = np.argsort(np.diag(matrix))
    return np.diag(matrix)[order], vectors[:, order]


def lowest(stiffness: Array, mass: Array, shift: float, band: int) -> Array:
    """The eight lowest eigenvalues, by iteration of a subspace."""
    factor = cholesky(stiffness + Long(shift) * mass, band)
    fields = np.random.default_rng(0).standard_normal((len(mass), 12)).astype(Long)
    for _ in range(8):
        fields = solved(factor, mass @ fields)
        sizes, turn = turned(fields.T @ mass @ fields)
        fields = fields @ (turn / np.sqrt(sizes))
        values, turn = turned(fields.T @ stiffness @ fields)
        fields = fields @ turn
    return values[:8]


def reduction(slenderness: float, elements: int) -> str:
    with tempfile.TemporaryDirectory() as folder:
        try:
            model = reduce_link(bar(Path(folder), slenderness, elements, "craig-chang"))
        except FEImportError as problem:
            return f"refused: {problem.message.partition(',')[0]} | {problem.value or '-'}"
    return f"{(model.frequencies_hz[6] / bending(slenderness)) ** 2 - 1:.1e} | {rounding(model):.1e}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--elements", type=int, default=30)
    elements = parser.parse_args().elements
    print("| slenderness | rounded: ω², rigid | assembled: ω², rigid | reduced: ω² | share said |")
    print("|---|---|---|---|---|")
    for slenderness in (300.0, 1000.0, 3000.0, 10_000.0):
        mesh = box("hex20", (elements, 1, 1), (1.0, 1 / slenderness, 1 / slenderness))
        heavy, stiff = assemble_solid(mesh, [SolidMaterial(E, NU, RHO)])
        order = (3 * np.argsort(mesh.nodes[:, 0], kind="stable")[:, None] + np.arange(3)).ravel()
        rows, columns = stiff[order][:, order].nonzero()
        band = int(np.abs(rows - columns).max())
        pick = np.ix_(order, order)
        mass, exact = heavy.toarray()[pick].astype(Long), extended_stiffness(mesh)[pick]
        shift = (2 * np.pi * bending(slenderness)) ** 2
        true = lowest(exact, mass, shift, band)
        texts = []
        for other in (exact.astype(np.float64), stiff.toarray()[pick]):
            found = lowest(other.astype(Long), mass, shift, band)
            off, rigid = np.abs(found[6:] / true[6:] - 1).max(), np.abs(found[:6]).max() / true[6]
            texts.append(f"{float(off):.1e}, {float(rigid):.1e}")
        print(f"| {slenderness:g} | {' | '.join(texts)} | {reduction(slenderness, elements)} |", flush=True)


if __name__ == "__main__":
    main()
