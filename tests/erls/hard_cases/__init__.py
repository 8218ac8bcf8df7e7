"""Hard cases: one record each, by subject; `CASES` are the rows of the table, in its order."""

from hard_cases import contacts, drives, flexible, invariance, loops, pendulums, stability, tops
from hard_cases.case import FORMULATIONS, Case

CASES: tuple[Case, ...] = (
    *pendulums.CASES,
    *tops.CASES,
    *flexible.CASES,
    *drives.CASES,
    *contacts.CASES,
    *loops.CASES,
    *stability.CASES,
    *invariance.CASES,
)
ROWS = tuple((case, formulation) for case in CASES for formulation in FORMULATIONS)
