"""A MATLAB file with sparse K and M, rows and nodes; read by MATLAB, Octave and SciPy, not here."""

from __future__ import annotations

from pathlib import Path

from fe_import.writers.base import MARK, MatrixFormat, Written, WrittenLink


def write_mat(link: WrittenLink, folder: Path, stem: str) -> Written:
    """``STEM.mat``: K, M; ``rows`` (number, component 1 ... 6, 0 of modal coordinates); ``nodes`` (number, x, y, z)."""
    import numpy as np
    from scipy.io import savemat  # heavy

    nodes = np.column_stack([link.labels.astype(float), link.positions])
    content = {"K": link.stiffness, "M": link.mass, "rows": link.points().astype(float), "nodes": nodes}
    savemat(folder / f"{stem}.mat", {"written_by": MARK, **content, "name": link.name})
    return Written({"matrices": f"{stem}.mat"}, {}, readable=False)


MAT = MatrixFormat(".mat", write_mat)
