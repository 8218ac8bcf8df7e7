"""Shells of a scene with every quadrangle cut into four, for what is left of the error of a mesh."""

from __future__ import annotations

from pathlib import Path

import msgspec

from erls.equations.nodal.scenes.shell_mesh import mesh_of
from erls.equations.nodal.surfaces import corner_frames, quartered
from erls.scene.bodies.schema import ShellSurface


def refined_mesh(shell: ShellSurface, folder: Path, place: str) -> ShellSurface:
    """A shell that comes from a mesh, with four times the elements; nodes of the mesh keep their numbers.

    Raises
    ------
    SceneError, FEImportError
        As of `erls.equations.nodal.scenes.shell_mesh.surface`.
    """
    places, cells, sets = mesh_of(shell, folder, place)
    finer = quartered(places, cells, corner_frames(places, cells, shell.fold_deg, place))
    return msgspec.structs.replace(
        shell,
        mesh="",
        places=[tuple(at) for at in finer.places.tolist()],
        cells=[tuple(cell) for cell in finer.cells.tolist()],
        sets={name: finer.grown(nodes).tolist() for name, nodes in sets.items()},
    )
