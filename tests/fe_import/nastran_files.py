"""Links from files of Nastran, and what refusals of faulty ones have in common."""

from __future__ import annotations

import shutil
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import scipy.linalg as la
from link_files import merged, write_toml
from superelements import Reduced

from fe_import.description.link import load_link
from fe_import.errors import Cause, FEImportError
from fe_import.modal.model import ModalModel
from fe_import.reduce import reduce_link

ROOT = Path(__file__).parents[2]
DATA = ROOT / "tests" / "data"
BINARY, TEXT, PUNCH = "llink_cb_pyyeti_bin.op4", "llink_cb_pynastran_ascii.op4.gz", "llink_cb_dmig.pch.gz"
ENDS = {"1": [0.0, 0.0, 0.0], "2": [0.5, 0.5, 0.0]}
OP4: dict[str, Any] = {
    "matrices": {
        "format": "nastran-op4",
        "files": {"stiffness": BINARY},
        "options": {"boundary": [1, 2], "positions": ENDS},
    },
    "interfaces": [{"name": "root", "node": "1"}, {"name": "tip", "node": "2"}],
    "reduction": {"method": "none"},
}
DMIG: dict[str, Any] = {
    **OP4,
    "matrices": {"format": "nastran-dmig", "files": {"stiffness": PUNCH}, "options": {"positions": ENDS}},
}


@cache
def own_frequencies() -> np.ndarray:
    """Frequencies of our own Craig-Bampton reduction of the CalculiX matrices, 20 fixed-interface modes [Hz]."""
    link = load_link(ROOT / "data" / "calculix" / "l_hex20.toml", {"fixed_interface_modes": 20, "elastic_modes": 26})
    return reduce_link(link).frequencies_hz[6:]


def reduced(folder: Path, base: dict[str, Any], **changes: Any) -> ModalModel:
    """The link of a table, its files from tests/data, reduced."""
    for name in base["matrices"]["files"].values():
        shutil.copy(DATA / name, folder)
    return reduce_link(write_toml(folder / "link.toml", merged(base, changes)))


def small() -> Reduced:
    """Two kept nodes and a mode, numbers that are easy to spoil: a free rigid bar with a sprung mass."""
    mass = np.diag([2.0, 2, 2, 1, 1, 1] * 2 + [1.0])
    arm = np.array([1.0, 0.0, 0.0])
    rigid = np.eye(6)
    rigid[:3, 3:] = -np.array([[0, -arm[2], arm[1]], [arm[2], 0, -arm[0]], [-arm[1], arm[0], 0]])
    relative = np.hstack([-rigid, np.eye(6)])
    stiffness = la.block_diag(1e4 * relative.T @ relative, 9e6)
    return Reduced(mass, stiffness, np.array([[0.0, 0, 0], arm]))


def check_message(error: FEImportError, words: str, folder: Path) -> None:
    """One line that says what is wrong, where and what to do."""
    assert words in str(error)
    assert error.cause in (Cause.EXPORT, Cause.GROUNDED, Cause.NOT_READABLE, Cause.BAD_REFERENCE, Cause.BAD_FIELD)
    assert str(folder) in error.where
    assert error.remedy
    assert error.exit_code == 2
    assert len(str(error)) < 600
    assert "\n" not in str(error)
