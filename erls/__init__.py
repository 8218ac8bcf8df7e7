"""Mechanisms and robots with flexible links: Equivalent Rigid Link System and component mode synthesis.

The command line in three lines::

    import erls

    scene = erls.load_scene("data/l_shape/steel_tall.toml")
    run = erls.simulate(scene)
    run.position("tip", [0.5, 1.0])  # dense output, at any time

The public names stand in ``__init__.pyi``; each is imported when it is first used, so that importing the package is
cheap.
"""

from typing import Any

<<<<<<< HEAD
__all__ = [
    "linearize",
    "load_run",
    "load_scene",
    "optimize",
    "save_run",
    "section_forces",
    "sensitivities",
    "simulate",
    "simulate_many",
    "stepper",
    "stress",
]

_HOME = {
    "load_scene": ("erls.scene.read", "load_scene"),
    "linearize": ("erls.linear.linearize", "linearize"),
    "optimize": ("erls.optimization.optimize", "optimize"),
    "simulate": ("erls.simulation.simulate", "simulate"),
    "simulate_many": ("erls.simulation.batch", "simulate_many"),
    "load_run": ("erls.run.file", "load_run"),
    "save_run": ("erls.run.file", "write_run"),
    "sensitivities": ("erls.sensitivity.sensitivities", "sensitivities"),
    "section_forces": ("erls.run.recovery", "section_forces"),
    "stepper": ("erls.simulation.stepper", "Stepper"),
    "stress": ("erls.run.recovery", "stress"),
}
=======
import lazy_loader

_named, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
>>>>>>> c1d66975d3d2d1134bb8ac1b1ddc9891cd6e0b9e


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from fe_import.files.versions import package_version

        return package_version("erls")
    return _named(name)
