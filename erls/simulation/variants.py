"""Variants of one scene, one after the other: what their links share is read once."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeAlias

import msgspec

from erls.equations.registry import formulate
from erls.errors import SceneError
from erls.integrate.choice import compile_kernels, compiled_steps, compiling_steps
from erls.run.chain.run import ChainRun
from erls.run.record import Run
from erls.scene.bodies.schema import BodyScene
from erls.scene.build import build_mechanism
from erls.scene.build_joints import led_by_inversion
from erls.scene.chain import Scene
from erls.scene.overrides import apply_override, set_field
from erls.scene.read import AnyScene, scene_with
from erls.simulation.asked import Asked
from erls.simulation.packed_run import Packed, PackedBodies, unpacked, unpacked_bodies
from erls.simulation.simulate import Progress, run_as_asked
from fe_import.errors import ReportedError
from fe_import.files.toml import read_toml

Changes: TypeAlias = Sequence[tuple[str, Any]]
_MOST_KEPT = 8  # sets of links


class Variants:
    """Simulates variants of a scene, which is read once.

    Parameters
    ----------
    scene : Path or str
    common : sequence of str
        ``KEY=VALUE`` of all variants.
    """

    def __init__(self, scene: Path | str, common: Sequence[str] = ()) -> None:
        self.path, self.common = Path(scene), common
        self._tables: dict[str, Any] | None = None
        self._runs: dict[tuple[bytes, bool, Any], ChainRun] = {}

    def scene(self, overrides: Sequence[str], changes: Changes = ()) -> AnyScene:
        """A variant.

        Parameters
        ----------
        overrides : sequence of str
            ``KEY=VALUE``.
        changes : sequence of (str, value)
            The same as values, of numbers, words and lists of them, which need not be read.

        Raises
        ------
        SceneError, FEImportError
            As `erls.scene.read.load_scene`.
        """
        if self._tables is None:
            found = read_toml(self.path, SceneError)
            for text in self.common:
                apply_override(found, text)
            self._tables = found
        tables = _copied(self._tables)
        for key, value in changes:
            set_field(tables, key, _plain(value), f"--set {key}={value}")
        return scene_with(tables, self.path, overrides)

    def run(
        self,
        overrides: Sequence[str],
        progress: Progress,
        verdict: bool = True,
        bending: bool = True,
    ) -> Run | ReportedError:
        """The run of a variant, or its failure.

        Parameters
        ----------
        overrides : sequence of str
        progress : callable
            As of `erls.simulation.simulate.simulate`; called once before the start, too.
        verdict : bool
            Whether the run states its error.
        bending : bool
            Whether it looks at how far off links are that bend, without a verdict, too.
        """
        try:
            progress(0.0, 0.0)
            scene = self.scene(overrides)
        except ReportedError as problem:
            return problem
        return self.run_scene(scene, progress, verdict, bending)

    def run_scene(
        self, scene: AnyScene, progress: Progress, verdict: bool = True, bending: bool = True
    ) -> Run | ReportedError:
        """The same of a variant that was read."""
        asked = Asked(progress, lambda text: None, None, False, self._alike(scene), verdict, bending=bending or verdict)
        try:
            run = run_as_asked(scene, asked)
        except ReportedError as problem:
            return problem
        self._know(run)
        return run

    def prepare(self, overrides: Sequence[str]) -> None:
        """Read and compile what a variant needs."""
        scene = self.scene(overrides)
        if isinstance(scene, BodyScene):
            from erls.equations.nodal.scenes.build import assemble  # here: chains need no nodal elements

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
        if isinstance(run, ChainRun) and run.scene.record.simulation.effects != "auto":  # which may make links rigid
            self._runs.setdefault(_links(run.scene), run)
        if len(self._runs) > _MOST_KEPT:
            self._runs.pop(next(iter(self._runs)))


def _plain(value: Any) -> Any:
    """What TOML would have made of a value."""
    return value if type(value) in (bool, int, float, str) else json.loads(json.dumps(value))


def _copied(tables: Any) -> Any:
    """Parsed tables that may be changed."""
    if isinstance(tables, dict):
        return {key: _copied(value) for key, value in tables.items()}
    return [_copied(value) for value in tables] if isinstance(tables, list) else tables


def _links(scene: Scene) -> tuple[bytes, bool, Any]:
    """What modal models depend on; substructures are left whole in the nodal formulation, and without some effects
    there are no modes.
    """
    simulation = scene.record.simulation
    effects = simulation.effects if isinstance(simulation.effects, str) else tuple(simulation.effects)
    return msgspec.json.encode(scene.record.links), simulation.formulation == "nodal", effects
