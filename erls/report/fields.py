"""Tables of all fields of scenes and link descriptions, in Markdown.

Names, types and defaults are those of the records that read the files, descriptions those of their docstrings
(``Attributes``), options those of the registries. A record stands once, where it is met first; other places link there.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import msgspec
from msgspec import inspect as schema

from erls.equations.registry import FORMULATIONS
from erls.mechanism.dh import CONVENTIONS
from erls.mechanism.joint_types import CHAIN_TYPES, HOLDING_TYPES
from erls.optimization import records as optimization
from erls.scene import chain, check, check_settings, joints, links
from erls.scene.bodies import analyses
from erls.scene.bodies.schema import BodySceneRecord, Connection
from erls.scene.integrators import INTEGRATORS, MATRICES
from erls.scene.settings import Simulation
from fe_import.description import records, reduction
from fe_import.description.check import COUPLINGS, WEIGHTS
from fe_import.exports import EXPORTS
from fe_import.files.docstrings import record_texts
from fe_import.reduction import REDUCTIONS

Record: TypeAlias = type[msgspec.Struct]

PAGES: dict[str, tuple[str, Record]] = {
    "link description": ("links.md", records.LinkDescription),
    "scene": ("scenes.md", chain.SceneRecord),
    "scene of bodies": ("bodies.md", BodySceneRecord),
    "problem": ("optimize.md", optimization.ProblemRecord),
}
"""Kinds of files, each with the page that holds its tables and its outermost record."""

OPTIONS: dict[tuple[Record, str], Collection[str]] = {
    (Simulation, "formulation"): FORMULATIONS,
    (Simulation, "gauge"): check_settings.GAUGES,
    (Simulation, "body_frame"): check_settings.BODY_FRAMES,
    (Simulation, "coordinates"): check_settings.COORDINATES,
    (Simulation, "integrator"): INTEGRATORS,
    (Simulation, "inertia_interpolation"): check_settings.INERTIA,
    (optimization.Term, "frame"): optimization.FRAMES,
    (optimization.Goal, "quantity"): optimization.QUANTITIES,
    (optimization.Goal, "over_time"): optimization.OVER_TIME,
    (optimization.DeflectionLimit, "times"): optimization.TIMES,
    (optimization.StressLimit, "times"): optimization.TIMES,
    (optimization.EffortLimit, "times"): optimization.TIMES,
    (optimization.Settings, "optimizer"): optimization.OPTIMIZERS,
    (joints.DH, "convention"): CONVENTIONS,
    (joints.Joint, "type"): CHAIN_TYPES,
    (joints.Loop, "type"): HOLDING_TYPES,
    (links.MeshPose, "frame"): check.FRAMES,
    (chain.Initial, "deformation"): check.DEFORMATIONS,
    (chain.Initial, "assemble"): check.ASSEMBLIES,
    (chain.Load, "axes"): check.AXES,
    (chain.Event, "direction"): check.DIRECTIONS,
    (Connection, "type"): HOLDING_TYPES,
    (analyses.Dynamics, "group"): analyses.GROUPS,
    (analyses.Dynamics, "iteration_matrix"): MATRICES,
    (analyses.StaticSteps, "tangent"): analyses.TANGENTS,
    (records.Matrices, "format"): EXPORTS,
    (records.Interface, "coupling"): COUPLINGS,
    (records.Interface, "weights"): WEIGHTS,
    (reduction.Reduction, "method"): REDUCTIONS,
    (reduction.Reduction, "truncation"): reduction.TRUNCATIONS,
    (reduction.Reduction, "form"): reduction.FORMS,
    (reduction.Reduction, "selection"): reduction.SELECTIONS,
}
"""Registries whose names a field takes; what the description of the field leaves out is listed behind it."""

FREE: dict[tuple[Record, str], Callable[[], Iterator[tuple[str, Record]]]] = {
    (records.Matrices, "options"): lambda: (
        (f'format = "{name}"', e.options) for name, e in EXPORTS.items() if e.options.__struct_fields__
    ),
}
"""Tables without a type of their own: the records that they may hold."""

_WORDS: dict[Any, str] = {
    schema.FloatType: "number",
    schema.IntType: "whole number",
    schema.StrType: "text",
    schema.BoolType: "true or false",
    schema.AnyType: "any",
}
_COUNTS = {2: "two", 3: "three", 4: "four", 6: "six"}


def field_tables() -> dict[str, str]:
    """Headings and tables of every kind of file."""
    found = _Found()
    made = {name: _section(root, found, page) for name, (page, root) in PAGES.items()}
    return {name: "\n".join(lines).strip() for name, lines in made.items()}


@dataclass
class _Found:
    """Where records stand, page and heading; and what remains to be written on the present page."""

    places: dict[Record, tuple[str, str]] = field(default_factory=dict)
    waiting: list[tuple[str, list[tuple[str, Record]]]] = field(default_factory=list)


def _section(root: Record, found: _Found, page: str) -> Iterator[str]:
    """Lines of the tables of one kind of file, the outermost first."""
    found.places[root] = (page, "")
    yield from _table(root, "", found, page)
    while found.waiting:
        heading, variants = found.waiting.pop(0)
        waiting, found.waiting = found.waiting, []
        yield from ("", f"### `{heading}`")
        for name, record in variants:
            if name:
                yield from ("", f"**`{name}`**")
            yield from _table(record, heading.strip("[]") + ".", found, page)
        found.waiting += waiting  # what stands inside comes right behind


def _table(record: Record, path: str, found: _Found, page: str) -> Iterator[str]:
    """What the record is, and a row for each of its fields."""
    told, entries = documentation(record)
    yield from ("", told, "")
    fields = {f.name: f for f in msgspec.structs.fields(record)}
    kinds = {f.name: f.type for f in schema.type_info(record).fields}  # type: ignore[attr-defined]
    if fields:
        yield from ("| field | value | default | meaning |", "|---|---|---|---|")
    for names, text in entries:
        first = fields[names[0]]
        kind = _kind(record, first, kinds[first.name], path, found, page)
        default = ", ".join(dict.fromkeys(_default(fields[name]) for name in names))
        shown = ", ".join(f"`{fields[name].encode_name}`" for name in names)
        yield "| " + " | ".join((shown, kind, default, _described(record, names, text))) + " |"


def documentation(record: Record) -> tuple[str, list[tuple[list[str], str]]]:
    """What the docstring of a record says: itself, and the fields with their descriptions; bases included.

    Raises
    ------
    LookupError
        A field without a description, or a description without its field.
    """
    told, entries = record_texts(record)
    described = [name for names, text in entries if text for name in names]
    if sorted(described) != sorted(record.__struct_fields__):
        wrong = set(described) ^ set(record.__struct_fields__)
        raise LookupError(f"{record.__module__}.{record.__qualname__}: descriptions do not fit fields: {wrong}")
    # what must be given comes first, as it does in the records
    required = {f.name for f in msgspec.structs.fields(record) if f.required}
    return told, sorted(entries, key=lambda entry: entry[0][0] not in required)


def _described(record: Record, names: list[str], text: str) -> str:
    options = OPTIONS.get((record, names[0]), ())
    if any(f"`{name}`" not in text for name in options):
        text += " One of " + ", ".join(f"`{name}`" for name in options) + "."
    return text.replace("|", "\\|")


def _kind(record: Record, f: Any, kind: Any, path: str, found: _Found, page: str) -> str:
    """What a field takes; the records in it are put down to be written, or linked to."""
    if (record, f.name) in FREE:
        inner = list(FREE[record, f.name]())
        return _linked(f"[{path}{f.encode_name}]", inner, found, page)
    many, one, named = "[[{}]]", "[{}]", "[{}.NAME]"
    parts = [p for p in getattr(kind, "types", (kind,)) if not isinstance(p, schema.NoneType)]
    heading = one
    if len(parts) == 1 and isinstance(parts[0], (schema.ListType, schema.VarTupleType, schema.DictType)):
        heading = named if isinstance(parts[0], schema.DictType) else many
        inside = parts[0].value_type if isinstance(parts[0], schema.DictType) else parts[0].item_type
        parts = list(getattr(inside, "types", (inside,)))
    if not all(isinstance(p, schema.StructType) for p in parts):
        return _words(kind)
    variants = [(f'{p.tag_field} = "{p.tag}"' if p.tag else "", p.cls) for p in parts]
    return _linked(heading.format(path + f.encode_name), variants, found, page)


def _linked(heading: str, variants: list[tuple[str, Record]], found: _Found, page: str) -> str:
    """A link to the tables of these records."""
    record = variants[0][1]
    if record not in found.places:
        found.places.update({r: (page, heading) for _, r in variants})
        found.waiting.append((heading, variants))
    where, stands = found.places[record]
    anchor = re.sub(r"[^\w -]", "", stands.lower()).replace(" ", "-")
    kind = "tables" if heading.startswith("[[") or heading.endswith("NAME]") else "table"
    return f"{kind} [`{stands}`]({'' if where == page else where}#{anchor})"


def _words(kind: Any) -> str:
    """A type in words."""
    if isinstance(kind, schema.UnionType):
        parts = [_words(p) for p in kind.types if not isinstance(p, schema.NoneType)]
        return " or ".join(dict.fromkeys(parts))
    if isinstance(kind, schema.TupleType):
        inner = list(dict.fromkeys(_words(p) for p in kind.item_types))
        size = len(kind.item_types)
        if inner == [f"number or {_COUNTS[size]} numbers"]:
            return f"{_COUNTS[size]} numbers or {size} × {size} numbers"
        return f"{_COUNTS[len(kind.item_types)]} {inner[0]}s"
    if isinstance(kind, (schema.ListType, schema.VarTupleType)):
        return f"list of {_words(kind.item_type)}s"
    if isinstance(kind, schema.DictType):
        inner_words = _words(kind.value_type)
        return "table" if inner_words == "any" else f"{inner_words} by name"
    return _WORDS[type(kind)]


def _default(f: msgspec.structs.FieldInfo) -> str:
    """A default as the file would state it; a dash where the description says what happens."""
    if f.required:
        return "required"
    value = f.default if f.default is not msgspec.NODEFAULT else f.default_factory()
    if isinstance(value, msgspec.Struct):
        tag = value.__struct_config__.tag
        return f'`{value.__struct_config__.tag_field} = "{tag}"`' if tag else "see there"
    if value is None or (isinstance(value, (str, list, tuple, dict)) and not value):
        return "–"
    return f"`{_toml(value)}`"


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, tuple):
        return f"[{', '.join(_toml(v) for v in value)}]"
    if isinstance(value, float):
        return re.sub(r"e([+-])0", r"e\1", repr(float(f"{value:.6g}"))).replace("e+", "e")
    return str(value)
