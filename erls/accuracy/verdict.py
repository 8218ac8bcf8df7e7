"""The verdict on a run: what of its stated error and its audits it follows from, and what to change."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from erls.run.accuracy import BROKEN, GOOD, LIMITED, PARTS, Accuracy, Trust


def verdict(
    accuracy: Accuracy, breaches: Sequence[str], tolerance: float, remedies: Mapping[str, str], growth: float = 0.0
) -> Trust:
    """Good, limited or broken, with the reasons why it is no better.

    Parameters
    ----------
    accuracy : Accuracy
    breaches : sequence of str
        Audits that failed.
    tolerance : float
        The wanted total [m].
    remedies : mapping of str to str
        By part, what makes it smaller.
    growth : float
        Rate at which disturbances grow [1/s]; 0 where they do not.
    """
    if breaches:
        return Trust(BROKEN, tuple(f"audit: {text}" for text in breaches))
    if accuracy.total is None:
        return Trust(BROKEN, tuple(f"the part {name} is not known: {why}" for name, why in accuracy.unjudged.items()))
    if accuracy.total <= tolerance:
        return Trust(GOOD)
    largest = max(PARTS, key=lambda name: getattr(accuracy, name) or 0.0)
    reasons = [
        f"the stated error is {accuracy.total:.2g} m, the tolerance {tolerance:.2g} m; the largest part is {largest}, "
        f"{getattr(accuracy, largest):.2g} m: use {remedies[largest]}"
    ]
    if accuracy.horizon is not None:
        faster = f"; disturbances grow by a factor of e in {1 / growth:.2g} s" if growth else ""
        reasons.append(f"up to t = {accuracy.horizon:.4g} s the error stays within the tolerance{faster}")
    return Trust(LIMITED, tuple(reasons))
