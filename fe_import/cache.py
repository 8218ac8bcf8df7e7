"""Reductions that were made before, by the content that they were made of."""

from __future__ import annotations

import contextlib
import hashlib
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path

from fe_import.description.link import LinkFile
from fe_import.errors import Cause, FEImportError
from fe_import.files.versions import package_version
from fe_import.modal import left_out_file
from fe_import.modal.file import SCHEMA_VERSION, read_modal_file, write_modal_file
from fe_import.modal.left_out import LeftOut
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


_SMALL = 10_000  # nodes times modes up to which a reduction takes hardly longer than writing and reading its file
_MOST_SMALL = 8
_small: dict[str, ModalModel] = {}  # that this process has reduced lately and not written


def reduce_cached(
    link: LinkFile, folder: Path, tell: Callable[[str], None] | None = None, passing: bool = False
) -> tuple[ModalModel, bool]:
    """Reduce, or read the earlier reduction of the same content from a cache folder.

    Parameters
    ----------
    link : LinkFile
    folder : Path
    tell : callable, optional
        Told about each step that takes time.
    passing : bool
        Whether the link is one of many variants: then this process alone remembers it if it is small.

    Returns
    -------
    model : ModalModel
    cached : bool
        Whether it came from the cache. An unreadable cache entry is made anew.
    """
    key = cache_key(link)
    if (known := _small.get(key)) is not None:
        return known, True
    path = folder / f"{key}.modal.h5"
    with contextlib.suppress(OSError, FEImportError):  # none there, or not readable: made anew
        return read_modal_file(path), True
    from fe_import.reduce import reduce_link  # elements and solvers: what was reduced before has no use for them

    model = reduce_link(link, tell)
    if passing and len(model.nodes) * model.modes <= _SMALL:
        _small[key] = model
        while len(_small) > _MOST_SMALL:
            _small.pop(next(iter(_small)), None)
        return model, False
    with contextlib.suppress(OSError, FEImportError):  # a cache that cannot be written costs time, not the result
        folder.mkdir(parents=True, exist_ok=True)
        write_modal_file(path, model)
    return model, False


_KEPT = 32
_lately: dict[str, LeftOut] = {}


def left_out_cached(
    link: Callable[[], LinkFile], modal: ModalModel, folder: Path, loaded: Sequence[int] = ()
) -> LeftOut:
    """What a reduced link leaves out of its finite-element model: what this process has found lately, a file beside
    the reductions of a cache folder, or made now.

    Parameters
    ----------
    link : callable
        Gives the description that ``modal`` was reduced from; called only when it has to be made.
    modal : ModalModel
        A reduction with its provenance, truncated to the modes in use.
    folder : Path
    loaded : sequence of int
        See `fe_import.reduction.left_out.left_out_of`.

    Raises
    ------
    FEImportError
        MODAL_FILE: the description is no longer the one that was reduced; as `left_out_of`.
    """
    source = modal.provenance.get("sha256", "")
    frequencies = hashlib.sha256(modal.frequencies_hz.tobytes()).hexdigest()
    warm = modal.thermal is not None and bool(modal.thermal.change)
    content = f"{source} {modal.modes} {frequencies} {sorted(loaded)} {warm} {_sources_hash()}"
    key = hashlib.sha256(f"{left_out_file.SCHEMA_VERSION} {content}".encode()).hexdigest()[:32]
    if key in _lately:
        return _lately[key]
    path = folder / f"{key}.left_out.h5"
    try:
        found = left_out_file.read_left_out_file(path, modal)
    except (OSError, FEImportError):  # none there, or not readable: made anew
        found = _made(link(), modal, source, loaded)
        with contextlib.suppress(OSError, FEImportError):
            folder.mkdir(parents=True, exist_ok=True)
            left_out_file.write_left_out_file(path, found)
    _lately[key] = found
    while len(_lately) > _KEPT:
        del _lately[next(iter(_lately))]
    return found


def _made(link: LinkFile, modal: ModalModel, source: str, loaded: Sequence[int]) -> LeftOut:
    from fe_import.reduction.left_out import left_out_of  # as in `reduce_cached`

    if link.content_hash() != source:
        raise FEImportError(
            Cause.MODAL_FILE,
            "this description is not the one that the modal model was reduced from",
            where=str(link.path),
            remedy="reduce the link again",
        )
    return left_out_of(link, modal, loaded)
