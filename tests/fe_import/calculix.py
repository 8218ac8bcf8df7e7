"""CalculiX, run on decks that tests write: the independent judge. Tests that use it are skipped where it is absent."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

NEEDS_CALCULIX = pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX (ccx) is not installed")


def calculix_frequencies(folder: Path, lines: list[str], count: int) -> np.ndarray:
    """Frequencies [Hz] of a free deck, the rigid-body ones first, as CalculiX prints them (7 digits)."""
    step = ["*STEP", "*FREQUENCY", f"{count},", "*END STEP"]
    (folder / "judge.inp").write_text("\n".join([*lines, *step]) + "\n")
    done = subprocess.run(["ccx", "judge"], cwd=folder, capture_output=True, text=True, timeout=60, check=False)
    text = (folder / "judge.dat").read_text() if (folder / "judge.dat").exists() else ""
    table = text.partition("P A R T I C I P A T I O N")[0]
    rows = re.findall(r"^ +\d+ +(\S+) +(\S+) +(\S+) +\S+ *$", table, re.MULTILINE)
    assert len(rows) >= count, done.stdout[-2000:]
    return np.array([float(row[2]) for row in rows])[:count]


def calculix_matrices(folder: Path, lines: list[str]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Labels and components (from 1) of the rows, stiffness and mass that CalculiX assembles for a free deck."""
    step = ["*STEP", "*FREQUENCY, SOLVER=MATRIXSTORAGE", "10,", "*END STEP"]
    (folder / "judge.inp").write_text("\n".join([*lines, *step]) + "\n")
    done = subprocess.run(["ccx", "judge"], cwd=folder, capture_output=True, text=True, timeout=60, check=False)
    assert (folder / "judge.sti").exists(), done.stdout[-2000:]
    rows = [line.split(".") for line in (folder / "judge.dof").read_text().split()]
    found = []
    for suffix in ("sti", "mas"):
        i, j, values = np.loadtxt(folder / f"judge.{suffix}").T
        matrix = np.zeros((len(rows), len(rows)))
        matrix[i.astype(int) - 1, j.astype(int) - 1] = values
        found.append(matrix + np.triu(matrix, 1).T if not np.tril(matrix, -1).any() else matrix)
    return np.array(rows, dtype=int), found[0], found[1]
