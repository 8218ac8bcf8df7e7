"""Hard cases: one record each, by subject; `CASES` are the rows of the table, in its order."""

from hard_cases import drives, flexible, invariance, loops, pendulums, stability, tops
from hard_cases.case import FORMULATIONS, Case

CASES: tuple[Case, ...] = (
    *pendulums.CASES,
    *tops.CASES,
    *flexible.CASES,
    *drives.CASES,
    *loops.CASES,
    *stability.CASES,
    *invariance.CASES,
)
ROWS = tuple((case, formulation) for case in CASES for formulation in FORMULATIONS)

_TOP, _CHANGE = "top of Bruels, Arnold and Cardona", "parallelogram through its change point, adaptive"
FALLS_SHORT = frozenset({(_TOP, "erls"), (_TOP, "ffr"), (_CHANGE, "nodal")})
"""Rows known to state too little, which the table shows as failures: of the top, what is stated also varies with the
chunks in which steps are made, by whether it knows a horizon; of the other at a hundredth of the usual tolerance.
"""
