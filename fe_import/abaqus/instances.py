"""Instances of parts put together to one flat deck.

The names of an only instance stay as its part has them; of several, each is prefixed with its instance, as in Abaqus:
``INSTANCE.NAME``. Labels are counted on by a thousand million for each instance.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fe_import.abaqus.deck import CODED, Deck, Placement, Statement
from fe_import.abaqus.sets import Item, NodesOf, SetTable

_STEP = 10**9
_LABEL = re.compile(r"\d{1,9}\Z")
_NAMES = ("NSET", "ELSET", "TIENSET", "PINNSET", "REFNODE", "SURFACE")  # parameters that name sets, nodes, surfaces
_OWN = ("ORIENTATION",)  # their names belong to the part


@dataclass(frozen=True)
class _Scope:
    """How labels and names of a part, or of the assembly, are called in the flat deck."""

    name: str
    placement: Placement
    label: Callable[[int], int]
    called: Callable[[str], str]

    def token(self, text: str) -> str:
        """A label or a name in a data line."""
        return str(self.label(int(text))) if _LABEL.match(text) else self.called(text)

    def item(self, item: Item) -> Item:
        """A member of a set."""
        if isinstance(item, str):
            return self.called(item)
        if isinstance(item, NodesOf):
            return NodesOf(self.called(item.element_set))
        if isinstance(item, int):
            return self.label(item)
        shift = self.label(item.start) - item.start
        return range(item.start + shift, item.stop + shift, item.step)


def put_together(deck: Deck) -> Deck:
    """The flat deck of all instances and of what stands beside them; a deck without parts stays as it is.

    Raises
    ------
    ValueError
        A part that is not there, or that no instance shows; labels that stand twice.
    """
    if not deck.parts and not deck.instances and not deck.codes:
        return deck
    if not deck.instances:
        (name,) = deck.parts if len(deck.parts) == 1 else ("",)
        deck.instances = {name: (name, name, Deck())} if name else {}
    several = len(deck.instances) > 1
    result = replace(
        deck, points={}, elements={}, types={}, kinds={}, orientation_nodes={}, normals=set(), node_sets=SetTable(),
        element_sets=SetTable(), surfaces={}, solid_sections=[], statements=[], parts={}, instances={}, codes={},
    )  # fmt: skip
    offsets = {name: _STEP * k if several else 0 for k, name in enumerate(deck.instances, start=1)}
    seen = set()
    for name, (shown, part, own) in deck.instances.items():
        if part and part not in deck.parts:
            raise ValueError(f"*INSTANCE {name}: part {part} is not there")
        seen.add(part)
        prefix = f"{shown}." if several else ""
        scope = _of_instance(name, prefix, offsets[name], deck.placements.get(name, Placement()))
        for content in (deck.parts[part] if part else Deck(), own):
            _add(result, content, scope)
    unused = deck.parts.keys() - seen
    if any(deck.parts[name].points for name in unused):
        raise ValueError(f"*PART {min(unused)}: no instance shows it")
    _add(result, deck, _of_assembly(deck, offsets, result, several))
    return result


def _of_instance(name: str, prefix: str, offset: int, placement: Placement) -> _Scope:
    return _Scope(name, placement, lambda label: label + offset, lambda text: prefix + text)


def _of_assembly(deck: Deck, offsets: dict[str, int], flat: Deck, several: bool) -> _Scope:
    """Labels and names beside the instances; nodes and elements there get new labels if those are taken."""
    taken = any(label in flat.points for label in deck.points) or any(label in flat.kinds for label in deck.kinds)
    own = _STEP * (len(offsets) + 1) if taken else 0
    instances = {code: name for name, code in deck.codes.items()}

    def label(given: int) -> int:
        code, plain = divmod(given, CODED)
        if code:
            return plain + offsets.get(instances[code], 0)
        return plain + own if plain in deck.points or plain in deck.kinds else plain

    def called(text: str) -> str:
        instance, dot, rest = text.partition(".")
        if not dot or instance.upper() not in offsets:
            return text
        if _LABEL.match(rest):
            return str(int(rest) + offsets[instance.upper()])
        return text if several else rest

    return _Scope("", Placement(), label, called)


def _add(flat: Deck, deck: Deck, scope: _Scope) -> None:
    place = scope.placement
    for label, position in deck.points.items():
        still = not place.turned and not place.translation.any()  # to the last bit
        flat.points[scope.label(label)] = position if still else tuple(place.moved(np.array(position)).tolist())
    flat.types.update(deck.types)
    for kind, cells in deck.elements.items():
        own = flat.elements.setdefault(kind, {})
        for label, nodes in cells.items():
            new = scope.label(label)
            if flat.kinds.setdefault(new, kind) != kind or new in own:
                raise ValueError(f"element {label} stands twice, in the assembly and in its instance")
            own[new] = [scope.label(node) for node in nodes]
    flat.orientation_nodes.update({scope.label(e): scope.label(n) for e, n in deck.orientation_nodes.items()})
    flat.normals.update(map(scope.label, deck.normals))
    for table, given in ((flat.node_sets, deck.node_sets), (flat.element_sets, deck.element_sets)):
        for key, items in given.items.items():
            table.add(scope.called(given.names[key]), [scope.item(item) for item in items])
    for name, (by_nodes, rows) in deck.surfaces.items():
        flat.surfaces[scope.called(name)] = by_nodes, [[*map(scope.token, row[:1]), *row[1:]] for row in rows]
    for options in deck.solid_sections:
        flat.solid_sections.append(_renamed(options, scope, ("ELSET", "ORIENTATION")))
    _add_statements(flat, deck.statements, scope)


def _renamed(options: dict[str, str], scope: _Scope, names: tuple[str, ...]) -> dict[str, str]:
    return {key: scope.token(value) if key in names and value else value for key, value in options.items()}


def _add_statements(flat: Deck, statements: list[Statement], scope: _Scope) -> None:
    for statement in statements:
        names = ("NAME",) if statement.name in _OWN else _NAMES
        new = replace(
            statement, options=_renamed(statement.options, scope, names), rows=_rows(statement, scope), scope=scope.name
        )
        if statement.follows and flat.statements:
            flat.statements[-1].following = new
        flat.statements.append(new)


def _rows(statement: Statement, scope: _Scope) -> list[list[str]]:
    rows = statement.rows
    if statement.name == "TIE":
        return [[scope.called(text) for text in row] for row in rows]
    if statement.name == "MPC":
        return [[*row[:1], *(scope.token(text) for text in row[1:] if text)] for row in rows]
    if statement.name != "EQUATION":
        return rows
    fields, result = [f for row in rows for f in row], list[list[str]]()
    while fields and fields[0].isdigit() and 0 < int(fields[0]) <= (len(fields) - 1) // 3:
        count = int(fields[0])
        nodes = {1 + 3 * k for k in range(count)}
        result.append([scope.token(f) if k in nodes else f for k, f in enumerate(fields[: 3 * count + 1])])
        fields = fields[3 * count + 1 :]
    return [*result, *([fields] if fields else [])]

