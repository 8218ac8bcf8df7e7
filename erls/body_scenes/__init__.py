"""Scenes of bodies, beams and connections, in any arrangement: solved by the nodal elements of `erls.nodal` alone."""

from __future__ import annotations

from erls.body_scenes.scene import BodyScene, is_body_scene, load_body_scene
from erls.body_scenes.solve import solve

__all__ = ["BodyScene", "is_body_scene", "load_body_scene", "solve"]
