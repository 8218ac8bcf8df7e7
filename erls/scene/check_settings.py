"""The conditions on the settings of a chain's simulation."""

from __future__ import annotations

from erls.errors import SceneError
from erls.mechanism.effects import named_effects
from erls.scene.checks import bad, check_stepping, positive
from erls.scene.integrators import FIXED_STEP, INTEGRATORS
from erls.scene.settings import Simulation
from fe_import.files.toml import choose

GAUGES = ("joint-angle", "minimum-norm")
BODY_FRAMES = ("tangent", "mean-axis")
COORDINATES = ("independent", "absolute")
INERTIA = ("helicoidal", "linear")
TIED = (FIXED_STEP, "auto")  # integrators for coordinates that conditions tie
SMALLEST_RTOL = 3e-14  # rounding


def check_settings(s: Simulation, place: str) -> None:
    """Refuse settings that cannot be meant, or that do not go together."""
    check_stepping(s, place)
    choose(s.integrator, INTEGRATORS, f"{place}.integrator", SceneError)
    choose(s.gauge, GAUGES, f"{place}.gauge", SceneError)
    choose(s.body_frame, BODY_FRAMES, f"{place}.body_frame", SceneError)
    choose(s.coordinates, COORDINATES, f"{place}.coordinates", SceneError)
    choose(s.inertia_interpolation, INERTIA, f"{place}.inertia_interpolation", SceneError)
    for name in ("residual_bending_flexibility", "inertia_interpolation"):
        if s.formulation != "nodal" and getattr(s, name) != getattr(Simulation(duration=1.0), name):
            message = f"'{s.formulation}' has no elements of its own"
            raise bad(f"{place}.{name}", message, getattr(s, name), "use formulation = 'nodal', or remove it")
    if s.coordinates == "absolute":
        for name, value, right in (("formulation", s.formulation, ("ffr",)), ("integrator", s.integrator, TIED)):
            if value not in right:
                message = "absolute coordinates do not go with this"
                remedy = f"use {' or '.join(right)}, or coordinates = 'independent'"
                raise bad(f"{place}.{name}", message, value, remedy)
    if s.formulation == "nodal" and s.integrator not in TIED:
        message = "nodal frames need an integrator for constraints"
        raise bad(f"{place}.integrator", message, s.integrator, f"use {FIXED_STEP}, or auto")
    if s.elements_per_member is not None and s.elements_per_member < 1:
        message = "a member needs at least one element"
        raise bad(f"{place}.elements_per_member", message, s.elements_per_member, "give 1 or more")
    for name in ("output_step", "bandwidth", "atol", "tolerance", "effects_tolerance", "effects_effort_tolerance"):
        positive(f"{place}.{name}", getattr(s, name))
    if not SMALLEST_RTOL <= s.rtol < 1:
        remedy = f"give {SMALLEST_RTOL:g} (rounding) to 1"
        raise bad(f"{place}.rtol", "not a relative tolerance", s.rtol, remedy)
    named_effects(s.effects, f"{place}.effects")
