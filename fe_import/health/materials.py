"""Constants of a material that belong to two: the modulus of one with the density of another."""

from __future__ import annotations

from fe_import.description.records import Material
from fe_import.modal.model import HealthCheck

# E [Pa] and density [kg/m³] of what links are made of, all alloys (ASM Ready Reference: Properties and Units, 1999)
_METALS = {
    "steel": ((1.85e11, 2.2e11), (7650.0, 8100.0)),
    "aluminium": ((6.6e10, 7.9e10), (2550.0, 2900.0)),
    "titanium": ((1.0e11, 1.25e11), (4300.0, 4700.0)),
    "magnesium": ((4.0e10, 4.7e10), (1700.0, 1900.0)),
}


def check_materials(materials: dict[str, Material], length: float, mass: float, time: float) -> tuple[HealthCheck, ...]:
    """Whether modulus and density are of one metal, where each is one of a metal.

    Parameters
    ----------
    materials : dict of Material
        Constants in units of ``length`` [m], ``mass`` [kg] and ``time`` [s].
    length, mass, time : float
    """
    mixed = []
    for name, m in materials.items():
        modulus, density = m.youngs_modulus * mass / (length * time**2), m.density * mass / length**3
        stiff = {metal for metal, (moduli, _) in _METALS.items() if moduli[0] <= modulus <= moduli[1]}
        heavy = {metal for metal, (_, densities) in _METALS.items() if densities[0] <= density <= densities[1]}
        if stiff and heavy and not stiff & heavy:
            mixed.append(f"{name} has Young's modulus of {min(stiff)} ({modulus:.3g} Pa) and density of {min(heavy)}")
    text = f" ({'; '.join(mixed)})" if mixed else ""
    return (HealthCheck(f"material: constants of two metals{text}", float(len(mixed)), 0.0),)
