"""What a design looks like while it moves: beams with their true sections, other links by their surfaces."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from erls.errors import SceneError
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.optimization.beams import Outlines, elements_by_link, outlines_of
from erls.optimization.frozen import of_beams
from erls.optimization.limits import Motion
from erls.optimization.link_numbers import LinkNumbers
from erls.run.chain.places import node_positions, rigid_positions
from erls.scene.settings import Simulation
from fe_import.model import IntArray

_FRAMES = 25
_SIDES = 12  # of round sections


@dataclass(frozen=True)
class Drawn:
    """A link in k frames.

    Attributes
    ----------
    name : str
    rest, moved : (k, n, 3) arrays
        Places of its corners where rigid links would have them, and displacements from there [m].
    lines, triangles : lists of lists of int
        Of corners.
    """

    name: str
    rest: Array
    moved: Array
    lines: list[list[int]] = field(default_factory=list)
    triangles: list[list[int]] = field(default_factory=list)


def frames_among(count: int) -> IntArray:
    """Numbers of the times, of so many, that are drawn."""
    return np.unique(np.linspace(0, count - 1, min(count, _FRAMES)).round().astype(np.int64))


def drawn(motion: Motion, settings: Simulation, numbers: LinkNumbers, x: Array) -> tuple[Drawn, ...]:
    """All links of a run.

    Parameters
    ----------
    motion : Motion
        With its run.
    settings : Simulation
    numbers : LinkNumbers
    x : (v,) array
        The design.
    """
    assert motion.run is not None
    mechanism, at = motion.run.formulation.mechanism, frames_among(len(motion.frozen.times))
    states = motion.run.series(motion.frozen.times[at])
    owners = elements_by_link(mechanism, settings, numbers, x)
    result = []
    for k in mechanism.bodies:
        link = mechanism.links[k]
        outlines = _outlines(mechanism, settings, numbers, x, k) if link.elastic_modes and of_beams(link) else None
        if outlines is not None and len(outlines.links):
            result.append(_beams(link.name, motion, at, np.flatnonzero(owners == k), outlines))
            continue
        rest = rigid_positions(mechanism, states, k)
        moved = node_positions(mechanism, states, k) - rest
        result.append(Drawn(link.name, rest, moved, link.model.lines.tolist(), link.model.triangles.tolist()))
    return tuple(result)


def _outlines(
    mechanism: Mechanism, settings: Simulation, numbers: LinkNumbers, x: Array, k: int
) -> Outlines | None:
    """Of the beams of a link; None where some have constants alone."""
    try:
        return outlines_of(mechanism, settings, numbers, x, [k])
    except SceneError:
        return None


def _beams(name: str, motion: Motion, at: IntArray, own: IntArray, outlines: Outlines) -> Drawn:
    """A prism for each element."""
    frozen = motion.frozen
    corners: list[tuple[Array, Array]] = []
    triangles: list[list[int]] = []
    poses, rigid = motion.poses[at], frozen.frames[at][:, frozen.links] @ frozen.local
    for e, half, rounded in zip(own.tolist(), outlines.half, outlines.rounds.tolist(), strict=True):
        ring = _ring(half, rounded)
        ends = [(frozen.ends[e, side], frozen.sections[e, side]) for side in (0, 1)]
        triangles += _prism(sum(rest.shape[2] for rest, _ in corners), len(ring))
        corners += [(rigid[:, node] @ seat @ ring.T, poses[:, node] @ seat @ ring.T) for node, seat in ends]
    rest, there = (np.concatenate(each, axis=2)[:, :3].swapaxes(1, 2) for each in zip(*corners, strict=True))
    return Drawn(name, rest, there - rest, triangles=triangles)


def _ring(half: Array, rounded: bool) -> Array:
    """(n, 4) corners of a section in its axes: half its height along z, half its width along y."""
    angles = np.linspace(0, 2 * np.pi, _SIDES, endpoint=False) if rounded else np.pi / 4 + np.arange(4) * np.pi / 2
    y, z = np.cos(angles), np.sin(angles)
    if not rounded:
        y, z = np.sign(y), np.sign(z)
    return np.stack([np.zeros_like(y), half[1] * y, half[0] * z, np.ones_like(y)], axis=1)


def _prism(first: int, n: int) -> list[list[int]]:
    """Triangles between two rings that follow one another, and over both ends."""
    found = []
    for k in range(n):
        a, b = first + k, first + (k + 1) % n
        found += [[a, b, a + n], [b, b + n, a + n]]
    for start in (first, first + n):
        found += [[start, start + k, start + k + 1] for k in range(1, n - 1)]
    return found
