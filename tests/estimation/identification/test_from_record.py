from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from estimation.identification import LinearModel, identify_record
from estimation.identification.from_record import record_signals
from estimation.identification.notes import IdentificationCode
from plant.errors import HydrostateError, LogError, LogWarning
from plant.log.record import Record

Binary = Callable[..., np.ndarray]


@pytest.fixture
def record(plant_30hz: LinearModel, binary: Binary) -> Record:
    rng = np.random.default_rng(1)
    u = binary(rng, 8_000, 20)
    y = plant_30hz.simulate(u)
    noise = 0.01 * y.std() * rng.standard_normal(u.size)
    return Record(1e-3, {"motor_speed_rad_s": u, "velocity_m_s": y + noise})


def natural_frequency_hz(model: LinearModel) -> float:
    return float(np.abs(np.log(model.poles[0])) / (2.0 * np.pi * model.sample_time))


def test_a_record_gives_a_model_with_channel_names(record: Record, plant_30hz: LinearModel) -> None:
    model = identify_record(record)
    assert (model.input_name, model.output_name) == ("motor_speed_rad_s", "velocity_m_s")
    assert model.sample_time == 1e-3
    assert model.n_samples == len(record)
    assert natural_frequency_hz(model) == pytest.approx(30.0, rel=0.01)
    assert abs(model.dc_gain - plant_30hz.dc_gain) < 3.0 * model.dc_gain_std


def test_filtering_input_and_output_keeps_the_poles(record: Record) -> None:
    assert natural_frequency_hz(identify_record(record, filter_cutoff_hz=30.0)) == pytest.approx(30.0, rel=0.02)


def test_a_record_is_resampled_to_the_model_s_sample_time(plant_30hz: LinearModel, binary: Binary) -> None:
    fast = LinearModel.from_dict(plant_30hz.to_dict() | {"sample_time_s": 1e-4})
    u = binary(np.random.default_rng(2), 80_000, 200)
    model = identify_record(Record(1e-4, {"motor_speed_rad_s": u, "velocity_m_s": fast.simulate(u)}))
    assert model.sample_time == 1e-3
    assert model.n_samples == 8_000
    assert model.fit_percent > 98.0
    # a plant of 300 Hz, sampled at 1 kHz
    assert model.dc_gain == pytest.approx(fast.dc_gain, rel=0.01)


def test_without_velocity_the_position_is_differentiated_with_a_warning(record: Record) -> None:
    position = cumulative_trapezoid(record["velocity_m_s"], dx=1e-3, initial=0.0)
    with pytest.warns(LogWarning) as caught:
        model = identify_record(record.replace(velocity_m_s=None, position_m=position))
    assert IdentificationCode.VELOCITY_DIFFERENTIATED in [one.message.note.code for one in caught]
    assert model.output_name == "velocity_m_s"
    assert natural_frequency_hz(model) == pytest.approx(30.0, rel=0.03)


def test_missing_inputs_are_bridged_with_a_warning(record: Record) -> None:
    u = record["motor_speed_rad_s"].copy()
    u[[105, 107, 2_010]] = np.nan
    with pytest.warns(LogWarning) as caught:
        model = identify_record(record.replace(motor_speed_rad_s=u))
    bridged = IdentificationCode.INPUT_BRIDGED.note(channel="motor_speed_rad_s", count=3, total=8000)
    assert bridged in [one.message.note for one in caught]
    assert natural_frequency_hz(model) == pytest.approx(30.0, rel=0.01)


def test_missing_outputs_are_left_out(record: Record) -> None:
    y = record["velocity_m_s"].copy()
    y[500:600] = np.nan
    assert identify_record(record.replace(velocity_m_s=y)).n_samples == 7_900


def test_a_record_without_the_channels_is_refused(record: Record) -> None:
    with pytest.raises(LogError, match="'motor_speed_rad_s' is needed"):
        identify_record(record.replace(motor_speed_rad_s=None))
    with pytest.raises(LogError, match="'velocity_m_s' is needed"):
        identify_record(record.replace(velocity_m_s=None, other=record["velocity_m_s"]))
    with pytest.raises(LogError, match="3 samples of 'position_m'"):
        identify_record(Record(1e-3, {"motor_speed_rad_s": np.ones(2), "position_m": np.ones(2)}))


def test_three_samples_of_position_give_a_velocity_and_warnings_that_point_at_the_caller() -> None:
    short = Record(1e-3, {"motor_speed_rad_s": np.array([1.0, np.nan, 3.0]), "position_m": np.array([0.0, 1e-3, 4e-3])})
    with pytest.warns(LogWarning) as caught:
        u, y = record_signals(short)
    assert u == pytest.approx([1.0, 2.0, 3.0])
    assert y == pytest.approx([1.0, 2.0, 3.0])
    said = {one.message.note.code: one.filename for one in caught}  # type: ignore[union-attr]
    assert said == {
        IdentificationCode.VELOCITY_DIFFERENTIATED: __file__,
        IdentificationCode.INPUT_BRIDGED: __file__,
    }


def test_a_motor_at_constant_speed_is_refused(record: Record) -> None:
    with pytest.raises(HydrostateError, match=r"'motor_speed_rad_s'.*constant 125\.66"):
        identify_record(record.replace(motor_speed_rad_s=np.full(8_000, 125.66)))
