"""The commands for who begins: ``erls new``, ``erls examples``, ``erls schema``."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Literal

from cyclopts import App

import erls
from erls.cli.terminal import Force, Json, Output, print_json

examples = App(name="examples", help="Scenes that come with the program.", help_format="plaintext")

_NEXT = "erls simulate {scene} -o {name}.run.h5"


def new(
    kind: Literal["chain", "robot", "loop", "solid", "matrices"], folder: Path | None = None, /, *, json: Json = False
) -> None:
    """Write a scene to start from, with its links, comments that say what to change, and the commands that run it.

    Beside it lie the schemas that its files name in their first lines, for editors that complete and check TOML.

    Parameters
    ----------
    kind
        An arm on a joint, a robot with two links and drives, a closed loop, a link from a solid mesh, or one from
        matrices that another program exported.
    folder
        Folder to make; that of the kind unless given.
    json
        Print one JSON object.
    """
    target = Path(kind) if folder is None else folder
    _copied(_shipped() / "start" / kind, target, _with_schemas)
    scene = target / "scene.toml"
    if json:
        return print_json({"kind": kind, "folder": str(target), "scene": str(scene), "files": _files(target)})
    print(f"written to {target}: {', '.join(_files(target))}\nnext: {_NEXT.format(scene=scene, name=target.name)}")


@examples.command(name="list")
def list_(*, json: Json = False) -> None:
    """Name the scenes that come with the program, with a line on each.

    Parameters
    ----------
    json
        Print one JSON object.
    """
    folder = _shipped()
    found = {str(path.relative_to(folder).with_suffix("")): _headline(path) for path in _scenes(folder)}
    if json:
        return print_json({"examples": found})
    width = max(map(len, found))
    print("\n".join(f"{name:<{width}}  {text}" for name, text in found.items()))


@examples.command
def copy(name: str, folder: Path | None = None, /, *, json: Json = False) -> None:
    """Copy a group of scenes with their links, or all.

    Parameters
    ----------
    name
        A group, such as robot, one of its scenes, or all.
    folder
        Folder to make; that of the group, or examples, unless given.
    json
        Print one JSON object.
    """
    from erls.errors import SceneError
    from fe_import.files.toml import choose

    shipped = _shipped()
    groups = sorted({path.relative_to(shipped).parts[0] for path in _scenes(shipped)})
    group, _, scene = name.strip("/").partition("/")
    choose(group, ["all", *groups], "name", SceneError)
    if scene:
        stems = [str(path.relative_to(shipped / group).with_suffix("")) for path in _scenes(shipped / group)]
        choose(scene.removesuffix(".toml"), stems, "name", SceneError)
    target = folder or Path("examples" if group == "all" else group)
    _copied(shipped if group == "all" else shipped / group, target)
    if json:
        return print_json({"folder": str(target), "files": _files(target)})
    print(f"written to {target}: {', '.join(_files(target))}")


def schema(
    kind: Literal["scene", "link", "bodies", "problem"],
    /,
    *,
    output: Output = None,
    force: Force = False,
    json: Json = False,
) -> None:
    """JSON schema of scenes, links, scenes of bodies or problems, for editors that complete and check TOML.

    A first line "#:schema ./scene.schema.json" in a TOML file names it to them.

    Parameters
    ----------
    kind
        Of the file.
    output
        File to write; printed unless given.
    force
        Replace an existing file that is no JSON file.
    json
        The schema is JSON in any case: print it, or with -o an object that names the file.
    """
    from erls.cli.reports import dumped, write
    from erls.files.results import claim
    from erls.report.schema import json_schema

    if output is None:
        return print_json(json_schema(kind))
    claim(output, ".json", [], force)
    write(output, dumped(json_schema(kind)))
    if json:
        return print_json({"kind": kind, "output": str(output)})
    print(f"written to {output}")


def _shipped() -> Path:
    """Scenes of an installed package lie inside it, those of a checkout beside it."""
    package = Path(erls.__file__).parent
    inside = package / "examples"
    return inside if inside.is_dir() else package.parent / "data"


def _scenes(folder: Path) -> list[Path]:
    """Files with a table of settings."""
    files = sorted(folder.rglob("*.toml"))
    return [path for path in files if "\n[simulation]" in "\n" + path.read_text(encoding="utf-8")]


def _headline(path: Path) -> str:
    """The first sentence of the comment that a scene begins with."""
    lines = []
    for line in path.read_text(encoding="utf-8").splitlines():
        if not line.startswith("# "):
            break
        lines.append(line[2:].strip())
    text = " ".join(lines)
    found = re.match(r"(.{12,}?[^A-Z])([.;:] |\.$)", text)
    return found[1] if found else text


def _files(folder: Path) -> list[str]:
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


def _with_schemas(folder: Path) -> None:
    """The schemas of a scene and its links beside them, and first lines that name them."""
    from erls.cli.reports import dumped
    from erls.report.schema import json_schema

    for kind, files in {"scene": [folder / "scene.toml"], "link": sorted(folder.glob("links/*.toml"))}.items():
        schema = folder / f"{kind}.schema.json"
        schema.write_text(dumped(json_schema(kind)), encoding="utf-8")
        for file in files:
            text, up = file.read_text(encoding="utf-8"), "." if file.parent == folder else ".."
            file.write_text(f"#:schema {up}/{schema.name}\n{text}", encoding="utf-8")


def _copied(source: Path, target: Path, finish: Callable[[Path], None] | None = None) -> None:
    """Copy a folder, and finish it, whole or not at all; nothing is replaced."""
    from erls.files.output import not_writable, temporary_name

    if target.exists() or target.is_symlink():
        raise not_writable(target, "there is a file or folder of that name", "name a folder that does not exist")
    partial = temporary_name(target)
    try:
        shutil.copytree(source, partial)
        if finish is not None:
            finish(partial)
        partial.rename(target)
    except OSError as problem:
        raise not_writable(target, problem, "name a folder that can be made") from None
    finally:
        shutil.rmtree(partial, ignore_errors=True)
