from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimation.identification import LinearModel, fit_output_error, from_record, identify_record
from estimation.identification.fit.feedback import feedback_note
from estimation.identification.fit.residual_tests import DEFAULT_LAGS, feedback_test
from estimation.identification.free_run import other_structures
from estimation.identification.free_run.data import channels_from
from estimation.identification.free_run.identify import identify_channels
from estimation.identification.model.recursion import filtered
from estimation.identification.notes import IdentificationCode
from plant.errors import HydrostateError, LogWarning
from plant.log.record import Record


def closed_loop(rng: np.random.Generator, n: int, gain: float) -> tuple[np.ndarray, np.ndarray]:
    """Return input and output of y = 0.2 / (1 - 0.8 q^-1) q^-1 u + noise, with u = reference - gain y."""
    reference, noise = np.repeat(rng.choice([-1.0, 1.0], n // 10), 10), 0.1 * rng.standard_normal(n)
    u, y, x = np.zeros(n), np.zeros(n), 0.0
    for t in range(n):
        y[t] = x + noise[t]
        u[t] = reference[t] - gain * (y[t - 1] if t else 0.0)
        x = 0.8 * x + 0.2 * u[t]
    return u, y


def test_feedback_from_the_noise_to_the_input_is_found() -> None:
    u, y = closed_loop(np.random.default_rng(1), 4_000, 0.8)
    model = fit_output_error(u, y, 1e-3, n_numerator=1, n_denominator=1, delay=1)
    assert feedback_test(y - model.simulate(u), u).p_value < 1e-9


def test_the_feedback_test_keeps_its_false_alarm_rate_for_coloured_noise() -> None:
    rejected = []
    for seed in range(100):
        rng = np.random.default_rng([3, seed])
        u = np.repeat(rng.choice([-1.0, 1.0], 200), 10)
        noise = np.convolve(rng.standard_normal(2_100), 0.9 ** np.arange(60))[:2_000]
        rejected.append(not feedback_test(noise, u).passed())
    assert 0.01 < np.mean(rejected) < 0.10


def test_a_log_from_a_closed_loop_warns() -> None:
    u, y = closed_loop(np.random.default_rng(2), 4_000, 0.8)
    record = Record(1e-3, {"motor_speed_rad_s": u, "velocity_m_s": y})
    with pytest.warns(LogWarning) as caught:
        identify_record(record, n_numerator=1, n_denominator=1, delay=1)
    (note,) = [one.message.note for one in caught if one.message.note.code == IdentificationCode.FEEDBACK]
    assert (note.data["input"], note.data["output"]) == ("motor_speed_rad_s", "velocity_m_s")
    assert note.data["p_value"] < 1e-3
    assert {one.filename for one in caught} == {__file__}  # a warning points at the caller


def test_a_closed_loop_is_noted_for_columns_of_any_name_and_an_open_one_is_not() -> None:
    u, y = closed_loop(np.random.default_rng(2), 1_000, 0.8)
    with pytest.warns(LogWarning, match="closed loop"):
        found = identify_channels(channels_from([u], [y], 1e-3, ["u"], "y"), order=1, delay=1)
    assert [one.code for one in found.notes] == [IdentificationCode.FEEDBACK]
    assert found.sound
    u, y = closed_loop(np.random.default_rng(2), 1_000, 0.0)
    assert identify_channels(channels_from([u], [y], 1e-3, ["u"], "y"), order=1, delay=1).notes == ()


def test_a_short_residual_is_refused(plant_30hz: LinearModel) -> None:
    with pytest.raises(HydrostateError, match="200 samples or more"):
        feedback_test(plant_30hz.simulate(np.ones(50)), np.ones(50))


def test_a_log_too_short_for_the_feedback_test_gets_no_note() -> None:
    u, y = closed_loop(np.random.default_rng(1), 4_000, 0.8)
    model = fit_output_error(u, y, 1e-3, n_numerator=1, n_denominator=1, delay=1)
    residual, short = y - model.simulate(u), 8 * DEFAULT_LAGS - 1
    assert feedback_note(residual, u, ("u", "y")) is not None
    assert feedback_note(residual[:short], u[:short], ("u", "y")) is None


def test_the_feedback_test_does_not_simulate_an_unstable_model(recwarn: pytest.WarningsRecorder) -> None:
    unstable: Any = SimpleNamespace(is_stable=False)
    from_record._warn_of_feedback(unstable, np.zeros(10), np.zeros(10))
    assert len(recwarn) == 0


def test_an_unstable_model_is_refused_for_free_runs() -> None:
    unstable: Any = SimpleNamespace(is_stable=False, structure="arx")
    data: Any = SimpleNamespace(output="speed")
    with pytest.raises(HydrostateError, match="the arx model of 'speed' is unstable and does not run free: use"):
        other_structures._free_run_dynamics(unstable, data, data)


def test_swapped_input_and_output_are_noted_and_the_model_is_not_sound() -> None:
    rng = np.random.default_rng(4)
    u = np.repeat(rng.uniform(-1.0, 1.0, 80), 10)
    y = filtered(np.array([0.0, 0.2]), np.array([1.0, -0.9]), u) + 0.01 * rng.normal(size=u.size)
    with pytest.warns(LogWarning, match="exchange --input and --output"):
        found = identify_channels(channels_from([y[:, None]], [u], 0.01, ["pressure"], "valve"), order=1, delay=0)
    assert not found.sound
    (note,) = (one for one in found.notes if one.code == IdentificationCode.SWAPPED)
    assert note.data["back"] < 0.05 < 0.2 < note.data["left"]


def test_a_closed_loop_driven_by_its_set_point_is_not_taken_for_swapped_columns() -> None:
    u, y = closed_loop(np.random.default_rng(5), 2_000, 0.8)
    with pytest.warns(LogWarning, match="closed loop"):
        found = identify_channels(channels_from([u[:, None]], [y], 0.01, ["u"], "y"), order=1, delay=1)
    assert IdentificationCode.SWAPPED not in {note.code for note in found.notes}
