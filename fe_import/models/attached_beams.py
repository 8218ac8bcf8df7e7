"""Matrices of a beam that a mesh file attaches: its ends at an arm from the nodes, some components not passed on.

A released component passes no force: it follows from the others by the beam's own stiffness, in the mass too.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fe_import.elements.attachments import AttachedBeam
from fe_import.elements.frame import element_mass, element_stiffness
from fe_import.elements.frame_releases import released_motion
from fe_import.interfaces.dependence import arm
from fe_import.model import Array


def beam_matrices(beam: AttachedBeam) -> tuple[Array, Array]:
    """(12, 12) mass and stiffness over the components of its two nodes, mesh axes."""
    element = beam.element
    ends = np.zeros((12, 12))  # local components of the points at the arms per components of the nodes
    for k, offset in zip((0, 6), beam.offsets, strict=True):
        end = np.eye(6)
        end[:3] = arm(offset[None])[0]
        ends[k : k + 6, k : k + 6] = np.kron(np.eye(2), element.axes) @ end
    motion = released_motion(element, beam.released) @ ends
    mass = element_mass(element, True, "consistent", rotary_inertia=True)
    if beam.line_mass:
        line = replace(element.section, inertia_y=0.0, inertia_z=0.0)
        filled = replace(element, section=line, density=beam.line_mass / line.area)
        mass = mass + element_mass(filled, True, "consistent", rotary_inertia=False)
    stiffness = sum(element_stiffness(element, True).values(), np.zeros((12, 12)))
    return motion.T @ mass @ motion, motion.T @ stiffness @ motion
