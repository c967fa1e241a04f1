"""From fitted values to the one result type: scaling undone, both covariances, quality of fit."""

import warnings
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from estimation.arrays import Array
from estimation.identification.fit.covariances import covariances
from estimation.identification.fit.residual_tests import ljung_box
from estimation.identification.model.linear_model import LinearModel
from estimation.identification.model.recursion import filtered
from estimation.identification.notes import IdentificationCode
from estimation.identification.search.experiments import Experiments, data_hash
from estimation.notes import EstimateCode
from plant.errors import CovarianceWarning, HydrostateError, LogWarning

CovarianceKind = Literal["white", "coloured", "auto"]

COLOURED = 1e-3
"""p-value of the whiteness test below which ``covariance="auto"`` takes the robust covariance."""


class NoEffectError(HydrostateError):
    """A model of the wanted size explains no more of the output than chance would."""


def scaled(data: Experiments) -> tuple[Experiments, float, float]:
    """Return the data with input and output of order one, and their root mean squares.

    Parameters
    ----------
    data : Experiments
        In any unit.

    Returns
    -------
    data : Experiments
        Divided.
    u_scale, y_scale : float
        What by [input unit], [output unit].
    """
    u_scale = float(np.sqrt(np.mean(data.u**2)))
    y_scale = float(np.sqrt(np.sum(data.y**2) / data.n_used))
    return replace(data, u=data.u / u_scale, y=data.y / y_scale), u_scale, y_scale


def fitted_model(
    values: tuple[Array, Array, Array],
    jacobian: Array,
    residual: Array,
    data: Experiments,
    scales: tuple[float, float],
    *,
    sample_time: float,
    delay: int,
    covariance: CovarianceKind,
    names: tuple[str, str],
    structure: str,
    noise: tuple[Array, Array] | None = None,
) -> LinearModel:
    """Return the result of a fit to scaled data.

    Parameters
    ----------
    values : tuple of ndarray, shapes (n_b,), (n_f,) and (n_states,)
        Free numerator, denominator behind its 1, initial state of the first experiment.
    jacobian : ndarray, shape (n, p)
        Derivative of the prediction, numerator and denominator first.
    residual : ndarray, shape (n,)
        Prediction error; 0 where the output is missing.
    data : Experiments
        The scaled data.
    scales : tuple of float
        Root mean squares that the data were divided by [input unit, output unit].
    sample_time : float
        Seconds between samples [s].
    delay : int
        Dead time [samples].
    covariance : {"white", "coloured", "auto"}
        Which one the standard deviations use.
    names : tuple of str
        Input and output channel.
    structure : str
        What was fitted.
    noise : tuple of ndarray, shapes (n_c + 1,) and (n_d + 1,), optional
        C and D, monic.

    Returns
    -------
    LinearModel
        In the data's units.

    Raises
    ------
    NoEffectError
        If the model is no better than none by BIC.

    Warns
    -----
    LogWarning
        If the model is unstable, the coefficients are not separately determined, or a pole nearly cancels a zero.
    """
    b, f, state = values
    u_scale, y_scale = scales
    n_main = b.size + f.size
    unscale = np.concatenate([np.full(b.size, y_scale / u_scale), np.ones(f.size)])
    *spreads, determined = covariances(jacobian, residual, data)
    white, robust = (spread[:n_main, :n_main] * np.outer(unscale, unscale) for spread in spreads)
    if covariance == "auto":
        coloured = ljung_box(np.where(data.used, residual, np.nan)).p_value < COLOURED
    else:
        coloured = covariance == "coloured"
    rss, n_used = float(residual @ residual) * y_scale**2, data.n_used
    if noise is None:
        _require_effect(rss, float(data.y @ data.y) * y_scale**2, n_used, n_main, names)
    whole = replace(data, u=data.u * u_scale, y=data.y * y_scale)
    model = LinearModel(
        numerator=np.concatenate([np.zeros(delay), b * (y_scale / u_scale)]),
        denominator=np.concatenate([[1.0], f]),
        sample_time=sample_time,
        input_name=names[0],
        output_name=names[1],
        delay=delay,
        covariance=robust if coloured else white,
        initial_state=state * y_scale,
        fit_percent=_simulated_fit(values, delay, residual if noise is None else None, data),
        rmse=float(np.sqrt(rss / n_used)),
        residual_std=float(np.sqrt(rss / (n_used - jacobian.shape[1]))),
        n_samples=n_used,
        data_hash=data_hash(whole, sample_time),
        covariance_white=white,
        covariance_robust=robust,
        structure=structure,
        **_noise(noise),
    )
    _warn(model, determined)
    return model


def _require_effect(rss: float, power: float, n_used: int, n_parameters: int, names: tuple[str, str]) -> None:
    """Refuse a model that by BIC is no better than none: whatever its coefficients, they would be of noise."""
    if rss > 0.0 and n_used * np.log(power / rss) < n_parameters * np.log(n_used):
        raise NoEffectError(
            f"input {names[0]!r} does not move {names[1]!r} above its noise: by BIC the model explains no more than "
            "chance would; use a stronger or livelier input, or another order"
        )


def _noise(noise: tuple[Array, Array] | None) -> dict[str, Any]:
    return {} if noise is None else {"noise_numerator": noise[0], "noise_denominator": noise[1]}


def _simulated_fit(values: tuple[Array, Array, Array], delay: int, residual: Array | None, data: Experiments) -> float:
    """Return the fit of the simulation from the fitted initial state; with a noise model, of the first experiment."""
    deviation = data.y[data.used] - data.y[data.used].mean()
    if residual is None:
        b, f, state = values
        part = data.slices[0]
        with np.errstate(over="ignore", invalid="ignore"):
            numerator, denominator = np.concatenate([np.zeros(delay), b]), np.concatenate([[1.0], f])
            output = filtered(numerator, denominator, data.u[part], state)
            residual = np.where(data.used[part], data.y[part] - output, 0.0)
            measured = data.y[part][data.used[part]]
            deviation = measured - measured.mean()
            total = float(residual @ residual)
        if not np.isfinite(total):
            return float("nan")
    return 100.0 * (1.0 - float(np.sqrt((residual @ residual) / (deviation @ deviation))))


def _warn(model: LinearModel, determined: bool) -> None:
    if not model.is_stable:
        modulus = float(np.abs(model.poles[0]))
        unstable = IdentificationCode.UNSTABLE.note(structure=model.structure, modulus=modulus)
        warnings.warn(LogWarning(unstable), stacklevel=4)
    if not determined:
        warnings.warn(CovarianceWarning(EstimateCode.NOT_DETERMINED.note()), stacklevel=4)
    elif model.cancellations:
        pair = model.cancellations[0]
        near = IdentificationCode.NEARLY_CANCEL.note(
            pole=f"{pair.pole:.4g}", zero=f"{pair.zero:.4g}", deviations=pair.deviations
        )
        warnings.warn(CovarianceWarning(near), stacklevel=4)
