"""An averaged pressure gives the numbers of the raw one, since the model is averaged over the same rows."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from estimation.eha.bulk_modulus import BulkModulusEstimate, estimate_bulk_modulus
from estimation.eha.smoothed_pressure import told_if_smoothed
from estimation.finding import Gate
from estimation.fits.flow.mean_rows import NO_MEAN, PressureMean
from estimation.fits.greybox.log import GreyBoxLog, OutputNoise
from estimation.log_checks.channel_names import PRESSURE
from estimation.notes import EstimateCode
from faults.conditions import CONDITIONS, parameters_for
from plant.arrays import Array
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH
from tests.estimation.log_checks.test_averaged import over_both_sides, over_last

RIG = EhaParameters()


@cache
def log(drive: str, sample_time: float) -> Record:
    rng = np.random.default_rng(11)
    p = parameters_for(CONDITIONS["minor_leakage"])
    return simulate(CIRCUIT, make_drive(drive, 5.0, sample_time, p, rng), sample_time, p, sensors=BENCH, rng=rng)


@cache
def raw_estimate(drive: str, sample_time: float) -> BulkModulusEstimate:
    return estimate_bulk_modulus(log(drive, sample_time), RIG)


def estimated(record: Record) -> BulkModulusEstimate:
    with pytest.warns(UserWarning, match="moving average"):
        return estimate_bulk_modulus(record, RIG)


@pytest.mark.parametrize(
    ("drive", "average", "rows", "sample_time"),
    [
        ("prbs", over_last, 3, 1e-3),
        ("prbs", over_last, 8, 1e-3),
        ("steps", over_both_sides, 5, 1e-3),
        pytest.param("multisine", over_both_sides, 10, 1e-3, marks=pytest.mark.slow),
        ("prbs", over_last, 5, 1e-4),
    ],
)
def test_an_averaged_pressure_gives_the_bulk_modulus_of_the_raw_one(
    drive: str, average: Callable[[Array, int], Array], rows: int, sample_time: float
) -> None:
    record = log(drive, sample_time)
    raw = raw_estimate(drive, sample_time)
    found = estimated(record.replace(**{PRESSURE: average(record[PRESSURE], rows)}))
    assert raw.value is not None
    assert raw.std is not None
    assert found.value is not None
    assert found.std is not None
    assert found.gate.passed
    assert abs(found.value - raw.value) < 2.0 * np.hypot(found.std, raw.std)
    middle = 0.5 * (rows - 1) if average is over_last else 0.0
    assert found.mean_late == pytest.approx(middle * sample_time, abs=0.6 * sample_time)


def test_means_stand_in_all_of_their_rows_and_rows_without_a_whole_mean_are_missing() -> None:
    read = np.full((11, 1), np.nan)
    read[[3, 7]] = [[1.0], [2.0]]  # means over rows 1 to 4 and 5 to 8, written one row before their last
    rows = np.arange(11)
    plain = GreyBoxLog(np.zeros((11, 1)), read, np.zeros(1), 1e-3, rows, (OutputNoise(2.0),))
    spread = PressureMean(4, 2, first=1).spread(plain)
    assert spread.measured[:, 0].tolist()[1:9] == [1.0] * 4 + [2.0] * 4
    assert np.flatnonzero(np.isnan(spread.measured[:, 0])).tolist() == [0, 9, 10]
    assert spread.noise[0].variance == 8.0
    assert spread.count_measured == 2
    assert PressureMean(4, 2).judged(spread).block == pytest.approx(4e-3)
    assert NO_MEAN.spread(plain) is plain
    assert NO_MEAN.judged(plain) is plain


@pytest.mark.parametrize(("rows", "after", "late"), [(4, 3, 1.5), (4, 2, 0.5), (4, 1, -0.5), (5, 2, 0.0), (1, 0, 0.0)])
def test_a_mean_is_late_by_the_rows_from_the_middle_of_its_own(rows: int, after: int, late: float) -> None:
    assert PressureMean(rows, after).late_rows == late


def test_a_log_begins_with_the_first_row_of_a_whole_mean() -> None:
    record = Record(1e-3, {PRESSURE: np.arange(10.0)})
    assert [float(PressureMean(4, after).begun(record)[PRESSURE][0]) for after in (3, 2, 1)] == [0.0, 1.0, 2.0]
    assert float(PressureMean(5, 4, first=3).begun(record)[PRESSURE][0]) == 2.0
    assert NO_MEAN.begun(record) is record


def test_a_fit_that_is_refused_behind_a_zero_phase_filter_names_the_filter_first() -> None:
    from scipy.signal import butter, filtfilt

    record = log("steps", 1e-3)
    smooth = record.replace(**{PRESSURE: filtfilt(*butter(2, 0.1), record[PRESSURE])})
    sound = raw_estimate("steps", 1e-3)
    large = EstimateCode.PRESSURE_RESIDUALS_LARGE.note(ratio=9.0)
    refused = replace(sound, gate=Gate(False, (large,)))
    named = told_if_smoothed(refused, smooth)
    assert [note.code for note in named.gate.reasons] == [EstimateCode.PRESSURE_SMOOTHED, large.code]
    assert told_if_smoothed(refused, record) is refused
    assert told_if_smoothed(sound, smooth) is sound
