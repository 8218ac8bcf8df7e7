"""Compiled systems beside what they must equal: the same source as plain Python, systems without a compiled form."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np


def uncompiled(cases: ModuleType, folder: Path) -> dict[str, np.ndarray]:
    """What ``all_results`` of a module of cases gives as plain Python (``ERLS_JIT=0``), in a process of its own."""
    home, output = Path(str(cases.__file__)).parent, folder / "twin.npz"
    environment = {**os.environ, "ERLS_JIT": "0", "PYTHONPATH": os.pathsep.join([str(home), str(home.parents[1])])}
    subprocess.run([sys.executable, str(cases.__file__), str(folder), str(output)], env=environment, check=True)
    with np.load(output) as twin:
        return dict(twin)


class Plain:
    """A system without its compiled form."""

    compiled = None

    def __init__(self, system: Any) -> None:
        self.system = system

    def __getattr__(self, name: str) -> Any:
        return getattr(self.system, name)


def distance(found: np.ndarray, expected: np.ndarray) -> float:
    """Largest difference, relative to the largest value expected."""
    return float(np.abs(found - expected).max(initial=0.0) / max(np.abs(expected).max(initial=0.0), 1e-300))
