"""Failures of scenes and simulations: the causes, and the exception that carries place, value, limit, remedy."""

from __future__ import annotations

import enum
from typing import Any

from fe_import.errors import ReportedError


class Cause(enum.StrEnum):
    """Why a scene was refused or a simulation stopped. A test provokes each."""

    FILE_NOT_FOUND = "file not found"
    NOT_READABLE = "file not readable"
    NOT_WRITABLE = "file not writable"
    SYNTAX = "syntax error"
    UNKNOWN_FIELD = "unknown field"
    BAD_FIELD = "bad field"
    BAD_REFERENCE = "reference to something that does not exist"
    TABLE = "faulty table"
    RUN_FILE = "faulty run file"
    CHANGED = "changed since the run began"
    TIME_OUT_OF_RANGE = "time outside the run"
    SINGULAR_MASS = "mass matrix not positive definite"
    REDUNDANT_CONSTRAINTS = "redundant constraints"
    INCONSISTENT_START = "start that does not fulfil the constraints"
    LOOP_OPEN = "loop cannot be closed"
    CHANGE_POINT = "loop may go on in two ways"
    NO_DERIVATIVE = "derivative not known yet"
    NO_EQUILIBRIUM = "no static equilibrium"
    UNSTABLE_START = "unstable static equilibrium"
    NEWTON_FAILED = "Newton iteration did not converge"
    NOT_FINITE = "solution is no longer finite"
    STEP_TOO_SMALL = "step size became too small"
    TOO_STIFF = "too stiff for an explicit method"
    NO_PICTURE = "picture could not be made"
    OUT_OF_MEMORY = "out of memory"
    RUNAWAY = "deflection beyond any meaning"
    OUT_OF_REACH = "demanded place out of reach"
    SINGULAR_SERVO = "demanded direction that no drive moves"
    TOO_FEW_DRIVES = "fewer drives than conditions"
    UNSTABLE_INVERSE = "internal dynamics that grow"
    UNDAMPED_INVERSE = "internal dynamics that neither grow nor decay"
    NO_PLAN = "bounds that no motion keeps"
    BEYOND_TOLERANCE = "estimated error beyond the tolerance"
    INTERRUPTED = "interrupted"
    BUDGET = "time budget used up"


_NUMERICAL = {
    Cause.SINGULAR_MASS,
    Cause.INCONSISTENT_START,
    Cause.LOOP_OPEN,
    Cause.CHANGE_POINT,
    Cause.NO_EQUILIBRIUM,
    Cause.NEWTON_FAILED,
    Cause.NOT_FINITE,
    Cause.STEP_TOO_SMALL,
    Cause.RUNAWAY,
    Cause.OUT_OF_REACH,
    Cause.SINGULAR_SERVO,
    Cause.NO_PLAN,
    Cause.OUT_OF_MEMORY,
    Cause.NO_PICTURE,
}


class SceneError(ReportedError):
    """A faulty scene, table, run file or command line."""


class SimulationError(ReportedError):
    """A failed simulation: says when, why and what to try; ``run`` holds what was computed, if anything."""

    run: Any = None  # a Run; its module stands above this one
    whole: tuple[float, ...] = ()  # times whose steps are kept where others are dropped

    @property
    def exit_code(self) -> int:
        """3 for a numerical failure, 4 for a tolerance not met, 130 after an interrupt, otherwise 2."""
        if self.cause == Cause.INTERRUPTED:
            return 130
        if self.cause == Cause.BEYOND_TOLERANCE:
            return 4
        return 3 if self.cause in _NUMERICAL else 2
