"""Fits without pressure of logs from other sources."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from estimation.fits.motion.fit import fit_motion
from estimation.notes import EstimateCode
from plant.eha.model import EhaParameters
from plant.log.files import read_record
from plant.log.record import Record

HEALTHY = EhaParameters()


def bench(shared: Path, name: str) -> tuple[Record, float]:
    truth = pd.read_csv(shared / "bench" / "truth.csv").set_index("file")
    record = read_record(shared / "bench" / name).replace(differential_pressure_pa=None)
    return record, float(truth.loc[name, "bulk_modulus_pa"])


@pytest.mark.slow
def test_a_foreign_log_without_pressure_gives_its_bulk_modulus(shared: Path) -> None:
    record, truth = bench(shared, "run001.csv")
    fit = fit_motion(record, HEALTHY, HEALTHY.bulk_modulus)
    assert fit.parameters["bulk_modulus"][0] == pytest.approx(truth, rel=0.01)
    assert fit.reasons == ()


@pytest.mark.slow
def test_a_shaken_position_in_a_foreign_log_is_objected_to(shared: Path) -> None:
    record, _ = bench(shared, "run001.csv")
    record = record.slice(0, 3000)
    shaken = record["position_m"] + 2e-5 * np.sin(200.0 * np.arange(3000) * 1e-3)
    fit = fit_motion(record.replace(position_m=shaken), HEALTHY, HEALTHY.bulk_modulus)
    (large,) = (note for note in fit.reasons if note.code == EstimateCode.POSITION_RESIDUALS_LARGE)
    assert large.data["ratio"] == pytest.approx(fit.chi_square**0.5)
