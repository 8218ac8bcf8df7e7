"""Every cause of failure is provoked by a test, and raised by some code."""

from __future__ import annotations

import ast
from collections.abc import Iterator

import pytest
import scenes

import erls.errors
import fe_import.errors

CAUSES = {"erls": erls.errors.Cause, "fe_import": fe_import.errors.Cause}


def named(nodes: list[ast.AST], package: str) -> Iterator[str]:
    """Members of the package's ``Cause`` that a file names, whatever it calls the enumeration."""
    aliases = {
        alias.asname or alias.name
        for node in nodes
        if isinstance(node, ast.ImportFrom) and node.module == f"{package}.errors"
        for alias in node.names
        if alias.name == "Cause"
    }
    for node in nodes:
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in aliases:
            yield node.attr
        if isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Constant):  # by name: causes["NOT_READABLE"]
            yield str(node.slice.value)


def missing(*folders: str) -> dict[str, set[str]]:
    """Members of each package that no file below the folders names, the files with the enumerations aside."""
    found: dict[str, set[str]] = {package: {c.name for c in causes} for package, causes in CAUSES.items()}
    for path in (p for folder in folders for p in (scenes.ROOT / folder).rglob("*.py") if p.name != "errors.py"):
        text = path.read_text(encoding="utf-8")
        if "Cause" in text or "cause" in text:
            nodes = list(ast.walk(ast.parse(text)))
            for package, names in found.items():
                names.difference_update(named(nodes, package))
    return found


def test_every_cause_has_a_test() -> None:
    """A member without one is a promise that nobody has tried."""
    assert missing("tests") == {"erls": set(), "fe_import": set()}


def test_every_cause_can_occur() -> None:
    """A member that no code raises is dead."""
    elsewhere = {"OUT_OF_MEMORY", "SYNTAX", "UNKNOWN_FIELD"}  # by name in erls/cli/main.py; TOML is read by fe_import
    found = missing("erls", "fe_import")
    assert found["erls"] <= elsewhere
    assert found["fe_import"] <= elsewhere


@pytest.mark.parametrize("package", CAUSES)
def test_causes_differ(package: str) -> None:
    """Texts are what files and JSON hold."""
    assert len({str(c) for c in CAUSES[package]}) == len(list(CAUSES[package]))
    assert all(str(c) == str(c).strip() != "" for c in CAUSES[package])
