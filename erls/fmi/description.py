"""The description of a unit (XML), as FMI 3.0 (2022) and FMI 2.0 (2014) of the Modelica Association have it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from erls.fmi.channels import Channel

SOURCES = ("unit.c", "fmi2.c", "fmi3.c")

_BASE = {
    "m": {"m": 1},
    "rad": {"rad": 1},
    "m/s": {"m": 1, "s": -1},
    "rad/s": {"rad": 1, "s": -1},
    "m/s2": {"m": 1, "s": -2},
    "rad/s2": {"rad": 1, "s": -2},
    "N": {"kg": 1, "m": 1, "s": -2},
    "N m": {"kg": 1, "m": 2, "s": -2},
    "Pa": {"kg": 1, "m": -1, "s": -2},
}
"""Exponents of base units."""


@dataclass(frozen=True)
class UnitText:
    """What a description says.

    Attributes
    ----------
    name : str
        Of the model.
    identifier : str
        Of its binary; a word of C.
    token : str
    tool : str
        That made it.
    inputs, outputs : sequence of Channel
        With value references 1 and on; 0 is time.
    step, stop : float
        Step and duration of the scene [s].
    """

    name: str
    identifier: str
    token: str
    tool: str
    inputs: Sequence[Channel]
    outputs: Sequence[Channel]
    step: float
    stop: float


def described(unit: UnitText, version: int) -> str:
    """``modelDescription.xml`` of FMI 2 or 3."""
    root = (_second if version == 2 else _third)(unit)
    return _text(root)


def build_description(unit: UnitText) -> str:
    """``sources/buildDescription.xml`` of FMI 3."""
    root = Element("fmiBuildDescription", fmiVersion="3.0")
    building = SubElement(root, "BuildConfiguration", modelIdentifier=unit.identifier)
    files = SubElement(building, "SourceFileSet", language="C99")
    for name in SOURCES:
        SubElement(files, "SourceFile", name=name)
    return _text(root)


def _text(root: Element) -> str:
    indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(root, encoding="unicode") + "\n"


def _units(root: Element, unit: UnitText) -> None:
    used = [name for name in dict.fromkeys(channel.unit for channel in (*unit.inputs, *unit.outputs)) if name != "1"]
    if used:
        definitions = SubElement(root, "UnitDefinitions")
        for name in used:
            one = SubElement(definitions, "Unit", name=name)
            if name in _BASE:
                SubElement(one, "BaseUnit", {base: str(power) for base, power in _BASE[name].items()})


def _experiment(root: Element, unit: UnitText) -> None:
    SubElement(root, "DefaultExperiment", startTime="0.0", stopTime=repr(unit.stop), stepSize=repr(unit.step))


def _of(channel: Channel) -> dict[str, str]:
    return {} if channel.unit == "1" else {"unit": channel.unit}


def _third(unit: UnitText) -> Element:
    root = Element(
        "fmiModelDescription", fmiVersion="3.0", modelName=unit.name, instantiationToken=unit.token,
        generationTool=unit.tool, variableNamingConvention="flat",
    )  # fmt: skip
    SubElement(
        root, "CoSimulation", modelIdentifier=unit.identifier, needsExecutionTool="true",
        canGetAndSetFMUState="true", canHandleVariableCommunicationStepSize="true",
    )  # fmt: skip
    _units(root, unit)
    _experiment(root, unit)
    variables, structure = SubElement(root, "ModelVariables"), SubElement(root, "ModelStructure")
    alike, time = {"variability": "continuous"}, {"name": "time", "valueReference": "0", "causality": "independent"}
    SubElement(variables, "Float64", {**time, **alike})
    for k, one in enumerate((*unit.inputs, *unit.outputs), 1):
        enters = k <= len(unit.inputs)
        own = {"causality": "input", "start": "0.0"} if enters else {"causality": "output", "initial": "calculated"}
        own |= {"name": one.name, "valueReference": str(k), "description": one.text, **alike, **_of(one)}
        SubElement(variables, "Float64", own)
        if not enters:
            SubElement(structure, "Output", valueReference=str(k))
    for k in range(1 + len(unit.inputs), 1 + len(unit.inputs) + len(unit.outputs)):
        SubElement(structure, "InitialUnknown", valueReference=str(k))
    return root


def _second(unit: UnitText) -> Element:
    root = Element(
        "fmiModelDescription", fmiVersion="2.0", modelName=unit.name, guid=unit.token, generationTool=unit.tool,
        variableNamingConvention="flat",
    )  # fmt: skip
    simulated = SubElement(
        root, "CoSimulation", modelIdentifier=unit.identifier, needsExecutionTool="true",
        canGetAndSetFMUstate="true", canHandleVariableCommunicationStepSize="true",
    )  # fmt: skip
    files = SubElement(simulated, "SourceFiles")
    for name in SOURCES:
        SubElement(files, "File", name=name)
    _units(root, unit)
    _experiment(root, unit)
    variables, structure = SubElement(root, "ModelVariables"), SubElement(root, "ModelStructure")
    known, unknown = SubElement(structure, "Outputs"), SubElement(structure, "InitialUnknowns")
    alike, time = {"variability": "continuous"}, {"name": "time", "valueReference": "0", "causality": "independent"}
    SubElement(SubElement(variables, "ScalarVariable", {**time, **alike}), "Real")
    for k, one in enumerate((*unit.inputs, *unit.outputs), 1):
        enters = k <= len(unit.inputs)
        own = {"causality": "input"} if enters else {"causality": "output", "initial": "calculated"}
        own |= {"name": one.name, "valueReference": str(k), "description": one.text, **alike}
        variable = SubElement(variables, "ScalarVariable", own)
        SubElement(variable, "Real", {**_of(one), **({"start": "0.0"} if enters else {})})
        if not enters:
            for part in (known, unknown):
                SubElement(part, "Unknown", index=str(k + 1))
    return root
