"""Shells with every quadrangle cut into four, for what is left of the error of a mesh.

New nodes lie on the surface as its elements interpolate it, H_A exp(½ log(H_A⁻¹ H_B)) in the middle of an edge and
likewise between two of these in the middle of an element; where the elements on both sides of an edge see it a little
differently, in between.
"""

from __future__ import annotations

from pathlib import Path

import msgspec
import numpy as np

from erls.equations.nodal.scenes.shell_mesh import corner_frames, mesh_of
from erls.maths import motion_maps as motions
from erls.maths.so3 import Array
from erls.scene.bodies.schema import ShellSurface


def refined_mesh(shell: ShellSurface, folder: Path, place: str) -> ShellSurface:
    """A shell that comes from a mesh, with four times the elements; nodes of the mesh keep their numbers.

    Raises
    ------
    SceneError, FEImportError
        As of `erls.equations.nodal.scenes.shell_mesh.surface`.
    """
    places, cells, sets = mesh_of(shell, folder, place)
    frames = corner_frames(places, cells, shell.fold_deg, place)
    middles = _between(frames, np.roll(frames, -1, axis=1))  # (e, 4, 4, 4) of the edges, from each corner to the next
    centres = _between(middles[:, 0], middles[:, 2])[:, :3, 3]
    ends = np.sort(np.stack([cells, np.roll(cells, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    edges, own = np.unique(ends, axis=0, return_inverse=True)
    own = own.reshape(cells.shape)
    seen = np.zeros((len(edges), 3))
    np.add.at(seen, own.ravel(), middles[..., :3, 3].reshape(-1, 3))
    seen /= np.bincount(own.ravel())[:, None]
    first = len(places)
    inner = first + len(edges) + np.arange(len(cells))
    around = first + own
    quarters = [[cells[:, k], around[:, k], inner, around[:, k - 1]] for k in range(4)]
    new = [(first + np.arange(len(edges)), edges), (inner, cells)]  # with what they lie between
    finer = {
        name: [int(k) for k in np.concatenate([nodes, *(at[np.isin(of, nodes).all(axis=1)] for at, of in new)])]
        for name, nodes in sets.items()
    }
    every = np.concatenate([places, seen, centres])
    return msgspec.structs.replace(
        shell,
        mesh="",
        places=[tuple(at) for at in every.tolist()],
        cells=[tuple(cell) for cell in np.array(quarters).transpose(2, 0, 1).reshape(-1, 4).tolist()],
        sets=finer,
    )


def _between(a: Array, b: Array) -> Array:
    """(..., 4, 4) in the middle of the way from a to b."""
    shape = a.shape
    a, b = a.reshape(-1, 4, 4), b.reshape(-1, 4, 4)
    return np.asarray(a @ motions.exp(0.5 * motions.log(motions.inverse(a) @ b))).reshape(shape)
