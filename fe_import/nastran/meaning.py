"""What the cards of a bulk data file mean to a link: read, of no consequence, or a loss when left out.

Loads, cases and output requests belong to an analysis and cannot matter to a link; everything else that is not read
would make the link another one, so it is a loss. So is a card that is not known here.
"""

from __future__ import annotations

import re

_UNNEEDED = re.compile(
    r"""(MAT|PSOLID|PLSOLID|PSHELL|PCOMP|PBAR|PBEAM|PROD|PTUBE|PBUSH|PELAS|PVISC|PDAMP|PGAP|PMASS|PSHEAR|PLOTEL|PARAM
    |MDLPRM|EIG|FORCE|MOMENT|PLOAD|TEMP|GRAV|ACCEL|RFORCE|LOAD|LSEQ|SUPA|SUPORT|[ABCQ]SET|USET|OMIT|SET\d|SPOINT
    |EPOINT|CORD|GRDSET|TABL|TABD|DAREA|DLOAD|DELAY|DPHASE|[RT]LOAD|FREQ|TSTEP|TIC|NLP|NLSTEP|DES|DRESP|DV|DCONSTR|DOPT
    |DTABLE|DEQATN|CONV|RADSET|RANDPS|TABR|AE|CAERO|PAERO|SPLINE|FLUTTER|FLFACT|TRIM|MKAERO|GUST|SLOAD|CSSCHD|DIVERG|DTI|SPCD|SESET|BAROR|BEAMOR)""",
    re.VERBOSE,
)  # properties and materials matter through their elements, which are judged, and the description states them
_LOSSES = {
    "supports (a link is free, and joints hold it)": re.compile(r"SPC"),
    "constraints between nodes": re.compile(r"MPC|RBE\d|RBAR|RROD|RTRPLT|RJOINT|RSPLINE|RSSCON|CWELD|CFAST|CSEAM"),
    "point masses": re.compile(r"CONM\d|CMASS\d|NSM"),
    "springs, dampers or connectors": re.compile(r"CELAS\d|CBUSH|CDAMP|CVISC|CGAP|GENEL|CBEAR"),
    "stiffness or mass given as matrices": re.compile(r"DMI"),
    "superelements": re.compile(r"SE(?!T\d|SET)|EXTRN|CSUPER|RELEASE"),
    "contact": re.compile(r"BC|BSQUEAL|BFRIC|BGSET"),
    "beams or bars": re.compile(r"CBAR|CBEAM|CBEND|CROD|CONROD|CTUBE"),
    "shells": re.compile(r"CQUAD|CTRIA|CSHEAR|CTRAX"),
}
SURFACES = {"CTRIA3": 3, "CTRIAR": 3, "CQUAD4": 4, "CQUADR": 4, "CTRIA6": 6, "CQUAD8": 8}
LINES = {"CBAR": 2, "CBEAM": 2, "CROD": 2, "CTUBE": 2}


def loss(name: str) -> str:
    """What a link lacks without a card; empty when it cannot matter."""
    if _UNNEEDED.match(name):
        return ""
    return next((text for text, pattern in _LOSSES.items() if pattern.match(name)), "what is not known here")
