"""Spectra of sampled histories: amplitude against frequency, and its peaks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.signal

from erls.maths.so3 import Array


@dataclass(frozen=True)
class Spectrum:
    """One-sided amplitude spectrum: ``frequencies`` (k,) [Hz], ``amplitudes`` (k,) in the unit of the signal."""

    frequencies: Array
    amplitudes: Array


@dataclass(frozen=True)
class Peak:
    """Frequency [Hz] and amplitude of a peak."""

    frequency: float
    amplitude: float


def amplitude_spectrum(times: Array, signal: Array) -> Spectrum:
    """Amplitude spectrum with a Hann window, mean removed; of a vector signal, the norm over its components.

    Parameters
    ----------
    times : (k,) array
        Evenly spaced [s].
    signal : (k,) or (k, c) array
    """
    columns = signal.reshape(len(times), -1)
    window = np.hanning(len(times))
    step = float(times[-1] - times[0]) / max(1, len(times) - 1)
    found = np.fft.rfft((columns - columns.mean(axis=0)) * window[:, None], axis=0)
    amplitude = np.asarray(2 * np.linalg.norm(np.abs(found), axis=1) / max(window.sum(), 1e-300), dtype=np.float64)
    return Spectrum(np.asarray(np.fft.rfftfreq(len(times), step or 1.0), dtype=np.float64), amplitude)


def peaks(spectrum: Spectrum, count: int = 5) -> list[Peak]:
    """The highest peaks, in rising frequency; the frequency between two lines by a parabola through the logarithms.

    A peak counts when it stands out of its surroundings by a fiftieth of the highest one.
    """
    amplitude = spectrum.amplitudes
    if len(amplitude) < 3 or not amplitude.max() > 0:
        return []
    places, _ = scipy.signal.find_peaks(amplitude, prominence=0.02 * amplitude.max())
    best = sorted(sorted(places, key=lambda k: -amplitude[k])[:count])
    line = float(spectrum.frequencies[1])
    result = []
    for k in best:
        left, middle, right = np.log(np.maximum(amplitude[k - 1 : k + 2], 1e-300))
        bend = left - 2 * middle + right
        shift = 0.5 * (left - right) / bend if bend < 0 else 0.0
        height = float(np.exp(middle - 0.25 * (left - right) * shift))
        result.append(Peak(float(spectrum.frequencies[k] + shift * line), height))
    return result
