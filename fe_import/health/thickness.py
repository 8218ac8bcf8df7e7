"""How thick shells and cross sections are beside the link: a thickness in other units than the mesh."""

from __future__ import annotations

from fe_import.description.meshes import Shell, ShellRegion
from fe_import.description.records import LinkDescription
from fe_import.elements.sections import section_constants
from fe_import.health.plausibility import Range
from fe_import.modal.model import HealthCheck

_SHARE = Range(
    *("thickness per size of the link", "", 2e-5, 1.0, 1e-9, 1e5),
    below="m read as mm, or the mesh in mm read as m? units.length holds for both",
    above="mm read as m, or the mesh in m read as mm? units.length holds for both",
)


def plausible_thickness(link: LinkDescription, size: float, length: float, where: str) -> tuple[HealthCheck, ...]:
    """The worst thickness of shells and cross sections, of these the square root of the area.

    Parameters
    ----------
    link : LinkDescription
    size : float
        Of the link [m].
    length : float
        Unit of length of the description [m].
    where : str

    Raises
    ------
    FEImportError
        ``BAD_FIELD``: a thickness that cannot be.
    """
    used = {member.section for member in link.frame.members} if link.frame is not None else set()
    places = {f"{where}: sections.{name}": link.sections[name] for name in sorted(used)}
    found = {place: section_constants(s, 0.3, "saint-venant", place).area ** 0.5 for place, s in places.items()}
    if link.shell is not None:
        makes: dict[str, Shell | ShellRegion] = {f"{where}: shell": link.shell}
        makes |= {f"{where}: shell.regions[{k}]": region for k, region in enumerate(link.shell.regions)}
        thick = {place: sum(layer.thickness for layer in m.layers) or m.thickness for place, m in makes.items()}
        found |= {place: value for place, value in thick.items() if value}
    checks = [_SHARE.check(value * length / size, place) for place, value in found.items()]
    return (max(checks, key=lambda check: check.value),) if checks else ()
