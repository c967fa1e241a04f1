import numpy as np
import pytest
from scipy.signal import lfilter

from estimation.fits.greybox.covariance import (
    FEW_LAGS,
    _autocovariance,
    _meat,
    automatic_lags,
    least_squares_covariance,
)
from estimation.notes import EstimateCode
from plant.errors import LogWarning

NOTHING = np.zeros(2)
"""Prior information on two parameters: none."""


def spread_of_estimates(colour: float, runs: int = 300) -> tuple[float, float, float]:
    """Return the slope's true deviation over many fits, and the mean ones of the white and the coloured formula."""
    n = 600
    columns = np.column_stack([np.ones(n), np.sin(np.arange(n) * 0.01)])
    found, white, coloured = [], [], []
    for seed in range(runs):
        noise = lfilter([1.0], [1.0, -colour], np.random.default_rng(seed).standard_normal(n))
        solution = np.linalg.lstsq(columns, noise, rcond=None)[0]
        residual = noise - columns @ solution
        found.append(solution[1])
        for said, lags in ((white, 0), (coloured, automatic_lags(residual))):
            said.append(least_squares_covariance(columns, residual, n, lags, NOTHING)[1][1, 1])
    return float(np.std(found)), float(np.sqrt(np.mean(white))), float(np.sqrt(np.mean(coloured)))


def test_both_formulas_give_the_true_deviation_in_white_noise() -> None:
    true, white, coloured = spread_of_estimates(0.0)
    assert white == pytest.approx(true, rel=0.12)
    assert coloured == pytest.approx(true, rel=0.15)


def test_coloured_noise_needs_the_sandwich() -> None:
    true, white, coloured = spread_of_estimates(0.8)
    assert white < 0.5 * true
    assert coloured == pytest.approx(true, rel=0.25)


def test_the_bread_is_the_inverse_of_the_normal_equations_however_columns_are_scaled() -> None:
    rng = np.random.default_rng(1)
    columns, residual = rng.standard_normal((250_000, 2)) * [1.0, 1e9], rng.standard_normal(250_000)
    bread, spread = least_squares_covariance(columns, residual, len(residual), 0, NOTHING)
    np.testing.assert_allclose(bread, np.linalg.inv(columns.T @ columns), rtol=1e-9)
    np.testing.assert_allclose(spread, bread * (residual @ residual) / (len(residual) - 2), rtol=1e-9)


def test_collinear_parameters_raise_a_warning() -> None:
    column = np.random.default_rng(2).standard_normal(40)
    with pytest.warns(LogWarning) as caught:
        least_squares_covariance(np.column_stack([column, column]), column, 40, 0, NOTHING)
    assert [one.message.note.code for one in caught] == [EstimateCode.NOT_DETERMINED]


def test_the_warning_points_to_the_caller_of_the_fit() -> None:
    column = np.random.default_rng(2).standard_normal(40)

    def fitted() -> object:
        return least_squares_covariance(np.column_stack([column, column]), column, 40, 0, NOTHING)

    with pytest.warns(LogWarning) as caught:
        fitted()
    assert [one.filename for one in caught] == [__file__]


def test_prior_information_determines_collinear_parameters() -> None:
    rng = np.random.default_rng(3)
    column, noise = rng.standard_normal(4000), rng.standard_normal(4000)
    _, spread = least_squares_covariance(np.column_stack([column, column]), noise, 4000, 0, np.array([0.0, 25.0]))
    assert np.sqrt(np.diag(spread)) == pytest.approx([0.2, 0.2], rel=0.01)
    assert spread.sum() == pytest.approx(1.0 / (column @ column), rel=0.05)


@pytest.mark.parametrize("lags", [0, FEW_LAGS, FEW_LAGS + 1, 400])
def test_an_autocovariance_is_the_windowed_sum_of_products_however_many_lags(lags: int) -> None:
    rng = np.random.default_rng(4)
    residual = np.convolve(rng.standard_normal(3001), np.ones(30), "same")
    residual[700:720] = 0.0
    window = 1.0 - np.arange(lags + 1) / (lags + 1.0)
    summed = [np.sum(residual[lag:] * residual[: len(residual) - lag]) / 2981 for lag in range(lags + 1)]
    assert _autocovariance(residual, 2981, lags) == pytest.approx(window * np.array(summed), rel=1e-9, abs=1e-9)


def test_zero_residuals_need_no_lags() -> None:
    assert automatic_lags(np.zeros(50)) == 0


def test_the_number_of_lags_follows_the_rule_of_andrews() -> None:
    count = 40_000
    noise = np.random.default_rng(2).standard_normal(count)
    coloured = lfilter([1.0], [1.0, -0.6], noise)
    wanted = 1.1447 * (4.0 * 0.36 / (1.0 - 0.36) ** 2 * count) ** (1.0 / 3.0)
    assert automatic_lags(coloured) == pytest.approx(wanted, rel=0.05)


def test_collinear_parameters_have_infinite_variance_without_a_warning() -> None:
    column = np.random.default_rng(1).standard_normal(40)
    _, spread = least_squares_covariance(np.column_stack([column, column]), column, 40, 0, np.zeros(2), warned=False)
    assert np.all(np.isinf(spread))


@pytest.mark.parametrize("lags", [1, 7, FEW_LAGS - 1, FEW_LAGS])
def test_products_with_an_autocovariance_equal_those_with_its_full_matrix(lags: int) -> None:
    rng = np.random.default_rng(8)
    columns, known = rng.normal(size=(200, 3)), rng.normal(size=lags + 1)
    apart = np.abs(np.subtract.outer(np.arange(200), np.arange(200)))
    whole = np.where(apart <= lags, known[np.minimum(apart, lags)], 0.0)
    np.testing.assert_allclose(_meat(columns, known), columns.T @ whole @ columns, rtol=1e-9, atol=1e-9)
