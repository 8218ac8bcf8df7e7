"""Text files of rows and nodes beside formats that hold numbers only; `fe_import.exports.row_files` reads them."""

from __future__ import annotations

from pathlib import Path

from fe_import.exports.dofs import COMPONENTS
from fe_import.writers.base import MARK, MODAL, WrittenLink


def write_rows(link: WrittenLink, folder: Path, stem: str) -> dict[str, str]:
    """The files ``STEM.rows.txt`` and ``STEM.nodes.txt``, by role."""
    rows = [
        "modal" if component == MODAL else f"{link.labels[node]} {COMPONENTS[component]}"
        for node, component in zip(link.node, link.component, strict=True)
    ]
    nodes = [
        f"{label} " + " ".join(map(repr, place))
        for label, place in zip(link.labels.tolist(), link.positions.tolist(), strict=True)
    ]
    names = {"dofs": f"{stem}.rows.txt", "nodes": f"{stem}.nodes.txt"}
    for name, lines in zip(names.values(), (rows, nodes), strict=True):
        (folder / name).write_text("\n".join([f"# {MARK}", *lines, ""]), encoding="utf-8")
    return names
