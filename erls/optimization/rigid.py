"""The motion of rigid links: where a mechanism would be if nothing bent, at prescribed and wanted motions.

Joints that follow closing joints are found by Newton's method, first from one time to the next in short strides, so
that they stay on the branch on which they start, and from there on at all times together.
"""

from __future__ import annotations

import numpy as np

from erls.errors import Cause, SceneError, SimulationError
from erls.maths.rotation_maps import exp
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.drives import Drive
from erls.mechanism.loops import Loop, LoopEnd

_ITERATIONS, _STEP, _REACHED = 30, 1e-6, 1e-11
_CLOSED = 1e-6  # of the size of the mechanism: what lengths that do not fit may leave open
_STRIDE, _MOST = 0.1, 10_000  # rad or m: prescribed coordinates go no farther in a stride; strides in all
_RANK = 1e-9


def link_frames(mechanism: Mechanism, theta: Array) -> Array:
    """(k, links, 4, 4) in the world at joint coordinates (k, joints)."""
    moved = [joint.freedom.poses(theta[:, n]) for n, joint in enumerate(mechanism.joints)]
    for n in mechanism.rotation_vectors:
        moved[n] = np.tile(np.eye(4), (len(theta), 1, 1))
        moved[n][:, :3, :3] = exp(theta[:, n : n + 3])
    result: list[Array] = []
    for joint, own in zip(mechanism.joints, moved, strict=True):
        step = joint.before @ own @ joint.after
        result.append(step if joint.parent < 0 else result[joint.parent] @ step)
    return np.stack(result, axis=1)


class RigidMotion:
    """Of a mechanism.

    Parameters
    ----------
    mechanism : Mechanism
    times : (k,) array
        Rising [s].

    Attributes
    ----------
    times : (k,) array
    coordinates : (k, joints) array
    frames : (k, links, 4, 4) array
        Of the links in the world.
    following : list of int
        Joints that no motion is given for: closing joints lead them.

    Raises
    ------
    SceneError
        A joint moves freely, so that rigid links would move in another way.
    SimulationError
        LOOP_OPEN: rigid links do not reach.
    """

    def __init__(self, mechanism: Mechanism, times: Array) -> None:
        self.times, self._mechanism = times, mechanism
        self._driven = [k for k, joint in enumerate(mechanism.joints) if joint.drive.motion is not None]
        self.following = [k for k in range(len(mechanism.joints)) if k not in self._driven]
        if self.following and not mechanism.loops:
            raise self._free()
        theta = self._given(times)
        if self.following:
            walk = self._walk(times)
            path = self._followed(walk)
            for k in self.following:
                theta[:, k] = np.interp(times, walk, path[:, k])
            theta = self._closed(times, theta)
        self.coordinates, self.frames = theta, link_frames(mechanism, theta)

    def _free(self) -> SceneError:
        return SceneError(
            Cause.BAD_FIELD,
            "a joint moves freely: where rigid links would be is not known",
            where=f"joint {self._mechanism.joints[self.following[0]].name!r}",
            remedy="let its drive have a motion; joints that follow closed loops need none",
        )

    def _given(self, times: Array) -> Array:
        """(k, joints) with what is given; others as they start."""
        theta = np.tile([joint.position for joint in self._mechanism.joints], (len(times), 1)).astype(float)
        for k in self._driven:
            theta[:, k] = _motion(self._mechanism.joints[k].drive, times)
        return theta

    def _walk(self, times: Array) -> Array:
        """Times of short strides."""
        walk = np.unique(np.append(times, 0.0))
        inputs = [_motion(self._mechanism.joints[k].drive, walk) for k in self._driven]
        inputs += [_motion(x.freedom.drive, walk) for x in self._mechanism.loops if x.freedom and x.prescribed]
        moved = np.abs(np.diff(inputs, axis=1)).max(axis=0, initial=0.0)
        parts = np.clip(np.ceil(moved / _STRIDE), 1, _MOST // len(walk) + 1).astype(int)
        pieces = [np.linspace(a, b, n, endpoint=False) for a, b, n in zip(walk, walk[1:], parts, strict=False)]
        fine = np.append(np.concatenate(pieces), walk[-1]) if pieces else walk
        far = np.concatenate([[0.0], np.cumsum(np.repeat(moved / parts, parts))])
        kept = np.unique(np.append(np.unique(np.floor(far / _STRIDE), return_index=True)[1], len(fine) - 1))
        return np.asarray(fine[kept])

    def _followed(self, walk: Array) -> Array:
        """(k, joints) one time after the other."""
        path = self._given(walk)
        for n in range(len(walk)):
            path[n, self.following] = path[max(n - 1, 0), self.following]
            path[n] = self._closed(walk[n : n + 1], path[n : n + 1])[0]
        return path

    def _closed(self, times: Array, theta: Array) -> Array:
        """Followers at all times, by Newton's method from where they are."""
        theta = theta.copy()
        for _ in range(_ITERATIONS):
            gap = self._gap(times, theta)
            slope = np.stack([self._slope(times, theta, k) for k in self.following], axis=2)
            if np.linalg.matrix_rank(slope[0], tol=_RANK * max(1.0, float(np.abs(slope).max()))) < len(self.following):
                raise self._free()
            step = np.einsum("kij,kj->ki", np.linalg.pinv(slope, rcond=_RANK), gap)
            theta[:, self.following] -= step
            if not np.abs(step).max() > _REACHED:
                break
        left = np.abs(self._gap(times, theta)).max(axis=1)
        if not left.max() <= _CLOSED * self._mechanism.reach:
            raise SimulationError(
                Cause.LOOP_OPEN,
                "rigid links do not reach",
                where=f"t = {times[int(np.nan_to_num(left, nan=np.inf).argmax())]:.6g} s",
                value=float(left.max()),
                limit=_CLOSED * self._mechanism.reach,
                remedy="look at lengths and motions",
            )
        return theta

    def _slope(self, times: Array, theta: Array, k: int) -> Array:
        above, below = theta.copy(), theta.copy()
        above[:, k] += _STEP
        below[:, k] -= _STEP
        return np.asarray((self._gap(times, above) - self._gap(times, below)) / (2 * _STEP))

    def _gap(self, times: Array, theta: Array) -> Array:
        """(k, m) violations of closing joints, turns times the size of the mechanism [m]."""
        frames = link_frames(self._mechanism, theta)
        return np.concatenate([self._violation(loop, frames, times) for loop in self._mechanism.loops], axis=1)

    def _violation(self, loop: Loop, frames: Array, times: Array) -> Array:
        inner, outer = self._end(loop.inner, frames), self._end(loop.outer, frames)
        conditions = loop.type.conditions
        if loop.freedom is not None and loop.prescribed:
            ahead = _motion(loop.freedom.drive, times) - loop.freedom.zero
            inner = inner @ loop.freedom.freedom.poses(ahead)
            conditions = loop.type.driven_conditions
        relative = np.linalg.inv(inner) @ outer
        turn = np.arctan2(relative[:, 1, 0] - relative[:, 0, 1], relative[:, 0, 0] + relative[:, 1, 1])
        rows = [
            (relative[:, :3, 3] @ c.line + (c.entries * relative[:, :3, :3]).sum(axis=(1, 2)) - c.pitch * turn)
            * (1.0 if c.line.any() else self._mechanism.reach)
            for c in conditions
        ]
        return np.stack(rows, axis=1)

    def _end(self, end: LoopEnd, frames: Array) -> Array:
        """(k, 4, 4) a joint frame in the world."""
        if end.link is None:
            return np.tile(end.frame, (len(frames), 1, 1))
        local = end.frame.copy()
        local[:3, 3] += self._mechanism.links[end.link].model.nodes[end.node]
        return np.asarray(frames[:, end.link] @ local)


def _motion(drive: Drive, times: Array) -> Array:
    """(k,) prescribed or wanted coordinates."""
    found = [drive.reference(t) for t in times.tolist()]
    return np.array([0.0 if one is None else one[0] for one in found])
