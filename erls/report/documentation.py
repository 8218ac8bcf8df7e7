"""Tables of the documentation, in Markdown, from the records and registries of the program.

A page holds a table between two marks, ``<!-- table: NAME -->`` and ``<!-- end of table -->``, and

    python -m erls.report.documentation docs

makes all of them anew, and numbers equations. A new table is one function here and one line in `TABLES`.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterable
from pathlib import Path

from erls.mechanism.effects import EFFECTS, LINEAR
from erls.report.equation_numbers import numbered
from erls.report.fields import field_tables
from erls.scene.integrators import INTEGRATORS
from fe_import.exports import EXPORTS

_MARKS = re.compile(r"(<!-- table: (.+?) -->\n).*?(<!-- end of table -->)", re.DOTALL)


def written(page: str) -> str:
    """A page with its tables made, and its equations numbered, anew."""
    made = tables()
    return numbered(_MARKS.sub(lambda found: f"{found[1]}\n{made[found[2]]}\n\n{found[3]}", page))


def tables() -> dict[str, str]:
    """Every table by name; those of fields with their headings."""
    fields = {f"fields of a {name}": text for name, text in field_tables().items()}
    return {**fields, **{name: make() for name, make in TABLES.items()}}


def effects() -> str:
    """Effects, and whether ``linear`` has them."""
    rows = ((f"`{e.name}`", e.summary, "yes" if e.name in LINEAR else "no") for e in EFFECTS.values())
    return _table(("effect", "what it is", "in `linear`"), rows)


def integrators() -> str:
    """Integrators that a scene can name."""
    return _table(("`integrator`", "what it is"), ((f"`{name}`", e.description) for name, e in INTEGRATORS.items()))


def formats() -> str:
    """Formats of exported matrices with the files that each takes."""
    rows = ((f"`{name}`", _names(e.required), _names(e.optional)) for name, e in EXPORTS.items())
    return _table(("`format`", "files", "files that may be given"), rows)


def _names(names: Iterable[str]) -> str:
    return ", ".join(f"`{name}`" for name in names)


def _table(head: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    lines = [head, ("---",) * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" if line[0] != "---" else "|" + "---|" * len(head) for line in lines)


TABLES: dict[str, Callable[[], str]] = {
    "effects": effects,
    "integrators": integrators,
    "formats of exported matrices": formats,
}
"""What is made from a registry."""


if __name__ == "__main__":
    for path in Path(sys.argv[1]).glob("*.md"):
        path.write_text(written(path.read_text(encoding="utf-8")), encoding="utf-8")
