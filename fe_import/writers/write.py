"""Files of a link in one format, all of them or none, with a link description that reads them."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from pathlib import Path

import tomlkit

from fe_import.errors import Cause, FEImportError
from fe_import.files.toml import choose
from fe_import.writers import WRITERS, MatrixFormat, WrittenLink
from fe_import.writers.base import MARK, Written


def chosen_format(target: Path, name: str = "") -> MatrixFormat:
    """The format of that name, or the one that a file's suffix means.

    Raises
    ------
    FEImportError
        ``BAD_REFERENCE``: an unknown name; ``BAD_FIELD``: a suffix that means none.
    """
    if name:
        choose(name, WRITERS, "format")
        return WRITERS[name]
    found = [w for w in WRITERS.values() if w.suffix and w.suffix == target.suffix.lower()]
    if not found:
        known = ", ".join(f"{w.suffix} ({key})" for key, w in WRITERS.items() if w.suffix)
        raise FEImportError(
            Cause.BAD_FIELD,
            "the suffix names no format of matrices",
            where=str(target),
            value=target.suffix,
            limit=known,
            remedy="give one of these, or name the format: " + ", ".join(WRITERS),
        )
    return found[0]


def write_link(
    link: WrittenLink,
    target: Path,
    form: MatrixFormat,
    claim: Callable[[Path], None] = lambda path: None,
    method: str = "none",
) -> list[Path]:
    """Write the files of a link beside each other, the first part of their names that of ``target``.

    Parameters
    ----------
    link : WrittenLink
    target : Path
    form : MatrixFormat
    claim : callable
        Raises when a file must not be replaced; asked for each before the first is put in place.
    method : str
        Reduction that the description asks for.

    Returns
    -------
    list of Path
        All files, the description last, where the format can be read here.
    """
    stem = target.stem
    with tempfile.TemporaryDirectory(dir=target.parent, prefix=".erls-") as name:
        folder = Path(name)
        written = form.write(link, folder, stem)
        names = list(dict.fromkeys(written.files.values()))
        if written.readable:
            names.append(f"{stem}.toml")
            (folder / names[-1]).write_text(_description(link, form, written, method), encoding="utf-8")
        for each in names:
            claim(target.parent / each)
        for each in names:
            os.replace(folder / each, target.parent / each)
    return [target.parent / each for each in names]


def _description(link: WrittenLink, form: MatrixFormat, written: Written, method: str) -> str:
    key = next(key for key, known in WRITERS.items() if known is form)
    matrices = {"format": key, "files": written.files, **({"options": written.options} if written.options else {})}
    interfaces = [{"name": name, "node": str(link.labels[node])} for name, node in link.interfaces.items()]
    text = tomlkit.dumps(
        {"name": link.name, "matrices": matrices, "interfaces": interfaces, "reduction": {"method": method}}
    )
    return f"# {MARK}: matrices for other programs; erls reduce reads them, too\n{text}"
