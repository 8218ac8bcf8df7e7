"""Decks that tests write."""

from __future__ import annotations

import numpy as np
from solid_meshes import side

from fe_import.elements.solid_mesh import SolidMesh


def part(mesh: SolidMesh, shift: tuple[float, float, float], first: int, name: str) -> list[str]:
    """Lines of a box of one element type: element set ``name``, node sets name-x0 ..., surfaces of these faces."""
    lines = ["*NODE"]
    for k, p in enumerate(mesh.nodes + np.array(shift)):
        lines.append(f"{first + k}, " + ", ".join(repr(float(x)) for x in p))
    element = mesh.only.element
    lines.append(f"*ELEMENT, TYPE=C3D{element.size}, ELSET={name}")
    for k, nodes in enumerate(mesh.only.elements):
        numbers = [str(first + k), *(str(first + n) for n in nodes)]
        lines += [", ".join(numbers[at : at + 16]) + "," for at in range(0, len(numbers), 16)]
    for end in ("x0", "x1"):
        lines += [f"*NSET, NSET={name}-{end}", *(f"{first + n}," for n in mesh.node_sets[end])]
        lines.append(f"*SURFACE, NAME=S-{name}-{end}")
        own = {frozenset(face.tolist()) for face in side(mesh, end)}
        for k, nodes in enumerate(mesh.only.elements):
            for number, which in enumerate(element.cell.deck_faces):
                if frozenset(nodes[element.faces[which]].tolist()) in own:
                    lines.append(f"{first + k}, S{number + 1}")
    return [*lines, f"*SOLID SECTION, ELSET={name}, MATERIAL=M"]
