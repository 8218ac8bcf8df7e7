"""Faulty link files: each is one typed error that names file, field and remedy, and leaves nothing behind."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from link_files import FRAME, SOLID, frame_link, merged, write_box, write_toml

from fe_import.description.link import load_link
from fe_import.description.records import LinkDescription
from fe_import.errors import Cause, FEImportError, ReportedError, shortened
from fe_import.files.toml import choose, convert, read_toml
from fe_import.reduce import reduce_link

NODES = FRAME["frame"]["nodes"]
MEMBER = FRAME["frame"]["members"][0]
HUB, HAND = FRAME["interfaces"]


class Fault(NamedTuple):
    """A change of a sound description and what the message says about it."""

    name: str
    base: dict[str, Any]
    changes: dict[str, Any]
    cause: Cause
    place: str  # after "link.toml: "
    words: str  # of message or remedy


def frame(name: str, changes: dict[str, Any], cause: Cause, place: str, words: str = "") -> Fault:
    return Fault(name, FRAME, changes, cause, place, words)


def solid(name: str, changes: dict[str, Any], cause: Cause, place: str, words: str = "") -> Fault:
    return Fault(name, SOLID, changes, cause, place, words)


def members(**changes: Any) -> dict[str, Any]:
    """The first member changed."""
    return {"frame": {"members": [{**MEMBER, **changes}, FRAME["frame"]["members"][1]]}}


def without(table: dict[str, Any], key: str) -> dict[str, Any]:
    return {k: v for k, v in table.items() if k != key}


UNKNOWN, BAD, REFERENCE = Cause.UNKNOWN_FIELD, Cause.BAD_FIELD, Cause.BAD_REFERENCE
LUMPED = {"frame": {"mass": "lumped", "rotary_inertia": False}}

FAULTS = [
    # unknown names
    frame("unknown table", {"materiels": {}}, UNKNOWN, "materiels", "did you mean 'materials'?"),
    frame("unknown field", {"frame": {"theroy": "timoshenko"}}, UNKNOWN, "frame.theroy", "'theory'"),
    frame("unknown in a list", members(element=3), UNKNOWN, "frame.members[0].element", "'elements'"),
    frame("unknown in a named table", {"materials": {"m": {"denstiy": 1.0}}}, UNKNOWN, "materials.m.denstiy",
          "density"),
    frame(
        "unknown in a tagged table",
        {"sections": {"t": {"shape": "circular", "diameter": 1.0, "width": 1.0}}},
        UNKNOWN,
        "sections.t.width",
        "known fields: diameter, shear_factor, torsion_constant",
    ),
    frame("unknown deep down", {"damping": {"rayleigh": {"alfa": 1.0}}}, UNKNOWN, "damping.rayleigh.alfa", "'alpha'"),
    solid("unknown in solid", {"solid": {"mehs": "x"}}, UNKNOWN, "solid.mehs", "did you mean 'mesh'?"),
    frame("misspelt shape", {"sections": {"s": {"shape": "rectangel"}}}, BAD, "sections.s.shape", "'rectangular' or"),
    frame("unknown theory", {"frame": {"theory": "euler"}}, BAD, "frame.theory", "euler-bernoulli"),
    frame("unknown mass", {"frame": {"mass": "diagonal"}}, BAD, "frame.mass", "lumped"),
    frame("unknown method", {"reduction": {"method": "guyon"}}, REFERENCE, "reduction.method", "did you mean 'guyan'"),
    frame("unknown truncation", {"reduction": {"truncation": "free"}}, BAD, "reduction.truncation", "clamped"),
    frame("unknown unit", {"units": {"length": "mmm"}}, REFERENCE, "units.length", "did you mean 'mm'?"),
    frame("unknown coupling", {"interfaces": [{**HUB, "coupling": "soft"}]}, REFERENCE,
          "interfaces[0].coupling", "rigid"),
    # missing and mistyped
    frame("missing field", {"materials": {"n": {"density": 1.0, "poissons_ratio": 0.3}}}, BAD, "materials.n",
          "add youngs_modulus"),
    frame("missing shape", {"sections": {"t": {"width": 1.0}}}, BAD, "sections.t", "add shape = 'rectangular' or"),
    frame("missing in a list", {"masses": [{"mass": 1.0}]}, BAD, "masses[0]", "add node"),
    frame("text for a number", {"materials": {"m": {"density": "7800"}}}, BAD, "materials.m.density", "give a number"),
    frame("number for a text", {"name": 3}, BAD, "name", "give a text in quotes"),
    frame("number for a truth", {"frame": {"rotary_inertia": 1}}, BAD, "frame.rotary_inertia", "true or false"),
    frame("fraction for a count", members(elements=2.5), BAD, "frame.members[0].elements", "a whole number"),
    frame("table for a list", {"interfaces": {"hub": "root"}}, BAD, "interfaces", "a list in brackets"),
    frame("list for a table", {"reduction": [1]}, BAD, "reduction", "give a table"),
    frame("two coordinates", {"frame": {"nodes": {"tip": [0.0, 1.0]}}}, BAD, "frame.nodes.tip", "of 3 values"),
    frame("text in a position", {"frame": {"nodes": {"tip": [0.0, 1.0, "x"]}}}, BAD, "frame.nodes.tip[2]", "a number"),
    frame("number too large", {"materials": {"m": {"density": 10**400}}}, BAD, "materials.m.density", "within range"),
    frame("inertia of two", {"masses": [{"node": "tip", "inertia": [1.0, 2.0]}]}, BAD, "masses[0].inertia", "3 values"),
    # numbers that no link has
    frame("negative width", {"sections": {"s": {"width": -0.01}}}, BAD, "sections.s.width", "positive"),
    frame("unused bad section", {"sections": {"t": {"shape": "circular", "diameter": 0.0}}}, BAD, "sections.t.diameter",
          "positive"),
    frame("diameter for a thickness", {"sections": {"s": None, "t": {"shape": "tubular", "outer_diameter": 0.02,
          "inner_diameter": 0.01}}}, Cause.UNKNOWN_FIELD, "sections.t.inner_diameter", "thickness"),
    frame("thick wall", {"sections": {"s": None, "t": {"shape": "tubular", "outer_diameter": 0.02, "thickness": 0.02}}},
          BAD, "sections.t.thickness", "below half"),
    frame("incompressible", {"materials": {"m": {"poissons_ratio": 0.5}}}, BAD, "materials.m.poissons_ratio", "0.5"),
    frame("Poisson's ratio nan", {"materials": {"m": {"poissons_ratio": math.nan}}}, BAD, "materials.m.poissons_ratio"),
    frame("no density", {"materials": {"m": {"density": 0}}}, BAD, "materials.m.density", "above 0"),
    frame("infinite modulus", {"materials": {"m": {"youngs_modulus": math.inf}}}, BAD, "materials.m.youngs_modulus"),
    frame("nan position", {"frame": {"nodes": {"tip": [0.0, math.nan, 0.0]}}}, BAD, "frame.nodes.tip", "finite"),
    frame("infinite position", {"frame": {"nodes": {"tip": [math.inf, 0.0, 0.0]}}}, BAD, "frame.nodes.tip", "finite"),
    frame("negative mass", {"masses": [{"node": "tip", "mass": -1.0}]}, BAD, "masses[0].mass", "negative"),
    frame("nan mass", {"masses": [{"node": "tip", "mass": math.nan}]}, BAD, "masses[0].mass"),
    frame("asymmetric inertia", {"masses": [{"node": "tip", "inertia": [[1.0, 1.0, 0.0], [0.0, 1.0, 0.0],
                                                                       [0.0, 0.0, 1.0]]}]},
          BAD, "masses[0].inertia", "symmetric"),
    frame("negative inertia", {"masses": [{"node": "tip", "inertia": [1.0, -1.0, 1.0]}]}, BAD, "masses[0].inertia"),
    frame("infinite inertia", {"masses": [{"node": "tip", "inertia": [1.0, math.inf, 1.0]}]}, BAD, "masses[0].inertia"),
    # frames
    frame("no members", {"frame": {"members": []}}, BAD, "frame.members", "at least one"),
    frame("member to nowhere", members(to="elbwo"), REFERENCE, "frame.members[0].to", "did you mean 'elbow'?"),
    frame("no material", members(material=""), REFERENCE, "frame.members[0].material", "a name is missing; known: m"),
    frame("unknown section", members(section="x"), REFERENCE, "frame.members[0].section", "known: s"),
    frame("member without length", members(to="root"), BAD, "frame.members[0]", "no length"),
    frame("nodes in one place", {"frame": {"nodes": {"elbow": NODES["root"]}}}, BAD, "frame.members[0]", "no length"),
    frame("no elements", members(elements=0), BAD, "frame.members[0].elements", "1 or more"),
    frame("absurd elements", members(elements=10**30), BAD, "frame.members[0].elements", "too many"),
    frame("local_z along the member", members(local_z=[0.4, 0.1, 0.05]), BAD, "frame.members[0].local_z", "parallel"),
    frame("local_z zero", members(local_z=[0.0, 0.0, 0.0]), BAD, "frame.members[0].local_z", "across"),
    frame("local_z nan", members(local_z=[0.0, math.nan, 1.0]), BAD, "frame.members[0].local_z", "finite"),
    frame("node without member", {"frame": {"nodes": {"alone": [1.0, 1.0, 1.0]}}}, Cause.DISCONNECTED,
          "frame.nodes.alone", "no member"),
    frame(
        "two frames",
        {"frame": {"nodes": {"a": [1.0, 0.0, 0.0], "b": [1.0, 1.0, 0.0]},
                   "members": [*FRAME["frame"]["members"], {**MEMBER, "from": "a", "to": "b"}]}},
        Cause.DISCONNECTED, "frame.members", "no members join node 'a' to node 'root'",
    ),
    frame(
        "name of an inner node",
        {"frame": {"nodes": {"root-elbow/1": [0.0, 1.0, 0.0]},
                   "members": [*FRAME["frame"]["members"], {**MEMBER, "to": "root-elbow/1"}]}},
        BAD, "frame.members[0]", "two nodes of one name",
    ),
    frame("side by side", {"frame": {"members": [*FRAME["frame"]["members"], MEMBER]}}, BAD, "frame.members[2]",
          "root-elbow/1"),
    frame("empty node name", {"frame": {"nodes": {"": [1.0, 1.0, 1.0]}}}, BAD, "frame.nodes.", "must not be empty"),
    frame("mass on one line", merged(LUMPED, {"frame": {"nodes": {"tip": [0.9, 0.2, 0.1]}}}), Cause.NOT_DEFINITE, "",
          "no inertia about some axis"),
    # interfaces
    frame("no interface", {"interfaces": []}, BAD, "interfaces", "add [[interfaces]]"),
    frame("interface nowhere", {"interfaces": [HUB, {"name": "x", "node": "tpi"}]}, REFERENCE, "interfaces[1].node",
          "did you mean 'tip'?"),
    frame("interfaces on one node", {"interfaces": [HUB, {**HAND, "node": "root"}]}, Cause.INTERFACE,
          "interfaces[1].node", "its own node"),
    frame("one name twice", {"interfaces": [HUB, {**HAND, "name": "hub"}]}, BAD, "interfaces[1].name", "rename"),
    frame("no name", {"interfaces": [{**HUB, "name": ""}]}, BAD, "interfaces[0].name"),
    frame("face of a frame", {"interfaces": [{"name": "x", "face": "x0"}]}, Cause.INTERFACE, "interfaces[0]", "node ="),
    frame("position of a node", {"interfaces": [{**HUB, "position": [0.0, 0.0, 0.0]}]}, Cause.INTERFACE,
          "interfaces[0].position", "remove the field"),
    frame("ambiguous name", {"interfaces": [{**HUB, "name": "tip"}], "masses": [{"node": "tip", "mass": 1.0}]},
          REFERENCE, "masses[0].node", "rename one"),
    frame("mass nowhere", {"masses": [{"node": "hbu", "mass": 1.0}]}, REFERENCE, "masses[0].node",
          "did you mean 'hub'?"),
    # reduction and damping
    frame("negative count", {"reduction": {"elastic_modes": -1}}, BAD, "reduction.elastic_modes", "negative"),
    frame("absurd count", {"reduction": {"elastic_modes": 10**400}}, BAD, "reduction.elastic_modes", "too many"),
    frame("too many fixed", {"reduction": {"fixed_interface_modes": 31}}, Cause.MODE_COUNT,
          "reduction.fixed_interface_modes", "limit 30"),
    frame("too many elastic", {"reduction": {"elastic_modes": 19}}, Cause.MODE_COUNT, "reduction.elastic_modes",
          "limit 18"),
    frame("too many clamped", {"reduction": {"elastic_modes": 19, "truncation": "clamped"}}, Cause.MODE_COUNT,
          "reduction.elastic_modes", "limit 18"),
    frame("none with fixed", {"reduction": {"method": "none", "fixed_interface_modes": 3}}, BAD,
          "reduction.fixed_interface_modes", "craig-bampton"),
    frame("too large for none", {**members(elements=400), "reduction": {"method": "none"}}, Cause.MODE_COUNT,
          "reduction.method", "limit 2000"),
    frame("unknown inboard", {"reduction": {"inboard": "root"}}, REFERENCE, "reduction.inboard", "hand, hub"),
    frame("physical, elastic", {"reduction": {"form": "physical", "elastic_modes": 3}}, BAD, "reduction.elastic_modes",
          "remove it"),
    frame("physical, clamped", {"reduction": {"form": "physical", "truncation": "clamped"}}, BAD,
          "reduction.truncation", "keeps the interface displacements"),
    frame("physical, inboard", {"reduction": {"form": "physical", "inboard": "hand"}}, BAD, "reduction.inboard",
          "keeps the interface displacements"),
    frame("physical, damped", {"reduction": {"form": "physical"}, "damping": {"ratio": 0.01}}, BAD, "damping",
          "remove it"),
    frame("too many ratios", {"damping": {"ratios": [0.01] * 19}}, BAD, "damping.ratios", "limit 18"),
    frame("two kinds of damping", {"damping": {"ratio": 0.01, "rayleigh": {"beta": 1e-4}}}, BAD, "damping", "keep one"),
    frame("negative damping", {"damping": {"ratios": [0.01, -0.01]}}, BAD, "damping.ratios[1]", "negative"),
    frame("damping in percent", {"damping": {"ratio": 2.0}}, BAD, "damping.ratio", "give 0.02"),
    frame("nan damping", {"damping": {"rayleigh": {"beta": math.nan}}}, BAD, "damping.rayleigh.beta"),
    # frame or solid
    frame("frame and solid", {"solid": SOLID["solid"]}, BAD, "", "exactly one of the tables"),
    frame("neither", {"frame": None}, BAD, "", "exactly one of the tables"),
    # solids
    solid("no mesh file", {"solid": {"mesh": "bx.inp"}}, Cause.FILE_NOT_FOUND, "solid.mesh", "no such mesh file"),
    solid("mesh without name", {"solid": {"mesh": ""}}, Cause.FILE_NOT_FOUND, "solid.mesh"),
    solid("mesh with NUL", {"solid": {"mesh": "a\0b"}}, Cause.FILE_NOT_FOUND, "solid.mesh"),
    solid("unknown material", {"solid": {"material": "steel"}}, REFERENCE, "solid.material", "known: m"),
    solid("no material", {"solid": {"material": ""}}, BAD, "solid", "no *SOLID SECTION"),
    solid("material and regions", {"solid": {"regions": [{"set": "all", "material": "m"}]}}, BAD, "solid",
          "give one of"),
    solid("unknown region", {"solid": {"material": "", "regions": [{"set": "al", "material": "m"}]}}, REFERENCE,
          "solid.regions[0].set", "did you mean 'all'?"),
    solid("unknown face", {"interfaces": [{"name": "x", "face": "x7"}]}, Cause.INTERFACE, "interfaces[0].face",
          "x0, x1"),
    solid("face of elements", {"interfaces": [{"name": "x", "face": "all"}]}, Cause.INTERFACE, "interfaces[0].face",
          "set of solid elements"),
    solid("node of a solid", {"interfaces": [{"name": "x", "node": "n"}]}, Cause.INTERFACE, "interfaces[0].node",
          "face = SET"),
    solid("one face twice", {"interfaces": [{"name": "a", "face": "x0"}, {"name": "b", "face": "x0"}]},
          Cause.INTERFACE, "", "share 8 nodes"),
    solid("position far away", {"interfaces": [{"name": "a", "face": "x0", "position": [0.0, 50.0, 0.0]}]},
          Cause.INTERFACE, "", "far from its face"),
    solid("nan position", {"interfaces": [{"name": "a", "face": "x0", "position": [0.0, math.nan, 0.0]}]},
          BAD, "interfaces[0].position", "finite"),
    solid("named node far away", {"solid": {"nodes": {"n": [9.0, 0.0, 0.0]}}}, REFERENCE, "solid.nodes.n", "units"),
    solid("named node nan", {"solid": {"nodes": {"n": [math.nan, 0.0, 0.0]}}}, BAD, "solid.nodes.n", "finite"),
    solid("inertia on a mesh node", {"solid": {"nodes": {"n": [0.1, 0.0, 0.0]}},
                                     "masses": [{"node": "n", "inertia": [1.0, 1.0, 1.0]}]},
          BAD, "masses[0].inertia", "no rotations"),
]  # fmt: skip


def pruned(table: dict[str, Any]) -> dict[str, Any]:
    """Without the keys that a change set to None."""
    return {k: pruned(v) if isinstance(v, dict) else v for k, v in table.items() if v is not None}


def checked(error: FEImportError, file: str) -> str:
    """What holds for every fault: exit code, file, remedy, one printable line, a JSON object."""
    assert type(error) is FEImportError
    assert error.exit_code == 2
    text = str(error)
    assert file in text
    assert error.remedy
    assert "\n" not in text
    assert len(text) < 600
    assert "np." not in text
    as_json = json.loads(json.dumps(error.as_dict()))
    assert set(as_json) == {"cause", "message", "where", "value", "limit", "remedy"}
    assert as_json["cause"] == str(error.cause)
    return text


@pytest.mark.parametrize("fault", FAULTS, ids=lambda f: f.name)
def test_faulty_links_are_named(tmp_path: Path, fault: Fault) -> None:
    write_box(tmp_path / "box.inp")
    path = write_toml(tmp_path / "link.toml", pruned(merged(fault.base, fault.changes)))
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(FEImportError) as caught:
        reduce_link(path)
    error = caught.value
    text = checked(error, str(path))
    assert error.cause is fault.cause
    assert error.where == (f"{path}: {fault.place}" if fault.place else str(path))
    assert fault.words in text
    assert sorted(tmp_path.rglob("*")) == before


def test_the_sound_descriptions_are_sound(tmp_path: Path) -> None:
    """Without a fault both reduce, so each fault above is what is refused."""
    write_box(tmp_path / "box.inp")
    for base in (FRAME, SOLID):
        modal = reduce_link(write_toml(tmp_path / "link.toml", base))
        assert all(c.ok for c in modal.health)
    assert len({f.name + f.place for f in FAULTS}) == len(FAULTS)


NOT_TOML = [
    ("not TOML", b"frame = [", Cause.SYNTAX),
    ("key twice", b"name = 'a'\nname = 'b'\n", Cause.SYNTAX),
    ("number of 5000 digits", b"name = " + b"1" * 5000, Cause.SYNTAX),
    ("nested deeply", b"a = " + b"[" * 100000, Cause.SYNTAX),
    ("not UTF-8", b"name = '\xff\xfe'", Cause.NOT_READABLE),
    ("binary", bytes(range(256)), Cause.NOT_READABLE),
    ("empty", b"", Cause.BAD_FIELD),
]


@pytest.mark.parametrize(("content", "cause"), [n[1:] for n in NOT_TOML], ids=[n[0] for n in NOT_TOML])
def test_files_that_are_no_description(tmp_path: Path, content: bytes, cause: Cause) -> None:
    path = tmp_path / "link.toml"
    path.write_bytes(content)
    with pytest.raises(FEImportError) as caught:
        load_link(path)
    checked(caught.value, str(path))
    assert caught.value.cause is cause


def test_byte_order_mark(tmp_path: Path) -> None:
    path = write_toml(tmp_path / "link.toml", FRAME)
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes())
    assert load_link(path).description == frame_link(tmp_path).description


def test_files_that_are_no_files(tmp_path: Path) -> None:
    (tmp_path / "folder.toml").mkdir()
    (tmp_path / "file.toml").write_text("", encoding="utf-8")
    for name, cause in (
        ("missing.toml", Cause.FILE_NOT_FOUND),
        ("folder.toml", Cause.NOT_READABLE),
        ("file.toml/inside.toml", Cause.NOT_READABLE),
        ("x" * 5000, Cause.NOT_READABLE),
        ("nul\0.toml", Cause.NOT_READABLE),
    ):
        with pytest.raises(FEImportError) as caught:
            load_link(tmp_path / name)
        assert caught.value.cause is cause
        assert caught.value.remedy
        assert caught.value.exit_code == 2


def test_files_too_large(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fe_import.files.toml._MAX_BYTES", 10)
    path = write_toml(tmp_path / "big.toml", {"name": "longer than ten bytes"})
    with pytest.raises(FEImportError, match="too large") as caught:
        read_toml(path)
    checked(caught.value, str(path))


def test_faulty_overrides_are_named_like_fields(tmp_path: Path) -> None:
    """What the command line passes on is checked like the file."""
    path = frame_link(tmp_path).path
    for overrides, field in (({"elastic_modes": -2}, "elastic_modes"), ({"form": "x"}, "form"), ({"mode": 3}, "mode")):
        with pytest.raises(FEImportError) as caught:
            load_link(path, overrides)
        assert caught.value.where == f"{path}: reduction.{field}"
    bad = write_toml(tmp_path / "bad.toml", {**FRAME, "reduction": 3})
    with pytest.raises(FEImportError, match="give a table"):
        load_link(bad, {"elastic_modes": 3})


HUGE = "z" * 10_000


@pytest.mark.parametrize(
    "changes",
    [
        {HUGE: 1},
        {"materials": {HUGE: {"density": "x"}}},
        {"materials": {"m": {HUGE: 1.0}}},
        {"frame": {"theory": HUGE}},
        {"reduction": {"method": HUGE}},
        {"reduction": {"elastic_modes": 10**400}},
        {"sections": {"s": {"shape": HUGE}}},
        {"interfaces": [{"name": HUGE, "node": HUGE}]},
        {"damping": {"ratios": HUGE}},
        {"materials": {"m": {"density": [1.0] * 5000}}},
    ],
    ids=lambda c: shortened(str(c))[:30],
)
def test_huge_values_are_not_echoed(tmp_path: Path, changes: dict[str, Any]) -> None:
    """A message stays below 600 characters whatever stands in the file."""
    with pytest.raises(FEImportError) as caught:
        reduce_link(write_toml(tmp_path / "link.toml", merged(FRAME, changes)))
    checked(caught.value, "link.toml")
    assert all(len(v or "") < 400 for v in caught.value.as_dict().values())


def test_values_that_cannot_be_printed() -> None:
    """Integers beyond Python's limit for text, as hexadecimal TOML integers can be."""
    error = FEImportError(Cause.BAD_FIELD, "too large", where="l.toml", value=16**5000, limit=16**5000, remedy="less")
    assert "thousands of digits" in str(error)
    assert "thousands of digits" in str(error.as_dict()["value"])
    assert shortened("a" * 80) == "a" * 80
    assert shortened("a" * 81) == "a" * 55 + "... (81 characters)"
    assert len(shortened("a" * 10**6)) <= 80


def test_message_is_put_together() -> None:
    """Place, message, value and limit, remedy; parts that are not given are left out."""
    error = FEImportError(Cause.BAD_FIELD, "too wide", where="l.toml: w", value=3, limit=2, remedy="narrow it")
    assert str(error) == "l.toml: w: too wide; got 3, limit 2; narrow it"
    assert str(FEImportError(Cause.BAD_FIELD, "too wide", limit=2)) == "too wide; limit 2"
    assert str(FEImportError(Cause.BAD_FIELD, "too wide", value="x")) == "too wide; got 'x'"
    assert isinstance(error, ReportedError)
    assert FEImportError(Cause.EIGENSOLVER, "x").exit_code == 3
    assert error.as_dict() == {
        "cause": "bad field", "message": "too wide", "where": "l.toml: w", "value": "3", "limit": "2",
        "remedy": "narrow it",
    }  # fmt: skip


def test_long_registries_are_cut() -> None:
    """The names of 2000 nodes do not fill the screen, the near one is still suggested."""
    names = [f"leg/{k}" for k in range(2000)]
    with pytest.raises(FEImportError) as caught:
        choose("leg1999", names, "l.toml: node")
    assert "did you mean 'leg/1999'?" in caught.value.remedy
    assert "and 1970 more" in caught.value.remedy
    with pytest.raises(FEImportError, match="none is defined"):
        choose("m", {}, "l.toml: material")


def test_bad_elements_deep_in_tables() -> None:
    """The key of a table of names is found even when two of them look alike."""
    data = merged(FRAME, {"materials": {"a": FRAME["materials"]["m"], "b.c": {"density": "x"}, "d": {"density": "y"}}})
    with pytest.raises(FEImportError) as caught:
        convert(data, LinkDescription, "l.toml")
    assert caught.value.where == "l.toml: materials.b.c.density"
    assert caught.value.value == "x"
