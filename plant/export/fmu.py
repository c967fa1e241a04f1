"""FMUs for co-simulation: a model's C sources with the interface, compiled for this machine, in one archive."""

import hashlib
import io
import platform
import shutil
import subprocess
import tempfile
import zipfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from plant.compiled.c99.files import checked_name, fill_template
from plant.eha.model import EhaParameters
from plant.eha.simulate import Plant
from plant.errors import HydrostateError, require_known
from plant.export.c_plant import plant_graphs, plant_in_c, substeps_of
from plant.export.fmu_description import (
    VERSIONS,
    ModelDescription,
    Variable,
    build_description,
    model_description,
    sources,
)
from plant.log.record import CHANNELS
from plant.solvers.steps import parameter_names, parameter_row
from plant.units import notes

FLAGS = ("-std=c99", "-O2", "-fPIC", "-shared", "-fvisibility=hidden")
"""Compiler flags of the binary."""

PLATFORMS: Mapping[str, Mapping[str, str]] = {
    "2.0": {"x86_64": "linux64"},
    "3.0": {"x86_64": "x86_64-linux", "aarch64": "aarch64-linux"},
}
"""Folder of the binary by version and machine; on other machines an FMU holds only its sources."""

STATE_UNITS: Mapping[str, str] = {"acceleration_m_s2": "m/s^2", "presliding": "1"}


def plant_fmu(plant: Plant, parameters: EhaParameters, sample_time: float, fmi: str, *, name: str) -> bytes:
    """Return a plant as an FMU for co-simulation.

    Its input is the motor speed, held over a step; with FMI 2.0 it may have a slope. A communication step is any
    whole number of samples.

    Parameters
    ----------
    plant : Plant
        One of `plant.eha.simulate.PLANTS`.
    parameters : EhaParameters
        The actuator, which gives the start values of the FMU's parameters.
    sample_time : float
        Shortest communication step [s].
    fmi : str
        ``2.0`` or ``3.0``.
    name : str
        The model's identifier.

    Raises
    ------
    HydrostateError
        If the name is not valid in C, the version is not known, or the compiler fails.
    """
    files = plant_in_c(plant, parameters, sample_time, name=name)
    row = parameter_row(plant.complete(parameters))
    known = notes(plant.parameter_class)
    variables = [
        Variable(one, known[one].unit, known[one].meaning, "parameter", float(value))
        for one, value in zip(parameter_names(plant.parameter_class), row, strict=True)
    ]
    step = sample_time / substeps_of(plant, sample_time, row)
    variables.append(Variable("step", "s", "step of the scheme", "parameter", step))
    variables += [
        Variable(f"start_{one}", _unit(one), f"{one} before the first step", "parameter", float(value))
        for one, value in zip(plant.states, plant.start(row), strict=True)
    ]
    variables.append(Variable("motor_speed_rad_s", "rad/s", "motor speed, or what is asked of it", "input", 0.0))
    variables += [Variable(one, CHANNELS[one], f"{one} of the plant", "output") for one in plant_graphs(plant).outputs]
    told = f"{plant.name} plant of the electro-hydrostatic actuator"
    model = ModelDescription(name, told, "", variables, sample_time, interpolates=True)
    return archive(model, files, ("plant", "export/templates", "fmu_plant.c", "plant"), fmi)


def _unit(state: str) -> str:
    if state in CHANNELS or state in STATE_UNITS:
        return CHANNELS[state] if state in CHANNELS else STATE_UNITS[state]
    return "m^3"


def archive(model: ModelDescription, files: Mapping[str, str], glue: tuple[str, str, str, str], fmi: str) -> bytes:
    """Return an FMU.

    Parameters
    ----------
    model : ModelDescription
        Its description, with an empty token.
    files : Mapping[str, str]
        The sources, by file name.
    glue : tuple of str
        Package, folder and file of the template that connects the two, and the name of the type inside.
    fmi : str
        Version of the interface.

    Returns
    -------
    bytes
        The archive; the same model always gives the same archive.

    Raises
    ------
    HydrostateError
        If the version is not known, or the compiler fails.
    """
    require_known("version of FMI", fmi, VERSIONS)
    package, folder, template, kind = glue
    name = checked_name(model.name)
    inside = {file: text for file, text in files.items() if file in (f"{name}.c", f"{name}.h")}
    token = hashlib.sha256(repr((fmi, model, sorted(inside.items()))).encode()).hexdigest()[:32]
    model = replace(model, token=token)
    places = [one.causality for one in model.variables]
    facts: dict[str, Any] = {
        "name": name,
        "NAME": name.upper(),
        "kind": kind,
        "token": token,
        "values": len(places) + 1,
        "inputs_at": 1 + places.index("input"),
        "outputs_at": 1 + places.index("output"),
        "sample_time": repr(model.sample_time),
    }
    shared = {"model.h": "fmu_model.h", f"fmi{fmi[0]}.c": f"fmu{fmi[0]}.c"}
    written = {
        **inside,
        **{file: fill_template("plant", "export/templates", one, facts) for file, one in shared.items()},
        "model.c": fill_template(package, folder, template, facts),
    }
    description = model_description(model, fmi)
    entries: dict[str, bytes] = {"modelDescription.xml": description.encode()}
    entries |= {f"sources/{file}": text.encode() for file, text in sorted(written.items())}
    if fmi == "3.0":
        entries["sources/buildDescription.xml"] = build_description(name).encode()
    where = PLATFORMS[fmi].get(platform.machine()) if platform.system() == "Linux" else None
    if where is not None:
        entries[f"binaries/{where}/{name}.so"] = _binary(name, written, fmi)
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as file:
        for entry, content in entries.items():
            file.writestr(zipfile.ZipInfo(entry, (1980, 1, 1, 0, 0, 0)), content, zipfile.ZIP_DEFLATED)
    return packed.getvalue()


def _binary(name: str, files: Mapping[str, str], fmi: str) -> bytes:
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        raise HydrostateError("a C compiler (cc, gcc or clang) is needed to build an FMU, found none")
    with tempfile.TemporaryDirectory() as folder:
        for file, text in files.items():
            (Path(folder) / file).write_text(text, encoding="utf-8")
        command = [compiler, *FLAGS, "-o", f"{name}.so", *sources(name, fmi), "-lm"]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)  # noqa: S603  our own
        if done.returncode:
            raise HydrostateError(f"the C compiler {compiler} refused the FMU's sources: {done.stderr.strip()[:300]}")
        return (Path(folder) / f"{name}.so").read_bytes()
