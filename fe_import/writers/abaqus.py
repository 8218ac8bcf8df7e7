"""Abaqus matrices as text, with the nodes as a deck.

Without modal coordinates as *MATRIX GENERATE writes and *MATRIX INPUT reads them, ``node, dof, node, dof, value`` in
each line; with some as *SUBSTRUCTURE MATRIX OUTPUT writes them, a *USER ELEMENT whose last node carries the modal
coordinates as its dofs 1, 2, ...
"""

from __future__ import annotations

from pathlib import Path

from fe_import.writers.base import MARK, MatrixFormat, Written, WrittenLink, lower_columns

_PER_LINE = 4  # numbers
_NODES_PER_LINE = 10


def write_abaqus(link: WrittenLink, folder: Path, stem: str) -> Written:
    """``STEM.mtx`` and ``STEM.inp``, or ``STEM.stiffness.mtx``, ``STEM.mass.mtx`` and ``STEM.inp``."""
    mesh = f"{stem}.inp"
    places = zip(link.labels.tolist(), link.positions.tolist(), strict=True)
    lines = [f"** {MARK}", "*NODE", *(f"{label}, " + ", ".join(map(repr, place)) for label, place in places)]
    (folder / mesh).write_text("\n".join([*lines, ""]), encoding="ascii")
    if link.modal:
        _write_element(link, folder / f"{stem}.mtx")
        return Written({"stiffness": f"{stem}.mtx", "mesh": mesh}, {"modal_nodes": [_modal_node(link)]})
    names = {"stiffness": f"{stem}.stiffness.mtx", "mass": f"{stem}.mass.mtx"}
    points = link.points()
    for role, matrix in (("stiffness", link.stiffness), ("mass", link.mass)):
        with (folder / names[role]).open("w", encoding="ascii") as file:
            file.write(f"** {MARK}\n")
            for column, rows, values in lower_columns(matrix):
                node, dof = points[column]
                pairs = zip(points[rows].tolist(), values.tolist(), strict=True)
                file.writelines(f"{n},{c}, {node},{dof}, {value!r}\n" for (n, c), value in pairs)
    return Written({**names, "mesh": mesh}, {})


def _modal_node(link: WrittenLink) -> int:
    return int(link.labels.max()) + 1


def _write_element(link: WrittenLink, path: Path) -> None:
    """Every node has its six dofs, as interface nodes have."""
    nodes = [*link.labels.tolist(), _modal_node(link)]
    lines = [f"** {MARK}", f"*USER ELEMENT, NODES= {len(nodes)}, LINEAR", "** ELEMENT NODES"]
    for at in range(0, len(nodes), _NODES_PER_LINE):
        more = ", " if at + _NODES_PER_LINE < len(nodes) else ""
        lines.append("** " + ", ".join(map(str, nodes[at : at + _NODES_PER_LINE])) + more)
    lines += ["1, 2, 3, 4, 5, 6", ", ".join(map(str, [len(nodes), *range(1, link.modal + 1)]))]
    for kind, matrix in (("STIFFNESS", link.stiffness), ("MASS", link.mass)):
        lines.append(f"*MATRIX,TYPE={kind}")
        for k, row in enumerate(matrix.toarray().tolist()):
            words = [repr(value) for value in row[: k + 1]]
            lines += [", ".join(words[at : at + _PER_LINE]) + " ," for at in range(0, len(words), _PER_LINE)]
    path.write_text("\n".join([*lines, ""]), encoding="ascii")


ABAQUS = MatrixFormat("", write_abaqus)
