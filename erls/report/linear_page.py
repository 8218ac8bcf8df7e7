"""Reports of linear models and of diagrams of their poles: text for the terminal, JSON, HTML."""

from __future__ import annotations

from typing import Any

import numpy as np

from erls.linear.diagrams import Diagram
from erls.linear.model import LinearModel, Mode
from erls.linear.response import frequency_response, step_response, telling_frequencies, telling_times
from erls.maths.so3 import Array
from erls.report.html import Curve, Plot, figure, heading, page, paragraph
from erls.report.html import table as html_table
from erls.report.tables import table

_SHOWN = 30  # modes
_NOISE = "~0"  # a real part that rounding makes
_CURVES = 6  # of a plot
_NOTHING = 1e-12  # of the largest response of a kind: no curve
_MODES = ("pole [1/s]", "frequency [Hz]", "damped [Hz]", "damping ratio", "moves farthest")


def model_text(model: LinearModel) -> str:
    """What it is, its modes and zeros, for the terminal."""
    parts = [_about(model), *(text for text, _ in _verdicts(model))]
    parts.append("Modes\n" + table(_MODES, [_mode_row(model, mode) for mode in model.modes[:_SHOWN]]))
    if len(model.modes) > _SHOWN:
        parts[-1] += f"\n... and {len(model.modes) - _SHOWN} more"
    return "\n\n".join(parts)


def model_page(model: LinearModel) -> str:
    """One self-contained HTML page."""
    parts = [paragraph(_about(model))]
    parts += [paragraph(text, "good" if fine else "bad") for text, fine in _verdicts(model)]
    parts += [paragraph(text, "note") for text in model.warnings]
    parts += [heading("Modes"), html_table(_MODES, [_mode_row(model, mode) for mode in model.modes])]
    if model.outputs:
        header = ("output", *(_short(mode.pole) for mode in model.modes[:_SHOWN]))
        rows = [
            (channel.name, *(_amplitude(mode.seen[k]) for mode in model.modes[:_SHOWN]))
            for k, channel in enumerate(model.outputs)
        ]
        parts += [heading("Outputs in each mode, per metre of its largest displacement"), html_table(header, rows)]
    if model.inputs and model.outputs:
        f, times = telling_frequencies(model), telling_times(model)
        responses, steps = frequency_response(model, f), step_response(model, times)
        for r, channel in enumerate(model.inputs):
            parts += [heading(f"From {channel.name} [{channel.unit}]"), html_table(*_zeros(model, channel.name))]
            for numbers in _groups(model, responses[:, :, r]):
                parts += _response_figures(model, channel.name, f, responses[:, numbers, r], numbers)
                parts.append(_step_figure(model, times, steps[:, numbers, r], numbers))
    return page(f"{model.scene}: linear model, {model.at}", parts)


def _about(model: LinearModel) -> str:
    sizes = f"{model.size} coordinates, {len(model.states)} states"
    return f"{model.scene} ({model.at}): {sizes}, {len(model.inputs)} inputs, {len(model.outputs)} outputs"


def _verdicts(model: LinearModel) -> list[tuple[str, bool]]:
    if not model.steady:
        growing = max((mode.pole.real for mode in model.unstable), default=0.0)
        text = "the mechanism moves or is let go in this state: the model is that of the instant"
        return [(text + (f", in which motions grow by up to {growing:.3g} 1/s" if growing > 0 else ""), False)]
    found = [
        (f"unstable: pole {_pole(mode.pole)} 1/s, {mode.moves} moves farthest", False) for mode in model.unstable
    ]
    return found or [("no mode grows", True)]


def _mode_row(model: LinearModel, mode: Mode) -> tuple[str, ...]:
    hz, noise = (f"{mode.frequency_hz:.6g}", f"{mode.damped_frequency_hz:.6g}"), model.noise(mode.pole)
    if noise and mode.pole.imag and mode.pole.real:  # its sign says nothing
        return (f"{_NOISE}{_pole(1j * mode.pole.imag)[1:]}", *hz, _NOISE, mode.moves)
    return (_pole(mode.pole), *hz, f"{mode.damping_ratio:.4g}", mode.moves)


def _pole(pole: complex) -> str:
    return f"{pole.real:.5g}" + (f" ± {pole.imag:.6g} i" if pole.imag else "")


def _short(pole: complex) -> str:
    return f"{abs(pole) / (2 * np.pi):.4g} Hz" if pole.imag else f"{pole.real:.4g} 1/s"


def _amplitude(value: complex) -> str:
    return f"{abs(value):.3g}" if abs(value) < 1e-9 or abs(value.imag) > 1e-3 * abs(value) else f"{value.real:.3g}"


def _zeros(model: LinearModel, name: str) -> tuple[tuple[str, ...], list[tuple[str, str]]]:
    rows = []
    for channel in model.outputs:
        own = [z for z in model.zeros([name], [channel.name]).tolist() if z.imag >= 0]
        rows.append((channel.name, ", ".join(_pole(z) for z in own[:8]) + (" ..." if len(own) > 8 else "")))
    return ("output", "transmission zeros [1/s], slow ones first"), rows


def _groups(model: LinearModel, response: Array) -> list[list[int]]:
    """Outputs of one unit that answer at all, as many as a plot takes."""
    groups = []
    for unit in dict.fromkeys(channel.unit for channel in model.outputs):
        own = [k for k, channel in enumerate(model.outputs) if channel.unit == unit]
        largest = float(np.abs(response[:, own]).max(initial=0.0))
        answers = [k for k in own if np.abs(response[:, k]).max() > _NOTHING * largest]
        groups += [answers[k : k + _CURVES] for k in range(0, len(answers), _CURVES)]
    return groups


def _response_figures(model: LinearModel, name: str, f: Array, response: Array, numbers: list[int]) -> list[str]:
    """Bode's two plots and Nichols's."""
    unit = f"[{model.outputs[numbers[0]].unit}] per [{next(c.unit for c in model.inputs if c.name == name)}]"
    size = np.maximum(np.abs(response), 1e-300)
    phase = np.degrees(np.unwrap(np.angle(response), axis=0))
    phase -= 360 * np.round(phase[0] / 360)
    names = [model.outputs[k].name for k in numbers]

    def curves(x: Array, y: Array) -> list[Curve]:
        return [Curve(label, np.broadcast_to(x.T, y.T.shape)[k], y[:, k]) for k, label in enumerate(names)]

    plots = [
        Plot(f"Bode: amplitude from {name}", "frequency [Hz]", unit, curves(f[:, None], size), "xy"),
        Plot(f"Bode: phase from {name}", "frequency [Hz]", "phase [deg]", curves(f[:, None], phase), "x"),
        Plot(f"Nichols: from {name}", "phase [deg]", f"20 log of {unit}", curves(phase, 20 * np.log10(size))),
    ]
    return [figure(plot) for plot in plots]


def _step_figure(model: LinearModel, times: Array, response: Array, numbers: list[int]) -> str:
    curves = [Curve(model.outputs[k].name, times, response[:, i]) for i, k in enumerate(numbers)]
    return figure(Plot("After a step of one unit", "time [s]", f"[{model.outputs[numbers[0]].unit}]", curves))


def diagram_summary(found: Diagram) -> dict[str, Any]:
    """The JSON of ``erls linearize --campbell`` and ``--locus``."""
    return {
        "scene": found.scene,
        "over": found.over,
        "unit": found.unit,
        "values": found.values.tolist(),
        "poles": [[[mode.pole.real, mode.pole.imag] for mode in model.modes] for model in found.models],
        "unstable": [[mode.moves for mode in model.unstable] for model in found.models],
        "warnings": list(found.warnings),
    }


def diagram_text(found: Diagram) -> str:
    """The slowest poles at each value, for the terminal."""
    header = (_over(found), "slowest poles [1/s]", "unstable")
    rows = []
    for value, model in zip(found.values.tolist(), found.models, strict=True):
        slow = sorted((mode.pole for mode in model.modes), key=abs)[:4]
        growing = ", ".join(dict.fromkeys(mode.moves for mode in model.unstable)) or "-"
        rows.append((f"{value:.6g}", ", ".join(map(_pole, slow)), growing))
    return f"{found.scene}: poles over {found.over}\n\n" + table(header, rows)


def diagram_page(found: Diagram) -> str:
    """One self-contained HTML page."""
    poles = found.poles
    parts = [paragraph(text, "note") for text in found.warnings]
    parts += _campbell_figures(found, poles) if found.speed else [_locus_figure(found, poles)]
    header = (_over(found), *(f"pole {k + 1} [1/s]" for k in range(min(poles.shape[1], _SHOWN))))
    rows = [
        (f"{value:.6g}", *("" if np.isnan(pole) else _pole(pole) for pole in row[:_SHOWN].tolist()))
        for value, row in zip(found.values.tolist(), poles, strict=True)
    ]
    parts += [heading("Poles by size"), html_table(header, rows)]
    return page(f"{found.scene}: poles over {found.over}", parts)


def _over(found: Diagram) -> str:
    return f"{found.over} [{found.unit}]" if found.unit else found.over


def _campbell_figures(found: Diagram, poles: Array) -> list[str]:
    hz = poles.imag / (2 * np.pi)
    curves = [Curve(f"mode {k + 1}", found.values, hz[:, k], marked=True) for k in range(min(poles.shape[1], _CURVES))]
    orders = [
        Curve(f"{n} per turn", found.values, n * np.abs(found.values) / (2 * np.pi), dashed=True) for n in (1, 2, 3)
    ]
    plots = [
        Plot("Campbell diagram", _over(found), "damped frequency [Hz]", [*curves, *orders]),
        Plot(
            "Growth and decay",
            _over(found),
            "real part of the pole [1/s]",
            [Curve(curve.label, curve.x, poles.real[:, k], marked=True) for k, curve in enumerate(curves)],
            note="above zero it grows",
        ),
    ]
    return [figure(plot) for plot in plots]


def _locus_figure(found: Diagram, poles: Array) -> str:
    own = poles[:, :_CURVES]
    both = np.concatenate([own, np.conj(own)])
    ends = [("first value", poles[0]), ("last value", poles[-1])]
    curves = [Curve("between", both.real.ravel(), both.imag.ravel(), points=True)]
    curves += [
        Curve(name, np.concatenate([x.real] * 2), np.concatenate([x.imag, -x.imag]), points=True)
        for name, x in ((name, row[:_CURVES]) for name, row in ends)
    ]
    note = f"the {_CURVES} slowest poles and pairs"
    return figure(Plot("Root locus", "real part [1/s]", "imaginary part [1/s]", curves, note=note))
