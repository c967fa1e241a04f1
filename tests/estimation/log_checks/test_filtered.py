"""Pressure that was filtered before logging keeps samples with independent noise; no other log is changed."""

import numpy as np
import pytest

from estimation.log_checks.clean import clean_log
from estimation.log_checks.filtered import (
    WINDOW,
    flatness,
    independent_rows,
    is_white,
    is_white_when_quiet,
    without_correlated_noise,
)
from estimation.log_checks.notes import LoggerCode
from estimation.notes import SensorCode
from faults.conditions import CONDITIONS, parameters_for
from plant.arrays import Array
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH, IDEAL, Sensors

PRESSURE = "differential_pressure_pa"


def log(drive: str, sensors: Sensors = BENCH, sample_time: float = 1e-3, seed: int = 4) -> Record:
    rng = np.random.default_rng(seed)
    p = parameters_for(CONDITIONS["minor_leakage"])
    signal = make_drive(drive, 6.0, sample_time, p, rng)
    return simulate(CIRCUIT, signal, sample_time, p, sensors=sensors, rng=rng)


def averaged(values: Array, rows: int) -> Array:
    """Return means over the last rows, like those of a logger's block average."""
    return np.convolve(np.concatenate([np.full(rows - 1, values[0]), values]), np.ones(rows) / rows, "valid")


def lagged(values: Array, corner: float) -> Array:
    """Return the output of a first-order analogue filter with a corner [cycles/sample]."""
    kept, out = np.exp(-2.0 * np.pi * corner), values.copy()
    for row in range(1, len(values)):
        out[row] = kept * out[row - 1] + (1.0 - kept) * values[row]
    return out


@pytest.mark.parametrize("sensors", [BENCH, IDEAL])
@pytest.mark.parametrize("drive", ["steps", "prbs", "multisine", "chirp", "sine"])
def test_a_log_with_white_noise_or_none_is_unchanged(drive: str, sensors: Sensors) -> None:
    for sample_time in (1e-3, 1e-4):
        record = log(drive, sensors, sample_time)
        assert without_correlated_noise(record) == (record, ())


def test_a_log_that_thinning_would_make_too_slow_for_its_actuator_is_unchanged() -> None:
    record = log("steps")
    smooth = record.replace(**{PRESSURE: averaged(record[PRESSURE], 4)})
    assert without_correlated_noise(smooth, 99.0)[1]
    assert without_correlated_noise(smooth, 101.0) == (smooth, ())


@pytest.mark.parametrize("rows", [2, 3, 4, 5])
@pytest.mark.parametrize("drive", ["steps", "multisine"])
def test_an_averaged_pressure_keeps_only_samples_with_independent_noise(drive: str, rows: int) -> None:
    record = log(drive)
    found, (note,) = without_correlated_noise(record.replace(**{PRESSURE: averaged(record[PRESSURE], rows)}))
    assert note.code is SensorCode.FILTERED
    assert note.data["channel"] == PRESSURE
    kept = int(note.data["rows"])
    assert rows <= kept <= 2 * rows + 1
    there = np.flatnonzero(np.isfinite(found[PRESSURE]))
    assert there.tolist() == list(range(0, len(record), kept))
    assert np.array_equal(found[PRESSURE][there], averaged(record[PRESSURE], rows)[there])
    assert all(np.array_equal(found[name], record[name]) for name in record if name != PRESSURE)


@pytest.mark.parametrize(("corner", "least"), [(0.25, 2), (0.15, 3), (0.1, 4)])
def test_samples_behind_a_first_order_filter_are_correlated_by_less_than_a_tenth(corner: float, least: int) -> None:
    noise = np.random.default_rng(7).standard_normal(20_000)
    rows = independent_rows(lagged(noise, corner), 1e-3)
    assert rows >= least
    assert np.exp(-2.0 * np.pi * corner * rows) < 0.1


def test_white_noise_is_seldom_taken_for_filtered() -> None:
    rng = np.random.default_rng(8)
    taken = [not is_white(rng.standard_normal(size)) for size in (1000, 2000, 5000, 10_000) for _ in range(250)]
    assert sum(taken) <= 5


@pytest.mark.parametrize("correlation", [0.2, -0.3])
def test_a_correlation_of_a_fifth_is_detected_in_a_log_of_twenty_seconds(correlation: float) -> None:
    noise = np.random.default_rng(9).standard_normal(20_001)
    assert not is_white(noise[1:] + correlation / (1.0 + correlation**2) * 1.1 * noise[:-1])


def turning(teeth: float, amplitude: float, rng: np.random.Generator) -> Record:
    """Return 20 s of a pump at 30 to 100 % of 157 rad/s, with its ripple and white noise in pressure [Pa]."""
    speed = 157.0 * np.repeat(rng.choice((-1.0, 1.0), 40) * rng.uniform(0.3, 1.0, 40), 500)
    tones = amplitude * np.sin(teeth * np.cumsum(speed) * 1e-3)
    return Record(1e-3, {"motor_speed_rad_s": speed, PRESSURE: 3.0 * speed + tones + rng.normal(0.0, 5e3, len(speed))})


@pytest.mark.parametrize("seed", range(5))
def test_pump_ripple_is_no_filter_and_an_average_is_found_beside_it(seed: int) -> None:
    record = turning(13.0, 7e3, np.random.default_rng(seed))
    assert independent_rows(record[PRESSURE], 1e-3) > 1
    assert without_correlated_noise(record) == (record, ())
    _, (note,) = without_correlated_noise(record.replace(**{PRESSURE: averaged(record[PRESSURE], 4)}))
    assert note.code is SensorCode.FILTERED


def test_whiteness_is_judged_only_in_quiet_stretches_of_a_long_log() -> None:
    rng = np.random.default_rng(3)
    white, struck = rng.normal(size=(2, 6400))
    rests = np.repeat([False, True, False, False], 1600)
    moved = np.where(rests, 0.0, 3.0 * averaged(struck, 3))
    assert not is_white(white + moved)
    assert is_white_when_quiet(white + moved)
    assert not is_white_when_quiet(averaged(white, 3) + moved)
    assert not is_white_when_quiet(averaged(white, 3))
    few = slice(0, 14 * WINDOW)  # 27 windows, of which seven are quiet
    assert not is_white_when_quiet((white + moved)[few])
    assert not is_white_when_quiet(white[: WINDOW - 1])


@pytest.mark.parametrize("seed", range(5))
def test_a_filter_is_also_found_in_quiet_stretches(seed: int) -> None:
    noise = np.random.default_rng(seed).normal(size=10_000)
    assert not any(is_white_when_quiet(one) for one in (averaged(noise, 2), averaged(noise, 4), lagged(noise, 0.1)))


def test_samples_that_no_thinning_makes_independent_are_kept() -> None:
    walk = np.cumsum(np.random.default_rng(10).standard_normal(20_000))
    assert not is_white(walk)
    assert independent_rows(walk, 1e-3) == 1
    struck = log("prbs")  # the actuator rings as fast as the remaining samples would come
    assert without_correlated_noise(struck.replace(**{PRESSURE: averaged(struck[PRESSURE], 4)}))[1] == ()
    assert independent_rows(averaged(np.random.default_rng(11).standard_normal(4000), 4), 0.01) == 1  # log too slow


def test_a_short_or_broken_log_is_no_evidence_of_a_filter() -> None:
    rng = np.random.default_rng(12)
    short, broken = averaged(rng.standard_normal(200), 5), averaged(rng.standard_normal(8000), 5)
    broken[::50] = np.nan  # no window is complete
    assert is_white(short)
    assert is_white(broken)
    assert is_white(short[: WINDOW - 1])
    assert flatness(np.zeros((9, WINDOW))) == 1.0


def test_a_linear_trend_in_a_window_does_not_change_its_flatness() -> None:
    windows = np.random.default_rng(13).standard_normal((40, WINDOW))
    steep = windows + np.linspace(-1e6, 1e6, WINDOW)
    assert flatness(steep) == pytest.approx(flatness(windows), rel=1e-6)


def test_a_cleaned_log_with_averaged_pressure_has_the_reduced_variance() -> None:
    record = log("steps")
    clean = clean_log(record.replace(**{PRESSURE: averaged(record[PRESSURE], 4)}), EhaParameters())
    assert [note.code for note in clean.left_out] == [LoggerCode.AVERAGED]
    # an average of four has half the noise
    white = clean_log(record, EhaParameters()).variances[PRESSURE]
    assert clean.variances[PRESSURE] == pytest.approx(white / 4.0, rel=0.25)
