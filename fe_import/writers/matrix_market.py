"""Matrix Market files: the lower triangles, all digits, with text files of rows and nodes."""

from __future__ import annotations

from pathlib import Path

import scipy.sparse as sp

from fe_import.writers.base import MARK, MatrixFormat, Written, WrittenLink, lower_columns
from fe_import.writers.row_files import write_rows


def write_matrix_market(link: WrittenLink, folder: Path, stem: str) -> Written:
    """``STEM.mtx`` (stiffness), ``STEM.mass.mtx``, rows and nodes."""
    names = {"stiffness": f"{stem}.mtx", "mass": f"{stem}.mass.mtx"}
    for name, matrix in zip(names.values(), (link.stiffness, link.mass), strict=True):
        size, count = matrix.shape[0], sp.tril(matrix).nnz
        with (folder / name).open("w", encoding="ascii") as file:
            file.write(f"%%MatrixMarket matrix coordinate real symmetric\n% {MARK}\n{size} {size} {count}\n")
            for column, rows, values in lower_columns(matrix):
                pairs = zip(rows.tolist(), values.tolist(), strict=True)
                file.writelines(f"{row + 1} {column + 1} {value!r}\n" for row, value in pairs)
    return Written({**names, **write_rows(link, folder, stem)}, {})


MATRIX_MARKET = MatrixFormat(".mtx", write_matrix_market)
