"""Examples in docstrings run, and every public function and class has a docstring."""

from __future__ import annotations

import doctest
import importlib
import inspect
import pkgutil
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
MODULES = sorted(
    m.name
    for package in ("erls", "fe_import")
    for m in pkgutil.walk_packages([str(ROOT / package)], prefix=f"{package}.")
)


@pytest.mark.parametrize("name", MODULES)
def test_module(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Doctest passes; public members defined in the module are documented."""
    monkeypatch.chdir(ROOT)
    module = importlib.import_module(name)
    assert module.__doc__
    for member_name, member in vars(module).items():
        public = not member_name.startswith("_") and getattr(member, "__module__", None) == name
        if public and (inspect.isfunction(member) or inspect.isclass(member)):
            assert member.__doc__, f"{name}.{member_name} has no docstring"
    assert ">>>" not in inspect.getsource(module) or doctest.testmod(module).failed == 0  # looking takes long


def test_the_examples_of_the_api_are_among_them() -> None:
    """The doors of both packages teach by example."""
    doors = ("erls/simulation/simulate.py", "erls/simulation/batch.py", "fe_import/reduce.py")
    text = "".join((ROOT / p).read_text(encoding="utf-8") for p in doors)
    assert text.count(">>> ") > 10
