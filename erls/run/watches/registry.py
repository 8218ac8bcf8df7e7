"""The watches of a run, in the order in which they look; `erls.run.watches.base` has the rules for the next one."""

from __future__ import annotations

from erls.run.watches.base import Watch
from erls.run.watches.change_points import ChangePoints
from erls.run.watches.deflection_range import DeflectionRange
from erls.run.watches.events import Events
from erls.run.watches.growing_disturbances import GrowingDisturbances
from erls.run.watches.impulses import Impulses
from erls.run.watches.integration import Integration
from erls.run.watches.loop_conditions import LoopConditions
from erls.run.watches.mass import IndefiniteMass
from erls.run.watches.motor_limits import MotorLimits
from erls.run.watches.runaway import Runaway
from erls.run.watches.second_order_data import SecondOrderData
from erls.run.watches.small_displacements import SmallDisplacements
from erls.run.watches.spin_stability import SpinStability
from erls.run.watches.static_following import StaticFollowing
from erls.run.watches.stored_output import StoredOutput

WATCHES: tuple[type[Watch], ...] = (
    Impulses,
    SecondOrderData,
    GrowingDisturbances,
    LoopConditions,
    ChangePoints,
    Events,
    Runaway,
    Integration,
    SmallDisplacements,
    DeflectionRange,
    StoredOutput,
    StaticFollowing,
    MotorLimits,
    SpinStability,
    IndefiniteMass,
)
