"""Every command and example of the documentation runs; its tables, links and names are those of the program."""

from __future__ import annotations

import importlib
import re
import shutil
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import pytest
from pages import DOCS, PAGES, ROOT, blocks, run, shell_lines

from erls.report.documentation import tables, written
from erls.report.fields import PAGES as FILES
from erls.report.fields import documentation

REGENERATE = "python -m erls.report.documentation docs"
GALLERY = "python benchmarks/gallery.py"
RECORDS = dict(FILES.values())


@pytest.mark.parametrize("page", [page for page in DOCS if shell_lines(page) or blocks(page, "python")])
def test_commands_and_python_examples_run_in_order(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Word for word, in a folder that looks like a checkout; commands of one page first, then its Python."""
    shutil.copytree(ROOT / "data", tmp_path / "data")
    shutil.copytree(ROOT / "docs", tmp_path / "docs", ignore=shutil.ignore_patterns("__pycache__"))
    for command in shell_lines(page):
        assert command.startswith("erls ") or command == REGENERATE
        run(command, tmp_path)
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    for block in blocks(page, "python"):
        exec(compile(block, page, "exec"), names)


@pytest.mark.parametrize("page", [page for page in PAGES if blocks(page, "toml")])
def test_toml_examples_fit_the_schema(page: str) -> None:
    """Fragments too: each of their tables is one of a link description, a scene, or a scene of bodies."""
    kinds = {**dict.fromkeys(PAGES, tuple(RECORDS.values())), **{f"docs/{p}": (r,) for p, r in RECORDS.items()}}
    for block in blocks(page, "toml"):
        tables = tomllib.loads(block)
        assert any(_fits(tables, record) for record in kinds[page]), block


def _fits(tables: dict[str, Any], record: type[msgspec.Struct]) -> bool:
    """Whether all tables are fields of a record, or of one joint."""
    types = {f.encode_name: f.type for f in msgspec.structs.fields(record)}
    if record is RECORDS["scenes.md"] and "drive" in tables:
        from erls.mechanism.drives import DriveRecord

        types["drive"] = DriveRecord
    if not set(tables) <= set(types):
        return False
    for name, table in tables.items():
        msgspec.convert(table, types[name], strict=True)
    return True


def _example(page: str, words: str) -> str:
    return next(block for block in blocks(page, "toml") if words in block)


def test_annotated_link_and_scene_run(tmp_path: Path) -> None:
    """The link description and the scene that show the fields are valid as printed, and simulate."""
    import erls

    scene = _example("docs/scenes.md", 'name = "pick and place"')
    (tmp_path / "links").mkdir()
    (tmp_path / "links" / "arm.toml").write_text(_example("docs/links.md", "[frame.nodes]"), encoding="utf-8")
    (tmp_path / "scene.toml").write_text(scene, encoding="utf-8")
    run = erls.simulate(erls.load_scene(tmp_path / "scene.toml", ["simulation.duration=0.1"]))
    assert run.end == 0.1
    assert set(tomllib.loads(scene)) == {
        *("name", "gravity", "simulation", "base", "initial", "joints", "links", "points"),
        *("payloads", "loads", "contacts", "events"),
    }


def test_drive_examples_are_valid() -> None:
    """The drives decode and build, every profile among them."""
    from erls.errors import SceneError
    from erls.mechanism.drives import DriveRecord, build_drive
    from fe_import.files.toml import convert

    drives = [tomllib.loads(block)["drive"] for block in blocks("docs/scenes.md", "toml") if block.startswith("drive")]
    built = [build_drive(convert(d, DriveRecord, "scenes.md", SceneError), ROOT, "scenes.md", True) for d in drives]
    assert built[0].torque(0.1, 0.0, 0.0) != 0
    assert built[1].prescribed


def test_defaults_are_as_printed() -> None:
    """Fields marked #= in the annotated scene and link hold the default of the schema."""
    from erls.scene.chain import Simulation
    from fe_import.description.records import Frame, Member

    simulation = Simulation(duration=1.0)
    assert (simulation.formulation, simulation.gauge) == ("erls", "joint-angle")
    assert (simulation.rtol, simulation.atol, simulation.spectral_radius) == (1e-8, 1e-12, 0.8)
    frame = Frame(nodes={}, members=[])
    assert (frame.theory, frame.mass, frame.rotary_inertia, frame.torsion) == (
        *("timoshenko", "consistent", True, "saint-venant"),
    )
    assert Member(start="a", end="b").elements == 1


@pytest.mark.parametrize("page", DOCS)
def test_tables_are_those_of_the_program(page: str) -> None:
    """What stands there is what is made from the records and registries."""
    assert PAGES[page] == written(PAGES[page]), f"run: {REGENERATE}"


def test_every_table_stands_on_a_page() -> None:
    """Between its marks."""
    marks = re.findall(r"<!-- table: (.+?) -->", "".join(PAGES.values()))
    assert sorted(marks) == sorted(tables())


def _records(kind: Any) -> Iterator[type[msgspec.Struct]]:
    """Every record in a type."""
    if isinstance(kind, msgspec.inspect.StructType):
        yield kind.cls
        for f in kind.fields:
            yield from _records(f.type)
    for part in (getattr(kind, "item_type", None), getattr(kind, "value_type", None), *getattr(kind, "types", ())):
        yield from _records(part) if part is not None else ()


@pytest.mark.parametrize("page", RECORDS)
def test_no_field_is_missing(page: str) -> None:
    """Every record that the file may hold has a description of every field, and its tables name them all."""
    shown = set(re.findall(r"`(\w+)`", "".join(PAGES[f"docs/{other}"] for other in RECORDS)))
    for record in dict.fromkeys(_records(msgspec.inspect.type_info(RECORDS[page]))):
        _, entries = documentation(record)
        assert all(len(text) >= 3 for _, text in entries)
        assert {f.encode_name for f in msgspec.structs.fields(record)} <= shown
        config = record.__struct_config__
        assert config.tag is None or f'**`{config.tag_field} = "{config.tag}"`**' in "".join(PAGES.values())


def test_a_field_without_description_is_refused() -> None:
    """And a description without its field."""

    class Bare(msgspec.Struct):
        """A record.

        Attributes
        ----------
        mass : float
            [kg]
        """

        mass: float
        size: float

    with pytest.raises(LookupError, match="size"):
        documentation(Bare)


def _anchors(text: str) -> list[str]:
    """Where links may lead to on a page, as GitHub names its headings."""
    plain = re.sub(r"```.*?```", "", text, flags=re.DOTALL)
    headings = re.findall(r"^#+ (.*)$", plain, flags=re.MULTILINE)
    return [re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings]


@pytest.mark.parametrize("page", PAGES)
def test_links_lead_somewhere(page: str) -> None:
    """Files and headings that a page links to are there; headings differ."""
    anchors = _anchors(PAGES[page])
    assert len(anchors) == len(set(anchors))
    for target in re.findall(r"\]\(([^)\s]+)\)", PAGES[page]):
        name, _, anchor = target.partition("#")
        path = (ROOT / page).parent / name if name else ROOT / page
        assert path.exists(), target
        if anchor:
            assert anchor in _anchors(path.read_text(encoding="utf-8")), target


def test_the_gallery_shows_every_scene() -> None:
    """By its name, with a picture of its own, or as not drawn yet; no other pictures, and all of them small. Others
    files of ``data/`` are descriptions of links, and problems.
    """
    page = PAGES["docs/gallery.md"]
    for path in sorted((ROOT / "data").glob("*/*.toml")):
        name = path.relative_to(ROOT / "data").with_suffix("").as_posix()
        tables = tomllib.loads(path.read_text(encoding="utf-8"))
        scene = "simulation" in tables or not {"beams", "bodies", "shells"}.isdisjoint(tables)
        drawn = f"| ![{name}](gallery/{name.replace('/', '-')}.jpg) |" in page
        assert drawn or f"`data/{name}.toml`" in page if scene else not drawn, f"{GALLERY} {name}"
    pictures = list((ROOT / "docs/gallery").iterdir())
    assert {f"gallery/{picture.name}" for picture in pictures} == set(re.findall(r"gallery/[^)]+\.jpg", page))
    assert sum(picture.stat().st_size for picture in pictures) < 1.5e6


def test_the_page_of_shells_holds_every_table_of_their_benchmark() -> None:
    """As `benchmarks/shells.py --page` puts them there."""
    text = (ROOT / "benchmarks/shells.py").read_text(encoding="utf-8").partition("TABLES: ")[2].partition("\n}\n")[0]
    found = dict(re.findall(r"```text (\S+)\n(.*?)```", PAGES["docs/shells.md"], flags=re.DOTALL))
    assert sorted(found) == sorted(re.findall(r'^    "([\w-]+)":', text, flags=re.MULTILINE))
    assert all(len(table.splitlines()) > 2 for table in found.values())


@pytest.mark.parametrize("page", PAGES)
def test_places_and_names_exist(page: str) -> None:
    """Files, modules and functions that a page names are there."""
    for place in re.findall(r"`((?:data|docs|tests|erls|fe_import|benchmarks)/[^`*<> ]*)`", PAGES[page]):
        assert (ROOT / place).exists(), place
    for name in re.findall(r"`((?:erls|fe_import)(?:\.\w+)+)`", PAGES[page]):
        assert _resolves(name), name


def _resolves(name: str) -> bool:
    """Whether a dotted name is a module, or something in one."""
    parts = name.split(".")
    for k in range(len(parts), 0, -1):
        try:
            found: Any = importlib.import_module(".".join(parts[:k]))
        except ImportError:
            continue
        try:
            for part in parts[k:]:
                found = getattr(found, part)
        except AttributeError:
            return False
        return True
    return False
