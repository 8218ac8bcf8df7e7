"""Universal files, Ansys archives and Exodus files of a mesh, written here: neither meshio nor the package writes them.

Node k has number 10 k + 7 and element k number k + 1 (Exodus counts from 1). Nodes x1 are a group, faces x1 surface
elements (UNV) or a side set (Exodus); the first half of the elements is a set "HALF".
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import netcdf_file
from solid_meshes import side

from fe_import.elements.solid_mesh import SolidMesh

FACES = {3: (41, [0, 1, 2]), 6: (42, [0, 3, 1, 4, 2, 5]), 4: (44, [0, 1, 2, 3]), 8: (45, [0, 4, 1, 5, 2, 6, 3, 7])}
SOLIDS = {  # our order of nodes in the order of the file
    "tet4": (111, range(4)),
    "tet10": (118, [0, 4, 1, 5, 2, 6, 7, 8, 9, 3]),
    "wedge6": (112, range(6)),
    "wedge15": (113, [0, 6, 1, 7, 2, 8, 12, 13, 14, 3, 9, 4, 10, 5, 11]),
    "hex8": (115, range(8)),
    "hex20": (116, [0, 8, 1, 9, 2, 10, 3, 11, 16, 17, 18, 19, 4, 12, 5, 13, 6, 14, 7, 15]),
}
# corners and edges of a degenerate hexahedron in Ansys, by ours
FOLDED = {
    "tet": ([0, 1, 2, 2, 3, 3, 3, 3], [4, 5, 2, 6, 3, 3, 3, 3, 7, 8, 9, 9]),
    "wed": ([0, 1, 2, 2, 3, 4, 5, 5], [6, 7, 2, 8, 9, 10, 5, 11, 12, 13, 14, 14]),
    "pyr": ([0, 1, 2, 3, 4, 4, 4, 4], [5, 6, 7, 8, 4, 4, 4, 4, 9, 10, 11, 12]),
    "hex": (list(range(8)), list(range(8, 20))),
}
EXODUS = {
    "wedge15": [*range(9), 12, 13, 14, 9, 10, 11], "hex20": [*range(12), 16, 17, 18, 19, 12, 13, 14, 15],
    "hex27": [*range(12), 16, 17, 18, 19, 12, 13, 14, 15, 26, 24, 25, 20, 21, 22, 23],
}
SIDES = {  # of Exodus, by corners
    "hex": [(0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (0, 4, 7, 3), (0, 3, 2, 1), (4, 5, 6, 7)],
    "tet": [(0, 1, 3), (1, 2, 3), (0, 3, 2), (0, 2, 1)],
    "wed": [(0, 1, 4, 3), (1, 2, 5, 4), (0, 3, 5, 2), (0, 2, 1), (3, 4, 5)],
    "pyr": [(0, 1, 4), (1, 2, 4), (2, 3, 4), (0, 4, 3), (0, 3, 2, 1)],
}


def rows(numbers: Any, width: int, per_line: int) -> list[str]:
    """Whole numbers in columns."""
    words = [f"{n:{width}d}" for n in numbers]
    return ["".join(words[k : k + per_line]) for k in range(0, len(words), per_line)]


def universal(mesh: SolidMesh) -> str:
    """A universal file."""
    kind, order = SOLIDS[mesh.only.type]
    elements, faces = mesh.only.elements, side(mesh, "x1")
    face, places = FACES[faces.shape[1]]
    lines = ["    -1", "   164", "         1  SI: Meter (newton)         2", "    1.0 1.0 1.0", "    273.15", "    -1"]
    lines += ["    -1", "  2411"]
    for k, p in enumerate(mesh.nodes.tolist()):
        lines += [*rows([10 * k + 7, 1, 1, 11], 10, 8), "".join(f"{x:25.16E}".replace("E", "D") for x in p)]
    lines += ["    -1", "    -1", "  2412"]
    for k, (number, nodes) in enumerate([*((kind, e[order]) for e in elements), *((face, f[places]) for f in faces)]):
        lines += rows([k + 1, number, 1, 1, 7, len(nodes)], 10, 8) + rows(10 * nodes + 7, 10, 8)
    for record in ([len(elements) + len(faces) + 1, 11, 1, 1, 7, 2], [0, 1, 1], [7, 17]):  # a line
        lines += rows(record, 10, 8)
    lines += ["    -1", "    -1", "  2467"]
    half = np.arange(len(elements) // 2) + 1
    groups = {"NODES": (7, 10 * mesh.node_sets["x1"] + 7), "HALF": (8, half)}
    groups["FACES"] = (8, len(elements) + 1 + np.arange(len(faces)))
    for k, (name, (entity, members)) in enumerate(groups.items(), start=1):
        lines += [*rows([k, 0, 0, 0, 0, 0, 0, len(members)], 10, 8), name]
        lines += rows(np.array([[entity, m, 0, 0] for m in members]).ravel(), 10, 8)
    return "\n".join([*lines, "    -1", ""])


def archive(mesh: SolidMesh, element: int = 0) -> str:
    """An archive of Ansys: SOLID185 or 186, or element type ``element`` of its own number of nodes."""
    size = mesh.only.element.size
    corners, edges = FOLDED[mesh.only.type[:3]]
    quadratic = size > mesh.only.element.corners
    order = list(range(size)) if element else corners + (edges if quadratic else [])
    kind = element or (186 if quadratic else 185)
    lines = ["/COM,ANSYS RELEASE 2021 R2", "/PREP7", "NUMOFF,NODE, 10", f"ET,        1,{kind}", "DOF,DELETE"]
    lines += [f"NBLOCK,6,SOLID,  {10 * len(mesh.nodes)},  {len(mesh.nodes)}", "(3i9,6e21.13e3)"]
    for k, p in enumerate(mesh.nodes.tolist()):
        while p and not p[-1]:
            p.pop()  # zeros at the end are left out
        lines.append("".join([*rows([10 * k + 7, 0, 0], 9, 3), *(f"{x:21.13E}" for x in p)]))
    count = len(mesh.only.elements)
    lines += ["N,R5.3,LOC,       -1,", f"EBLOCK,19,SOLID, {count}, {count}", "(19i9)"]
    for k, nodes in enumerate(mesh.only.elements):
        labels = (10 * nodes[order] + 7).tolist()
        lines += rows([2, 1, 1, 1, 0, 0, 0, 0, len(labels), 0, k + 1, *labels[:8]], 9, 19) + rows(labels[8:], 9, 19)
    ends = (10 * mesh.node_sets["x1"] + 7).tolist()
    lines += ["      -1", f"CMBLOCK,NODES   ,NODE,  {len(ends)}", "(8i10)", *rows(ends, 10, 8)]
    half = [1, -(len(mesh.only.elements) // 2)] if len(mesh.only.elements) > 3 else [1]
    lines += [f"CMBLOCK,HALF    ,ELEM,  {len(half)}", "(8i10)", *rows(half, 10, 8)]
    return "\n".join([*lines, "MPTEMP,R5.0, 1, 1,  0.00000000    ,", "FINISH", ""])


def exodus(path: Path, mesh: SolidMesh) -> None:
    """An Exodus file."""
    elements, ends = mesh.only.elements, set(mesh.node_sets["x1"].tolist())
    sides = [
        (k + 1, s + 1)
        for k, nodes in enumerate(elements.tolist())
        for s, face in enumerate(SIDES[mesh.only.type[:3]])
        if all(nodes[c] in ends for c in face)
    ]
    with netcdf_file(str(path), "w") as data:
        for name, size in {"num_nodes": len(mesh.nodes), "len_name": 33, "one": 1}.items():
            data.createDimension(name, size)

        def table(name: str, values: Any, *sizes: str) -> Any:
            for size, count in zip(sizes, np.shape(values), strict=True):
                if size not in data.dimensions:
                    data.createDimension(size, count)
            array = np.asarray(values)
            kind = "c" if array.dtype.kind == "S" else "d" if array.dtype.kind == "f" else "i"
            variable = data.createVariable(name, kind, sizes)
            variable[:] = array
            return variable

        for axis, values in zip("xyz", mesh.nodes.T, strict=True):
            table(f"coord{axis}", values, "num_nodes")
        table("eb_prop1", [5], "one")
        cells = elements[:, EXODUS.get(mesh.only.type, range(elements.shape[1]))] + 1
        kind = {"hex": "HEX", "tet": "TETRA", "wed": "WEDGE", "pyr": "PYRAMID"}[mesh.only.type[:3]]
        table("connect1", cells, "num_el", "num_nod").elem_type = kind
        table("ns_prop1", [3], "one")
        table("node_ns1", mesh.node_sets["x1"] + 1, "num_ns")
        table("ss_prop1", [9], "one")
        name = np.zeros((1, 33), dtype="S1")
        name[0, :5] = list("FACES")
        table("ss_names", name, "one", "len_name")
        table("elem_ss1", [k for k, _ in sides], "num_ss")
        table("side_ss1", [s for _, s in sides], "num_ss")
