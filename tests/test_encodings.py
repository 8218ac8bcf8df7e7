"""Every text that is read or written says its encoding: that of the locale may have no letters (LC_ALL=C)."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
_TEXTS = {"read_text", "write_text", "NamedTemporaryFile", "TextIOWrapper"}
_PROCESSES = {"run", "Popen", "check_output", "check_call", "call"}


def _name(call: ast.Call) -> tuple[str, str]:
    """Of what is called: what stands before the last point, if that is a name, and what behind."""
    if isinstance(call.func, ast.Attribute):
        return (call.func.value.id if isinstance(call.func.value, ast.Name) else "?"), call.func.attr
    return "", call.func.id if isinstance(call.func, ast.Name) else ""


def _silent(call: ast.Call) -> bool:
    """Whether a call opens a text and leaves its encoding to the locale."""
    given = {keyword.arg: keyword.value for keyword in call.keywords}
    if "encoding" in given or None in given:
        return False
    owner, name = _name(call)
    if name in _TEXTS:
        return len(call.args) < (1 if name == "read_text" else 2)
    if owner == "subprocess" and name in _PROCESSES:
        return "text" in given or "universal_newlines" in given
    if name != "open" or owner not in ("", "?", "path", "file", "io", "temporary"):
        return False
    modes = [given.get("mode"), *call.args[(1 if owner in ("", "io") else 0) :][:1]]
    texts = [mode.value for mode in modes if isinstance(mode, ast.Constant) and isinstance(mode.value, str)]
    return not any("b" in text for text in texts)


def _silent_ones(folder: Path) -> Iterator[str]:
    for path in sorted(folder.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and _silent(node):
                yield f"{path.relative_to(ROOT)}:{node.lineno}"


@pytest.mark.parametrize("folder", ["erls", "fe_import", "benchmarks"])
def test_texts_say_their_encoding(folder: str) -> None:
    """None is left to the locale."""
    assert list(_silent_ones(ROOT / folder)) == []


def test_what_counts() -> None:
    """Texts without an encoding are found, bytes and texts with one are not."""
    found = [
        _silent(ast.parse(text, mode="eval").body)  # type: ignore[arg-type]
        for text in ("open(x)", "open(x, 'w')", "path.open()", "x.read_text()", "subprocess.run(x, text=True)")
    ]
    assert all(found)
    found = [
        _silent(ast.parse(text, mode="eval").body)  # type: ignore[arg-type]
        for text in ("open(x, 'rb')", "open(x, encoding='utf-8')", "path.open('rb')", "subprocess.run(x)", "os.open(x)")
    ]
    assert not any(found)
