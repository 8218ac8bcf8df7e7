"""The gallery of the documentation: a picture of every scene of ``data/``, a line about it, and how long it runs.

    python benchmarks/gallery.py [NAME ...]

writes docs/gallery.md and its pictures. With names (`l_shape/steel_tall`) it makes those anew and leaves the others;
scenes that are gone, go. The line is the first sentence of the scene's own comment. Times are those of the processor
for a second run from the scene file on, without a verdict, which takes about as long again: beside other work they say
more than a clock.
"""

from __future__ import annotations

import re
import sys
import tempfile
import time
from pathlib import Path
from textwrap import fill

from PIL import Image

import erls
from erls.files.output import replacing
from erls.run.record import Run
from erls.view import picture
from fe_import.errors import ReportedError

ROOT = Path(__file__).parents[1]
PAGE, PICTURES = ROOT / "docs/gallery.md", ROOT / "docs/gallery"
WIDTH, QUALITY = 400, 80  # pixels
_HEAD = """# Gallery

Every scene of `data/`, at a few times of its motion or under its last load, and what a run takes of one core once
everything is compiled and reduced, without a verdict. `python benchmarks/gallery.py` makes this page.

| | scene | processor time |
|---|---|---|
"""
_ROW = re.compile(r"^\| !\[(?P<name>\S+)\].*$", re.MULTILINE)


def scenes() -> dict[str, Path]:
    """All scenes by name; other files describe links and problems."""
    found = {}
    for path in sorted((ROOT / "data").glob("*/*.toml")):
        try:
            erls.load_scene(path)
        except ReportedError:
            continue
        found[path.relative_to(ROOT / "data").with_suffix("").as_posix()] = path
    return found


def line(path: Path) -> str:
    """The first sentence of a scene's comment."""
    words = []
    for text in path.read_text(encoding="utf-8").splitlines():
        if not text.startswith("#"):
            break
        words.append(text.lstrip("# "))
    sentence = re.split(r"(?<=[a-z0-9)])[.:;] ", " ".join(words) + " ", maxsplit=1)[0]
    return sentence.strip().rstrip(".:;").replace("|", "/") + "."


def timed(path: Path) -> tuple[Run, float]:
    """A run and its processor time [s], of the second one: the first may compile and reduce."""
    for _ in range(2):
        begun = time.process_time()
        run = erls.simulate(erls.load_scene(path), verdict=False)
        took = time.process_time() - begun
    return run, took


def row(name: str, path: Path) -> str:
    """Of the table; draws the picture."""
    run, took = timed(path)
    place = PICTURES / f"{name.replace('/', '-')}.jpg"
    place.parent.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        large = Path(folder) / "r.png"
        picture(run, large, size=(2 * WIDTH, 3 * WIDTH // 2))
        with Image.open(large) as image:
            small = image.convert("RGB")
    small.thumbnail((WIDTH, WIDTH))
    with replacing(place) as temporary:
        small.save(temporary, "JPEG", quality=QUALITY, optimize=True)
    shown = f"{1e3 * took:.0f} ms" if took < 1 else f"{took:.1f} s"
    return f"| ![{name}](gallery/{place.name}) | `data/{name}.toml`: {line(path)} | {shown} |"


def page(rows: dict[str, str], every: list[str]) -> str:
    """What is drawn, and what is not yet."""
    missing = [f"`data/{name}.toml`" for name in every if name not in rows]
    told = fill(f"Not drawn yet: {', '.join(missing)}.", 120, break_long_words=False) + "\n" if missing else ""
    return _HEAD + "\n".join(rows[name] for name in every if name in rows) + "\n" + ("\n" + told if told else "")


def main() -> None:
    """Write page and pictures."""
    asked, every = sys.argv[1:], scenes()
    unknown = set(asked) - set(every)
    if unknown:
        raise SystemExit(f"no such scenes: {', '.join(sorted(unknown))}; known: {', '.join(every)}")
    known = PAGE.read_text(encoding="utf-8") if PAGE.exists() else ""
    rows = {found["name"]: found[0] for found in _ROW.finditer(known)} if asked else {}
    for name, path in every.items():
        if name in asked or not asked:
            rows[name] = row(name, path)
            print(rows[name], flush=True)
        PAGE.write_text(page(rows, list(every)), encoding="utf-8")
    for left in PICTURES.glob("*.jpg"):
        if left.stem not in {name.replace("/", "-") for name in every}:
            left.unlink()


if __name__ == "__main__":
    main()
