"""A mode of a mechanism as a motion to look at: a run of one period, slowed to a second, which ``erls view`` draws."""

from __future__ import annotations

from pathlib import Path

import msgspec
import numpy as np

from erls.errors import Cause, SceneError
from erls.integrate.base import Solution
from erls.linear.assembly import linear_model
from erls.linear.linearize import EQUILIBRIUM, Message, state_of
from erls.linear.plants import ChainPlant
from erls.run.chain.run import ChainRun
from erls.scene.chain import Scene
from erls.scene.read import load_chain

_LARGEST = 0.1  # displacement, of the size of a link
_PHASES = 49


def mode_run(
    scene: Scene | ChainRun | Path | str, number: int, at: float | str = EQUILIBRIUM, tell: Message = lambda text: None
) -> ChainRun:
    """One period of a mode about a state, which is taken as at rest; its amplitude means nothing.

    Parameters
    ----------
    scene : Scene, ChainRun, Path or str
        Of a chain.
    number : int
        Of the mode, from 1 on, as `erls.linear.model.LinearModel.modes` has them.
    at : float or str
        As of `erls.linear.linearize.linearize`.
    tell : callable, optional

    Raises
    ------
    SceneError
        BAD_FIELD: there is no such mode.
    SceneError, FEImportError, SimulationError
        As `erls.linear.linearize.linearize`.
    """
    given = load_chain(scene) if isinstance(scene, (str, Path)) else scene
    found = state_of(given, at, tell)
    plant = found.plant
    assert isinstance(plant, ChainPlant)
    modes = linear_model(plant, (), (), (found.scene, found.at), ()).modes
    if not 1 <= number <= len(modes):
        remedy = f"give 1 to {len(modes)}"
        raise SceneError(Cause.BAD_FIELD, "there is no such mode", where="mode", value=number, remedy=remedy)
    mode, still = modes[number - 1], np.zeros(len(plant.near.metres))
    near = plant.near.at_rest(still, plant.near.multipliers)
    phases = np.linspace(0.0, 1.0, _PHASES)
    waves = _LARGEST * plant.mechanism.reach * np.exp(2j * np.pi * phases)[:, None] * mode.shape
    states = near.states(*((factor * waves).real for factor in (1.0, 2j * np.pi, (2j * np.pi) ** 2)))
    own = given.scene if isinstance(given, ChainRun) else given
    settings = msgspec.structs.replace(plant.settings, duration=1.0, output_step=None)
    hz = f"{mode.frequency_hz:.4g} Hz" if mode.pole.imag else f"{mode.pole.real:.4g} 1/s"
    record = msgspec.structs.replace(own.record, simulation=settings, name=f"{own.name}: mode {number}, {hz}")
    return ChainRun(Scene(own.path, record), plant.formulation, Solution(phases, states.y, states.v, states.a))
