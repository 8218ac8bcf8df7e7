"""A run on its way from one process to another: its scene and its knots, from which the rest is made again."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any

from erls.equations.formulation import Formulation
from erls.equations.quasi_static.formulation import QuasiStatic
from erls.equations.registry import formulate
from erls.integrate.base import Solution
from erls.mechanism.effects import Certificate
from erls.run.accuracy import Accuracy, Trust
from erls.run.chain.run import ChainRun
from erls.run.record import Run
from erls.scene.build import build_mechanism
from erls.scene.chain import Scene
from erls.simulation.chains import build_like

if TYPE_CHECKING:  # it imports nodal elements, which chains do not need
    from erls.run.bodies.run import BodyRun


@dataclass(frozen=True)
class PackedRun:
    """What a `ChainRun` is without its formulation.

    Attributes
    ----------
    scene, solution, wall_s, warnings, certificate, accuracy, trust
        Of the run; ``solution`` in the coordinates of all modes where some follow statically, since those of the
        others depend on how modes are scaled.
    """

    scene: Scene
    solution: Solution
    wall_s: float
    warnings: tuple[str, ...]
    certificate: Certificate | None
    accuracy: Accuracy | None
    trust: Trust | None


@dataclass(frozen=True)
class PackedBodies:
    """What a run of bodies and beams is without its equations: its kind, and its other fields by name."""

    kind: type[BodyRun]
    values: dict[str, Any]


Packed = PackedRun | PackedBodies


def packed(run: Run) -> Packed:
    """A run to be sent."""
    if not isinstance(run, ChainRun):
        from erls.run.bodies.run import BodyRun  # here: it imports nodal elements, which chains do not need

        assert isinstance(run, BodyRun)
        return PackedBodies(type(run), {f.name: getattr(run, f.name) for f in fields(run) if f.name != "assembly"})
    s = run.solution
    if isinstance(run.formulation, QuasiStatic):
        y, v, a = (run.formulation.stored(values) for values in (s.y, s.v, s.a))
        s = replace(s, y=y, v=v, a=a)
    return PackedRun(run.scene, s, run.wall_s, run.warnings, run.certificate, run.accuracy, run.trust)


def unpacked_bodies(run: PackedBodies) -> BodyRun:
    """A run of bodies that was sent."""
    from erls.equations.nodal.scenes.build import assemble  # here: it imports nodal elements, which chains do not need

    return run.kind(assembly=assemble(run.values["scene"]), **run.values)


def unpacked(run: PackedRun, like: ChainRun | None) -> ChainRun:
    """A run of a chain that was sent.

    Parameters
    ----------
    run : PackedRun
    like : ChainRun, optional
        One with the same links, whose modal models serve again.
    """
    if like is not None and run.scene.record.simulation.bandwidth is None:
        return LaterRun.of(run, like)
    formulation, s = formulated(run.scene, like), run.solution
    if isinstance(formulation, QuasiStatic):
        y, v, a = (formulation.restored(values) for values in (s.y, s.v, s.a))
        s = replace(s, y=y, v=v, a=a)
    shared = run.wall_s, run.warnings, run.certificate
    return ChainRun(run.scene, formulation, s, *shared, accuracy=run.accuracy, trust=run.trust)


def formulated(scene: Scene, like: ChainRun | None) -> Formulation:
    """The equations of motion of a scene; modal models of a run with the same links serve again."""
    built = build_mechanism(scene) if like is None else build_like(scene, like)
    return formulate(built.mechanism, scene.record.simulation)


class LaterRun(ChainRun):
    """A `ChainRun` whose formulation is put together when it is first asked for: many are never asked."""

    @classmethod
    def of(cls, run: PackedRun, like: ChainRun) -> LaterRun:
        """The run, with the modal models of one with the same links."""
        result = cls.__new__(cls)
        vars(result).update(vars(run), _like=like)
        return result

    def __getattr__(self, name: str) -> Any:
        """What is not there yet."""
        if name != "formulation" or "_like" not in vars(self):
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        made = formulated(self.scene, vars(self)["_like"])
        vars(self)["formulation"] = made
        return made
