"""Numbers of equations on pages: (T1), (T2) ... at the end of each, and where the text mentions them.

A page that holds the mark ``<!-- equations: T -->`` has the equations that stand by themselves, indented after a blank
line, numbered in their order. One that was added has no number yet, or any; what the text says of the others follows.
"""

from __future__ import annotations

import re

_MARK = re.compile(r"<!-- equations: ([A-Z]) -->")
_EQUATION = re.compile(r"(?<=\n\n)(?P<lines>(?: {4,}\S.*\n|\n(?= {4,}\S))+)")
_COLUMN = 100


def numbered(page: str) -> str:
    """A page with its equations numbered anew; unchanged without the mark."""
    mark = _MARK.search(page)
    if mark is None:
        return page
    letter, became, count = mark[1], dict[str, str](), 0
    number = re.compile(rf"  \(({letter}\d+)\)$")

    def renumbered(found: re.Match[str]) -> str:
        nonlocal count
        lines = found["lines"].rstrip("\n")
        if _is_list(lines):
            return found[0]
        count += 1
        old = number.search(lines)
        if old:
            lines = lines[: old.start()].rstrip()
            became.setdefault(old[1], f"{letter}{count}")
        *before, last = lines.split("\n")
        return "\n".join([*before, f"{last.ljust(_COLUMN)}  ({letter}{count})\n"])

    found = _EQUATION.sub(renumbered, page)
    return re.sub(rf"(?<!  )\(({letter}\d+)\)", lambda m: f"({became.get(m[1], m[1])})", found)


def _is_list(lines: str) -> bool:
    return lines.lstrip().startswith(("- ", "* ", "#"))
