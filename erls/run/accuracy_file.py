"""What a run states of its error in its file, as JSON: written once, read back as the same records."""

from __future__ import annotations

from typing import Any

import h5py
import msgspec

from erls.run.accuracy import Accuracy, Trust
from fe_import.files.hdf5.files import write_strings
from fe_import.files.hdf5.values import Reader

_NAME = "statement"


def write_statement(group: h5py.Group, accuracy: Accuracy | None, trust: Trust | None) -> None:
    """Nothing where nothing was asked for."""
    if accuracy is None or trust is None:
        return
    text = msgspec.json.encode({"accuracy": msgspec.to_builtins(accuracy), "trust": msgspec.to_builtins(trust)})
    write_strings(group, _NAME, text.decode(), "stated error and verdict, as JSON")


def read_statement(file: Reader) -> dict[str, Any]:
    """Fields ``accuracy`` and ``trust`` of a run; empty where the file states nothing.

    Raises
    ------
    SceneError
        RUN_FILE.
    """
    if _NAME not in file.names_inside():
        return {}
    try:
        found = msgspec.json.decode(file.text(_NAME), type=dict[str, Any])
        return {
            "accuracy": msgspec.convert(found.get("accuracy"), Accuracy),
            "trust": msgspec.convert(found.get("trust"), Trust),
        }
    except (msgspec.DecodeError, msgspec.ValidationError, RecursionError) as problem:
        raise file.fail(_NAME, f"not a statement: {problem}") from None
