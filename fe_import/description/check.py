"""What a link description must satisfy beyond the types of its fields."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import Any

from fe_import.description.meshes import Layer, Shell, ShellRegion, Stretch
from fe_import.description.numbers import tables_of
from fe_import.description.parameters import check_parameters
from fe_import.description.records import Damping, LinkDescription, Material
from fe_import.description.reduction import check_reduction_options
from fe_import.elements.sections import check_section
from fe_import.errors import Cause, FEImportError, ReportedError
from fe_import.files.toml import choose

COUPLINGS = ("rigid", "averaged")
WEIGHTS = ("area", "uniform")
MOST_KELVIN = 4000.0  # no material is solid beyond


def _fail(where: str, message: str, value: Any = None, remedy: str = "", limit: Any = None) -> FEImportError:
    return FEImportError(Cause.BAD_FIELD, message, where=where, value=value, limit=limit, remedy=remedy)


_CHOICES = {
    "frame.theory": ("timoshenko", "euler-bernoulli"),
    "frame.mass": ("consistent", "lumped"),
    "frame.torsion": ("saint-venant", "polar"),
    "solid.hex8": ("incompatible-modes", "compatible"),
    "shell.mass": ("consistent", "lumped"),
}


def _check_stretch(stretch: Stretch, place: str) -> None:
    choose(stretch.axis, "xyz", f"{place}.axis")
    if not math.isfinite(stretch.about):
        raise _fail(f"{place}.about", "not a finite number", stretch.about, "give where the plane lies")
    for j, factor in enumerate(stretch.factors):
        if not (math.isfinite(factor) and factor > 0):
            raise _fail(f"{place}.factors[{j}]", "a factor must be positive", factor, "give 1 to keep the mesh")
    if not stretch.along:
        if len(stretch.factors) != 1 or stretch.at:
            remedy = "give along = AXIS and a station for each factor, or one factor alone"
            raise _fail(f"{place}.along", "factors change along an axis", None, remedy)
        return
    choose(stretch.along, "xyz", f"{place}.along")
    if stretch.along == stretch.axis:
        raise _fail(f"{place}.along", "it grows in this axis", stretch.along, "name another one")
    if len(stretch.at) != len(stretch.factors) or len(stretch.at) < 2:
        counts = f"{len(stretch.at)} stations, {len(stretch.factors)} factors"
        raise _fail(f"{place}.at", "every factor has a station, and there are at least two", counts, "give as many")
    rising = all(a < b for a, b in itertools.pairwise(stretch.at))
    if not rising or not all(math.isfinite(a) for a in stretch.at):
        raise _fail(f"{place}.at", "stations rise", stretch.at, "sort them, each once")


def check_link(link: LinkDescription, file: str) -> None:
    """Check the conditions that the types cannot state.

    Raises
    ------
    FEImportError
        Naming file, field, value and remedy.
    """
    meshed = link.solid if link.solid is not None else link.shell
    if [link.frame, meshed, link.matrices].count(None) != 2:
        message = "give exactly one of the tables 'frame', 'solid', 'shell' and 'matrices'"
        raise _fail(file, message, remedy="a link has one model; only solid and shell go together")
    for field, options in _CHOICES.items():
        table, name = field.split(".")
        record = getattr(link, table)
        if record is not None and getattr(record, name) not in options:
            raise _fail(
                f"{file}: {field}", "unknown choice", getattr(record, name), remedy="one of " + ", ".join(options)
            )
    for name, m in link.materials.items():
        place = f"{file}: materials.{name}"
        for field in ("youngs_modulus", "density"):
            value = getattr(m, field)
            if not (math.isfinite(value) and value > 0):
                raise _fail(f"{place}.{field}", f"{field} must be positive", value, "give a value above 0")
        if m.thermal_expansion is not None and not math.isfinite(m.thermal_expansion):
            message, remedy = "thermal_expansion must be finite", "give it per kelvin, as 12e-6"
            raise _fail(f"{place}.thermal_expansion", message, m.thermal_expansion, remedy)
        if not -1 < m.poissons_ratio < 0.5:
            raise _fail(
                f"{place}.poissons_ratio", "Poisson's ratio out of range", m.poissons_ratio, "between -1 and 0.5"
            )
    for kind, meshed in (("solid", link.solid), ("shell", link.shell)):
        if meshed is not None and not 0 < meshed.mesh_error < math.inf:
            message, remedy = "an error must be positive", "give a share, as 0.05 for 5 percent"
            raise _fail(f"{file}: {kind}.mesh_error", message, meshed.mesh_error, remedy)
    if link.solid is not None and link.solid.size is not None and not 0 < link.solid.size < math.inf:
        raise _fail(f"{file}: solid.size", "a size must be positive", link.solid.size, "give a length")
    for name, at in link.solid.faces.items() if link.solid is not None else ():
        if not name or "\0" in name or not all(map(math.isfinite, at)):
            raise _fail(f"{file}: solid.faces.{name}", "a face has a name and a finite position", at, "give both")
    for k, stretch in enumerate(link.solid.stretch if link.solid is not None else ()):
        _check_stretch(stretch, f"{file}: solid.stretch[{k}]")
    if link.shell is not None:
        _check_shell(link, link.shell, f"{file}: shell")
    for name, m in link.materials.items():
        _check_fibres(link, m, f"{file}: materials.{name}")
    for name, section in link.sections.items():
        check_section(section, f"{file}: sections.{name}")
    for table, nodes in (
        ("frame", link.frame),
        ("solid", link.solid),
        ("shell", link.shell),
        ("matrices", link.matrices),
    ):
        for name, position in nodes.nodes.items() if nodes is not None else ():
            place = f"{file}: {table}.nodes.{name}"
            if not name or "\0" in name:
                raise _fail(place, "a name must not be empty", name, "name the node")
            if not isinstance(position, int) and not all(map(math.isfinite, position)):
                raise _fail(place, "a position must be finite", position, "give three numbers")
    if link.matrices is not None:
        for field in ("materials", "sections"):
            if getattr(link, field):
                message = "exported matrices hold stiffness and mass already"
                raise _fail(f"{file}: {field}", message, remedy="remove the table")
    if not link.interfaces:
        raise _fail(f"{file}: interfaces", "a link needs at least one interface", remedy="add [[interfaces]]")
    seen: set[str] = set()
    for k, i in enumerate(link.interfaces):
        if i.name in seen or not i.name:
            raise _fail(f"{file}: interfaces[{k}].name", "interface names must differ", i.name, "rename one")
        seen.add(i.name)
        choose(i.coupling, COUPLINGS, f"{file}: interfaces[{k}].coupling")
        if i.weights:
            choose(i.weights, WEIGHTS, f"{file}: interfaces[{k}].weights")
            if i.coupling != "averaged":
                message, remedy = "only averages have weights", 'remove it, or use coupling = "averaged"'
                raise _fail(f"{file}: interfaces[{k}].weights", message, i.weights, remedy)
        if i.position is not None and not all(map(math.isfinite, i.position)):
            raise _fail(
                f"{file}: interfaces[{k}].position", "a position must be finite", i.position, "give three numbers"
            )
    check_reduction_options(link.reduction, seen, f"{file}: reduction")
    if link.reduction.form == "physical" and _stated(link.damping):
        message = "the physical form carries no modal damping"
        raise _fail(f"{file}: damping", message, remedy="remove it, or use form = 'orthonormal'")
    if link.reduction.form == "physical" and link.recovery is not None:
        message = "the physical form carries no recovery data"
        raise _fail(f"{file}: recovery", message, remedy="remove it, or use form = 'orthonormal'")
    for k, p in enumerate(link.masses):
        if not (math.isfinite(p.mass) and p.mass >= 0):
            raise _fail(f"{file}: masses[{k}].mass", "a mass cannot be negative", p.mass, "give 0 or more")
    if link.temperature_change is not None:
        _check_temperature(link, link.temperature_change, file)
    check_damping(link.damping, f"{file}: damping")
    if link.parameters:
        check_parameters(link.parameters, tables_of(link), file)


_NOT_OF_THICKNESS = ("mesh", "direction", "nodes", "drilling", "mass", "ignore")


def _check_shell(link: LinkDescription, shell: Shell, place: str) -> None:
    """Where it comes from, and figures of its thickness."""
    if bool(shell.mesh) == (link.solid is not None):
        message = "shells beside a solid are of its mesh" if shell.mesh else "shells need a mesh"
        raise _fail(f"{place}.mesh", message, shell.mesh or None, "name the mesh once, in [solid] or else in [shell]")
    for field in ("ignore", "nodes") if link.solid is not None else ():
        if getattr(shell, field):
            raise _fail(f"{place}.{field}", "the solid has this field for the whole mesh", remedy="move it to [solid]")
    if link.solid is not None and not shell.regions:
        message, remedy = "shells beside a solid are named by their sets", "add [[shell.regions]]"
        raise _fail(f"{place}.regions", message, remedy=remedy)
    if shell.regions and (shell.material or shell.layers or shell.thickness is not None or shell.offset):
        message = "give either 'regions' or one thickness for the whole mesh"
        raise _fail(place, message, remedy="material, thickness, layers and offset of a set stand in its region")
    if not 0 < shell.drilling <= 1:
        raise _fail(f"{place}.drilling", "a share must be above 0 and at most 1", shell.drilling, "0.01 does well")
    if shell.direction is not None and not (all(map(math.isfinite, shell.direction)) and any(shell.direction)):
        raise _fail(f"{place}.direction", "a direction must be finite and not zero", shell.direction, "as [1, 0, 0]")
    for made, where in (
        [(shell, place)]
        if not shell.regions
        else [(region, f"{place}.regions[{k}]") for k, region in enumerate(shell.regions)]
    ):
        _check_thickness(link, made, where)


def _check_thickness(link: LinkDescription, made: Shell | ShellRegion, place: str) -> None:
    if isinstance(made, Shell) and made == Shell(**{f: getattr(made, f) for f in _NOT_OF_THICKNESS}):
        return  # the mesh file has sections
    if bool(made.layers) == bool(made.material or made.thickness is not None):
        message = "give either 'layers' or 'material' and 'thickness'"
        raise _fail(place, message, remedy="layers are for laminates, from the bottom to the top")
    if not math.isfinite(made.offset):
        raise _fail(f"{place}.offset", "an offset must be finite", made.offset, "give a height above the nodes")
    layers = [(layer, f"{place}.layers[{k}]") for k, layer in enumerate(made.layers)]
    for layer, where in layers or [(Layer(made.material, made.thickness or 0.0), place)]:
        choose(layer.material, link.materials, f"{where}.material")
        if not (math.isfinite(layer.thickness) and layer.thickness > 0):
            raise _fail(f"{where}.thickness", "a thickness must be positive", layer.thickness, "give a value above 0")
        if not math.isfinite(layer.angle):
            raise _fail(f"{where}.angle", "an angle must be finite", layer.angle, "give degrees")


def _check_fibres(link: LinkDescription, m: Material, place: str) -> None:
    """Moduli of a layer of fibres go together, and only in shells."""
    fields = ("transverse_modulus", "shear_modulus", "transverse_shear_modulus")
    given = [field for field in fields if getattr(m, field) is not None]
    if not given:
        return
    if link.shell is None or link.solid is not None:
        message, remedy = "only links of shells alone have layers of fibres", "remove it, or give the link as 'shell'"
        raise _fail(f"{place}.{given[0]}", message, getattr(m, given[0]), remedy)
    for field in given:
        value = getattr(m, field)
        if not (math.isfinite(value) and value > 0):
            raise _fail(f"{place}.{field}", f"{field} must be positive", value, "give a value above 0")
    if m.transverse_modulus is None or m.shear_modulus is None:
        message = "'transverse_modulus' and 'shear_modulus' go together"
        raise _fail(place, message, remedy="a layer of fibres has E1, E2, nu12 and G12")
    if m.poissons_ratio**2 >= m.youngs_modulus / m.transverse_modulus:
        message = "the square of Poisson's ratio must stay below E1 / E2"
        raise _fail(f"{place}.poissons_ratio", message, m.poissons_ratio, "it is nu12, of tension along the fibres")


def _check_temperature(link: LinkDescription, change: float, file: str) -> None:
    """Only beams expand, by coefficients that are given."""
    place = f"{file}: temperature_change"
    if link.frame is None:
        message = "only links made of beams expand with temperature"
        raise _fail(place, message, change, "remove it, or give the link as 'frame'")
    check_temperature(change, place)
    if link.reduction.form == "physical":
        message = "the physical form carries no thermal expansion"
        raise _fail(place, message, change, "remove it, or use form = 'orthonormal'")
    for member in link.frame.members:
        material = link.materials.get(member.material)
        if material is not None:
            check_expansion(material, f"{file}: materials.{member.material}.thermal_expansion")


def check_temperature(change: float, where: str, error: type[ReportedError] = FEImportError) -> None:
    """Refuse a change of temperature [K] that melts anything.

    Raises
    ------
    ReportedError
        Of class ``error``, BAD_FIELD.
    """
    if not abs(change) <= MOST_KELVIN:  # not a number fails too
        message, remedy = "no solid is that hot", "give the change of temperature in kelvin"
        raise error(Cause.BAD_FIELD, message, where=where, value=change, limit=MOST_KELVIN, remedy=remedy)


def check_expansion(material: Material, where: str, error: type[ReportedError] = FEImportError) -> None:
    """Refuse a material whose expansion is needed and not known; it is not taken for zero.

    Raises
    ------
    ReportedError
        Of class ``error``, BAD_FIELD.
    """
    if material.thermal_expansion is None:
        message = "a temperature change needs the expansion of the materials"
        remedy = "give it per kelvin, as 12e-6; 0 for what does not expand"
        raise error(Cause.BAD_FIELD, message, where=where, remedy=remedy)


def check_damping(d: Damping, where: str, error: type[ReportedError] = FEImportError) -> None:
    """Refuse damping that is stated twice, negative, or more than critical.

    Raises
    ------
    ReportedError
        Of class ``error``, BAD_FIELD.
    """
    given = _stated(d)
    if len(given) > 1:
        kinds = " and ".join(given)
        raise error(Cause.BAD_FIELD, "more than one kind of damping", where=where, value=kinds, remedy="keep one")
    for field, value in _damping_numbers(d):
        place = f"{where}.{field}"
        if not (math.isfinite(value) and value >= 0):
            message = "damping cannot be negative"
            raise error(Cause.BAD_FIELD, message, where=place, value=value, remedy="give 0 or more")
        if value > 1 and "rayleigh" not in field:
            message, remedy = "a damping ratio above 1 is more than critical", "for 2 percent give 0.02"
            raise error(Cause.BAD_FIELD, message, where=place, value=value, limit=1, remedy=remedy)


def _stated(d: Damping) -> list[str]:
    """Kinds of damping that are given."""
    return [n for n in ("ratio", "ratios", "rayleigh") if getattr(d, n) is not None]


def _damping_numbers(d: Damping) -> Iterator[tuple[str, float]]:
    if d.ratio is not None:
        yield "ratio", d.ratio
    for k, value in enumerate(d.ratios or []):
        yield f"ratios[{k}]", value
    if d.rayleigh is not None:
        yield "rayleigh.alpha", d.rayleigh.alpha
        yield "rayleigh.beta", d.rayleigh.beta
