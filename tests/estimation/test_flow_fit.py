from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from estimation.flow_fit import fit_flow
from faults.conditions import CONDITIONS, parameters_for
from plant.eha import EhaParameters
from plant.errors import LogError
from plant.record import Record
from plant.record_files import read_record
from plant.sensors import BENCH
from plant.signals import make_drive
from plant.simulate import LUMPED, simulate

HEALTHY = EhaParameters()


def log(condition: str, seed: int, drive: str = "steps") -> Record:
    rng = np.random.default_rng(seed)
    p = parameters_for(CONDITIONS[condition])
    return simulate(LUMPED, make_drive(drive, 10.0, 1e-3, p, rng), 1e-3, p, sensors=BENCH, rng=rng)


@pytest.mark.parametrize("condition", CONDITIONS)
def test_bulk_modulus_and_leakage_come_back_without_knowing_the_condition(condition: str) -> None:
    p = parameters_for(CONDITIONS[condition])
    fit = fit_flow(log(condition, 11), HEALTHY, 4e8)
    assert fit.parameters["bulk_modulus"][0] == pytest.approx(p.bulk_modulus, rel=0.005)
    assert fit.parameters["leakage_coefficient"][0] == pytest.approx(p.leakage_coefficient, rel=0.05)
    assert fit.parameters["flow_bias"][0] == pytest.approx(p.flow_bias, rel=0.10)
    assert fit.reasons == ()


def test_a_drifting_pressure_sensor_is_objected_to() -> None:
    record = log("normal", 12)
    drift = np.linspace(0.0, 2e5, len(record))
    fit = fit_flow(record.replace(differential_pressure_pa=record["differential_pressure_pa"] + drift), HEALTHY, 2e8)
    assert any("larger than the sensor's noise" in reason for reason in fit.reasons)


def test_a_log_without_pressure_is_refused_with_what_it_lacks() -> None:
    with pytest.raises(LogError, match="lacks differential_pressure_pa"):
        fit_flow(log("normal", 13).replace(differential_pressure_pa=None), HEALTHY, 2e8)


def test_logs_of_a_foreign_bench_give_their_bulk_modulus_without_the_condition(shared: Path) -> None:
    truth = pd.read_csv(shared / "bench" / "truth.csv")
    errors: list[float] = []
    covered = 0
    for name, bulk_modulus in zip(truth["file"], truth["bulk_modulus_pa"], strict=True):
        fit = fit_flow(read_record(shared / "bench" / name), HEALTHY, 4e8)
        value, std = fit.parameters["bulk_modulus"]
        errors.append(abs(value / bulk_modulus - 1.0))
        covered += abs(value - bulk_modulus) < 1.96 * std
    assert max(errors) < 0.01
    assert np.median(errors) < 0.002
    assert covered >= 15
