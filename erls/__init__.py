"""Mechanisms and robots with flexible links: Equivalent Rigid Link System and component mode synthesis.

The command line in three lines::

    import erls

    scene = erls.load_scene("data/l_shape/steel_tall.toml")
    run = erls.simulate(scene)
    run.position("tip", [0.5, 1.0])  # dense output, at any time
"""

from typing import Any

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


def __getattr__(name: str) -> Any:
    """Load the public names when first used: importing the package stays cheap."""
    import importlib

    if name in _HOME:
        module, attribute = _HOME[name]
        return getattr(importlib.import_module(module), attribute)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
