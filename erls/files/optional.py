"""Packages that only some users need: extras of the installation."""

from __future__ import annotations

import importlib
from types import ModuleType

from erls.errors import Cause, SceneError


def optional_package(name: str, extra: str, where: str) -> ModuleType:
    """The package.

    Parameters
    ----------
    name, extra : str
        Of the package, and of the extra of `erls` that installs it.
    where : str
        What asks for it.

    Raises
    ------
    SceneError
        BAD_FIELD: it is not installed.
    """
    try:
        return importlib.import_module(name)
    except ImportError:
        message, remedy = f"the package {name!r} is not installed", f"pip install 'erls[{extra}]'"
        raise SceneError(Cause.BAD_FIELD, message, where=where, remedy=remedy) from None
