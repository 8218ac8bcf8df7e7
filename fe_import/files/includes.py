"""Files that decks and bulk data include: which they are, relative to the file that names them or to the first one."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

MOST_INCLUDED = 1000  # files of one deck
_DECK = re.compile(r"\*\s*INCLUDE\s*,\s*INPUT\s*=\s*(.+)", re.IGNORECASE)
_BULK = re.compile(r"INCLUDE\s+(.+)", re.IGNORECASE)
_LINE = re.compile(rb"^[ \t]*(?:\*[ \t]*)?INCLUDE\b[^\r\n]*", re.IGNORECASE | re.MULTILINE)
_SUFFIXES = (".inp", ".bdf", ".nas", ".fem")


def included_name(line: str) -> str | None:
    """The file that a line of a deck (``*INCLUDE, INPUT=part.inp``) or of bulk data (``INCLUDE 'part.bdf'``) names;
    None for any other line, empty where there is no whole name."""
    match = _DECK.match(line.strip()) or _BULK.match(line.strip())
    if not match:
        return None
    name = match[1].strip()
    if name[0] in "'\"":
        return name[1:-1].strip() if len(name) > 2 and name[-1] == name[0] else ""
    return name.rstrip(",").strip()


def resolved(name: str, including: Path, first: Path) -> Path | None:
    """The file of that name beside the one that includes it, or beside the first one; None where there is none.

    Packed files include none: what a reduction depends on must be found without unpacking.
    """
    if not name or "\0" in name or first.suffix.lower() == ".gz":
        return None
    return next((p for p in (f.parent / name for f in (including, first)) if p.is_file()), None)


def with_included(path: Path) -> Sequence[Path]:
    """A file and all that it includes, directly or not, each once. Only text files of decks and bulk data do."""
    found, waiting = [path], [path]
    while waiting and len(found) <= MOST_INCLUDED:
        file = waiting.pop()
        if file is path and file.suffix.lower() not in _SUFFIXES:
            break
        for line in _LINE.findall(file.read_bytes()):
            target = resolved(included_name(line.decode("utf-8", errors="replace")) or "", file, path)
            if target is not None and target not in found:
                found.append(target)
                waiting.append(target)
    return found
