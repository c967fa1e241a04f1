"""Where runs of polynomial models begin, which samples are used, and what they take over from a linear model."""

import numpy as np
import pytest

from estimation.arrays import Array
from estimation.identification.free_run.data import Channels
from estimation.identification.free_run.linear_fit import fit_linear
from estimation.identification.free_run.linear_problem import Form
from estimation.identification.free_run.output_friction import _first_outputs
from estimation.identification.free_run.polynomial_fit import Runs, first_values, variables_of
from estimation.identification.free_run.polynomial_variables import SIGNAL_MARGIN, Variables

SIZES = (60, 90)


def logs(noise: float = 0.0) -> Channels:
    """Return two logs of ``y = 1.2 y[-1] - 0.5 y[-2] + 0.3 u[-3] + 0.1 u[-4] + 0.2``; inputs were constant before."""
    rng = np.random.default_rng(7)
    inputs, outputs = list[Array](), list[Array]()
    for n in SIZES:
        u, y = rng.normal(size=n + 10), np.zeros(n + 10)
        u[:11] = u[10]
        for t in range(4, n + 10):
            y[t] = 1.2 * y[t - 1] - 0.5 * y[t - 2] + 0.3 * u[t - 3] + 0.1 * u[t - 4] + 0.2
        inputs.append(u[10:, None])
        outputs.append(y[10:] + noise * rng.normal(size=n))
    return Channels(("u",), "y", 1.0, tuple(inputs), tuple(outputs))


VARIABLES = Variables(np.array([0, 0, 1, 1]), np.array([1, 2, 3, 4]), np.zeros((4, 2)))
LINEAR = np.array([[-1, -1, -1], *([k, -1, -1] for k in range(4))])


def test_a_run_begins_after_the_longest_input_lag_or_on_request_after_the_output_lags() -> None:
    data = logs()
    late, early = Runs(VARIABLES, LINEAR, data), Runs(VARIABLES, LINEAR, data, early=True)
    assert late.begins == [4, 4]
    assert early.begins == [2, 2]
    assert np.flatnonzero(~late.used).tolist() == [0, 1, SIZES[0], SIZES[0] + 1]
    assert early.used.all()
    assert np.array_equal(late.start_values(), [*data.y[0][2:4], *data.y[1][2:4]])
    assert np.array_equal(early.start_values(), [*data.y[0][:2], *data.y[1][:2]])
    short = Channels(("u",), "y", 1.0, (data.u[0][:3],), (data.y[0][:3],))
    assert Runs(VARIABLES, LINEAR, short).begins == [3]


def test_the_run_of_the_true_model_equals_the_measured_output_without_noise() -> None:
    data = logs()
    runs = Runs(VARIABLES, LINEAR, data)
    ran = runs.outputs(np.array([0.2, 1.2, -0.5, 0.3, 0.1, *runs.start_values()]))
    assert ran == pytest.approx(np.concatenate(data.y), abs=1e-12)


def test_coefficients_constant_and_first_outputs_are_taken_from_the_linear_model() -> None:
    data = logs(1e-6)
    linear = fit_linear(Form(2, (2,), (3,)), data)
    variables, terms, values = variables_of(linear, data)
    assert variables.source.tolist() == [0, 0, 1, 1]
    assert variables.lag.tolist() == [1, 2, 3, 4]
    assert terms.tolist() == LINEAR.tolist()
    assert values == pytest.approx([0.2, 1.2, -0.5, 0.3, 0.1], abs=1e-4)
    runs = Runs(variables, terms, data)
    assert _first_outputs(linear, runs, data) == pytest.approx(runs.start_values(), abs=1e-4)


def test_ranges_are_the_measured_ones_widened_by_a_share() -> None:
    data = logs()
    variables = variables_of(fit_linear(Form(2, (2,), (3,)), data), data)[0]
    seen = np.concatenate(data.y)
    low, high = float(seen.min()), float(seen.max())
    assert variables.ends == pytest.approx([low, high])
    assert variables.extended_ends(0.25) == pytest.approx([1.25 * low - 0.25 * high, 1.25 * high - 0.25 * low])
    u = np.concatenate(data.u)[:, 0]
    reach = SIGNAL_MARGIN * (u.max() - u.min())
    assert variables.limits[2:] == pytest.approx(np.array([[u.min() - reach, u.max() + reach]] * 2))


def test_gaps_in_the_first_outputs_are_filled_with_the_first_measured_one() -> None:
    y = np.array([np.nan, np.nan, 3.0, np.nan, 5.0])
    assert first_values(y, 4).tolist() == [3.0, 3.0, 3.0, 3.0]
    assert first_values(np.full(3, np.nan), 2).tolist() == [0.0, 0.0]
    assert first_values(np.array([1.0, np.nan, 3.0]), 3).tolist() == [1.0, 1.0, 3.0]
