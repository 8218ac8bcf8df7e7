"""How large random mechanisms are, of what they are made, and how long they run."""

from __future__ import annotations

from dataclasses import dataclass

from random_draws import Draws, rounded
from random_drives import seconds
from random_links import MATERIALS, SOFTEST
from random_loops_planar import Linkage, random_linkage

COUNTS = {1: 0.14, 2: 0.3, 3: 0.26, 4: 0.12, 5: 0.1, 6: 0.08}


@dataclass(frozen=True)
class Sizes:
    """What is drawn before anything is built.

    Attributes
    ----------
    whole : float
        Size of the mechanism [m].
    lengths : list of float
        Of the links [m].
    materials : list of str
        Of the links; ``rigid`` among them.
    sags : list of float
        For which they are sized, over their length.
    duration : float
        Of the run, before links have their say [s].
    linkage : Linkage or None
        Where the joints of a loop are.
    """

    whole: float
    lengths: list[float]
    materials: list[str]
    sags: list[float]
    duration: float
    linkage: Linkage | None

    @property
    def time(self) -> float:
        """In which the mechanism usually moves by its size [s]."""
        return 2 * seconds(self.whole)


def random_sizes(draws: Draws, kind: str, mechanism: str) -> Sizes:
    """The sizes of a scene of that kind."""
    ranges = {(0.1, 3.0): 0.7, (1e-3, 0.1): 0.15, (3.0, 50.0): 0.15}
    whole = draws.log_uniform(*draws.pick(ranges))
    linkage = random_linkage(draws, whole) if mechanism == "loop" else None
    if linkage is None:
        count = draws.pick(COUNTS)
        if kind == "chaotic" or mechanism == "tree":
            count = max(count, 2)
        shares = [draws.uniform(0.5, 1.0) for _ in range(count)]
        lengths = [rounded(whole * share / sum(shares)) for share in shares]
    else:
        lengths = linkage.lengths
    rigid = draws.chance(0.12)
    main = _material(draws, max(lengths))
    materials, sags = [], []
    for length in lengths:
        own = main if draws.chance(0.7) else _material(draws, length)
        materials.append("rigid" if rigid or draws.chance(0.15) else own)
        sags.append(draws.log_uniform(0.01, 0.2) if kind == "soft" else draws.log_uniform(1e-5, 1e-2))
    periods = draws.uniform(1.0, 4.0) if kind == "chaotic" else draws.uniform(0.4, 2.0)
    return Sizes(whole, lengths, materials, sags, rounded(periods * 5 * seconds(whole)), linkage)


def _material(draws: Draws, length: float) -> str:
    weights = {name: 2.0 if name in ("steel", "aluminium") else 1.0 for name in MATERIALS}
    return draws.pick({name: weight for name, weight in weights.items() if length < SOFTEST.get(name, 1e9)})
