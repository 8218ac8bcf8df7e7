"""Every cause of failure is provoked by a test, and raised by some code."""

from __future__ import annotations

import ast
import enum
from collections.abc import Iterator
from pathlib import Path

import pytest
import scenes

import erls.errors
import fe_import.errors

CAUSES = {"erls": erls.errors.Cause, "fe_import": fe_import.errors.Cause}


def named(path: Path, package: str) -> Iterator[str]:
    """Members of the package's ``Cause`` that a file names, whatever it calls the enumeration."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    aliases = {
        alias.asname or alias.name
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and node.module == f"{package}.errors"
        for alias in node.names
        if alias.name == "Cause"
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in aliases:
            yield node.attr
        if isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Constant):  # by name: causes["NOT_READABLE"]
            yield str(node.slice.value)


def missing(folders: list[str], package: str, causes: type[enum.StrEnum]) -> set[str]:
    """Members that no file below the folders names, the files with the enumeration aside."""
    files = [p for folder in folders for p in (scenes.ROOT / folder).rglob("*.py") if p.name != "errors.py"]
    return {c.name for c in causes} - {name for path in files for name in named(path, package)}


@pytest.mark.parametrize("package", CAUSES)
def test_every_cause_has_a_test(package: str) -> None:
    """A member without one is a promise that nobody has tried."""
    assert missing(["tests"], package, CAUSES[package]) == set()


@pytest.mark.parametrize("package", CAUSES)
def test_every_cause_can_occur(package: str) -> None:
    """A member that no code raises is dead."""
    folders = ["fe_import", "erls"] if package == "fe_import" else ["erls", "fe_import"]
    elsewhere = {"OUT_OF_MEMORY", "SYNTAX", "UNKNOWN_FIELD"}  # by name in erls/cli/main.py; TOML is read by fe_import
    assert missing(folders, package, CAUSES[package]) <= elsewhere


@pytest.mark.parametrize("package", CAUSES)
def test_causes_differ(package: str) -> None:
    """Texts are what files and JSON hold."""
    assert len({str(c) for c in CAUSES[package]}) == len(list(CAUSES[package]))
    assert all(str(c) == str(c).strip() != "" for c in CAUSES[package])
