"""The site of the documentation: it is built with no warning, notebooks give what they show, equations have numbers."""

from __future__ import annotations

import ast
import contextlib
import io
import json
import re
import shutil
import sys
import tomllib
from pathlib import Path
from typing import Any

import matplotlib
import matplotlib.pyplot
import pytest
import yaml
from pages import DOCS, PAGES, ROOT

import erls
import fe_import
from erls.report.equation_numbers import numbered

matplotlib.use("Agg")

SITE = ROOT / "docs/site"
NOTEBOOKS = sorted((ROOT / "docs/notebooks").glob("*.ipynb"))
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def _built(folder: Path, out: Path) -> tuple[int, str]:
    """Exit code and warnings of a build that reads all pages and follows all links, and writes none."""
    from sphinx.cmd.build import main

    told = io.StringIO()
    with contextlib.redirect_stderr(told), contextlib.redirect_stdout(io.StringIO()):
        code = main(["-q", "-W", "--keep-going", "-b", "dummy", "-c", str(SITE), str(folder), str(out)])
    return code, told.getvalue()


@pytest.fixture
def kept_modules(monkeypatch: pytest.MonkeyPatch) -> None:
    """What a build puts in the way of modules goes with it."""
    monkeypatch.setattr(sys, "path", list(sys.path))


@pytest.mark.filterwarnings("ignore")  # of packages that Sphinx stands on
@pytest.mark.usefixtures("kept_modules")
def test_the_site_is_built_and_no_link_is_lost(tmp_path: Path) -> None:
    """All pages, with those of public names: none is left out, and every name has its docstring there."""
    import docutils.nodes

    code, told = _built(ROOT / "docs", tmp_path / "site")
    assert (code, told) == (0, "")
    stored = {path.relative_to(tmp_path / "site/.doctrees").as_posix() for path in tmp_path.rglob("*.doctree")}
    pages = {f"{path.removeprefix('docs/').removesuffix('.md')}.doctree" for path in DOCS}
    assert stored >= pages | {f"notebooks/{path.stem}.doctree" for path in NOTEBOOKS}
    for package in (erls, fe_import):
        document = _document(tmp_path / f"site/.doctrees/api/{package.__name__}.doctree")
        names = {name for node in document.findall(docutils.nodes.Element) for name in node.get("ids", ())}
        assert names >= {f"{package.__name__}.{name}" for name in package.__all__}
    labels = {label for node in _theory(tmp_path).findall(docutils.nodes.Element) for label in node.get("ids", ())}
    assert {"t1", "t41"} <= labels


def _document(path: Path) -> Any:
    import pickle  # Sphinx's own form

    return pickle.loads(path.read_bytes())


def _theory(folder: Path) -> Any:
    return _document(folder / "site/.doctrees/theory.doctree")


@pytest.mark.filterwarnings("ignore")
@pytest.mark.usefixtures("kept_modules")
@pytest.mark.parametrize("text", ["[lost](nowhere.md)", "[lost](a.md#nowhere)", "as (T7) says"])
def test_a_link_that_is_lost_fails_the_build(text: str, tmp_path: Path) -> None:
    """To a page, to a heading, to an equation."""
    docs = tmp_path / "docs"
    docs.mkdir()
    (docs / "index.md").write_text("# A\n\n```{toctree}\na\n```\n", encoding="utf-8")
    (docs / "a.md").write_text(f"# A\n\n{text}\n", encoding="utf-8")
    code, told = _built(docs, tmp_path / "site")
    assert code == 1
    assert "xref_missing" in told


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebooks_give_what_they_show(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Cell after cell in one set of names; what they tell is what is stored, word for word; what draws, draws."""
    copy = tmp_path / "docs/notebooks"
    copy.mkdir(parents=True)
    shutil.copytree(ROOT / "data/robot", tmp_path / "data/robot")
    monkeypatch.chdir(copy)
    matplotlib.pyplot.close("all")  # what other tests have drawn
    names: dict[str, Any] = {}
    cells = [cell for cell in json.loads(path.read_text(encoding="utf-8"))["cells"] if cell["cell_type"] == "code"]
    assert sum(bool(cell["outputs"]) for cell in cells) >= 3
    for cell in cells:
        told = io.StringIO()
        with contextlib.redirect_stdout(told):
            exec(compile(ast.parse("".join(cell["source"])), path.name, "exec"), names)
        stored = "".join("".join(shown["text"]) for shown in cell["outputs"] if shown["output_type"] == "stream")
        assert told.getvalue() == stored
        drawn = any("image/png" in shown.get("data", {}) for shown in cell["outputs"])
        assert bool(matplotlib.pyplot.get_fignums()) == drawn
        matplotlib.pyplot.close("all")
    assert path.stat().st_size < 60_000


PAGE = """# Title
<!-- equations: T -->

    a = b                                                                                             (T1)

By (T1), and by (T2).

    new = one

- A list

      in a list                                                                                       (T2)

And (49).
"""


def test_equations_are_numbered_and_what_mentions_them_follows() -> None:
    """One that is new takes a number, and later ones theirs; other brackets and pages stay."""
    page = numbered(PAGE)
    found = re.findall(r"^ +(.+?) +\((T\d)\)$", page, re.MULTILINE)
    assert found == [("a = b", "T1"), ("new = one", "T2"), ("in a list", "T3")]
    assert "By (T1), and by (T3)." in page
    assert "And (49)." in page
    assert numbered(page) == page
    assert numbered(PAGE.replace("<!--", "<!")) == PAGE.replace("<!--", "<!")


def test_equations_that_are_mentioned_are_there() -> None:
    """In the theory, from the first to the last."""
    page = PAGES["docs/theory.md"]
    have = re.findall(r"  \((T\d+)\)$", page, re.MULTILINE)
    assert have == [f"T{k + 1}" for k in range(len(have))]
    assert len(have) > 40
    assert set(re.findall(r"\((T\d+)\)", page)) == set(have)


def test_versions_are_those_of_the_package() -> None:
    """What is cited, and what the changelog tells first."""
    cited = yaml.safe_load((ROOT / "docs/CITATION.cff").read_text(encoding="utf-8"))
    assert {"cff-version", "message", "title", "authors", "version", "license"} <= set(cited)
    assert (cited["version"], cited["license"]) == (PROJECT["version"], PROJECT["license"])
    (first, *_) = re.findall(r"^## (\S+)", PAGES["docs/changelog.md"], re.MULTILINE)
    assert first == PROJECT["version"]
