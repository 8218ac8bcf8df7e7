"""How a loop fails while it moves, and what is to be told of it: it comes apart, locks, or branches."""

from __future__ import annotations

from collections.abc import Callable

from erls.equations.loops.branching import Kind, Singular
from erls.equations.loops.start import Start
from erls.errors import Cause, SimulationError


def comes_apart(t: float, row: str, gap: float, limit: float, left_out: bool) -> SimulationError:
    """A condition is violated by ``gap`` [m]; ``left_out``: it followed from others at the start."""
    why = ", in a direction that followed from the other conditions at the start" if left_out else ""
    return SimulationError(
        Cause.LOOP_OPEN,
        f"{row}: the joint comes apart{why}",
        where=f"t = {t:.9g} s",
        value=f"{gap:.3g} m",
        limit=f"{limit:.3g} m",
        remedy="start outside of special positions (links in line or in one plane)"
        if left_out
        else "check whether the loop can reach this position; try smaller tolerances or steps",
    )


def locks(t: float, loop: str, value: float, start: float) -> SimulationError:
    """The smallest singular value of the conditions has fallen from ``start`` to ``value``."""
    return SimulationError(
        Cause.LOOP_OPEN,
        f"loop {loop!r} locks: in this singular position (a dead point, links in line) its joints cannot follow",
        where=f"t = {t:.9g} s",
        value=f"{value:.3g} metres per metre",
        limit=f"{start:.3g} at the start",
        remedy="keep the drive within what the lengths of the links allow, or end the run before",
    )


def ends_singular(t: float, found: Singular, value: float, start: float, where: str = "") -> SimulationError:
    """A run that ends at a singular position (``where`` in coordinates), by what the loop does there."""
    if found.kind == Kind.LOCKS:
        return locks(t, found.loop, value, start)
    what = f"loop {found.loop!r} comes to a change point{where}, where links in line may go on in two ways"
    remedy = "add a guide or a spring that decides, start elsewhere, or end the run before"
    if found.kind == Kind.STIFF:
        names = ", ".join(repr(name) for name in found.links)
        what += f", and no mode of links {names} gives way along the line: rounding decides"
        remedy = "give these links their axial modes (a larger reduction.elastic_modes, or all), or make them rigid"
    return SimulationError(
        Cause.CHANGE_POINT,
        what,
        where=f"t = {t:.9g} s",
        value=f"{value:.3g} metres per metre",
        limit=f"{start:.3g} at the start",
        remedy=remedy,
    )


def branches_warning(loop: str, where: str, times: list[float]) -> str:
    """What the user should know about a loop that passed change points, the first one in this position."""
    often = f", and at {len(times) - 1} more" if len(times) > 1 else ""
    return (
        f"loop {loop!r} passes a change point at t = {times[0]:.6g} s{where}{often}: links in line may go on in two "
        "ways there, and the run keeps to that which it came; in a real linkage play and friction decide, unless a "
        "guide or a spring does"
    )


def assembled_warning(start: Start, limit: float, force: Callable[[], float]) -> tuple[str, ...]:
    """What the user should know about loops that rigid links do not close to rounding, and what force [N] does."""
    if not start.where:
        return ()
    if start.gap > limit:
        return (
            f"{start.where}: undeformed links leave {start.gap:.3g} m open; they are bent into place and start "
            f"prestressed, with up to {force():.4g} N in a closing joint",
        )
    return (
        f"{start.where}: rigid links leave {start.gap:.3g} m open, within the assembly tolerance of {limit:.3g} m",
    )


def warnings_of(redundant: tuple[str, ...]) -> tuple[str, ...]:
    """What the user should know about conditions that are left out."""
    if not redundant:
        return ()
    return (
        f"{len(redundant)} conditions of the loops follow from the others and are left out: {'; '.join(redundant)}; "
        "of the forces that they could carry the smallest are taken",
    )
