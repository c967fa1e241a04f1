"""The model description of an FMU: variables with units and meanings, for FMI 2.0 and FMI 3.0."""

from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version
from typing import Any
from xml.etree import ElementTree as ET

from plant.unit_text import plain_unit
from plant.units import unit_registry

VERSIONS = ("2.0", "3.0")
"""Versions of the interface that FMUs are written for."""

INFINITY = 1e300
"""Number that represents infinity, which XML's numbers do not have [any unit]."""

_BASE = {"kilogram": "kg", "meter": "m", "second": "s", "ampere": "A", "kelvin": "K", "mole": "mol", "radian": "rad"}


@dataclass(frozen=True)
class Variable:
    """A variable of an FMU.

    Parameters
    ----------
    name : str
        Its name.
    unit : str
        SI unit; empty if it has none.
    meaning : str
        What it is.
    causality : str
        ``parameter``, ``input`` or ``output``.
    start : float or None
        Value before the first step, of a parameter or an input [its unit].
    """

    name: str
    unit: str
    meaning: str
    causality: str
    start: float | None = None

    @property
    def shown_unit(self) -> str:
        """Its unit, or nothing if it is a plain number."""
        return "" if self.unit == "1" else self.unit


@dataclass(frozen=True)
class ModelDescription:
    """Contents of a model description.

    Parameters
    ----------
    name, meaning, token : str
        The model's identifier in C, its meaning, and the text that must match in description and binary.
    variables : sequence of Variable
        Parameters, then inputs, then outputs; their references start at 1.
    sample_time : float
        Time between samples [s].
    interpolates : bool
        Whether inputs may be linear over a step.
    """

    name: str
    meaning: str
    token: str
    variables: Sequence[Variable]
    sample_time: float
    interpolates: bool


def model_description(model: ModelDescription, fmi: str) -> str:
    """Return ``modelDescription.xml``.

    Parameters
    ----------
    fmi : str
        Version of the interface, one of `VERSIONS`.
    """
    about = {
        "fmiVersion": fmi,
        "modelName": model.name,
        "guid" if fmi == "2.0" else "instantiationToken": model.token,
        "description": model.meaning,
        "generationTool": f"Hydrostate {version('hydrostate')}",
        "variableNamingConvention": "structured",
    }
    root = ET.Element("fmiModelDescription", about)
    can = {"canHandleVariableCommunicationStepSize": "true", "modelIdentifier": model.name}
    if fmi == "2.0":
        can |= {"canGetAndSetFMUstate": "true", "canSerializeFMUstate": "true"}
        can |= {"canInterpolateInputs": "true"} if model.interpolates else {}
        files = ET.SubElement(ET.SubElement(root, "CoSimulation", can), "SourceFiles")
        for file in sources(model.name, fmi):
            ET.SubElement(files, "File", name=file)
    else:
        can |= {"canGetAndSetFMUState": "true", "canSerializeFMUState": "true"}
        can["fixedInternalStepSize"] = repr(model.sample_time)
        ET.SubElement(root, "CoSimulation", can)
    _units(root, model.variables)
    times = {"startTime": "0", "stopTime": repr(1000.0 * model.sample_time), "stepSize": repr(model.sample_time)}
    ET.SubElement(root, "DefaultExperiment", times)
    outputs = _variables_2(root, model) if fmi == "2.0" else _variables_3(root, model)
    _structure(root, outputs, fmi)
    ET.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def sources(name: str, fmi: str) -> tuple[str, ...]:
    """Return the names of the compiled sources."""
    return f"{name}.c", "model.c", f"fmi{fmi[0]}.c"


def build_description(name: str) -> str:
    """Return ``buildDescription.xml``, which FMI 3.0 requires with the sources."""
    root = ET.Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = ET.SubElement(root, "BuildConfiguration", modelIdentifier=name)
    files = ET.SubElement(configuration, "SourceFileSet", language="C99")
    for file in sources(name, "3.0"):
        ET.SubElement(files, "SourceFile", name=file)
    ET.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def _units(root: ET.Element, variables: Sequence[Variable]) -> None:
    units = ET.SubElement(root, "UnitDefinitions")
    for unit in dict.fromkeys(["s", *(one.shown_unit for one in variables if one.shown_unit)]):
        base: Any = unit_registry().Quantity(1.0, plain_unit(unit, angular="rad" in unit)).to_base_units()
        powers = {_BASE[str(name)]: str(round(power)) for name, power in base.unit_items()}
        ET.SubElement(ET.SubElement(units, "Unit", name=unit), "BaseUnit", powers)


def _common_attributes(one: Variable, reference: int) -> dict[str, str]:
    kind = {"parameter": "fixed", "input": "continuous", "output": "continuous"}[one.causality]
    return {
        "name": one.name,
        "valueReference": str(reference),
        "description": one.meaning,
        "causality": one.causality,
        "variability": kind,
    }


def _real(one: Variable) -> dict[str, str]:
    told = {"unit": one.shown_unit} if one.shown_unit else {}
    return told | ({} if one.start is None else {"start": repr(min(one.start, INFINITY))})


def _variables_2(root: ET.Element, model: ModelDescription) -> list[str]:
    """Write variables; return the indices of outputs."""
    listed = ET.SubElement(root, "ModelVariables")
    for reference, one in enumerate(model.variables, start=1):
        given = _common_attributes(one, reference)
        if one.causality == "output":
            given["initial"] = "calculated"
        ET.SubElement(ET.SubElement(listed, "ScalarVariable", given), "Real", _real(one))
    return [str(i) for i, one in enumerate(model.variables, start=1) if one.causality == "output"]


def _variables_3(root: ET.Element, model: ModelDescription) -> list[str]:
    """Write variables; return the references of outputs."""
    listed = ET.SubElement(root, "ModelVariables")
    time = {"name": "time", "valueReference": "0", "causality": "independent", "variability": "continuous", "unit": "s"}
    ET.SubElement(listed, "Float64", time)
    for reference, one in enumerate(model.variables, start=1):
        ET.SubElement(listed, "Float64", _common_attributes(one, reference) | _real(one))
    return [str(i) for i, one in enumerate(model.variables, start=1) if one.causality == "output"]


def _structure(root: ET.Element, outputs: Sequence[str], fmi: str) -> None:
    structure = ET.SubElement(root, "ModelStructure")
    if fmi == "3.0":
        for kind in ("Output", "InitialUnknown"):
            for reference in outputs:
                ET.SubElement(structure, kind, valueReference=reference)
        return
    for kind in ("Outputs", "InitialUnknowns"):
        unknowns = ET.SubElement(structure, kind)
        for index in outputs:
            ET.SubElement(unknowns, "Unknown", index=index)
