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
def test_the_steps_of_a_plant_in_c_agree_with_python(plant: Plant, using: str, tmp_path: Path) -> None:
    wanted = native(plant)
    found = outputs(tmp_path, plant, using=using)
    assert np.max(np.abs(found - wanted) / np.max(np.abs(wanted), axis=0)) < 1e-12


def test_the_lumped_plant_in_c_agrees_with_simulate(tmp_path: Path) -> None:
    record = simulate(LUMPED, DRIVE, 1e-4, RIG)
    wanted = np.column_stack([record[name] for name in ("position_m", "velocity_m_s", "differential_pressure_pa")])
    assert np.max(np.abs(outputs(tmp_path, LUMPED) - wanted) / np.max(np.abs(wanted), axis=0)) < 1e-12


@pytest.mark.slow
@EVERY_PLANT
def test_a_plant_in_c_runs_clean_under_sanitizers(plant: Plant, tmp_path: Path) -> None:
    assert np.all(np.isfinite(outputs(tmp_path, plant, *SANITIZED)))


def test_a_plant_in_c_in_single_precision_errs_by_less_than_one_in_a_thousand(tmp_path: Path) -> None:
    wanted = native(LUMPED)
    error = np.max(np.abs(outputs(tmp_path, LUMPED, precision="float") - wanted) / np.max(np.abs(wanted), axis=0))
    assert 1e-8 < error < 1e-3


def test_the_header_gives_names_units_and_operation_counts() -> None:
    header = plant_in_c(LUMPED, RIG, 1e-3, name="bench")["bench.h"]
    assert "BENCH_ROW_PISTON_AREA = 1, /* m^2, effective piston area A */" in header
    assert "#define BENCH_SUBSTEPS 40" in header
    counts = [int(one) for one in re.findall(r"^ \* +(\d+) ", header, re.MULTILINE)]
    assert re.search(rf"#define BENCH_OPERATIONS {sum(counts)} ", header)


def test_an_invalid_name_or_sample_time_is_refused() -> None:
    with pytest.raises(HydrostateError, match="name in C"):
        plant_in_c(LUMPED, RIG, 1e-4, name="my plant")
    with pytest.raises(DriveError, match="sample_time must be positive"):
        plant_in_c(LUMPED, RIG, 0.0, name="bench")
