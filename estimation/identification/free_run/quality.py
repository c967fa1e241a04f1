"""One free run of a model, and how well free runs and one-step predictions fit."""

from dataclasses import dataclass

import numpy as np

from estimation.arrays import Array


@dataclass(frozen=True)
class FreeRunQuality:
    """Quality of a model's free run and one-step prediction.

    Parameters
    ----------
    fit_percent, rmse : float
        Of the free run: 100 is perfect, 0 as good as the mean; root-mean-square error [output unit].
    one_step_percent, one_step_rmse : float
        Of the prediction one step ahead from measured outputs [output unit].
    """

    fit_percent: float
    rmse: float
    one_step_percent: float
    one_step_rmse: float

    @classmethod
    def of(cls, measured: Array, free: Array, ahead: Array) -> "FreeRunQuality":
        """Return the quality of a free run and of a prediction one step ahead.

        Parameters
        ----------
        measured, free : ndarray, shape (n,)
            Output, NaN where missing, and its free run [output unit].
        ahead : ndarray, shape (n,)
            The prediction; NaN where there is none [output unit].
        """
        return cls(*_fit(measured, free, running=True), *_fit(measured, ahead, running=False))


@dataclass(frozen=True, eq=False)
class FreeRun:
    """A free run, and what was decided on the way.

    Parameters
    ----------
    output : ndarray, shape (n,)
        Simulated output; NaN from where a polynomial model diverges [output unit].
    errors : tuple of float or None
        Result of `Fallback.errors`, which decides whether a linear model is run instead; None for models without a
        fallback [dimensionless].
    without_error_model : bool
        Whether the model has an error model that these inputs do not determine, so that it was left out.
    """

    output: Array
    errors: tuple[float, float] | None
    without_error_model: bool


def _fit(measured: Array, found: Array, *, running: bool) -> tuple[float, float]:
    """Return fit [%] and root-mean-square error; NaN without samples, or if the free run diverged."""
    known = np.isfinite(measured) & (np.isfinite(found) | running)
    left = (measured - found)[known]
    if left.size == 0:
        return float("nan"), float("nan")
    if not np.isfinite(left).all():
        return float("-inf"), float("inf")
    spread = measured[known] - measured[known].mean()
    power = float(spread @ spread)
    fit = 100.0 * (1.0 - float(np.sqrt(left @ left / power))) if power > 0.0 else float("nan")
    return fit, float(np.sqrt(np.mean(left**2)))
