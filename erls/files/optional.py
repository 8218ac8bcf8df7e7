"""Packages that only some users need: extras of the installation."""

from __future__ import annotations

import importlib
from importlib.util import find_spec
from types import ModuleType

from erls.errors import Cause, SceneError

EXTRAS = {
    "pyvista": "view",
    "vtkmodules": "view",
    "matplotlib": "plot",
    "PIL": "view",
    "imageio_ffmpeg": "film",
    "pandas": "tables",
    "xarray": "tables",
    "control": "control",
    "distributed": "studies",
}
"""The extra of the installation that brings a package, by its name on import."""


def optional_package(name: str, where: str) -> ModuleType:
    """The package.

    Parameters
    ----------
    name : str
        From `EXTRAS`.
    where : str
        What asks for it.

    Raises
    ------
    SceneError
        BAD_FIELD: it is not installed.
    """
    require_package(name, where)
    return importlib.import_module(name)


def require_package(name: str, where: str) -> None:
    """Refuse, before any work is done, what needs a package that is not installed. See `optional_package`."""
    try:
        there = find_spec(name) is not None
    except ValueError:  # taken out of what may be imported
        there = False
    if not there:
        raise _missing(name, where)


def missing_package(problem: BaseException) -> SceneError | None:
    """The error for an import that failed for want of an extra; None where it is something else."""
    name = (problem.name or "").partition(".")[0] if isinstance(problem, ModuleNotFoundError) else ""
    return _missing(name, "installation") if name in EXTRAS else None


def _missing(name: str, where: str) -> SceneError:
    message, remedy = f"the package {name!r} is not installed", f"pip install 'erls[{EXTRAS[name]}]'"
    return SceneError(Cause.BAD_FIELD, message, where=where, remedy=remedy)
