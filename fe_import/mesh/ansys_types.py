"""Element types of Ansys and commands of its archives (.cdb): solids by number of nodes, and what others mean."""

from __future__ import annotations

import re

_TETRAHEDRA = (4, 10)  # nodes of types that are tetrahedra only
_FOLDED: dict[tuple[bool, bool], tuple[str, str, tuple[int, ...], tuple[int, ...]]] = {
    # edges fall together (L = K, P = O), all of the top (M = N = O = P): types, corners and edges that are left
    (False, False): ("hex8", "hex20", tuple(range(8)), tuple(range(12))),
    (True, False): ("wedge6", "wedge15", (0, 1, 2, 4, 5, 6), (0, 1, 3, 4, 5, 7, 8, 9, 10)),
    (False, True): ("pyramid5", "pyramid13", (0, 1, 2, 3, 4), (0, 1, 2, 3, 8, 9, 10, 11)),
    (True, True): ("tet4", "tet10", (0, 1, 2, 4), (0, 1, 3, 8, 9, 10)),
}
SOLIDS = {  # type -> most nodes; those of 8 and 20 nodes may be wedges, pyramids, tetrahedra with repeated nodes
    **dict.fromkeys((5, 45, 62, 64, 65, 69, 70, 96, 185), 8),
    **dict.fromkeys((90, 95, 122, 186, 226), 20),
    **dict.fromkeys((72, 285), 4),
    **dict.fromkeys((87, 92, 98, 123, 187, 227), 10),
}
MESHING = 200  # MESH200: shape by its first option
MESHING_SOLIDS = {8: 4, 9: 10, 10: 8, 11: 20}
_LOSSES = {
    "shells": (28, 41, 43, 57, 63, 91, 93, 99, 131, 132, 157, 163, 181, 190, 208, 209, 281),
    "beams or bars": (1, 3, 4, 8, 10, 16, 17, 18, 20, 23, 24, 44, 54, 59, 160, 161, 180, 188, 189, 288, 289, 290),
    "point masses": (21, 166),
    "springs, dampers or connectors": (7, 14, 37, 38, 39, 40, 165, 184, 214, 250),
    "contact": (12, 26, 48, 49, 52, *range(169, 179)),
    "surface effects, which may hold mass or stiffness": (19, 22, 151, 152, 153, 154, 156),
    "plane elements": (2, 25, 42, 82, 83, 182, 183, 55, 77, 35, 13, 53, 223, 233, 272, 273),
    "superelements": (50,),
    "pre-tension": (179,),
}
_LOSS_OF = {number: text for text, numbers in _LOSSES.items() for number in numbers}

_UNNEEDED = re.compile(
    r"""/\w*|\*(IF|ELSE|ENDIF|SET|DIM|END|PREA|VWRI)|\(.*|_.*
    |NUMO|DOF|FINI|ERES|EXTO|TREF|BFUN|ACEL|OMEG|DOME|CGLO|CGOM|DCGO|KUSE|TIME|ALPH|BETA|DMPR|DMPS|DMPO|CRPL|NCNV|NEQI
    |IRLF|ANTY|MODO|MXPA|LUMP|EQSL|PSTR|TINT|CNVT|TOFF|KBC|NSUB|THOP|TRNO|AUTO|TIMI|OUTR|OUTP|EMUN|CSCI|CSYS|ESYS|STEF
    |QRDO|MODC|SOLV|EXPA|NLGE|RESC|SYNC|CUTC|PRED|LNSR|NROP|SSTI|KEYW|BCSO|PIVC|STAB|ADAM|SPRI|VFOP|RADO|CMSE|CMDE|CM
    |ESEL|NSEL|ALLS|TYPE|MAT|REAL|SECN|ET|ETBL|KEYO|KEYOP|R|RMOR|RMOD|RLBL|MP|MPDA|MPTE|MPDE|TB|TBDA|TBTE|TBPT|TBFI
    |SECT|SECD|SECB|SECC|SECO|SECS|SECF|SLIS|LOCA|CLOC|CS|F|FBLO|SF|SFE|SFEB|SFBL|SFGR|BF|BFBL|BFE|BFEB|BFA|LCUR|KPT|KPAT
    |NLDI|IOPT|FC|FCUM|LCAT|ASAT|ASUR|MANF|NBLO|EBLO|CMBL|N|EN|E|EMOD|EDCO|TOTA|CMAC|SHPP|MCHE|END|CMRO|TBIN|TREF""",
    re.VERBOSE,
)
_COMMAND_LOSSES = {
    "supports (a link is free, and joints hold it)": re.compile(r"D|DBLO|DSYM|DJ"),
    "constraints between nodes": re.compile(r"CE|CP|CERI|CEIN|CPIN|RBE3|CECY|CEDE|CPNG|CPLG"),
    "superelements": re.compile(r"SE|SEBL|M"),
}
_SHORT = 4  # letters that tell commands apart


def type_loss(number: int) -> str:
    """What a link lacks without the elements of a type that is no solid."""
    return _LOSS_OF.get(number, "what is not known here")


def command_loss(command: str) -> str:
    """What a link lacks without a command (capitals); empty when it cannot matter."""
    short = command if command[0] in "/*(" else command[:_SHORT]
    for text, pattern in _COMMAND_LOSSES.items():
        if pattern.fullmatch(short):
            return text
    return "" if _UNNEEDED.fullmatch(short) else "what is not known here"


def solid_nodes(nodes: list[int], most: int) -> tuple[str, list[int]] | None:
    """Type of a solid and its nodes in meshio's order, from those that an element has in Ansys.

    Repeated corners make hexahedra wedges (L = K, P = O), pyramids (M = N = O = P) and tetrahedra (both); 0 stands for
    a middle node that is left out.

    Returns
    -------
    tuple or None
        None for another number of nodes, and where some middle nodes are left out but not all.
    """
    if most in _TETRAHEDRA:
        nodes = nodes + [0] * (most - len(nodes))
        corners, middle = nodes[:4], nodes[4:most]
        return _of_order("tet4", "tet10", corners, middle) if len(nodes) == most else None
    nodes = nodes + [0] * (most - len(nodes))
    if len(nodes) != most:
        return None
    corners, middle = nodes[:8], nodes[8:]
    folded, pointed = corners[2] == corners[3] and corners[6] == corners[7], len({*corners[4:]}) == 1
    linear, quadratic, kept, edges = _FOLDED[folded, pointed]
    chosen = [middle[k] for k in edges] if middle else []
    return _of_order(linear, quadratic, [corners[k] for k in kept], chosen)


def _of_order(linear: str, quadratic: str, corners: list[int], middle: list[int]) -> tuple[str, list[int]] | None:
    if not all(corners):
        return None
    if not any(middle):
        return linear, corners
    return (quadratic, corners + middle) if all(middle) else None
