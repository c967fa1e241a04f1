"""From fitted values to the common result type: original units, both covariances, quality of fit."""

import warnings
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from estimation.arrays import Array
from estimation.identification.fit.covariances import covariances, is_coloured
from estimation.identification.model.linear_model import LinearModel
from estimation.identification.model.recursion import filtered
from estimation.identification.notes import IdentificationCode
from estimation.identification.search.criterion import Structure
from estimation.identification.search.experiments import (
    SAMPLES_PER_PARAMETER,
    Experiments,
    Signals,
    data_hash,
    experiments_from,
)
from estimation.notes import EstimateCode
from plant.errors import CovarianceWarning, HydrostateError, LogWarning

CovarianceKind = Literal["white", "coloured", "auto"]


class NoEffectError(HydrostateError):
    """A model of the wanted size explains no more of the output than chance would."""


@dataclass(frozen=True)
class Task:
    """Specification of a fit.

    Parameters
    ----------
    form : Structure
        Orders of ``B/F``.
    sample_time : float
        Seconds between samples [s].
    covariance : {"white", "coloured", "auto"}
        Which one the standard deviations use.
    n_c, n_d : int
        Coefficients of the noise model behind their 1.
    estimate_offset : bool
        Whether a constant is added to the output, and fitted along.
    """

    form: Structure
    sample_time: float
    covariance: CovarianceKind
    names: tuple[str, str]
    n_c: int = 0
    n_d: int = 0
    estimate_offset: bool = False

    def experiments(self, u: Signals, y: Signals) -> Experiments:
        """Return checked experiments of order one, long and lively enough for the orders.

        Parameters
        ----------
        u, y : array_like of shape (n,), or a sequence of them
            Input, no gaps; output, NaN where missing.

        Raises
        ------
        HydrostateError
            If an order is not usable, or as `experiments_from`.
        """
        form = self.form
        n_b, n_f = form.n_numerator, form.n_denominator
        positive, others = (
            {"n_numerator": n_b, "n_denominator": n_f},
            {"delay": form.delay, "n_c": self.n_c, "n_d": self.n_d},
        )
        for least, sizes in ((1, positive), (0, others)):
            for name, size in sizes.items():
                if size < least:
                    raise HydrostateError(f"{name} must be at least {least}, got {size}")
        n_wanted = SAMPLES_PER_PARAMETER * (form.n_parameters + self.n_c + self.n_d)
        return experiments_from(u, y, self.names, n_excited=form.n_main, n_wanted=n_wanted).scaled()

    def model(
        self,
        theta: Array,
        jacobian: Array,
        residual: Array,
        data: Experiments,
        structure: str,
        noise: tuple[Array, Array] | None = None,
        offset: float = 0.0,
    ) -> LinearModel:
        """Return the result of a fit to scaled data, in the data's units.

        Parameters
        ----------
        theta : ndarray, shape (n_numerator + n_denominator + n_initial,) or longer
            Free numerator, denominator behind its 1, initial states.
        jacobian : ndarray, shape (n, p)
            Derivative of the prediction, numerator and denominator first.
        residual : ndarray, shape (n,)
            Prediction error; 0 where the output is missing.
        noise : tuple of ndarray, shapes (n_c + 1,) and (n_d + 1,), optional
            C and D, monic.
        offset : float
            Fitted constant of the scaled output [dimensionless].

        Raises
        ------
        NoEffectError
            If the model is no better than none by BIC.

        Warns
        -----
        LogWarning
            If the model is unstable, the coefficients are not separately determined, or a pole nearly cancels a zero.
        """
        form, gain = self.form, data.y_scale / data.u_scale
        b, f, state = form.split(theta[: form.n_parameters])
        n_main = form.n_main
        unscale = np.concatenate([np.full(form.n_numerator, gain), np.ones(form.n_denominator)])
        *spreads, determined = covariances(jacobian, residual, data)
        white, robust = (spread[:n_main, :n_main] * np.outer(unscale, unscale) for spread in spreads)
        coloured = is_robust(self.covariance, residual, data)
        found = quality(residual, data, jacobian.shape[1])
        if noise is None:
            _require_effect(float(residual @ residual), float(data.y @ data.y), data.n_used, n_main, self.names)
        else:
            fit, error = _simulated_fit(b, f, state, without_offset(data, offset))
            found |= {"noise_numerator": noise[0], "noise_denominator": noise[1], "fit_percent": fit}
            found |= {"rmse": error * data.y_scale, "one_step_rmse": found["rmse"]}
        whole = replace(data, u=data.u * data.u_scale, y=data.y * data.y_scale)
        model = LinearModel(
            numerator=b * gain,
            denominator=f,
            sample_time=self.sample_time,
            input_name=self.names[0],
            output_name=self.names[1],
            delay=form.delay,
            covariance=robust if coloured else white,
            initial_state=state * data.y_scale,
            data_hash=data_hash(whole, self.sample_time),
            covariance_white=white,
            covariance_robust=robust,
            structure=structure,
            offset=offset * data.y_scale,
            **found,
        )
        _warn(model, determined)
        return model


def without_offset(data: Experiments, offset: float) -> Experiments:
    """Return data whose output has a constant less; a missing sample stays 0.

    Parameters
    ----------
    offset : float
        The constant, in the data's scale [dimensionless].
    """
    return replace(data, y=np.where(data.used, data.y - offset, 0.0)) if offset else data


def is_robust(covariance: CovarianceKind, residual: Array, data: Experiments) -> bool:
    """Return whether deviations are from the robust covariance.

    Parameters
    ----------
    covariance : {"white", "coloured", "auto"}
        What was asked for; with ``"auto"`` the residual decides.
    residual : ndarray, shape (n,)
        Not read where the output is missing.
    """
    if covariance == "auto":
        return is_coloured(residual, data.used)
    return covariance == "coloured"


def quality(residual: Array, data: Experiments, n_parameters: int) -> dict[str, Any]:
    """Return fit, root mean square, deviation and count of a residual, by the fields of `LinearModel`.

    Parameters
    ----------
    residual : ndarray, shape (n,)
        0 where the output is missing.
    """
    rss = float(residual @ residual) * data.y_scale**2
    return {
        "fit_percent": _fit_percent(residual, data.y[data.used]),
        "rmse": float(np.sqrt(rss / data.n_used)),
        "residual_std": float(np.sqrt(rss / (data.n_used - n_parameters))),
        "n_samples": data.n_used,
    }


def _fit_percent(residual: Array, measured: Array) -> float:
    deviation = measured - measured.mean()
    return 100.0 * (1.0 - float(np.sqrt((residual @ residual) / (deviation @ deviation))))


def _require_effect(rss: float, power: float, n_used: int, n_parameters: int, names: tuple[str, str]) -> None:
    """Refuse a model that by BIC is no better than none: its coefficients would describe only noise."""
    if rss > 0.0 and n_used * np.log(power / rss) < n_parameters * np.log(n_used):
        raise NoEffectError(
            f"input {names[0]!r} does not move {names[1]!r} above its noise: by BIC the model explains no more than "
            "chance would; use a stronger or livelier input, or another order"
        )


def _simulated_fit(b: Array, f: Array, state: Array, data: Experiments) -> tuple[float, float]:
    """Return fit and rms error of the first experiment's free run from the fitted initial state; NaN on overflow."""
    part = data.slices[0]
    with np.errstate(over="ignore", invalid="ignore"):
        residual = np.where(data.used[part], data.y[part] - filtered(b, f, data.u[part], state), 0.0)
        total = float(residual @ residual)
    if not np.isfinite(total):
        return float("nan"), float("nan")
    measured = data.y[part][data.used[part]]
    return _fit_percent(residual, measured), float(np.sqrt(total / measured.size))


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
