"""Scenes of forward runs: other drives in place of what was found, from rest."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from msgspec.structs import replace

from erls.mechanism.chain import Mechanism
from erls.scene.build_joints import with_coordinates
from erls.scene.chain import Scene
from erls.scene.joints import Acting


def forward_scene(
    scene: Scene, mechanism: Mechanism, change: Callable[[str, Acting], Acting], formulation: str, **settings: Any
) -> Scene:
    """A scene with what acts in its joints changed, at rest where these start: under weight or loads as they bend it.

    Parameters
    ----------
    scene : Scene
    mechanism : Mechanism
        Of the scene.
    change : callable
        Of the name of a joint's coordinate and what acts along it.
    formulation : str
        That of the scene unless given.
    **settings
        Further ones of its simulation.
    """
    record, own = scene.record, scene.record.simulation
    own = replace(own, formulation=formulation or own.formulation, output_step=None, **settings)
    initial = record.initial
    if mechanism.gravity.any() or record.loads:  # links rest where these bend them
        initial = replace(initial, deformation="static")
    joints = [with_coordinates(joint, change) for joint in record.joints]
    return Scene(scene.path, replace(record, joints=joints, simulation=own, initial=initial))
