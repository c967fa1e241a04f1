import re
from pathlib import Path

import numpy as np
import pytest

from plant.eha.drives import sine
from plant.eha.model import EhaParameters
from plant.eha.simulate import LUMPED, PLANTS, Plant, simulate
from plant.errors import DriveError, HydrostateError
from plant.export.c_plant import plant_in_c, substeps_of
from plant.solvers.steps import parameter_row
from plant.solvers.trajectory import compile_trajectory
from tests.c_compiler import SANITIZED, compiled, ran

RIG = EhaParameters(leakage_coefficient=2e-11)
DRIVE = sine(0.3, 1e-4, RIG.rated_speed, 5.0)
EVERY_PLANT = pytest.mark.parametrize("plant", PLANTS.values(), ids=PLANTS)


def outputs(folder: Path, plant: Plant, *flags: str, precision: str = "double", using: str = "gcc") -> np.ndarray:
    files = plant_in_c(plant, RIG, 1e-4, name="bench", precision=precision)
    out, _ = ran(compiled(folder, files, *flags, using=using), [repr(float(speed)) for speed in DRIVE])
    return np.array([[float(one) for one in line.split(",")] for line in out.splitlines()])


def native(plant: Plant) -> np.ndarray:
    row = parameter_row(plant.complete(RIG))
    run = compile_trajectory(plant.name, plant.step, len(plant.states), plant.parameter_class)
    states = run(plant.start(row), DRIVE, row[None], 1e-4, substeps_of(plant, 1e-4, row))
    seen = plant.channels(states, row[None])
    return np.column_stack([values for name, values in seen.items() if name != "motor_speed_rad_s"])


@EVERY_PLANT
@pytest.mark.parametrize("using", ["gcc", "clang"])
def test_its_steps_in_c_are_those_of_python(plant: Plant, using: str, tmp_path: Path) -> None:
    wanted = native(plant)
    found = outputs(tmp_path, plant, using=using)
    assert np.max(np.abs(found - wanted) / np.max(np.abs(wanted), axis=0)) < 1e-12


def test_a_plant_of_fixed_steps_is_what_simulate_runs(tmp_path: Path) -> None:
    record = simulate(LUMPED, DRIVE, 1e-4, RIG)
    wanted = np.column_stack([record[name] for name in ("position_m", "velocity_m_s", "differential_pressure_pa")])
    assert np.max(np.abs(outputs(tmp_path, LUMPED) - wanted) / np.max(np.abs(wanted), axis=0)) < 1e-12


@pytest.mark.slow
@EVERY_PLANT
def test_it_runs_clean_under_sanitizers(plant: Plant, tmp_path: Path) -> None:
    assert np.all(np.isfinite(outputs(tmp_path, plant, *SANITIZED)))


def test_in_float_it_follows_within_a_few_parts_in_ten_thousand(tmp_path: Path) -> None:
    wanted = native(LUMPED)
    error = np.max(np.abs(outputs(tmp_path, LUMPED, precision="float") - wanted) / np.max(np.abs(wanted), axis=0))
    assert 1e-8 < error < 1e-3


def test_names_units_and_operations_stand_in_the_header() -> None:
    header = plant_in_c(LUMPED, RIG, 1e-3, name="bench")["bench.h"]
    assert "BENCH_ROW_PISTON_AREA = 1, /* m^2, effective piston area A */" in header
    assert "#define BENCH_SUBSTEPS 40" in header
    counts = [int(one) for one in re.findall(r"^ \* +(\d+) ", header, re.MULTILINE)]
    assert re.search(rf"#define BENCH_OPERATIONS {sum(counts)} ", header)


def test_what_cannot_be_exported_is_refused() -> None:
    with pytest.raises(HydrostateError, match="name in C"):
        plant_in_c(LUMPED, RIG, 1e-4, name="my plant")
    with pytest.raises(DriveError, match="sample_time must be positive"):
        plant_in_c(LUMPED, RIG, 0.0, name="bench")
