"""A stream's filter starts from its first samples, takes noise from another log, and resumes where it was saved."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from estimation.eha.online import StreamFilterOptions, begin_filter, load_filter, samples_of, save_filter
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import LUMPED, simulate
from plant.errors import HydrostateError, LogError
from plant.log.record import Record
from plant.sensors.sensors import BENCH

P = EhaParameters()
PRESSURE = "differential_pressure_pa"
ASKED = StreamFilterOptions(P, "pressure", "ekf")


def stream(seed: int = 0) -> Record:
    rng = np.random.default_rng(seed)
    return simulate(LUMPED, make_drive("steps", 0.5, 1e-3, P, rng), 1e-3, P, sensors=BENCH, rng=rng)


def chambers(record: Record) -> Record:
    high = 5e6 + 0.5 * record[PRESSURE]
    return record.replace(**{PRESSURE: None}, pressure_a_pa=high, pressure_b_pa=high - record[PRESSURE])


def test_noise_levels_come_from_another_log_with_the_same_channels_and_rate() -> None:
    first, like = stream(), stream(1)
    own, told = begin_filter(ASKED, first), begin_filter(ASKED, first, like)
    np.testing.assert_array_equal(told.problem.variances, begin_filter(ASKED, like).problem.variances)
    assert np.any(told.problem.variances != own.problem.variances)
    np.testing.assert_array_equal(told.problem.mean, own.problem.mean)
    for other in (like.replace(velocity_m_s=None), replace(like, sample_time=2e-3)):
        with pytest.raises(LogError, match=r"the log must have the stream's channels .* at its rate, 1000 Hz"):
            begin_filter(ASKED, first, other)


def test_stream_samples_are_split_into_drives_and_measurements_in_the_filters_order() -> None:
    record = stream()
    filtered = begin_filter(ASKED, record)
    split = chambers(record)
    known = {name: split[name] for name in split}
    drives, measured = samples_of(filtered, known)
    np.testing.assert_array_equal(drives[:, 0], record["motor_speed_rad_s"])
    place = filtered.problem.channels.index(PRESSURE)
    assert measured[:, place] == pytest.approx(record[PRESSURE], abs=1e-6)
    with pytest.raises(LogError, match="the stream lacks velocity_m_s"):
        samples_of(filtered, {name: record[name] for name in record if name != "velocity_m_s"})


def test_a_saved_filter_resumes_its_state_and_only_with_the_same_method_and_parameters(tmp_path: Path) -> None:
    record, path = stream(), tmp_path / "filter.npz"
    filtered = begin_filter(ASKED, record)
    save_filter(path, ASKED, filtered, 0.25)
    again, last = load_filter(path, ASKED)
    assert last == 0.25
    for name, value in filtered.remembered().items():
        np.testing.assert_array_equal(value, again.remembered()[name])
    np.testing.assert_array_equal(again.problem.variances, filtered.problem.variances)
    with pytest.raises(HydrostateError, match="is of pressure ekf, asked for is pressure imm"):
        load_filter(path, replace(ASKED, method="imm"))
    with pytest.raises(HydrostateError, match="is of an actuator with other parameters"):
        load_filter(path, replace(ASKED, parameters=replace(P, piston_area=2e-3)))
