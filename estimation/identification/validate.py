"""Whether an identified model may be believed: fit, residual whiteness, what of the input is left in it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import chi2

from estimation.identification.criterion import Structure, profile, sensitivities
from estimation.identification.linear_model import FloatArray, LinearModel
from estimation.identification.starts import lagged
from plant.errors import HydrostateError

DEFAULT_LAGS = 25
"""Lags that the residual tests look at."""


@dataclass(frozen=True)
class ResidualTest:
    """A chi-square test of a residual.

    Parameters
    ----------
    statistic : float
        The test statistic [dimensionless].
    degrees_of_freedom : int
        Of its chi-square distribution under the null hypothesis.
    p_value : float
        Probability of a statistic at least this large if the model is right.
    """

    statistic: float
    degrees_of_freedom: int
    p_value: float

    def passed(self, level: float = 0.05) -> bool:
        """Return whether the model survives.

        Parameters
        ----------
        level : float
            Significance level [probability].

        Returns
        -------
        bool
            True where the statistic is no surprise.
        """
        return self.p_value >= level


@dataclass(frozen=True)
class Validation:
    """How well a model simulates a log.

    Parameters
    ----------
    fit_percent : float
        Normalised fit.
    rmse : float
        Root-mean-square residual [output unit].
    whiteness : ResidualTest
        Ljung-Box test of the residual against itself.
    cross_correlation : ResidualTest
        Test of the residual against the input.
    """

    fit_percent: float
    rmse: float
    whiteness: ResidualTest
    cross_correlation: ResidualTest


def fit_percent(y: ArrayLike, simulated: ArrayLike) -> float:
    """Return ``100 (1 - |y - yhat| / |y - mean y|)`` over the samples that are there.

    Parameters
    ----------
    y : array_like, shape (n,)
        Measured output; NaN where missing.
    simulated : array_like, shape (n,)
        Model output.

    Returns
    -------
    float
        100 is perfect, 0 as good as the mean; negative is worse.

    Examples
    --------
    >>> fit_percent([0.0, 1.0, 2.0], [1.0, 1.0, 1.0])
    0.0
    """
    measured, model = _together(y, simulated)
    return float(100.0 * (1.0 - np.linalg.norm(measured - model) / np.linalg.norm(measured - measured.mean())))


def rmse(y: ArrayLike, simulated: ArrayLike) -> float:
    """Return the root-mean-square difference over the samples that are there.

    Parameters
    ----------
    y : array_like, shape (n,)
        Measured output; NaN where missing.
    simulated : array_like, shape (n,)
        Model output.

    Returns
    -------
    float
        In the output's unit.

    Examples
    --------
    >>> rmse([0.0, float("nan"), 2.0], [1.0, 1.0, 1.0])
    1.0
    """
    measured, model = _together(y, simulated)
    return float(np.sqrt(np.mean((measured - model) ** 2)))


def ljung_box(residual: ArrayLike, *, n_lags: int = DEFAULT_LAGS, n_parameters: int = 0) -> ResidualTest:
    """Test whether a residual is white (Ljung and Box, 1978).

    Parameters
    ----------
    residual : array_like, shape (n,)
        NaN where missing.
    n_lags : int
        Lags counted.
    n_parameters : int
        Parameters of a *noise* model fitted to it; none for output error.

    Returns
    -------
    ResidualTest
        A small p-value says that the residual is coloured: the fit may stand, its white-noise covariance not.

    Raises
    ------
    HydrostateError
        If there are not more samples than lags, or not more lags than parameters.
    """
    values = np.asarray(residual, dtype=np.float64)
    known = np.isfinite(values)
    n = int(known.sum())
    if n <= n_lags or n_lags <= n_parameters:
        raise HydrostateError(
            f"a whiteness test needs n_parameters < n_lags < samples, got {n_parameters}, {n_lags} and {n}"
        )
    centred = np.where(known, values - values[known].mean(), 0.0)
    weight = known.astype(np.float64)
    variance = float(centred @ centred) / n
    lags = np.arange(1, n_lags + 1)
    pairs = np.maximum([weight[k:] @ weight[:-k] for k in lags], 1.0)
    correlation = np.array([centred[k:] @ centred[:-k] for k in lags]) / (pairs * variance)
    # with every sample there, pairs is n - k and this is n (n + 2) sum(r_k^2 / (n - k)), r_k divided by n
    statistic = float((n + 2.0) / n * np.sum(pairs * correlation**2))
    return _chi_square(statistic, n_lags - n_parameters)


def cross_correlation_test(
    residual: ArrayLike,
    u: ArrayLike,
    *,
    n_lags: int = DEFAULT_LAGS,
    jacobian: ArrayLike | None = None,
) -> ResidualTest:
    """Test whether past inputs are left in a residual.

    The residual is projected on the lagged inputs, from which what the fit could already absorb (the columns
    of `jacobian`) has been removed; without that step the usual statistic rejects a right model too often.

    Parameters
    ----------
    residual : array_like, shape (n,)
        White if the model is right; NaN where missing.
    u : array_like, shape (n,)
        Input, no gaps.
    n_lags : int
        Lags 0 to ``n_lags`` are counted.
    jacobian : array_like, shape (n, p), optional
        Sensitivities of the model's output, if the model was fitted to these data.

    Returns
    -------
    ResidualTest
        A small p-value says that a better model exists: another order, delay, or a nonlinearity.

    Raises
    ------
    HydrostateError
        If the arrays do not match, or there are too few samples.
    """
    values, inputs = np.asarray(residual, dtype=np.float64), np.asarray(u, dtype=np.float64)
    if values.shape != inputs.shape:
        raise HydrostateError(f"residual and input must match, got shapes {values.shape} and {inputs.shape}")
    known = np.isfinite(values)
    known[:n_lags] = False
    absorbed = np.ones((values.size, 1)) if jacobian is None else np.asarray(jacobian, dtype=np.float64)
    columns = _without(absorbed[known], _unit(lagged(inputs, 0, n_lags + 1)[known]))
    left, strength, _ = np.linalg.svd(columns, full_matrices=False)
    rank = int(np.count_nonzero(strength > max(columns.shape) * np.finfo(float).eps * 1e2 * strength[0]))
    freedom = int(known.sum()) - absorbed.shape[1]
    if freedom <= rank:
        raise HydrostateError(f"a cross-correlation test over {n_lags} lags needs more samples, got {known.sum()}")
    remaining = values[known]
    if jacobian is None:
        remaining = remaining - remaining.mean()
    variance = float(remaining @ remaining) / freedom
    statistic = float(np.sum((left[:, :rank].T @ remaining) ** 2)) / variance
    return _chi_square(statistic, rank)


def estimate_initial_state(model: LinearModel, u: ArrayLike, y: ArrayLike) -> FloatArray:
    """Return the initial state with which a model simulates a log best.

    Parameters
    ----------
    model : LinearModel
        Held as it is.
    u : array_like, shape (n,)
        Input, no gaps.
    y : array_like, shape (n,)
        Measured output; NaN where missing.

    Returns
    -------
    ndarray, shape (len(model.initial_state),)
        For ``model.simulate(u, initial=...)``.
    """
    outputs = np.asarray(y, dtype=np.float64)
    missing = outputs - model.simulate(u)
    # beside a zero input only the initial state is free
    structure = Structure(1, model.denominator.size - 1, model.initial_state.size)
    known = np.isfinite(missing)
    theta = profile(structure, model.denominator, np.zeros(outputs.size), np.where(known, missing, 0.0), known)[1]
    return theta[model.denominator.size : model.denominator.size + model.initial_state.size]


def validate(
    model: LinearModel, u: ArrayLike, y: ArrayLike, *, fitted: bool = False, n_lags: int = DEFAULT_LAGS
) -> Validation:
    """Return how well a model simulates a log, from the initial state that suits it best.

    Parameters
    ----------
    model : LinearModel
        The model.
    u : array_like, shape (n,)
        Input, no gaps.
    y : array_like, shape (n,)
        Measured output; NaN where missing.
    fitted : bool
        Whether the model was fitted to these very data, which the cross-correlation test must know.
    n_lags : int
        Lags of both residual tests.

    Returns
    -------
    Validation
        Fit, RMSE and both tests.
    """
    inputs, outputs = np.asarray(u, dtype=np.float64), np.asarray(y, dtype=np.float64)
    state = model.initial_state if fitted else estimate_initial_state(model, inputs, outputs)
    simulated = model.simulate(inputs, initial=state)
    jacobian: FloatArray | None = None
    if fitted:
        n_b = model.numerator.size - model.delay
        structure = Structure(n_b, model.denominator.size - 1, model.delay)
        theta = np.concatenate([model.numerator[model.delay :], model.denominator[1:], state])
        jacobian = sensitivities(structure, theta, inputs)
    return Validation(
        fit_percent(outputs, simulated),
        rmse(outputs, simulated),
        ljung_box(outputs - simulated, n_lags=n_lags),
        cross_correlation_test(outputs - simulated, inputs, n_lags=n_lags, jacobian=jacobian),
    )


def _together(y: ArrayLike, simulated: ArrayLike) -> tuple[FloatArray, FloatArray]:
    measured, model = np.asarray(y, dtype=np.float64), np.asarray(simulated, dtype=np.float64)
    if measured.shape != model.shape:
        raise HydrostateError(f"measured and simulated output must match, got {measured.shape} and {model.shape}")
    known = np.isfinite(measured)
    if not known.any():
        raise HydrostateError("at least one measured sample is wanted, got none")
    return measured[known], model[known]


def _unit(columns: FloatArray) -> FloatArray:
    scale = np.linalg.norm(columns, axis=0)
    return columns / np.where(scale > 0.0, scale, 1.0)


def _without(absorbed: FloatArray, columns: FloatArray) -> FloatArray:
    basis = np.linalg.qr(_unit(absorbed))[0]
    return columns - basis @ (basis.T @ columns)


def _chi_square(statistic: float, freedom: int) -> ResidualTest:
    return ResidualTest(statistic, freedom, float(chi2.sf(statistic, freedom)))
