"""The motion of rigid links: where a mechanism would be if nothing bent, at prescribed and wanted motions.

Joints that follow closing joints are found by Newton's method from one time to the next, so that they stay on the
branch on which they start.
"""

from __future__ import annotations

import numpy as np

from erls.errors import Cause, SceneError, SimulationError
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism, poses
from erls.mechanism.loops import Loop, LoopEnd

_ITERATIONS, _STEP = 30, 1e-6
_CLOSED = 1e-6  # of the size of the mechanism: what lengths that do not fit may leave open
_STRIDE, _MOST = 0.1, 1000  # rad or m: prescribed coordinates go no farther between two solutions; their number


class RigidMotion:
    """Of a mechanism.

    Attributes
    ----------
    times : (k,) array
    coordinates : (k, joints) array
    frames : (k, links, 4, 4) array
        Of the links in the world.

    Raises
    ------
    SceneError
        A joint moves freely, so that rigid links would move in another way.
    SimulationError
        LOOP_OPEN: rigid links do not reach.
    """

    def __init__(self, mechanism: Mechanism, times: Array) -> None:
        self.times = times
        self._mechanism = mechanism
        joints, loops = mechanism.joints, mechanism.loops
        self._driven = [k for k, joint in enumerate(joints) if joint.drive.motion is not None]
        self.following = [k for k in range(len(joints)) if k not in self._driven]
        if self.following and not loops:
            raise self._free()
        self.coordinates = np.array([self._at(t) for t in self._walk(times)])[self._wanted]
        self.frames = np.array([poses(mechanism, row) for row in self.coordinates])

    def _free(self) -> SceneError:
        return SceneError(
            Cause.BAD_FIELD,
            "a joint moves freely: where rigid links would be is not known",
            where=f"joint {self._mechanism.joints[self.following[0]].name!r}",
            remedy="let its drive have a motion; joints that follow closed loops need none",
        )

    def _walk(self, times: Array) -> Array:
        """Times to solve at, in rising order, those that are asked for among them."""
        if not self.following:
            self._wanted = np.arange(len(times))
            return times
        every = np.unique(np.append(times, 0.0))
        moved = np.abs(np.diff([self._inputs(t) for t in every], axis=0)).max(axis=1, initial=0.0)
        parts = np.maximum(1, np.minimum(np.ceil(moved / _STRIDE), _MOST)).astype(int)
        pieces = [np.linspace(a, b, n, endpoint=False) for a, b, n in zip(every, every[1:], parts, strict=False)]
        every = np.unique(np.concatenate([*pieces, every]))
        self._wanted = np.searchsorted(every, times)
        self._last = np.array([joint.position for joint in self._mechanism.joints])
        return every

    def _inputs(self, t: float) -> list[float]:
        """Prescribed coordinates."""
        own = [self._mechanism.joints[k].drive.reference(t) for k in self._driven]
        own += [loop.freedom.drive.reference(t) for loop in self._mechanism.loops if loop.freedom and loop.prescribed]
        return [0.0 if value is None else value[0] for value in own]

    def _at(self, t: float) -> Array:
        theta = np.array([joint.position for joint in self._mechanism.joints])
        for k in self._driven:
            found = self._mechanism.joints[k].drive.reference(t)
            assert found is not None
            theta[k] = found[0]
        if not self.following:
            return theta
        theta[self.following] = self._last[self.following]
        for _ in range(_ITERATIONS):
            gap = self._gap(t, theta)
            slope = np.stack([self._slope(t, theta, k) for k in self.following], axis=1)
            step, _, rank, _ = np.linalg.lstsq(slope, gap, rcond=1e-9)
            if rank < len(self.following) and t == self.times[0]:
                raise self._free()
            theta[self.following] -= step
            if np.abs(step).max(initial=0.0) <= 1e-11:
                break
        if not np.abs(self._gap(t, theta)).max() <= _CLOSED * self._mechanism.reach:
            raise SimulationError(
                Cause.LOOP_OPEN,
                "rigid links do not reach",
                where=f"t = {t:.6g} s, loop {self._mechanism.loops[0].name!r}",
                remedy="look at lengths and motions",
            )
        self._last = theta.copy()
        return theta

    def _slope(self, t: float, theta: Array, k: int) -> Array:
        above, below = theta.copy(), theta.copy()
        above[k] += _STEP
        below[k] -= _STEP
        return (self._gap(t, above) - self._gap(t, below)) / (2 * _STEP)

    def _gap(self, t: float, theta: Array) -> Array:
        """(m,) violations of closing joints, turns times the size of the mechanism [m]."""
        frames = poses(self._mechanism, theta)
        return np.concatenate([self._violation(loop, frames, t) for loop in self._mechanism.loops])

    def _violation(self, loop: Loop, frames: list[Array], t: float) -> Array:
        inner, outer = self._end(loop.inner, frames), self._end(loop.outer, frames)
        conditions = loop.type.conditions
        if loop.freedom is not None and loop.prescribed:
            reference = loop.freedom.drive.reference(t)
            ahead = (0.0 if reference is None else reference[0]) - loop.freedom.zero
            inner = inner @ loop.freedom.freedom.pose(ahead)
            conditions = loop.type.driven_conditions
        relative = np.linalg.inv(inner) @ outer
        turn = np.arctan2(relative[1, 0] - relative[0, 1], relative[0, 0] + relative[1, 1])
        found = [c.line @ relative[:3, 3] + (c.entries * relative[:3, :3]).sum() - c.pitch * turn for c in conditions]
        turns = np.array([not c.line.any() for c in conditions])
        return np.array(found) * np.where(turns, self._mechanism.reach, 1.0)

    def _end(self, end: LoopEnd, frames: list[Array]) -> Array:
        if end.link is None:
            return end.frame
        result = frames[end.link] @ end.frame
        place = self._mechanism.links[end.link].model.nodes[end.node] + end.frame[:3, 3]
        result[:3, 3] = frames[end.link][:3, :3] @ place + frames[end.link][:3, 3]
        return result
