"""A channel with few significant digits is found, and then has steps of one size; a converter's is left alone."""

import numpy as np
import pytest

from estimation.eha.estimate import estimate_log
from estimation.log_checks.clean import clean_log
from estimation.log_checks.few_digits import FEWEST, with_even_steps, written_digits
from estimation.log_checks.notes import LoggerCode
from faults.conditions import CONDITIONS, parameters_for
from plant.arrays import Array
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.rig import Rig
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH

POSITION, PRESSURE = "position_m", "differential_pressure_pa"


def log(drive: str = "steps", condition: str = "normal") -> Record:
    rng, p = np.random.default_rng(5), parameters_for(CONDITIONS[condition])
    return simulate(CIRCUIT, make_drive(drive, 4.0, 1e-3, p, rng), 1e-3, p, sensors=BENCH, rng=rng)


def printed(values: Array, digits: int) -> Array:
    return np.array([float(f"{value:.{digits}g}") for value in values])


@pytest.mark.parametrize("digits", [2, 3, 4, 5])
@pytest.mark.parametrize("scale", [1.0, 1e-3, 1e5])
def test_digits_are_counted_in_every_decimal_unit(digits: int, scale: float) -> None:
    course = np.random.default_rng(1).normal(0.0, 30.0, 3000)
    course[::7] = np.nan
    assert written_digits(printed(course, digits) * scale) == digits
    assert written_digits(course * scale) == 0


@pytest.mark.parametrize("step", [1e-6, 2e-5, 2.5e-5, 1e-4, 0.05 / 2**10])
def test_a_converters_even_steps_are_not_taken_for_few_digits(step: float) -> None:
    course = 0.05 * np.sin(0.01 * np.arange(3000.0))
    assert written_digits(step * np.rint(course / step)) == 0


def test_a_constant_or_short_channel_has_no_countable_digits() -> None:
    assert written_digits(np.zeros(1000)) == 0
    assert written_digits(np.full(1000, 0.0123)) == 0
    assert written_digits(printed(np.random.default_rng(2).normal(size=FEWEST - 1), 3)) == 0


@pytest.mark.parametrize("drive", ["steps", "prbs", "chirp", "sine"])
def test_simulated_bench_logs_are_unchanged(drive: str) -> None:
    record = log(drive)
    assert with_even_steps(record) == (record, ())


def test_a_channel_with_few_digits_is_rounded_to_its_largest_step() -> None:
    values = printed(np.arange(-1.0, 30.0, 0.0137), 3)
    even, (note,) = with_even_steps(Record(1e-3, {"motor_speed_rad_s": values, POSITION: values}))
    assert (note.code, dict(note.data)) == (LoggerCode.FEW_DIGITS, {"channel": POSITION, "digits": 3})
    assert np.allclose(even[POSITION], np.rint(values / 0.1) * 0.1, rtol=0.0, atol=1e-12)
    assert np.array_equal(even["motor_speed_rad_s"], values)


@pytest.mark.parametrize("spike", [1.0, -9999.0])
def test_a_spike_does_not_coarsen_the_log(spike: float) -> None:
    """One sample of 9999 rounded all positions to 0."""
    values = printed(0.04 * np.sin(0.01 * np.arange(3000.0)), 4)
    whole, _ = with_even_steps(Record(1e-3, {"motor_speed_rad_s": values, POSITION: values}))
    struck = np.where(np.arange(3000) == 700, spike, values)
    even, (note,) = with_even_steps(Record(1e-3, {"motor_speed_rad_s": values, POSITION: struck}))
    assert note.data["digits"] == 4
    assert np.array_equal(np.delete(even[POSITION], 700), np.delete(whole[POSITION], 700))


def test_bulk_modulus_is_estimated_from_a_position_with_four_digits() -> None:
    """A plain log was refused after a search of 20 s."""
    record = log()
    found = estimate_log(record.replace(**{POSITION: printed(record[POSITION], 4)}), Rig())
    assert found.gate.passed
    assert LoggerCode.FEW_DIGITS in [note.code for note in found.notes]
    low, high = found.quantities["bulk_modulus"].ci95
    assert low < EhaParameters().bulk_modulus < high


def test_a_pressure_with_two_digits_is_not_taken_for_logged_on_change() -> None:
    record = log()
    cleaned = clean_log(record.replace(**{PRESSURE: printed(record[PRESSURE], 2)}), EhaParameters())
    assert cleaned.objections == ()
    assert [note.data["channel"] for note in cleaned.left_out if note.code == LoggerCode.FEW_DIGITS] == [PRESSURE]
