"""Variants of one scene, one after the other: what their links share is read once."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import msgspec

from erls.equations.nodal.scenes.build import assemble
from erls.equations.registry import formulate
from erls.integrate.choice import compile_kernels, compiled_steps, compiling_steps
from erls.run.chain.run import ChainRun
from erls.run.record import Run
from erls.scene.bodies.schema import BodyScene
from erls.scene.build import build_mechanism
from erls.scene.build_joints import led_by_inversion
from erls.scene.chain import Scene
from erls.scene.read import AnyScene, load_scene
from erls.simulation.packed_run import Packed, PackedBodies, unpacked, unpacked_bodies
from erls.simulation.simulate import Progress, simulate
from fe_import.errors import ReportedError

_MOST_KEPT = 8  # sets of links


class Variants:
    """Simulates variants of a scene.

    Parameters
    ----------
    scene : Path or str
    """

    def __init__(self, scene: Path | str) -> None:
        self.scene = scene
        self._runs: dict[tuple[bytes, bool], ChainRun] = {}

    def run(self, overrides: Sequence[str], progress: Progress, verdict: bool = True) -> Run | ReportedError:
        """The run of a variant, or its failure.

        Parameters
        ----------
        overrides : sequence of str
        progress : callable
            As of `erls.simulation.simulate.simulate`; called once before the start, too.
        verdict : bool
            Whether the run states its error.
        """
        try:
            progress(0.0, 0.0)
            scene = load_scene(self.scene, overrides)
            run = simulate(scene, progress=progress, like=self._alike(scene), verdict=verdict)
        except ReportedError as problem:
            return problem
        self._know(run)
        return run

    def prepare(self, overrides: Sequence[str]) -> None:
        """Read and compile what a variant needs."""
        scene = load_scene(self.scene, overrides)
        if isinstance(scene, BodyScene):
            assemble(scene)
            return
        if led_by_inversion(scene.record):
            return  # its run inverts it first
        mechanism, settings = build_mechanism(scene).mechanism, scene.record.simulation
        with compiling_steps(compiled_steps(mechanism, settings)):
            compile_kernels(formulate(mechanism, settings), settings)

    def unpacked(self, sent: Packed) -> Run:
        """A run that was computed by another process."""
        if isinstance(sent, PackedBodies):
            return unpacked_bodies(sent)
        run = unpacked(sent, self._alike(sent.scene))
        self._know(run)
        return run

    def _alike(self, scene: AnyScene) -> ChainRun | None:
        """A run of a chain with the same links."""
        return self._runs.get(_links(scene)) if isinstance(scene, Scene) else None

    def _know(self, run: Run) -> None:
        """Have later runs with the same links share those of this one."""
        if isinstance(run, ChainRun):
            self._runs.setdefault(_links(run.scene), run)
        if len(self._runs) > _MOST_KEPT:
            self._runs.pop(next(iter(self._runs)))


def _links(scene: Scene) -> tuple[bytes, bool]:
    """What modal models depend on; substructures are left whole in the nodal formulation."""
    return msgspec.json.encode(scene.record.links), scene.record.simulation.formulation == "nodal"
