"""Files of linear models: JSON, NumPy's .npz, MATLAB's .mat; one line each in `FORMATS`."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from erls.errors import Cause, SceneError
from erls.files.output import replacing
from erls.files.results import MARK
from erls.linear.model import LinearModel
from erls.maths.so3 import Array


def _pairs(values: Array) -> list[list[float]]:
    """Real and imaginary parts."""
    return [[float(x.real), float(x.imag)] for x in np.asarray(values, dtype=complex)]


def summary(model: LinearModel) -> dict[str, Any]:
    """The JSON of ``erls linearize``; ``zeros`` is None without inputs or outputs."""
    oscillating = [mode for mode in model.modes if mode.pole.imag > 0]
    return {
        "scene": model.scene,
        "at": model.at,
        "steady": model.steady,
        "inputs": [channel.name for channel in model.inputs],
        "outputs": [channel.name for channel in model.outputs],
        "units": {channel.name: channel.unit for channel in (*model.inputs, *model.outputs)},
        "states": list(model.states),
        "values": model.values.tolist(),
        "A": model.A.tolist(),
        "B": model.B.tolist(),
        "C": model.C.tolist(),
        "D": model.D.tolist(),
        "mass": model.mass.tolist(),
        "damping": model.damping.tolist(),
        "stiffness": model.stiffness.tolist(),
        "coordinates": list(model.coordinates),
        "ways": model.ways.tolist(),
        "poles": _pairs(model.poles),
        "frequencies_hz": [mode.frequency_hz for mode in oscillating],
        "damped_frequencies_hz": [mode.damped_frequency_hz for mode in oscillating],
        "damping_ratios": [mode.damping_ratio for mode in oscillating],
        "zeros": _pairs(model.zeros()) if model.inputs and model.outputs else None,
        "unstable": [{"pole": [mode.pole.real, mode.pole.imag], "moves": mode.moves} for mode in model.unstable],
        "modes": [
            {
                "pole": [mode.pole.real, mode.pole.imag],
                "real_part_is_noise": model.noise(mode.pole),
                "moves": mode.moves,
                "coordinates": _pairs(mode.shape),
                "outputs": _pairs(mode.seen),
            }
            for mode in model.modes
        ],
        "warnings": list(model.warnings),
    }


def arrays(model: LinearModel) -> dict[str, Any]:
    """The same as arrays by name; names are lists of text."""
    found: dict[str, Any] = {
        name: getattr(model, name)
        for name in ("A", "B", "C", "D", "mass", "damping", "stiffness", "ways", "values", "poles")
    }
    modes = model.modes
    found |= {
        "mode_poles": np.array([mode.pole for mode in modes], dtype=complex),
        "mode_shapes": np.array([mode.shape for mode in modes], dtype=complex).reshape(len(modes), -1),
        "mode_outputs": np.array([mode.seen for mode in modes], dtype=complex).reshape(len(modes), -1),
        "frequencies_hz": np.array([mode.frequency_hz for mode in modes]),
        "damping_ratios": np.array([mode.damping_ratio for mode in modes]),
    }
    names = {
        "inputs": [channel.name for channel in model.inputs],
        "outputs": [channel.name for channel in model.outputs],
        "input_units": [channel.unit for channel in model.inputs],
        "output_units": [channel.unit for channel in model.outputs],
        "states": list(model.states),
        "coordinates": list(model.coordinates),
    }
    return {**found, **names, "scene": model.scene, "at": model.at}


def _json(path: Path, model: LinearModel) -> None:
    text = json.dumps({"written_by": "erls", **summary(model)}, allow_nan=False)
    path.write_text(text + "\n", encoding="utf-8")


def _npz(path: Path, model: LinearModel) -> None:
    with path.open("wb") as file:
        own: dict[str, Any] = {name: np.asarray(value) for name, value in arrays(model).items()}
        np.savez(file, written_by=np.bytes_(f"{MARK}\n"), **own)


def _mat(path: Path, model: LinearModel) -> None:
    from scipy.io import savemat

    own = {
        name: np.array(value, dtype=object).reshape(-1, 1) if isinstance(value, list) else value
        for name, value in arrays(model).items()
    }
    with path.open("wb") as file:
        savemat(file, {"written_by": MARK, **own}, oned_as="column")


FORMATS: dict[str, Callable[[Path, LinearModel], None]] = {".json": _json, ".npz": _npz, ".mat": _mat}
"""By ending."""


def write_model(path: Path | str, model: LinearModel) -> None:
    """Write a model, completely or not at all; the ending says in what form.

    Raises
    ------
    SceneError
        BAD_FIELD: the ending says no form; NOT_WRITABLE.
    """
    path = Path(path)
    if path.suffix not in FORMATS:
        message, remedy = "the ending of the file decides its form", "end in " + ", ".join(FORMATS)
        raise SceneError(Cause.BAD_FIELD, message, where="output", value=path.name, remedy=remedy)
    with replacing(path) as temporary:
        FORMATS[path.suffix](temporary, model)
