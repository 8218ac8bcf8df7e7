"""Compiled code on disk, kept by Numba's means; what goes wrong with it costs time, never a run.

Numba takes whatever lies in its cache for code that it wrote. Here every file ends with a check sum of its content:
what is damaged, cut off or empty is dropped and compiled anew. Where nothing can be written, nothing is kept.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numba
from numba.core.caching import (
    CompileResultCacheImpl,
    FunctionCache,
    IndexDataCacheFile,
    UserProvidedCacheLocator,
)

from fe_import.compiled.address_space import TO_COMPILE, TO_LOAD, require_room

FORMAT = 1  # of the files; a number for the name of their folder
_SEAL = 4  # bytes of a check sum


class _Damaged(Exception):
    """A file does not hold what was written."""


def _sum(content: bytes | memoryview) -> bytes:
    return zlib.crc32(content).to_bytes(_SEAL, "little")


class _SealedFiles(IndexDataCacheFile):  # type: ignore[misc]  # Numba has no annotations
    """Index and data files of a function, each with a check sum behind it."""

    def _load_index(self) -> Any:
        try:
            version, stamp, overloads = self._read(self._index_path)
        except (FileNotFoundError, ImportError, AttributeError):  # or of a version that knows more kinds of numbers
            return {}
        return overloads if (version, stamp) == (self._version, self._source_stamp) else {}

    def _save_index(self, overloads: Any) -> None:
        self._write(self._index_path, (self._version, self._source_stamp, overloads))

    def _load_data(self, name: str) -> Any:
        return self._read(self._data_path(name))

    def _save_data(self, name: str, data: Any) -> None:
        self._write(self._data_path(name), data)

    def _read(self, path: str) -> Any:
        content = memoryview(Path(path).read_bytes())
        if len(content) <= _SEAL or _sum(content[:-_SEAL]) != content[-_SEAL:]:
            raise _Damaged(path)
        return pickle.loads(content[:-_SEAL])

    def _write(self, path: str, what: Any) -> None:
        content = self._dump(what)
        with self._open_for_write(path) as file:
            file.write(content + _sum(content))

    @contextlib.contextmanager
    def _open_for_write(self, filepath: str) -> Iterator[Any]:
        """A file that is there completely or not at all, whatever ends the process."""
        temporary = f"{filepath}.{os.getpid()}-{os.urandom(8).hex()}"
        try:
            with open(temporary, "xb") as file:
                yield file
            os.replace(temporary, filepath)
        finally:
            with contextlib.suppress(OSError):
                os.unlink(temporary)


class _Folder(UserProvidedCacheLocator):  # type: ignore[misc]
    """The folder of `numba.config.CACHE_DIR` and no other one, which would know nothing of what a function calls.

    Its name tells the source (`fe_import.compiled.jit.kernels_folder`), so that it does not matter where that lies: a
    second checkout or environment compiles nothing anew.
    """

    @classmethod
    def get_suitable_cache_subpath(cls, py_file: str) -> str:
        """A part of the path that is the same wherever a package is installed."""
        return os.path.basename(os.path.dirname(os.path.abspath(py_file)))

    def ensure_cache_path(self) -> None:
        """Where it cannot be made, or is not writable, there may still be code to read; who writes is told."""
        with contextlib.suppress(OSError):
            os.makedirs(self.get_cache_path(), exist_ok=True)


class _Stored(CompileResultCacheImpl):  # type: ignore[misc]
    _locator_classes = (_Folder,)


class KernelCache(FunctionCache):  # type: ignore[misc]
    """The cache of one function.

    Parameters
    ----------
    function : callable
    folder : Path
    tell : callable
        Told what is wrong with the folder, with a word for the kind of fault.
    """

    _impl_class = _Stored

    def __init__(self, function: Any, folder: Path, tell: Callable[[str, str], None]) -> None:
        before, numba.config.CACHE_DIR = numba.config.CACHE_DIR, str(folder)
        try:
            super().__init__(function)
        finally:
            numba.config.CACHE_DIR = before
        locator, base = self._impl.locator, self._impl.filename_base
        self._cache_file = _SealedFiles(self.cache_path, base, locator.get_source_stamp())
        self._folder, self._tell = folder.parent, tell

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Compiled code of a signature; None where there is none, or none that can be used: it is compiled then.

        Raises
        ------
        MemoryError
            Where loading or compiling would end the process.
        """
        require_room(TO_LOAD)
        found = self._loaded(sig, target_context)
        if found is None:
            require_room(TO_COMPILE)
        return found

    def _loaded(self, sig: Any, target_context: Any) -> Any:
        try:
            return super().load_overload(sig, target_context)
        except MemoryError:
            raise
        except OSError:  # no folder, or no permission: who writes is told
            return None
        except Exception:  # damage may make anything of a pickle, and of the code in it
            self._tell("damaged", f"compiled code in {self._folder} is damaged: compiled anew")
            with contextlib.suppress(OSError):
                self.flush()
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep compiled code, where that is possible."""
        try:
            super().save_overload(sig, data)
        except (OSError, _Damaged) as problem:
            reason = getattr(problem, "strerror", None) or "damaged, and not writable"
            remedy = "free disk space, or name a folder in ERLS_KERNELS"
            self._tell("lost", f"compiled code cannot be kept in {self._folder} ({reason}); {remedy}")
