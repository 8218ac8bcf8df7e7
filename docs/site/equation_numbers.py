"""Equations of the theory as places to link to: (T7) beside an equation is a label, elsewhere a link to it."""

from __future__ import annotations

import re
from typing import Any

from sphinx.application import Sphinx

_EQUATION = re.compile(r"(?:^ {4,}.*\n(?:\n(?= {4}))?)*?^( {4,}).*  \((T\d+)\)$", re.MULTILINE)
_MENTION = re.compile(r"(?<!  )\((T\d+)\)")


def linked(text: str) -> str:
    """A page with labels before its numbered equations, and links in place of mentions."""
    text = _MENTION.sub(lambda found: f"[({found[1]})](#{found[1].lower()})", text)
    return _EQUATION.sub(lambda found: f"{found[1][4:]}({found[2].lower()})=\n\n{found[0]}", text)


def _read(app: Sphinx, page: str, source: list[str]) -> None:
    if not page.startswith(("api/", "notebooks/")):
        source[0] = linked(source[0])


def setup(app: Sphinx) -> dict[str, Any]:
    """Tell Sphinx."""
    app.connect("source-read", _read)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
