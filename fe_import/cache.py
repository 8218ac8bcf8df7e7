"""Reductions that were made before, by the content that they were made of."""

from __future__ import annotations

import contextlib
import hashlib
from collections.abc import Callable
from functools import cache
from pathlib import Path

from fe_import.description.link import LinkFile
from fe_import.errors import FEImportError
from fe_import.files.versions import package_version
from fe_import.modal.file import SCHEMA_VERSION, read_modal_file, write_modal_file
from fe_import.modal.model import ModalModel


def cache_key(link: LinkFile) -> str:
    """Key of a reduction: content of the description and its files, package version and file schema."""
    text = f"{SCHEMA_VERSION} {package_version('erls')} {link.content_hash()} {_sources_hash()}"
    return hashlib.sha256(text.encode()).hexdigest()[:32]


@cache
def _sources_hash() -> str:
    """Hash of this package's own code, so that a changed reduction never meets an old cache."""
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parent.rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def reduce_cached(
    link: LinkFile, folder: Path, tell: Callable[[str], None] | None = None
) -> tuple[ModalModel, bool]:
    """Reduce, or read the earlier reduction of the same content from a cache folder.

    Returns
    -------
    model : ModalModel
    cached : bool
        Whether it came from the cache. An unreadable cache entry is made anew.
    """
    path = folder / f"{cache_key(link)}.modal.h5"
    with contextlib.suppress(OSError, FEImportError):  # none there, or not readable: made anew
        return read_modal_file(path), True
    from fe_import.reduce import reduce_link  # elements and solvers: what was reduced before has no use for them

    model = reduce_link(link, tell)
    with contextlib.suppress(OSError, FEImportError):  # a cache that cannot be written costs time, not the result
        folder.mkdir(parents=True, exist_ok=True)
        write_modal_file(path, model)
    return model, False
