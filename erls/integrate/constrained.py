"""Settings and results of integrations with constraints (`erls.equations.constrained_system`)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from erls.errors import Cause, SceneError
from erls.integrate.base import Options, Solution
from erls.maths.so3 import Array
from erls.scene.integrators import MATRICES, STARTS


@dataclass(frozen=True)
class ConstrainedOptions(Options):
    """Settings of an integration with constraints.

    Attributes
    ----------
    iteration_matrix : str
        ``update``: a new one in every Newton iteration; ``frozen``: one for all steps of a size; ``auto``: a new one
        when iteration has become slow.
    residual_tolerance : float
        Newton iterations stop, too, when the residual is below this times the sum of the norms of its terms.
    project_velocity : bool
        Move velocities onto the constraints after every step; otherwise they keep to them within the accuracy of
        the method.
    start_from : str
        Newton iterations start from ``zero`` accelerations and multipliers or from the ``last`` ones, which lie nearer.
    error_tolerance : float or None
        Largest local error of a step [m]: steps adapt to it, ``step`` being the largest. None for equal steps.
    rough : bool
        Steps that fall short of that are not repeated.
    follows_tolerance : bool
        Choose steps for an error of ``tolerance`` over the whole run; ``step`` is the largest of the first, coarse run.
    compiled : bool or None
        Whether to use compiled kernels where a system has them; None where the compiler is on (`erls.maths.jit`).

    Raises
    ------
    SceneError
        With cause BAD_FIELD, naming the setting.
    """

    iteration_matrix: str = "auto"
    residual_tolerance: float = 1e-10
    project_velocity: bool = False
    start_from: str = "zero"
    error_tolerance: float | None = None
    rough: bool = False
    follows_tolerance: bool = False
    compiled: bool | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        checks = (
            (
                "iteration_matrix",
                self.iteration_matrix,
                self.iteration_matrix in MATRICES,
                f"one of {', '.join(MATRICES)}",
            ),
            (
                "residual_tolerance",
                self.residual_tolerance,
                0 <= self.residual_tolerance < 1,
                "zero or more, and below 1",
            ),
            ("start_from", self.start_from, self.start_from in STARTS, f"one of {', '.join(STARTS)}"),
            (
                "error_tolerance",
                self.error_tolerance,
                self.error_tolerance is None or self.error_tolerance > 0,
                "a positive number of metres",
            ),
        )
        for name, value, ok, right in checks:
            if not ok:
                message = "the integrator cannot work with this value"
                raise SceneError(
                    Cause.BAD_FIELD, message, where=f"options.{name}", value=value, remedy=f"must be {right}"
                )


@dataclass(frozen=True)
class ConstrainedSolution(Solution):
    """Knots of what the system stores, with rates (k, n) of the velocities v and multipliers (k, m) there."""

    accelerations: Array = field(default_factory=lambda: np.zeros((0, 0)))
    multipliers: Array = field(default_factory=lambda: np.zeros((0, 0)))
