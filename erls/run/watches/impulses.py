"""Prescribed motions that would need an infinite force, before a run."""

from __future__ import annotations

from erls.mechanism.chain import Mechanism
from erls.run.watches.base import Finding, Plan, Watch


class Impulses(Watch):
    """Looks at prescribed motions."""

    def before(self, plan: Plan) -> Finding:
        """Those whose rate jumps."""
        return Finding(impulse_warnings(plan.mechanism, plan.settings.duration))


def impulse_warnings(mechanism: Mechanism, duration: float) -> list[str]:
    """Prescribed motions whose rate jumps would need an infinite force."""
    result = []
    drives = [(f"joint {joint.name!r}", joint.drive) for joint in mechanism.joints]
    drives += [(f"loop {loop.name!r}", loop.freedom.drive) for loop in mechanism.loops if loop.freedom is not None]
    for name, drive in drives:
        if not drive.prescribed:
            continue
        for t in (b for b in drive.breakpoints if 0 <= b < duration):
            before, after = drive.reference(t, left=True), drive.reference(t)
            if (
                before is not None
                and after is not None
                and abs(before[1] - after[1]) > 1e-9 * max(1, abs(after[1]))
            ):
                result.append(
                    f"{name}: the prescribed rate jumps at t = {t:.6g} s; the links do not feel the "
                    "blow (use a motion with continuous rate)"
                )
    return result
