"""The door of the package: same input, same bytes; the cache; what a modal file says about its origin."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from link_files import frame_link, solid_link, write_box
from modal_models import same

import fe_import
import fe_import.cache
import fe_import.reduce
from fe_import.cache import cache_key, reduce_cached
from fe_import.description.link import LinkFile, load_link
from fe_import.errors import FEImportError
from fe_import.modal.file import read_modal_file, write_modal_file
from fe_import.modal.model import ModalModel
from fe_import.reduce import reduce_link, reduction_summary

KINDS = pytest.mark.parametrize("make", [frame_link, solid_link])


@KINDS
@pytest.mark.parametrize("form", ["orthonormal", "physical"])
def test_same_link_same_bytes(tmp_path: Path, make: type, form: str) -> None:
    """Reduced twice and written twice: equal to the last bit; and read back likewise."""
    link: LinkFile = make(tmp_path, reduction={"form": form})
    files = [tmp_path / f"{k}.modal.h5" for k in range(2)]
    for file in files:
        write_modal_file(file, reduce_link(link))
    assert files[0].read_bytes() == files[1].read_bytes()
    assert same(read_modal_file(files[0]), reduce_link(link))


def test_link_by_path_or_loaded(tmp_path: Path) -> None:
    link = frame_link(tmp_path)
    assert same(reduce_link(link), reduce_link(link.path))
    assert same(reduce_link(link), fe_import.reduce_link(str(link.path)))
    with pytest.raises(AttributeError, match=r"attribute.*nothing"):
        _ = fe_import.nothing


def test_content_hash_is_of_the_content(tmp_path: Path) -> None:
    """Comments, order and place of the file do not matter; any field does, the name among them, and the mesh."""
    link = frame_link(tmp_path, name="l")
    text = link.path.read_text(encoding="utf-8")
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    moved = elsewhere / "other.toml"
    moved.write_text("# a comment\n" + "\n".join(reversed(text.splitlines())), encoding="utf-8")
    assert load_link(moved).content_hash() == link.content_hash()
    assert cache_key(load_link(moved)) == cache_key(link)
    hashes = {link.content_hash(), frame_link(tmp_path, name="k").content_hash()}
    hashes.add(frame_link(tmp_path, name="l", materials={"m": {"density": 2700.0000001}}).content_hash())
    hashes.add(frame_link(tmp_path, name="l", reduction={"elastic_modes": 4}).content_hash())
    assert len(hashes) == 4
    solid = solid_link(tmp_path)
    before = solid.content_hash()
    write_box(tmp_path / "box.inp", 1.5)
    assert solid.content_hash() != before
    (tmp_path / "box.inp").unlink()
    assert solid.content_hash() not in (before, *hashes)  # no mesh: reported when it is read


class Counter:
    """Counts reductions."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.count = 0
        true = fe_import.reduce.reduce_link

        def counting(link: LinkFile, tell: object = None) -> ModalModel:
            self.count += 1
            return true(link)

        monkeypatch.setattr(fe_import.reduce, "reduce_link", counting)


@KINDS
def test_second_call_reads(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, make: type) -> None:
    counter, cache = Counter(monkeypatch), tmp_path / "deep" / "cache"
    link: LinkFile = make(tmp_path)
    first, cached = reduce_cached(link, cache)
    assert (cached, counter.count) == (False, 1)
    second, cached = reduce_cached(link, cache)
    assert (cached, counter.count) == (True, 1)
    assert same(first, second)
    assert [p.name for p in cache.iterdir()] == [f"{cache_key(link)}.modal.h5"]


def test_changed_content_misses(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A changed field, a changed mesh, another version of this package's code."""
    counter, cache = Counter(monkeypatch), tmp_path / "cache"
    reduce_cached(frame_link(tmp_path), cache)
    assert reduce_cached(frame_link(tmp_path, reduction={"elastic_modes": 3}), cache)[1] is False
    assert reduce_cached(frame_link(tmp_path), cache)[1] is True
    solid = solid_link(tmp_path)
    mass = reduce_cached(solid, cache)[0].mass_properties.mass
    write_box(tmp_path / "box.inp", 1.1)
    bigger, cached = reduce_cached(solid, cache)
    assert not cached
    assert bigger.mass_properties.mass == pytest.approx(1.331 * mass, rel=1e-12)
    assert counter.count == 4
    key = cache_key(solid)
    monkeypatch.setattr(fe_import.cache, "_sources_hash", lambda: "other code")
    assert cache_key(solid) != key


@pytest.mark.parametrize("damage", ["empty", "text", "cut", "other link", "flipped"])
def test_corrupt_entry_is_made_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, damage: str) -> None:
    counter, cache = Counter(monkeypatch), tmp_path / "cache"
    link = frame_link(tmp_path)
    good, _ = reduce_cached(link, cache)
    entry = cache / f"{cache_key(link)}.modal.h5"
    content = entry.read_bytes()
    if damage == "flipped":  # every tenth byte of the second half
        half = len(content) // 2
        broken = content[:half] + bytes(b ^ 255 if k % 10 == 0 else b for k, b in enumerate(content[half:]))
    else:
        broken = {"empty": b"", "text": b"not a modal file", "cut": content[: len(content) // 2],
                  "other link": content[:512] + bytes(len(content) - 512)}[damage]  # fmt: skip
    entry.write_bytes(broken)
    again, cached = reduce_cached(link, cache)
    assert (cached, counter.count) == (False, 2)
    assert same(again, good)
    assert entry.read_bytes() == content
    assert reduce_cached(link, cache)[1] is True


@pytest.mark.parametrize("obstacle", ["file in the folder's place", "folder in the entry's place", "no permission"])
def test_unusable_cache_is_harmless(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, obstacle: str) -> None:
    """The reduction comes back all the same, and nothing is left behind."""
    link, cache = frame_link(tmp_path), tmp_path / "cache"
    if obstacle.startswith("file"):
        cache.write_text("in the way", encoding="utf-8")
    elif obstacle.startswith("folder"):
        (cache / f"{cache_key(link)}.modal.h5").mkdir(parents=True)
    else:

        def refuse(*arguments: object, **options: object) -> None:
            raise PermissionError(13, "Permission denied")

        for name in ("mkdir", "exists", "is_file"):
            monkeypatch.setattr(Path, name, refuse)
    for _ in range(2):
        model, cached = reduce_cached(link, cache)
        assert not cached
        assert model.elastic_modes == 18
    monkeypatch.undo()
    if obstacle.startswith("folder"):
        assert [p.name for p in cache.iterdir()] == [f"{cache_key(link)}.modal.h5"]
        assert list((cache / f"{cache_key(link)}.modal.h5").iterdir()) == []


def test_faulty_link_leaves_no_entry(tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    for _ in range(2):
        with pytest.raises(FEImportError):
            reduce_cached(frame_link(tmp_path, reduction={"elastic_modes": 999}), cache)
    assert not cache.exists() or not list(cache.iterdir())


@KINDS
def test_origin_and_summary(tmp_path: Path, make: type) -> None:
    """Provenance names source, content, method, options and versions, no folder; the summary is plain JSON."""
    link: LinkFile = make(tmp_path, reduction={"fixed_interface_modes": 5})
    modal = reduce_link(link)
    origin = modal.provenance
    assert origin["source"] == "link.toml"
    assert origin["sha256"] == link.content_hash()
    assert origin["method"] == "craig-bampton"
    assert json.loads(origin["options"])["fixed_interface_modes"] == 5
    assert origin["interface_dofs"] == "12"
    assert "numpy" in origin["versions"]
    assert str(tmp_path) not in json.dumps(origin)
    summary = json.loads(json.dumps(reduction_summary(modal)))
    assert summary["elastic_modes"] == 11 == len(summary["frequencies_hz"])
    assert summary["dofs"] == int(origin["dofs"])
    assert summary["health"]["ok"] is True
    assert summary["mass"] == modal.mass_properties.mass
    physical = reduction_summary(reduce_link(make(tmp_path, reduction={"form": "physical"})))
    assert physical["elastic_modes"] is None
    assert physical["frequencies_hz"] == []
