import json

import control
import numpy as np
import pytest

from estimation.identification import LinearModel
from estimation.identification.model.table import model_table
from plant.errors import HydrostateError


def model(**changes: object) -> LinearModel:
    values: dict[str, object] = {
        "numerator": [0.0, 0.1, 0.05],
        "denominator": [1.0, -1.5, 0.6],
        "sample_time": 1e-3,
        "input_name": "motor_speed_rad_s",
        "output_name": "velocity_m_s",
        "delay": 1,
        "covariance": np.diag([1e-6, 2e-6, 3e-6, 4e-6]),
        "fit_percent": 91.0,
        "rmse": 0.1,
        "residual_std": 0.11,
        "n_samples": 100,
        "data_hash": "abc",
    }
    return LinearModel(**(values | changes))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("b", "f", "delay"),
    [
        ([0.0, 0.1, 0.05], [1.0, -1.5, 0.6], 1),
        ([0.3, 0.1, 0.05], [1.0, -1.5, 0.6], 0),
        ([0.0, 0.0, 0.0, 0.2, 0.1], [1.0, -0.5], 3),
        ([0.2], [1.0, -0.5, 0.1, 0.02], 0),
    ],
)
def test_the_control_object_s_step_response_equals_simulate(b: list[float], f: list[float], delay: int) -> None:
    identified = LinearModel(b, f, 1e-3, "motor_speed_rad_s", "velocity_m_s", delay=delay)
    system = identified.to_control()
    assert system.dt == 1e-3
    assert (system.input_labels, system.output_labels) == (["motor_speed_rad_s"], ["velocity_m_s"])
    response = control.step_response(system, T=1e-3 * np.arange(60)).outputs
    np.testing.assert_allclose(np.squeeze(response), identified.simulate(np.ones(60)), atol=1e-12)


def test_the_initial_state_continues_a_run() -> None:
    u = np.random.default_rng(1).standard_normal(100)
    whole = model().simulate(u)
    free = model().simulate(np.concatenate([u[:40], np.zeros(60)]))
    state = model().initial_state
    assert not state.any()
    tail = model().simulate(u[40:]) + free[40:]
    np.testing.assert_allclose(tail, whole[40:], atol=1e-12)


def test_poles_and_zeros_are_roots_with_dead_time_left_out() -> None:
    np.testing.assert_allclose(np.polyval([1.0, -1.5, 0.6], model().poles), 0.0, atol=1e-12)
    np.testing.assert_allclose(model().zeros, [-0.5])
    assert model().is_stable
    assert not model(denominator=[1.0, -2.5, 0.6]).is_stable


def test_the_gain_s_deviation_agrees_with_drawn_coefficients() -> None:
    identified = model(covariance=1e-2 * np.diag([1e-6, 2e-6, 3e-6, 4e-6]))
    rng = np.random.default_rng(2)
    draws = rng.multivariate_normal([0.1, 0.05, -1.5, 0.6], identified.covariance, size=20_000)
    gains = draws[:, :2].sum(axis=1) / (1.0 + draws[:, 2:].sum(axis=1))
    assert identified.dc_gain == pytest.approx(1.5)
    assert identified.dc_gain_std == pytest.approx(gains.std(), rel=0.03)


def test_the_bandwidth_is_the_frequency_at_three_decibels_below_the_steady_gain() -> None:
    identified = model()
    bandwidth = identified.bandwidth_hz
    assert bandwidth is not None
    gain = np.abs(identified.frequency_response([bandwidth]))[0]
    assert gain == pytest.approx(abs(identified.dc_gain) / np.sqrt(2.0), rel=1e-9)
    first_order = LinearModel([0.0, 0.01], [1.0, -0.99], 1e-3, "u", "y", delay=1)
    assert first_order.bandwidth_hz == pytest.approx(-np.log(0.99) / (2e-3 * np.pi), rel=1e-3)


@pytest.mark.parametrize("place", [0.05, 0.17, 0.3, 0.37])
def test_a_notch_as_narrow_as_a_five_hundredth_of_the_nyquist_frequency_limits_the_bandwidth(place: float) -> None:
    turn, inner = np.pi * place, 0.997
    notch = np.poly(np.exp([1j * turn, -1j * turn])).real
    poles = np.poly(inner * np.exp([1j * turn, -1j * turn])).real
    falling = np.array([1.0, 0.5])  # by itself, 3 dB down at 0.54 of half the sample rate
    found = LinearModel(np.convolve(notch, falling), poles, 1e-3, "u", "y").bandwidth_hz
    assert found is not None
    width = (1.0 - inner) * 500.0 / np.pi  # half the width at which the gain of a narrow notch is 3 dB down
    assert 0.7 < (500.0 * place - found) / width < 1.6


def test_a_model_that_does_not_roll_off_has_no_bandwidth() -> None:
    assert LinearModel([2.0, -1.0], [1.0, -0.5], 1e-3, "u", "y").bandwidth_hz is None


def test_the_frequency_response_agrees_with_python_control() -> None:
    frequency = np.array([0.5, 10.0, 100.0, 450.0])
    expected = model().to_control()(np.exp(2j * np.pi * frequency * 1e-3))
    np.testing.assert_allclose(model().frequency_response(frequency), expected, rtol=1e-10)


@pytest.mark.parametrize("known", [True, False])
def test_json_keeps_every_bit(known: bool) -> None:
    rng = np.random.default_rng(3)
    unknown: dict[str, object] = {"covariance": np.empty(0), "fit_percent": float("nan"), "rmse": float("nan")}
    identified = model(numerator=[0.0, *rng.standard_normal(2)], **({} if known else unknown))
    text = json.dumps(identified.to_dict(), allow_nan=False)
    back = LinearModel.from_dict(json.loads(text))
    for name in ("numerator", "denominator", "covariance", "initial_state", "fit_percent", "rmse"):
        np.testing.assert_array_equal(getattr(back, name), getattr(identified, name))
    assert back.to_dict() == identified.to_dict()


def test_a_dictionary_without_an_entry_is_refused() -> None:
    values = model().to_dict()
    del values["denominator"]
    with pytest.raises(HydrostateError, match="entry 'denominator'"):
        LinearModel.from_dict(values)


def test_arrays_cannot_be_written_and_are_not_shared() -> None:
    b = np.array([0.0, 0.1, 0.05])
    identified = model(numerator=b)
    b[1] = 9.0
    assert identified.numerator[1] == 0.1
    with pytest.raises(ValueError, match="read-only"):
        identified.numerator[1] = 9.0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"sample_time": 0.0}, "sample_time must be positive"),
        ({"denominator": [2.0, 1.0]}, "monic"),
        ({"numerator": [0.1, 0.1, 0.05]}, "1 zeros for the delay"),
        ({"numerator": [0.0, np.nan, 0.05]}, "finite"),
        ({"covariance": np.eye(3)}, r"\(4, 4\), got \(3, 3\)"),
        ({"initial_state": [1.0]}, r"\(2,\), got \(1,\)"),
    ],
)
def test_an_impossible_model_is_refused(changes: dict[str, object], message: str) -> None:
    with pytest.raises(HydrostateError, match=message):
        model(**changes)


def test_the_table_has_one_row_for_each_model() -> None:
    table = model_table({"normal": model(), "published": LinearModel([1.0], [1.0, -0.5], 1e-3, "u", "y")})
    assert list(table.index) == ["normal", "published"]
    assert table.loc["normal", "dc_gain"] == pytest.approx(1.5)
    assert table.loc["normal", "f2"] == 0.6
    assert np.isnan(table.loc["published", "f2"])
    assert np.isnan(table.loc["published", "fit_percent"])


def test_a_noise_denominator_that_is_not_monic_is_refused() -> None:
    for wrong in ([0.9, 0.1], [], [[1.0]]):
        with pytest.raises(HydrostateError, match="noise_denominator must be monic"):
            model(noise_denominator=wrong)


def test_only_a_continuous_model_is_discretised_and_its_exports_stay_continuous() -> None:
    with pytest.raises(HydrostateError, match=r"discretised\(\) is for a model in continuous time"):
        model().discretised()
    continuous = LinearModel([200.0], [1.0, 8.0, 100.0], 1e-3, "u", "y", continuous=True)
    for made in (continuous.to_control(), continuous.to_ss()):
        for frequency in (0.0, 7.0, 40.0):
            at = 1j * frequency
            assert complex(made(at)) == pytest.approx(200.0 / (at * at + 8.0 * at + 100.0))
    one = continuous.discretised()
    assert one.dc_gain == pytest.approx(2.0)
    assert np.sort_complex(one.poles) == pytest.approx(np.sort_complex(np.exp(1e-3 * np.roots([1.0, 8.0, 100.0]))))


@pytest.mark.parametrize("continuous", [False, True])
def test_the_frequency_response_and_its_gradient_equal_those_of_the_polynomials(continuous: bool) -> None:
    late = {"continuous": True, "dead_time": 0.03} if continuous else {"delay": 2}
    b, f = ([0.4, 2.0], [1.0, 0.3, 4.0]) if continuous else ([0.0, 0.0, 0.4, 0.2], [1.0, -1.2, 0.5])
    frequency, T = np.array([0.0, 0.1, 0.7]), 0.1

    def made(numerator: np.ndarray, denominator: np.ndarray) -> LinearModel:
        return LinearModel(numerator, denominator, T, "u", "y", **late)

    response, gradient = made(np.array(b), np.array(f)).response_gradient(frequency)
    s = 2j * np.pi * frequency
    if continuous:
        wanted = np.polyval(b, s) / np.polyval(f, s) * np.exp(-0.03 * s)
    else:
        wanted = np.polyval(b[::-1], np.exp(-s * T)) / np.polyval(f[::-1], np.exp(-s * T))
    np.testing.assert_allclose(response, wanted, rtol=1e-12)
    free = len(b) - late.get("delay", 0)
    values = np.array([*b[len(b) - free :], *f[1:]])
    assert gradient.shape == (3, values.size)
    for k in range(values.size):
        step = np.zeros(values.size)
        step[k] = 1e-6
        sides = [
            made(np.array([*b[: len(b) - free], *one[:free]]), np.array([1.0, *one[free:]])).response_gradient(
                frequency
            )[0]
            for one in (values + step, values - step)
        ]
        np.testing.assert_allclose(gradient[:, k], (sides[0] - sides[1]) / 2e-6, rtol=1e-6, atol=1e-8)
