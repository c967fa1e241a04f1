import io
import itertools
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from plant.eha.drives import sine
from plant.eha.model import EhaParameters
from plant.eha.simulate import CIRCUIT, LUMPED, PLANTS, REDUCED, Plant, simulate
from plant.errors import HydrostateError
from plant.export.c_plant import substeps_of
from plant.export.fmu import _unit, plant_fmu
from plant.solvers.steps import parameter_row
from plant.solvers.trajectory import compile_trajectory
from tests.c_compiler import compiler
from tests.thinned import thinned

RIG, STEP = EhaParameters(leakage_coefficient=2e-11), 1e-3
TIME = STEP * np.arange(401)
DRIVE = sine(len(TIME) * STEP, STEP, RIG.rated_speed, 5.0)
EVERY_VERSION = pytest.mark.parametrize("fmi", ["2.0", "3.0"])


@pytest.fixture(scope="module")
def fmpy() -> Any:
    compiler("gcc")
    return pytest.importorskip("fmpy", reason="FMPy is an extra of developers")


def written(folder: Path, plant: Plant, fmi: str) -> str:
    path = folder / f"{plant.name}.fmu"
    path.write_bytes(plant_fmu(plant, RIG, STEP, fmi, name=f"{plant.name}_plant"))
    return str(path)


def held(plant: Plant, parameters: EhaParameters = RIG) -> dict[str, np.ndarray]:
    """Return the native trajectory, with the drive held from each sample to the next."""
    row = parameter_row(plant.complete(parameters))
    run = compile_trajectory(plant.name, plant.step, len(plant.states), plant.parameter_class)
    states = [np.asarray(plant.start(row), dtype=float)]
    for speed in DRIVE[:-1]:
        states.append(run(states[-1], np.full(2, speed), row[None], STEP, substeps_of(plant, STEP, row))[-1])
    return dict(plant.channels(np.array(states), row[None]))


def simulated(fmpy: Any, path: str, **values: float) -> Any:
    signals = np.array(list(zip(TIME, DRIVE, strict=True)), dtype=[("time", float), ("motor_speed_rad_s", float)])
    span = {"start_time": 0.0, "stop_time": TIME[-1], "step_size": STEP, "output_interval": STEP}
    with np.errstate(all="ignore"):
        return fmpy.simulate_fmu(path, **span, input=signals, start_values=values)


def apart(found: Any, wanted: dict[str, np.ndarray]) -> float:
    names = [name for name in found.dtype.names if name in wanted]
    assert len(names) >= 3
    return max(float(np.max(np.abs(found[name] - wanted[name])) / np.max(np.abs(wanted[name]))) for name in names)


@pytest.mark.parametrize(
    ("plant", "fmi"),
    thinned(itertools.product(PLANTS.values(), ("2.0", "3.0")), [(CIRCUIT, "2.0"), (LUMPED, "3.0"), (REDUCED, "2.0")]),
)
def test_an_fmu_passes_validation_and_follows_the_native_trajectory(
    fmpy: Any, plant: Plant, fmi: str, tmp_path: Path
) -> None:
    from fmpy.validation import validate_fmu

    path = written(tmp_path, plant, fmi)
    assert validate_fmu(path) == []
    assert apart(simulated(fmpy, path), held(plant)) < 1e-9


@pytest.mark.parametrize("plant", [REDUCED, LUMPED], ids=["reduced", "lumped"])
def test_an_fmu_given_the_derivative_of_its_input_agrees_with_simulate(fmpy: Any, plant: Plant, tmp_path: Path) -> None:
    from fmpy.fmi2 import FMU2Slave

    path = written(tmp_path, plant, "2.0")
    told = fmpy.read_model_description(path)
    places = {one.name: one.valueReference for one in told.modelVariables}
    folder = fmpy.extract(path, unzipdir=str(tmp_path / "open"))
    fmu = FMU2Slave(
        guid=told.guid, unzipDirectory=folder, modelIdentifier=told.coSimulation.modelIdentifier, instanceName="one"
    )
    fmu.instantiate()
    fmu.setupExperiment(startTime=0.0)
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    speed, seen = places["motor_speed_rad_s"], [fmu.getReal([places["velocity_m_s"]])[0]]
    from ctypes import c_double, c_int, c_uint32

    for k in range(len(DRIVE) - 1):
        fmu.setReal([speed], [DRIVE[k]])
        slope = (DRIVE[k + 1] - DRIVE[k]) / STEP
        fmu.fmi2SetRealInputDerivatives(fmu.component, (c_uint32 * 1)(speed), 1, (c_int * 1)(1), (c_double * 1)(slope))
        fmu.doStep(currentCommunicationPoint=TIME[k], communicationStepSize=STEP)
        seen.append(fmu.getReal([places["velocity_m_s"]])[0])
    fmu.terminate()
    fmu.freeInstance()
    wanted = simulate(plant, DRIVE, STEP, RIG)["velocity_m_s"]
    assert float(np.max(np.abs(np.array(seen) - wanted))) < 1e-9 * float(np.max(np.abs(wanted)))


@EVERY_VERSION
def test_a_parameter_that_is_set_changes_the_plant(fmpy: Any, fmi: str, tmp_path: Path) -> None:
    found = simulated(fmpy, written(tmp_path, LUMPED, fmi), bulk_modulus=1e8)
    assert apart(found, held(LUMPED)) > 1e-3
    assert apart(found, held(LUMPED, EhaParameters(leakage_coefficient=2e-11, bulk_modulus=1e8))) < 1e-9


def test_every_variable_has_a_description_and_its_unit(fmpy: Any, tmp_path: Path) -> None:
    told = fmpy.read_model_description(written(tmp_path, LUMPED, "3.0"))
    known = {one.name: one for one in told.modelVariables}
    assert known["leakage_coefficient"].unit == "m^3/(s Pa)"
    assert known["leakage_coefficient"].description == "lumped leakage L_t"
    assert [one.name for one in told.modelVariables if not one.description and one.name != "time"] == []
    units = {unit.name: unit.baseUnit for unit in told.unitDefinitions}
    assert (units["Pa"].kg, units["Pa"].m, units["Pa"].s) == (1, -1, -2)
    assert units["rad/s"].rad == 1


@EVERY_VERSION
def test_an_fmu_contains_its_sources_and_is_reproducible(fmi: str) -> None:
    compiler("gcc")
    archive = plant_fmu(LUMPED, RIG, STEP, fmi, name="bench")
    with zipfile.ZipFile(io.BytesIO(archive)) as packed:
        names = set(packed.namelist())
    assert {"sources/bench.c", "sources/bench.h", "sources/model.c", f"sources/fmi{fmi[0]}.c"} <= names
    assert ("sources/buildDescription.xml" in names) == (fmi == "3.0")
    assert archive == plant_fmu(LUMPED, RIG, STEP, fmi, name="bench")


def test_an_unknown_version_of_fmi_is_refused() -> None:
    with pytest.raises(HydrostateError, match=r"version of FMI must be one of 2\.0, 3\.0, got '1\.0'"):
        plant_fmu(LUMPED, RIG, STEP, "1.0", name="bench")


def test_every_state_of_every_plant_has_its_unit() -> None:
    units = {state: _unit(state) for plant in PLANTS.values() for state in plant.states}
    assert units == {
        "position_m": "m",
        "velocity_m_s": "m/s",
        "acceleration_m_s2": "m/s^2",
        "differential_pressure_pa": "Pa",
        "motor_speed_rad_s": "rad/s",
        "presliding": "1",
        "oil_a_m3": "m^3",
        "oil_b_m3": "m^3",
        "oil_accumulator_m3": "m^3",
    }
