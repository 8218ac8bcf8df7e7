"""What the keywords and element types of a deck mean to a link: read, of no consequence, or a loss when left out.

A link is free and elastic. Steps, loads and output requests belong to an analysis of the deck and cannot matter to it;
everything else that is not read would make the link another one, so it is a loss. So is what is not known here.
"""

from __future__ import annotations

import re


def _names(text: str) -> frozenset[str]:
    return frozenset(name.strip() for name in " ".join(text.split()).split(","))


_READ = _names(
    """NODE, SYSTEM, ELEMENT, NSET, ELSET, SURFACE, PART, END PART, ASSEMBLY, END ASSEMBLY, INSTANCE, END INSTANCE,
    END STEP"""
)
_ANALYSIS = _names(
    """HEADING, STEP, STATIC, FREQUENCY, BUCKLE, DYNAMIC, MODAL DYNAMIC, STEADY STATE DYNAMICS, COMPLEX FREQUENCY,
    VISCO, HEAT TRANSFER, COUPLED TEMPERATURE-DISPLACEMENT, UNCOUPLED TEMPERATURE-DISPLACEMENT, ELECTROMAGNETICS, GREEN,
    SUBSTRUCTURE GENERATE, SUBSTRUCTURE MATRIX OUTPUT, SENSITIVITY, RETAINED NODAL DOFS, SELECT CYCLIC SYMMETRY MODES,
    CLOAD, DLOAD, DSLOAD, DFLUX, CFLUX, DSFLUX, FILM, SFILM, RADIATE, SRADIATE, CRADIATE, CFILM, TEMPERATURE, FIELD,
    BASE MOTION, MODAL DAMPING, GLOBAL DAMPING, INITIAL CONDITIONS, INERTIA RELIEF, AMPLITUDE, TIME POINTS, LOAD CASE,
    END LOAD CASE, CONTROLS, CONTACT CONTROLS, SOLUTION TECHNIQUE, VALUES AT INFINITY, PHYSICAL CONSTANTS, RESTART,
    PREPRINT, FILTER, OUTPUT, NODE OUTPUT, ELEMENT OUTPUT, CONTACT OUTPUT, ENERGY OUTPUT, MODAL OUTPUT, NODE PRINT,
    EL PRINT, NODE FILE, EL FILE, CONTACT FILE, CONTACT PRINT, ENERGY PRINT, ENERGY FILE, MODAL PRINT, MODAL FILE,
    SECTION PRINT, SECTION FILE, FACE PRINT, FILE FORMAT, FILE OUTPUT, PRINT, MONITOR, ELEMENT MATRIX OUTPUT,
    MATRIX GENERATE, MATRIX OUTPUT, NGRAPHICS, DESIGN VARIABLES, DESIGN RESPONSE, OBJECTIVE, CONSTRAINT,
    FEASIBLE DIRECTION, ROBUST DESIGN, GEOMETRIC TOLERANCES, CORRELATION LENGTH, COORDINATE SYSTEM, TRANSFORM,
    SURFACE INTERACTION, SURFACE BEHAVIOR, FRICTION, GAP CONDUCTANCE, GAP HEAT GENERATION, CONTACT DAMPING,
    SPECIFIC GAS CONSTANT, CRACK PROPAGATION, HCF, CFD, NO ANALYSIS, VIEWFACTOR, CHANGE FRICTION, CHANGE MATERIAL,
    CHANGE SURFACE BEHAVIOR, CHANGE CONTACT TYPE, CHANGE PLASTIC, INITIAL STRAIN INCREASE"""
)
_MATERIALS = _names(
    """MATERIAL, ELASTIC, DENSITY, SOLID SECTION, ORIENTATION, DISTRIBUTION, DISTRIBUTION TABLE, SECTION CONTROLS,
    HOURGLASS STIFFNESS, EXPANSION, CONDUCTIVITY, SPECIFIC HEAT, DAMPING, PLASTIC, CYCLIC HARDENING, RATE DEPENDENT,
    CREEP, DEFORMATION PLASTICITY, HYPERELASTIC, HYPERFOAM, VISCOELASTIC, USER MATERIAL, DEPVAR, DAMAGE INITIATION,
    DAMAGE EVOLUTION, LATENT HEAT, ELECTRICAL CONDUCTIVITY, MAGNETIC PERMEABILITY, FLUID CONSTANTS"""
)  # the link description states them
_LOSSES = {
    "supports (a link is free, and joints hold it)": _names("BOUNDARY"),
    "symmetry: the mesh is only a part of it": _names("CYCLIC SYMMETRY MODEL"),
    "constraints between nodes": _names(
        """EQUATION, MPC, RIGID BODY, COUPLING, KINEMATIC, DISTRIBUTING, KINEMATIC COUPLING, DISTRIBUTING COUPLING, TIE,
        EMBEDDED ELEMENT, SHELL TO SOLID COUPLING, PRE-TENSION SECTION, FASTENER, NETWORK MPC"""
    ),
    "contact": _names("CONTACT, CONTACT PAIR, CONTACT INCLUSIONS, GAP, CLEARANCE"),
    "mass": _names("MASS, ROTARY INERTIA, NONSTRUCTURAL MASS, MASS ADJUST"),
    "stiffness": _names(
        """SPRING, DASHPOT, JOINT, CONNECTOR SECTION, COHESIVE SECTION, USER SECTION, USER ELEMENT, UEL PROPERTY,
        MATRIX, MATRIX INPUT, MATRIX ASSEMBLE, SUBSTRUCTURE PROPERTY, REBAR, REBAR LAYER, NODAL THICKNESS"""
    ),
    "shells": _names("SHELL SECTION, SHELL GENERAL SECTION, MEMBRANE SECTION, SURFACE SECTION"),
    "beams": _names("BEAM SECTION, BEAM GENERAL SECTION, FRAME SECTION"),
    "a fluid": _names("FLUID SECTION, FLUID SECTIONS, BOUNDARYF, EQUATIONF, TRANSFORMF, NETWORK SELECTION FOR GAS"),
    "changes of the model": _names("MODEL CHANGE, RELEASE, SUBMODEL, REFINE MESH, CHANGE SOLID SECTION"),
}
_LOSS_OF = {name: text for text, names in _LOSSES.items() for name in names}
_ELEMENTS = {
    "point masses": re.compile(r"MASS|ROTARYI"),
    "springs, dampers or connectors": re.compile(r"SPRING|DASHPOT|GAP|CONN|JOINT|ITS|DCOUP"),
    "a fluid": re.compile(r"D\Z|D[A-Z]\w*|F3D\d+|FC3D\d+"),
}


_WITHOUT_BLANKS = {name.replace(" ", ""): name for name in (*_READ, *_ANALYSIS, *_MATERIALS, *_LOSS_OF)}


def canonical(keyword: str) -> str:
    """The usual spelling of a keyword (capitals); CalculiX reads them with and without blanks."""
    return _WITHOUT_BLANKS.get(keyword.replace(" ", ""), keyword)


def loss(keyword: str) -> str:
    """What a link lacks without a keyword (capitals); empty when it is read or cannot matter."""
    return "" if keyword in _READ | _ANALYSIS | _MATERIALS else _LOSS_OF.get(keyword, "what is not known here")


def is_read(keyword: str) -> bool:
    """Whether a keyword is part of the mesh."""
    return keyword in _READ


def loss_of_elements(kind: str, dimension: int, with_section: bool) -> str:
    """What a link lacks without elements of a type (capitals); empty for those that only mark faces and lines.

    Shells and beams have sections, which are keywords of their own; ``with_section``: of a ``*SOLID SECTION``.
    """
    if dimension == 3:
        return ""
    for text, pattern in _ELEMENTS.items():
        if pattern.match(kind):
            return text
    if dimension == 0:
        return "what is not known here"
    return "trusses or plane elements" if with_section else ""
