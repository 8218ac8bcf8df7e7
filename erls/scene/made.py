"""Scenes made in Python, without a file, and scenes written as files."""

from __future__ import annotations

import hashlib
import math
import os
import re
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import msgspec
import numpy as np
import tomlkit

from erls.files.output import check_writable, replacing
from erls.files.results import MARK, MODAL, claim
from erls.scene.bodies.schema import ShellSurface
from erls.scene.build import cache_folder
from erls.scene.inputs import files_of
from erls.scene.links import Link, RigidBody
from erls.scene.read import AnyScene, checked
from erls.scene.sampled import sampled_load, sampled_motion
from fe_import.files.docstrings import record_texts
from fe_import.modal.file import write_modal_file
from fe_import.modal.model import ModalModel

_BARE = re.compile(r"[A-Za-z0-9_-]+")
_WHERE = "make_scene"
# fields that name files, beside those of CSV tables
_PATHS = {Link: ("model", "modal_file"), RigidBody: ("surface",), ShellSurface: ("mesh",)}


def make_scene(*, folder: Path | str = ".", **tables: Any) -> AnyScene:
    """A scene from the tables that a scene file would hold; checked as one.

    Parameters
    ----------
    folder : Path or str
        Where relative paths of links, meshes and tables start.
    **tables
        ``simulation``, ``joints``, ``links`` and the others, as mappings, lists of them, or records of another scene;
        arrays may stand for lists of numbers. The ``model`` of a link may be a `fe_import.ModalModel`, as
        `fe_import.reduce_link` and `fe_import.link_from_skfem` give it, instead of a path. A ``motion``, and profiles
        of drives and factors of loads, may be smooth functions of time, which are sampled over the duration, and 1 %
        beyond, until cubic splines are they to 1e-9 of their range.

    Returns
    -------
    Scene or BodyScene

    Raises
    ------
    SceneError, FEImportError
        Naming field, value and remedy.

    Examples
    --------
    >>> import erls
    >>> rod = {"mass": 1.0, "inertia": [0.0, 0.02, 0.02], "centre_of_mass": [-0.25, 0.0, 0.0], "points": {
    ...     "root": [-0.5, 0.0, 0.0], "tip": [0.0, 0.0, 0.0]}}
    >>> scene = erls.make_scene(
    ...     name="pendulum",
    ...     simulation={"duration": 0.1},
    ...     base={"rotation_deg": [90.0, 0.0, 0.0]},
    ...     joints=[{"name": "hinge", "dh": {"convention": "standard", "a": 0.5}}],
    ...     links=[{"name": "rod", "rigid": rod}],
    ...     points=[{"name": "tip", "link": "rod", "node": "tip"}],
    ... )
    >>> bool(erls.simulate(scene).position("tip", 0.1)[2] < 0)
    True
    """
    data = {name: _plain(value) for name, value in tables.items()}
    duration = data.get("simulation", {}).get("duration") if isinstance(data.get("simulation"), dict) else None
    if isinstance(duration, (int, float)) and 0 < duration < math.inf:  # others are refused below
        data = {name: _sampled(value, float(duration), f"{_WHERE}: {name}") for name, value in data.items()}
    path = Path(folder) / f"{re.sub(r'[^A-Za-z0-9_-]+', '_', str(data.get('name') or 'scene'))}.toml"
    return checked(data, path, _WHERE)


def save_scene(path: Path | str, scene: AnyScene, *, force: bool = False) -> list[Path]:
    """Write a scene as TOML, with a comment on each table; what it leaves at its default is left out.

    Paths of links, meshes and tables are written as seen from there; modal models that were given in Python are written
    beside the file, in ``links``.

    Parameters
    ----------
    path : Path or str
        Ends in ``.toml``.
    scene : Scene or BodyScene
    force : bool
        Replace an existing file that this did not write.

    Returns
    -------
    list of Path
        What was written, the scene last.

    Raises
    ------
    SceneError
        NOT_WRITABLE; also a file that the scene reads, itself included.
    """
    read = [each for each in files_of(scene) if each.exists()]
    claim(Path(path), ".toml", read, force)
    target = check_writable(path)
    record, written = _seen_from(scene.record, scene.folder, target.parent), list[Path]()
    made = [x for x in getattr(record, "links", ()) if x.modal_file and _kept(target.parent / x.modal_file)]
    copies = list[Path]()
    for link in made:
        name = re.sub(r"[^A-Za-z0-9_-]+", "_", link.name)
        copy = Path("links") / f"{name}.modal.h5"
        copies.append(copy if copy not in copies else copy.with_name(f"{name}_{len(copies)}.modal.h5"))
    if made:
        (target.parent / "links").mkdir(exist_ok=True)
        for copy in copies:  # before anything is written
            claim(target.parent / copy, MODAL, read, force)
    for link, copy in zip(made, copies, strict=True):
        with replacing(target.parent / copy) as temporary:
            shutil.copyfile(target.parent / link.modal_file, temporary)
        own = msgspec.structs.replace(link, modal_file=copy.as_posix())
        record = msgspec.structs.replace(record, links=[own if each is link else each for each in record.links])
        written.append(target.parent / copy)
    with replacing(target) as temporary:
        temporary.write_text(scene_text(record), encoding="utf-8")
    return [*written, target]


def scene_text(record: msgspec.Struct) -> str:
    """A record of a scene as TOML: plain fields first, then each table under what it is."""
    plain, tables = [f"# {MARK}"], []
    for name, value in _fields(record):
        if isinstance(value, msgspec.Struct):
            tables.append("\n".join([f"\n# {_said(value)}", f"[{_key(name)}]", *_lines(value)]))
        elif isinstance(value, (list, tuple)) and value and all(isinstance(one, msgspec.Struct) for one in value):
            for k, one in enumerate(value):
                said = [f"# {_said(one)}"] if k == 0 or type(one) is not type(value[k - 1]) else []
                tables.append("\n".join(["", *said, f"[[{_key(name)}]]", *_lines(one)]))
        else:
            plain.append(f"{_key(name)} = {_value(value)}")
    return "\n".join([*plain, *tables]) + "\n"


def _plain(value: Any) -> Any:
    """As parsed TOML has it; a modal model is kept as a file, by its content."""
    if isinstance(value, msgspec.Struct):
        return _plain(dict(_fields(value)))
    if isinstance(value, Mapping):
        found = {str(k): _plain(v) for k, v in value.items() if v is not None}
        if isinstance(value.get("model"), ModalModel):
            found["modal_file"] = str(found.pop("model"))
        return found
    if isinstance(value, (list, tuple)):
        return [_plain(one) for one in value]
    if isinstance(value, ModalModel):
        return _as_file(value)
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    return str(value) if isinstance(value, Path) else value


def _sampled(value: Any, duration: float, where: str) -> Any:
    """With tables in place of functions of time."""
    if isinstance(value, dict):
        return {
            k: sampled_motion(v, duration, f"{where}.{k}")
            if k == "motion" and callable(v)
            else _sampled(v, duration, f"{where}.{k}")
            for k, v in value.items()
        }
    if isinstance(value, list):
        return [
            sampled_load(one, duration, f"{where}[{k}]") if callable(one) else _sampled(one, duration, f"{where}[{k}]")
            for k, one in enumerate(value)
        ]
    return value


def _as_file(model: ModalModel) -> Path:
    """Its modal file among those that are kept."""
    folder = (cache_folder() / "made").absolute()
    folder.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(dir=folder) as made:
        first = Path(made) / "model.modal.h5"
        write_modal_file(first, model)
        path = folder / f"{hashlib.sha256(first.read_bytes()).hexdigest()[:32]}.modal.h5"
        os.replace(first, path)
    return path


def _kept(path: Path) -> bool:
    return path.resolve().parent == (cache_folder() / "made").resolve()


def _fields(record: msgspec.Struct) -> Iterator[tuple[str, Any]]:
    """Names in a file, and values, of all fields that differ from their defaults; the tag first."""
    tag = record.__struct_config__.tag
    if tag is not None:
        yield str(record.__struct_config__.tag_field), tag
    for field in msgspec.structs.fields(type(record)):
        value, default = getattr(record, field.name), field.default
        if field.default_factory is not msgspec.NODEFAULT:
            default = field.default_factory()
        if value is not None and (default is msgspec.NODEFAULT or value != default):
            yield field.encode_name, value


def _seen_from(value: Any, folder: Path, target: Path) -> Any:
    """A record whose relative paths start at ``target`` instead of ``folder``."""
    if isinstance(value, (list, tuple)):
        return type(value)(_seen_from(one, folder, target) for one in value)
    if isinstance(value, dict):
        return {key: _seen_from(one, folder, target) for key, one in value.items()}
    if not isinstance(value, msgspec.Struct):
        return value
    files = next((names for kind, names in _PATHS.items() if isinstance(value, kind)), ())
    if value.__struct_config__.tag == "table" and "file" in value.__struct_fields__:
        files = ("file",)
    changed = {}
    for name in value.__struct_fields__:
        own = getattr(value, name)
        if name in files and own and not Path(own).is_absolute():
            changed[name] = Path(os.path.relpath(folder / own, target)).as_posix()
        else:
            changed[name] = _seen_from(own, folder, target)
    return msgspec.structs.replace(value, **changed)


def _said(record: msgspec.Struct) -> str:
    """What it is: the first sentence of its documentation."""
    text = " ".join(record_texts(type(record))[0].split("\n\n")[0].split())
    return text.partition(": ")[0].rstrip(".") if len(text) > 100 else text.rstrip(".")


def _lines(record: msgspec.Struct) -> list[str]:
    return [f"{_key(name)} = {_value(value)}" for name, value in _fields(record)]


def _value(value: Any) -> str:
    if isinstance(value, msgspec.Struct):
        return _inline(_fields(value))
    if isinstance(value, Mapping):
        return _inline(iter(value.items()))
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(_value, value)) + "]"
    if isinstance(value, bool):
        return "true" if value else "false"
    return repr(value) if isinstance(value, (int, float)) else str(tomlkit.item(value).as_string())


def _inline(fields: Iterator[tuple[str, Any]]) -> str:
    inner = ", ".join(f"{_key(name)} = {_value(value)}" for name, value in fields)
    return f"{{ {inner} }}" if inner else "{}"


def _key(name: str) -> str:
    return name if _BARE.fullmatch(name) else str(tomlkit.item(name).as_string())
