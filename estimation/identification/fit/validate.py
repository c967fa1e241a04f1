"""Validates an identified model: fit, whiteness of the residual, and its dependence on the input."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from estimation.arrays import Array
from estimation.identification.fit.residual_tests import DEFAULT_LAGS, ResidualTest, cross_correlation_test, ljung_box
from estimation.identification.model.linear_model import LinearModel
from estimation.identification.search.criterion import Structure, profile, sensitivities
from plant.errors import HydrostateError


@dataclass(frozen=True)
class Validation:
    """Quality of a model's simulation of a log.

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
    """Return ``100 (1 - |y - yhat| / |y - mean y|)`` over the samples that are present.

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
    measured, model = _present_pairs(y, simulated)
    return float(100.0 * (1.0 - np.linalg.norm(measured - model) / np.linalg.norm(measured - measured.mean())))


def rmse(y: ArrayLike, simulated: ArrayLike) -> float:
    """Return the root-mean-square difference over the samples that are present.

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
    measured, model = _present_pairs(y, simulated)
    return float(np.sqrt(np.mean((measured - model) ** 2)))


def estimate_initial_state(model: LinearModel, u: ArrayLike, y: ArrayLike) -> Array:
    """Return the initial state with which a model simulates a log best.

    Parameters
    ----------
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
    # with a zero input only the initial state is free
    structure = Structure(1, model.denominator.size - 1, model.initial_state.size)
    known = np.isfinite(missing)
    theta = profile(structure, model.denominator, np.zeros(outputs.size), np.where(known, missing, 0.0), known)[1]
    return theta[model.denominator.size : model.denominator.size + model.initial_state.size]


def validate(
    model: LinearModel, u: ArrayLike, y: ArrayLike, *, fitted: bool = False, n_lags: int = DEFAULT_LAGS
) -> Validation:
    """Return the quality of a model's simulation of a log, from the best initial state.

    Parameters
    ----------
    u : array_like, shape (n,)
        Input, no gaps.
    y : array_like, shape (n,)
        Measured output; NaN where missing.
    fitted : bool
        Whether the model was fitted to these very data, which the cross-correlation test must know.
    """
    inputs, outputs = np.asarray(u, dtype=np.float64), np.asarray(y, dtype=np.float64)
    state = model.initial_state if fitted else estimate_initial_state(model, inputs, outputs)
    simulated = model.simulate(inputs, initial=state)
    jacobian: Array | None = None
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


def _present_pairs(y: ArrayLike, simulated: ArrayLike) -> tuple[Array, Array]:
    measured, model = np.asarray(y, dtype=np.float64), np.asarray(simulated, dtype=np.float64)
    if measured.shape != model.shape:
        raise HydrostateError(f"measured and simulated output must match, got {measured.shape} and {model.shape}")
    known = np.isfinite(measured)
    if not known.any():
        raise HydrostateError("at least one measured sample is needed, got none")
    return measured[known], model[known]
