"""Units that slipped: figures of a link held against what links are like.

A figure outside of its range is suspicious and a failed check that names the likely slip: the link is refused, unless
its description says that it is unusual. Far outside, where nothing is built (denser than a star's shell, faster than
any sound), it is refused in any case.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from fe_import.description.records import Material
from fe_import.errors import Cause, FEImportError
from fe_import.modal.model import NO_LIMIT, HealthCheck
from fe_import.model import Array

_HEAVY = 1000.0  # point masses per mass of the elements that carry them
_THIN = 0.1  # a model of beams has no thickness: a tenth of its length encloses it


@dataclass(frozen=True)
class Range:
    """What a figure may be.

    Attributes
    ----------
    name, unit : str
    low, high : float
        Outside it is suspicious.
    least, most : float
        Outside it is refused.
    below, above : str
        The slips that would explain it.
    """

    name: str
    unit: str
    low: float
    high: float
    least: float
    most: float
    below: str
    above: str

    def check(self, value: float, where: str) -> HealthCheck:
        """The check, passed at a factor of 1 and below.

        Raises
        ------
        FEImportError
            ``BAD_FIELD``: the figure is out of all proportion.
        """
        outside = max(value / self.high, self.low / value) if value > 0 else math.inf
        slip = "" if outside <= 1 else f"; {self.below if value < self.low else self.above}"
        if not self.least <= value <= self.most:
            raise FEImportError(
                Cause.BAD_FIELD,
                f"{self.name} of {value:.3g} {self.unit} cannot be: a unit slipped",
                where=where,
                value=value,
                limit=f"{self.least:g} ... {self.most:g} {self.unit}",
                remedy=slip[2:],
            )
        span = " to ".join(f"{limit:g}" for limit in (self.low, self.high) if 0 < limit < math.inf)
        name = f"units: {self.name} against {span} {self.unit}".rstrip()
        return HealthCheck(f"{name} (it is {value:.3g}{slip})" if slip else name, outside, 1.0)


_SIZE = Range(
    *("size of the link", "m", 1e-3, 100.0, 1e-9, 1e6),
    below='m read as mm? remove units.length = "mm"',
    above='mm read as m? set units.length = "mm"',
)
_MASS = Range(
    *("mass of the link", "kg", 1e-9, 1e6, 1e-18, 1e12),
    below='t read as kg? set units.mass = "t"; mm read as m? set units.length = "mm"',
    above='g read as kg? set units.mass = "g"; a mesh in mm read as m? set units.length = "mm"',
)
_DENSITY = Range(
    *("density", "kg/m³", 10.0, 3e4, 1e-6, 1e6),
    below='t, or g/cm³, read as kg? set units.mass = "t"; with t/mm³ set units.length = "mm" too',
    above="g read as kg? set units.mass",
)
_MODULUS = Range(
    *("Young's modulus", "Pa", 1e5, 2e12, 1e-2, 1e18),
    below='MPa (N/mm²) or GPa read as Pa? set units.length = "mm" and units.mass = "t", or give Pa',
    above="Pa given with other units? give it in the stated units",
)
_SOUND = Range(
    *("speed of sound √(E/ρ)", "m/s", 10.0, 2e4, 1e-6, 1e9),
    below="MPa or GPa read as Pa, or g read as kg? E and density must be in the same units",
    above="t, or g/cm³, read as kg? E and density must be in the same units",
)
_EXPANSION = Range(
    *("thermal expansion", "1/K", 1e-9, 1e-3, 0.0, 1e-2),
    below="",
    above="µm/(m K) read as 1/K? give 12e-6 for 12 of them",
)
_SOUND_SLIPS = (
    "stiffness in N/mm or MPa read as N/m or Pa, or mass in g read as kg? check units and scale of the matrices",
    "mass in t read as kg, or stiffness in other units? check units and scale of the matrices",
)
SOUND_IN_MATRICES = Range(  # of metals, stiffness in N/mm read as N/m gives 160
    "speed of sound in the matrices", "m/s", 300.0, 5e4, 1e-6, 1e9, *_SOUND_SLIPS
)
SOUND_IN_CONDENSED = Range("speed of sound in the matrices", "m/s", 20.0, 5e4, 1e-6, 1e9, *_SOUND_SLIPS)
_FREQUENCY = Range(
    *("first elastic frequency", "Hz", 1e-3, 1e7, 1e-9, 1e12),
    below="stiffness in N/mm read as N/m, or mass in g read as kg? check units",
    above="mass in t read as kg, or stiffness in other units? check units",
)
_SPEED = Range(
    *("first frequency times size", "m/s", 1e-2, 2e4, 1e-6, 1e7),
    below="stiffness in N/mm read as N/m, or mass in g read as kg? check units",
    above="mass in t read as kg, or the stiffness in other units? check units",
)
_SPARSE = Range(
    *("mass per volume of the box around it", "kg/m³", 1.0, math.inf, 1e-5, math.inf),
    below='mass in t read as kg, set units.mass = "t"; mm read as m, set units.length = "mm"',
    above="",
)
_DENSE = Range(
    *("mass per volume of the box around it, a tenth of its length thick at least", "kg/m³", 0.0, 3e4, 0.0, 1e6),
    below="",
    above='mass in g read as kg, set units.mass = "g"; m read as mm, set units.length = "m"',
)


def refuse_slips(checks: tuple[HealthCheck, ...], unusual: bool, where: str) -> tuple[HealthCheck, ...]:
    """The checks, those of units not judged where a link is said to be unusual.

    Raises
    ------
    FEImportError
        ``BAD_FIELD``: a check of units failed, and the link is not said to be unusual.
    """
    if unusual:
        return tuple(replace(c, limit=NO_LIMIT) if c.name.startswith("units: ") else c for c in checks)
    for check in checks:
        if check.name.startswith("units: ") and not check.ok:
            raise FEImportError(
                Cause.BAD_FIELD,
                f"a unit seems to have slipped: {check.name.removeprefix('units: ')}",
                where=f"{where}: units",
                remedy="mend it, or set unusual = true in [units] if the link is like that",
            )
    return checks


def plausible_link(
    nodes: Array, mass: float, first_frequency: float | None, exported: bool, where: str
) -> tuple[HealthCheck, ...]:
    """Checks of a whole link.

    Parameters
    ----------
    nodes : (n, 3) array
        Positions [m].
    mass : float
        [kg]
    first_frequency : float or None
        Of the free link [Hz]; None when there is no elastic mode.
    exported : bool
        Whether density is not known otherwise, as in exported matrices.
    where : str

    Raises
    ------
    FEImportError
        ``BAD_FIELD``: a figure that cannot be.
    """
    place = f"{where}: units"
    box = np.ptp(nodes, axis=0)
    size = float(np.linalg.norm(box))
    checks = [_SIZE.check(size, place), _MASS.check(mass, place)]
    if exported:
        if box.min() > 1e-6 * size:  # beams in a plane have no volume
            checks.append(_SPARSE.check(mass / float(np.prod(box)), place))
        checks.append(_DENSE.check(mass / float(np.prod(box.clip(min=_THIN * size))), place))
    if first_frequency is not None:
        checks.append(_FREQUENCY.check(first_frequency, place))
        checks.append(_SPEED.check(first_frequency * size, place))
    return tuple(checks)


def plausible_masses(added: float, own: float) -> HealthCheck:
    """Point masses beside the elements that carry them [kg]: reported, as some links are meant to weigh nothing."""
    share = added / own if own > 0 else NO_LIMIT
    slip = " (g read as kg? units.mass holds for [[masses]], too)" if share > _HEAVY else ""
    return HealthCheck(f"point masses per mass of what carries them{slip}", share, _HEAVY)


def plausible_materials(
    materials: dict[str, Material], length: float, mass: float, time: float, where: str
) -> tuple[HealthCheck, ...]:
    """Checks of materials, their constants given in units of ``length`` [m], ``mass`` [kg] and ``time`` [s].

    Of several materials the worst figure is reported.

    Raises
    ------
    FEImportError
        ``BAD_FIELD``: a constant that cannot be.
    """
    found = []
    for name, m in materials.items():
        place = f"{where}: materials.{name}"
        density = m.density * mass / length**3
        modulus = m.youngs_modulus * mass / (length * time**2)
        found.append(
            (
                _DENSITY.check(density, f"{place}.density"),
                _MODULUS.check(modulus, f"{place}.youngs_modulus"),
                _SOUND.check(math.sqrt(modulus / density), place),
            )
        )
    expansions = [
        _EXPANSION.check(abs(m.thermal_expansion), f"{where}: materials.{name}.thermal_expansion")
        for name, m in materials.items()
        if m.thermal_expansion
    ]
    kinds = [*zip(*found, strict=True), *([expansions] if expansions else [])]
    return tuple(max(kind, key=lambda check: check.value) for kind in kinds)
