"""Mesh of a Nastran bulk data file (.bdf, .nas, .fem): grid points, solid elements, sets.

Read here and not with meshio, which loses sets, coordinate systems, and all that is no element without a word.
Properties become sets ``PID:NUMBER``, SET1 cards and sets of the case control node sets ``SET:NUMBER``. Surface and
line elements without a property card only mark nodes.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np

from fe_import.elements.attachments import Attachment, nodes_of, renumbered
from fe_import.elements.solid_elements import MESH_ELEMENTS
from fe_import.errors import Cause, FEImportError
from fe_import.files.includes import included_name, resolved
from fe_import.files.text import TextFile
from fe_import.mesh.nastran_attachments import READERS, attached
from fe_import.mesh.nastran_bulk import Bulk, Unused
from fe_import.mesh.nastran_materials import mesh_materials
from fe_import.mesh.orders import HEIGHT_FIRST
from fe_import.mesh.raw import Block, LeftOut, RawMesh
from fe_import.model import IntArray
from fe_import.nastran.cards import Card, read_cards
from fe_import.nastran.grid import CARDS, grid_points
from fe_import.nastran.meaning import LINES, SURFACES, loss

_SOLIDS = {  # card -> types by number of nodes
    "CTETRA": ("tet4", "tet10"),
    "CPYRAM": ("pyramid5", "pyramid13"),
    "CPYRA": ("pyramid5", "pyramid13"),
    "CPENTA": ("wedge6", "wedge15"),
    "CHEXA": ("hex8", "hex20"),
}
_SHAPES = {2: ("line", 1), 3: ("triangle", 2), 4: ("quad", 2), 6: ("triangle6", 2), 8: ("quad8", 2)}
_PROPERTIES = re.compile(r"(PSHELL|PCOMP|PSHEAR|PBAR|PBEAM|PROD|PTUBE|PBEND)")
_BEGIN = re.compile(r"\s*BEGIN\b(?:\s+BULK)?\s*(?P<more>.*)", re.IGNORECASE)
_CASE_MPC = re.compile(r"\s*MPC\s*=\s*(\d{1,9})\s*\Z", re.IGNORECASE)
_PROPERTIES_OF = {  # cards that are used with others
    "CBAR": ("PBAR", "PBARL", "MAT1"),
    "CBEAM": ("PBEAM", "PBEAML", "MAT1"),
    "CELAS1": ("PELAS",),
    "CBUSH": ("PBUSH",),
}
_CASE_SET = re.compile(r"\s*SET\s+(\d{1,9})\s*=(.*)", re.IGNORECASE)
MOST_DEEP = 20  # files that include each other
_MOST_MEMBERS = 10_000_000  # of a set


def read_nastran(path: Path, name: str) -> RawMesh:
    """Read a bulk data file, with or without executive and case control.

    Parameters
    ----------
    path : Path
    name : str
        To name in messages.

    Raises
    ------
    FEImportError
        ``NOT_READABLE``: faulty cards, superelements, included files that are not there; ``BAD_REFERENCE``: a
        coordinate system that is not there.
    """
    lines: list[tuple[str, str]] = []
    _read(path, name, Path(name), lines, [])
    try:
        first, cases, selected = _case_control(lines)
        bulk = lines[first:]
        cards = list(read_cards((text for text, _ in bulk), None, lambda k: bulk[k - 1][1]))
        return _mesh(Bulk(cards, grid_points(card for card in cards if card.name in CARDS), selected), cases)
    except FEImportError as problem:
        if problem.cause is Cause.EXPORT:
            problem.cause, problem.message = Cause.NOT_READABLE, f"cannot be read as a mesh: {problem.message}"
        raise


def _read(path: Path, name: str, first: Path, lines: list[tuple[str, str]], within: list[Path]) -> None:
    """Lines of a file and of those that it includes, each with its place."""
    with TextFile(path, name, Cause.NOT_READABLE) as file:
        while (line := file.line()) is not None:
            place = f"{name}: line {file.number}"
            included = included_name(line.partition("$")[0]) if line[:1] not in " *" else None
            if included is None:
                lines.append((line, place))
                continue
            target = resolved(included, Path(name), first)
            known = [path, *within]
            if target is None or len(known) > MOST_DEEP or any(target.samefile(other) for other in known):
                why = "there is no such file, or this one is packed" if target is None else "it includes itself"
                message, remedy = f"INCLUDE cannot be followed: {why}", "give one file that holds all cards"
                raise file.failure(message, line=file.number, value=included, remedy=remedy)
            _read(target, str(target), first, lines, known)


def _case_control(lines: list[tuple[str, str]]) -> tuple[int, dict[int, str], set[int] | None]:
    """Number of lines before the bulk data, sets that stand there, and the sets of MPC that it selects, if it is."""
    begins = [k for k, (line, _) in enumerate(lines) if _BEGIN.match(line)]
    for k in begins:
        match = _BEGIN.match(lines[k][0])
        if match and match["more"].strip().upper().startswith("SUPER"):
            message, remedy = "BEGIN SUPER: superelements are not read", "write the parts as one bulk data file"
            raise _fault(lines[k][1], message, remedy)
    if len(begins) > 1:
        raise _fault(lines[begins[1]][1], "bulk data begin twice", "write one bulk data file")
    if not begins:
        return 0, {}, None
    selected: set[int] = set()
    sets: dict[int, str] = {}
    number, text = 0, ""
    for line, _ in lines[: begins[0]]:
        stripped = line.partition("$")[0].strip()
        if chosen := _CASE_MPC.match(stripped):
            selected.add(int(chosen[1]))
        match = _CASE_SET.match(stripped)
        if match:
            number, text = int(match[1]), match[2]
        elif number:
            text += stripped
        if number:
            sets[number] = text
            number = number if text.rstrip().endswith(",") else 0
    if len(selected) > 1:
        message, remedy = "cases select several sets of MPC", "give one case; a link has the same constraints always"
        raise _fault(lines[begins[0]][1], message, remedy)
    return begins[0] + 1, sets, selected


def _fault(where: str, message: str, remedy: str) -> FEImportError:
    return FEImportError(Cause.NOT_READABLE, message, where=where, remedy=remedy)


def _mesh(bulk: Bulk, cases: dict[int, str]) -> RawMesh:
    cards, points = bulk.cards, bulk.points
    place = {label: k for k, label in enumerate(points.positions)}
    properties = {card.integer(1) for card in cards if _PROPERTIES.match(card.name)}
    cells: dict[str, list[list[int]]] = {}
    owners: dict[str, list[int]] = {}
    labels: set[int] = set()
    left_out: list[tuple[str, str, str]] = []
    shells: set[int] = set()  # their properties
    attachments, reasons = _attachments(bulk, properties)
    for card in cards:
        kind_of_card = card.name.rstrip("_")  # as meshio writes those of second order
        marks = _marks(card, properties)
        if kind_of_card in _SOLIDS:
            kind, nodes = _solid(card, *_SOLIDS[kind_of_card])
            shape = MESH_ELEMENTS[kind].meshio_name
        elif marks:
            shape, nodes = _SHAPES[marks][0], [card.integer(k) for k in range(3, 3 + marks)]
            left_out.append((card.name, card.where, ""))
        elif kind_of_card in SURFACES:
            count = SURFACES[kind_of_card]
            shape, nodes = _SHAPES[count][0], [card.integer(k) for k in range(3, 3 + count)]
            left_out += _of_shell(card, count)
            shells.add(card.integer(2))
        else:
            why = f" ({reasons[card.name]})" if card.name in reasons else ""
            left_out.append((card.name, card.where, loss(card.name) + why))
            if card.name in ("GRID", "GRDSET"):
                left_out.pop()
                left_out += _of_grid(card)
            continue
        label = card.integer(1)
        if label in labels:
            raise card.fault("this element stands twice", label)
        labels.add(label)
        missing = next((n for n in nodes if n not in place), None)
        if missing is not None:
            raise card.fault("an element needs a grid point that is not there", missing)
        cells.setdefault(shape, []).append([place[n] for n in nodes])
        owners.setdefault(shape, []).append(card.integer(2, label))
    dimensions = {**dict(_SHAPES.values()), **{e.meshio_name: 3 for e in MESH_ELEMENTS.values()}}
    blocks = [Block(shape, dimensions[shape], np.array(rows, dtype=np.int64)) for shape, rows in cells.items()]
    mesh = RawMesh(np.array(list(points.positions.values()), dtype=float).reshape(-1, 3), blocks)
    mesh.attachments += [renumbered(item, place.__getitem__) for item in attachments if item.keyword not in reasons]
    used = {item.keyword for item in mesh.attachments}
    used |= {name for keyword in used for name in _PROPERTIES_OF.get(keyword, ())}
    for entry in _counted(left_out):
        known = entry.name in used or (entry.name in READERS and entry.name not in reasons)
        mesh.left_out.append(replace(entry, loss="", used=entry.name in used) if known else entry)
    solids = {n for shape in cells if dimensions[shape] == 3 for n in owners[shape]}
    mesh.materials = mesh_materials(bulk, solids, shells)
    _add_properties(mesh, [np.array(owners[shape]) for shape in cells])
    _add_sets(mesh, cards, cases, place)
    return mesh


def _marks(card: Card, properties: set[int]) -> int:
    """How many grid points a surface or line element has that only marks them; 0 for other cards.

    Those with pin flags or offsets are meant as beams: without a property they are refused.
    """
    name = card.name.rstrip("_")
    if name in LINES and any(card.fields[8:]):
        return 0
    count = SURFACES.get(name) or LINES.get(name) or 0
    return count if count and card.integer(2, card.integer(1)) not in properties else 0


def _attachments(bulk: Bulk, properties: set[int]) -> tuple[list[Attachment], dict[str, str]]:
    """What cards attach, and why cards of a name are not used."""
    found: list[Attachment] = []
    reasons: dict[str, str] = {}
    for card in bulk.cards:
        try:
            items = None if _marks(card, properties) else attached(card, bulk)
        except Unused as reason:
            reasons.setdefault(card.name, f"{reason}, {card.where.rpartition(': ')[2]}")
            continue
        for item in items or []:
            missing = next((n for n in nodes_of(item) if n not in bulk.points.positions), None)
            if missing is not None:
                raise card.fault("it needs a grid point that is not there", missing)
            found.append(item)
    return found, reasons


def _solid(card: Card, linear: str, quadratic: str) -> tuple[str, list[int]]:
    """Which of two types of solid elements a card is, and its grid points in meshio's order."""
    given = [card.integer(k, 0) for k in range(3, len(card.fields) + 1)]
    while given and not given[-1]:
        given.pop()
    for kind in (linear, quadratic):
        if len(given) == MESH_ELEMENTS[kind].size and all(given):
            return kind, [given[k] for k in HEIGHT_FIRST.get(kind, range(len(given)))]
    sizes = " or ".join(str(MESH_ELEMENTS[kind].size) for kind in (linear, quadratic))
    raise card.fault("another number of grid points than these elements have", sum(map(bool, given)), sizes)


def _of_shell(card: Card, count: int) -> Iterable[tuple[str, str, str]]:
    yield card.name, card.where, loss(card.name)
    if any(card.field(k) not in ("", "0", "0.", "0.0") for k in range(4 + count, len(card.fields) + 1)):
        yield f"offset or thicknesses of {card.name}", card.where, "offsets and thicknesses of single shells"


def _of_grid(card: Card) -> Iterable[tuple[str, str, str]]:
    if card.field(7) and card.field(7) != "0":
        yield f"PS of {card.name}", card.where, "supports (a link is free, and joints hold it)"
    if card.field(8) and card.field(8) != "0":
        yield f"SEID of {card.name}", card.where, "superelements"


def _counted(found: list[tuple[str, str, str]]) -> list[LeftOut]:
    counts = Counter(name for name, _, _ in found)
    first: dict[str, tuple[str, str]] = {}
    for name, where, text in found:
        known = first.setdefault(name, (where, text))
        if text and not known[1]:
            first[name] = (where, text)
    return [
        LeftOut(name, counts[name], Path(where).name.rpartition(": ")[2], text) for name, (where, text) in first.items()
    ]


def _add_properties(mesh: RawMesh, owners: list[IntArray]) -> None:
    for number in np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *owners])):
        mesh.cell_sets[f"PID:{number}"] = [np.flatnonzero(own == number) for own in owners]


def _add_sets(mesh: RawMesh, cards: list[Card], cases: dict[int, str], place: dict[int, int]) -> None:
    """Sets of the case control and SET1 cards, where all their members are grid points."""
    texts = {number: re.split(r"[,\s]+", text.strip(" ,")) for number, text in cases.items()}
    for card in cards:
        if card.name == "SET1":
            texts[card.integer(1)] = [f for f in card.fields[1:] if f]
    for number, words in texts.items():
        members = _members([word.upper() for word in words])
        if members is None or not all(m in place for m in members):
            mesh.lost[f"SET:{number}"] = "it is not a list of grid points of this file"
        else:
            mesh.point_sets[f"SET:{number}"] = np.unique([place[m] for m in members]).astype(np.int64)


def _members(words: list[str]) -> list[int] | None:
    """Numbers of a list with ranges ``1 THRU 9``; None for any other."""
    found: list[int] = []
    k = 0
    while k < len(words):
        if not words[k].isdigit() or len(words[k]) > 9:
            return None
        low = high = int(words[k])
        if words[k + 1 : k + 2] == ["THRU"]:
            if not (len(words) > k + 2 and words[k + 2].isdigit() and len(words[k + 2]) <= 9):
                return None
            high, k = int(words[k + 2]), k + 2
        if high - low + len(found) > _MOST_MEMBERS:
            return None
        found += range(low, high + 1)
        k += 1
    return found
