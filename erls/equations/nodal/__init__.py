"""Nodal finite elements on SE(3): one frame per node, equations in the local frame, no rotation parameters."""
