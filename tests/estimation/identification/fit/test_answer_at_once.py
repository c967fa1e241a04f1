import numpy as np
import pytest

from estimation.identification import LinearModel, fit_output_error, identify_record
from estimation.identification.fit.answer_at_once import answer_at_once, at_once_note
from estimation.identification.free_run.data import channels_from
from estimation.identification.free_run.identify import identify_channels
from estimation.identification.model.recursion import filtered
from estimation.identification.notes import IdentificationCode
from plant.errors import LogWarning
from plant.log.record import Record

COUNT = 2_000


def at_once_loop(seed: int, colour: float = 0.5, gain: float = 2.0) -> tuple[np.ndarray, np.ndarray]:
    """Return input and output of y = 0.1 / (1 - 0.9 q^-1) q^-1 u + AR(1) noise; u = gain (reference - y), same row."""
    rng = np.random.default_rng([464, seed])
    reference, noise = np.repeat(rng.choice([-1.0, 1.0], COUNT // 10), 10), np.zeros(COUNT)
    u, y, x = np.zeros(COUNT), np.zeros(COUNT), 0.0
    for t in range(COUNT):
        noise[t] = colour * noise[t - 1] + 0.2 * (1.0 - colour**2) ** 0.5 * rng.standard_normal()
        y[t] = x + noise[t]
        u[t] = gain * (reference[t] - (y[t] if gain > 0.0 else 0.0)) if gain else reference[t]
        x = 0.9 * x + 0.1 * u[t]
    return u, y


def codes(u: np.ndarray, y: np.ndarray, **asked: object) -> set[str]:
    found = identify_channels(channels_from([u], [y], 0.01, ["u"], "y"), **asked)  # pyright: ignore[reportArgumentType]
    return {str(note.code) for note in found.notes}


@pytest.mark.parametrize("structure", ["output-error", "box-jenkins"])
def test_a_controller_that_answers_within_one_sample_is_named(structure: str) -> None:
    u, y = at_once_loop(1)
    with pytest.warns(LogWarning, match="of the same row"):
        assert "feedback_at_once" in codes(u, y, structure=structure, order=1, delay=0)


@pytest.mark.slow
def test_box_jenkins_with_a_delay_holds_in_such_a_loop_and_is_not_accused() -> None:
    off = {0: list[float](), 1: list[float]()}
    for seed in range(6):
        channels = channels_from([(one := at_once_loop(seed))[0]], [one[1]], 0.01, ["u"], "y")
        for delay, errors in off.items():
            asked = {"structure": "box-jenkins", "order": 1, "n_numerator": 2 - delay, "delay": delay}
            if delay:
                found = identify_channels(channels, **asked)  # pyright: ignore[reportArgumentType]
                assert "feedback_at_once" not in {note.code for note in found.notes}
            else:
                with pytest.warns(LogWarning, match="of the same row"):
                    found = identify_channels(channels, **asked)  # pyright: ignore[reportArgumentType]
            model = found.model.linear
            assert model is not None
            errors.append((model.dc_gain - 1.0) / model.dc_gain_std)
    assert float(np.mean(np.square(off[0]))) > 2.0**2
    assert float(np.mean(np.square(off[1]))) < 1.6**2


@pytest.mark.slow
def test_a_nonlinear_model_of_a_closed_loop_says_so_however_well_it_fits() -> None:
    u, y = at_once_loop(1)
    with pytest.warns(LogWarning, match="closed loop"):
        found = identify_channels(channels_from([u], [y], 0.01, ["u"], "y"), structure="auto")
    assert found.model.structure == "narx"
    assert found.held_back_percent > 80.0  # it tells the two values of the set-point from each other
    assert "feedback_at_once" in {str(note.code) for note in found.notes}


def test_the_default_model_of_a_record_warns_too() -> None:
    u, y = at_once_loop(2)
    record = Record(1e-3, {"motor_speed_rad_s": u, "velocity_m_s": y})
    with pytest.warns(LogWarning) as caught:
        identify_record(record)
    told = {one.message.note.code for one in caught if isinstance(one.message, LogWarning)}
    assert IdentificationCode.FEEDBACK_AT_ONCE in told


def test_the_coefficient_has_the_deviation_that_it_states_in_open_loop() -> None:
    told = list[float]()
    for seed in range(200):
        rng = np.random.default_rng([4641, seed])
        u = np.repeat(rng.choice([-1.0, 1.0], 60), 10)
        y = filtered(np.array([0.0, 0.1]), np.array([1.0, -0.9]), u) + 0.1 * rng.standard_normal(u.size)
        slope, deviation = answer_at_once(u, y)
        told.append(slope / deviation)
    assert 0.7 < float(np.std(told)) < 1.15
    assert abs(float(np.mean(told))) < 0.2


def test_an_answer_at_once_is_measured_also_behind_missing_samples() -> None:
    rng = np.random.default_rng(5)
    u = rng.standard_normal(4_000)
    y = filtered(np.array([-0.3, 0.5]), np.array([1.0, -0.7]), u) + 0.1 * rng.standard_normal(u.size)
    y[::100] = np.nan
    slope, deviation = answer_at_once(u, y)
    assert abs(slope + 0.3) < 4.0 * deviation < 0.05


def test_what_the_past_foretells_tells_nothing() -> None:
    t = np.arange(1_000.0)
    rng = np.random.default_rng(6)
    assert np.isnan(answer_at_once(np.sin(0.05 * t), rng.standard_normal(t.size))).all()
    assert np.isnan(answer_at_once(rng.standard_normal(t.size), np.sin(0.05 * t))).all()
    assert np.isnan(answer_at_once(rng.standard_normal(90), rng.standard_normal(90))).all()
    gaps = np.where(t % 5 == 0, rng.standard_normal(t.size), np.nan)
    assert np.isnan(answer_at_once(rng.standard_normal(t.size), gaps)).all()


def fitted(b: list[float], f: list[float], noise: float) -> tuple[LinearModel, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(7)
    u = np.repeat(rng.choice([-1.0, 1.0], 200), 5)
    y = filtered(np.array(b), np.array(f), u) + noise * rng.standard_normal(u.size)
    return fit_output_error(u, y, 0.01, n_numerator=2, n_denominator=1), u, y


def test_an_answer_in_the_direction_of_the_gain_or_larger_than_it_is_the_plants() -> None:
    assert at_once_note(*fitted([0.3, 0.1], [1.0, -0.7], 0.05)) is None
    assert at_once_note(*fitted([-1.0, 1.02], [1.0, -0.9], 0.05)) is None  # an acceleration: all at once, hardly a gain
    told = at_once_note(*fitted([-0.2, 0.5], [1.0, -0.7], 0.05))
    assert told is not None
    assert told.data["p_value"] < 1e-6


def test_an_output_that_integrates_has_the_sign_of_its_numerator() -> None:
    rng = np.random.default_rng(8)
    u = np.repeat(rng.choice([-1.0, 1.0], 200), 5)
    y = filtered(np.array([-0.2, 0.5]), np.array([1.0, -1.0]), u) + 0.05 * rng.standard_normal(u.size)
    model = LinearModel(
        numerator=np.array([-0.2, 0.5]),
        denominator=np.array([1.0, -1.0]),
        delay=0,
        sample_time=0.01,
        input_name="u",
        output_name="y",
        structure="output-error",
        covariance=1e-6 * np.eye(3),
    )
    assert at_once_note(model, u, y) is not None


def test_a_log_too_short_gets_no_note() -> None:
    model, u, y = fitted([-0.2, 0.5], [1.0, -0.7], 0.001)
    assert at_once_note(model, u[:200], y[:200]) is not None
    assert at_once_note(model, u[:199], y[:199]) is None
