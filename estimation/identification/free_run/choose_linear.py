"""Order and dead time of a linear model by its free run on held-back blocks, with information criteria as well."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from estimation.arrays import Array
from estimation.identification.free_run.data import Channels
from estimation.identification.free_run.dead_times import estimate_delays
from estimation.identification.free_run.held_back import BLOCKS, COMPARISON_GAIN, ComparedModel, held_back_blocks
from estimation.identification.free_run.integrating import fit_integrating
from estimation.identification.free_run.linear_fit import extended_denominators, fit_linear
from estimation.identification.free_run.linear_problem import Form, LinearFit

CLEAR_GAIN = 0.01
"""Share by which a larger model must reduce the held-back error."""

DEAD_TIME = 0.03
"""Share by which a dead time of more than one sample must reduce it."""

INTEGRATING = 0.7
"""Largest ratio of the held-back error with a pole at one to that of the best other model."""

PATIENCE = 2
"""Orders without gain after which no higher one is tried."""


@dataclass(frozen=True, eq=False)
class Candidate(ComparedModel):
    """A form with its evidence.

    Parameters
    ----------
    aic : float
        Information criterion of the free run [dimensionless].
    doubt : str
        Why it may not be chosen; empty if it may.
    """

    fit: LinearFit
    aic: float
    doubt: str

    @property
    def price(self) -> float:
        """Held-back error for comparisons, increased for a dead time [dimensionless]."""
        return self.held_back * (1.0 + DEAD_TIME * (max(self.form.delays) > 1))

    @property
    def form(self) -> Form:
        """Size of the model."""
        return self.fit.form

    def outlasts_block(self, data: Channels) -> bool:
        """Return whether a time constant is longer than a held-back block.

        Outputs on both sides of a block determine the effect of such a pole there, so blocks do not reveal that it
        follows the drift of one record.

        Parameters
        ----------
        data : Channels
            The data on which it was judged.
        """
        return slowest_pole(self.fit.f) > np.exp(-(BLOCKS + 1.0) / data.informative_samples)


def slowest_pole(f: Array) -> float:
    """Return the largest modulus of the roots of a denominator.

    Parameters
    ----------
    f : ndarray, shape (order + 1,)
        Monic.

    Returns
    -------
    float
        Distance from the origin; zero if there is no root [dimensionless].
    """
    return float(np.abs(np.roots(f)).max()) if f.size > 1 else 0.0


def candidate(fit: LinearFit, data: Channels) -> Candidate:
    """Return a fit with its held-back error, criteria, and doubts."""
    # a dead time that was searched for counts as one more value
    values = fit.theta.size + sum(delay > 1 for delay in fit.form.delays) - fit.integrates
    bic, aic = criteria(fit.cost, values, data.n_samples)
    return Candidate(fit, aic, doubt_of(fit, data), block_errors=held_back_blocks(fit, data), bic=bic)


def criteria(cost: float, values: int, samples: int) -> tuple[float, float]:
    """Return the information criteria BIC and AIC of a free run with white Gaussian errors of unknown variance.

    Parameters
    ----------
    cost : float
        Sum of squared errors [squared unit of the output].
    values, samples : int
        Number of fitted values and of samples [count].

    Returns
    -------
    tuple of float
        Both [dimensionless]; less is better.
    """
    deviance = samples * float(np.log(max(cost, 1e-300) / samples))
    return deviance + values * float(np.log(samples)), deviance + 2.0 * values


def doubt_of(fit: LinearFit, data: Channels) -> str:
    """Return why a linear model may not be chosen: ``time_constant``, ``no_fit``, or nothing."""
    output, n = np.concatenate(data.y), data.n_samples
    spread = float(np.nansum((output - np.nanmean(output)) ** 2))
    if spread == 0.0:  # beside one huge value rounding makes all others equal
        return "no_fit"
    gained = n * float(np.log(spread / max(fit.cost, 1e-300 * spread, np.finfo(float).tiny)))
    if gained < fit.theta.size * float(np.log(n)):
        return "no_fit"
    radius = slowest_pole(fit.f)
    if radius >= 1.0 or (radius > 0.0 and -1.0 / np.log(radius) > data.informative_samples):
        return "time_constant"
    return ""


def linear_candidates(
    data: Channels, orders: Sequence[int], delays: tuple[int, ...] | None, sizes: int | None = None
) -> list[Candidate]:
    """Return linear models over orders and dead times, each judged on held-back blocks.

    Parameters
    ----------
    data : Channels
        Scaled.
    orders : sequence of int
        Orders that are tried, rising; the search ends after two without gain.
    delays : tuple of int or None
        Dead time of each input [samples]; None estimates it, and tries zero and one sample as well.
    sizes : int, optional
        Numerator coefficients of each input; by default as many as the order, or one more.
    """
    m = len(data.inputs)
    late = delays or estimate_delays(data)
    found: list[Candidate] = []
    previous: list[Array] = []
    best, idle = np.inf, 0
    for order in orders:
        forms = _forms(order, late, m, sizes)
        fits = [_best_start(form, data, previous) for form in (forms if delays is None else forms[:1])]
        tried = [candidate(fit, data) for fit in fits]
        beyond = [one for one in tried if one.doubt == "time_constant"]
        tried += [_bounded_candidate(one, data) for one in beyond]
        tried += [other for one in beyond for other in _integrating_candidates(one, data)]
        found += tried
        previous = [start for fit in fits for start in extended_denominators(fit)]
        now = _least_error(found)
        idle = 0 if now < (1.0 - CLEAR_GAIN) * best else idle + 1
        best = min(best, now)
        if idle >= PATIENCE:
            break
    return found


def _least_error(candidates: Sequence[Candidate]) -> float:
    """Return the least held-back error of acceptable models: of those with a pole at 1, if one is believed."""
    sound = min((one.held_back for one in candidates if not one.doubt), default=np.inf)
    integrating = min((one.held_back for one in candidates if one.fit.integrates), default=np.inf)
    return integrating if integrating < INTEGRATING * sound else sound


def _best_start(form: Form, data: Channels, previous: Sequence[Array]) -> LinearFit:
    fits = [fit_linear(form, data, least_gain=COMPARISON_GAIN)]
    if previous:
        fits.append(fit_linear(form, data, previous, least_gain=COMPARISON_GAIN))
    return min(fits, key=lambda fit: fit.cost)


def _bounded_candidate(one: Candidate, data: Channels) -> Candidate:
    """Return the best model of the same form whose time constants are shorter than the record."""
    return candidate(fit_linear(one.form, data, [one.fit.f], bounded=True), data)


def _integrating_candidates(one: Candidate, data: Channels) -> list[Candidate]:
    """Return the best model of the same form with a pole at 1; None if it cannot be written."""
    fit = fit_integrating(one.form, data, [one.fit.f], search=True, least_gain=COMPARISON_GAIN)
    return [candidate(fit, data)] if np.isfinite(fit.cost) else []


def _forms(order: int, late: tuple[int, ...], m: int, sizes: int | None) -> list[Form]:
    """Return forms of one order: with the estimated dead time, and with zero or one sample."""
    if sizes is not None:
        return [Form(order, (sizes,) * m, late)]
    forms = [
        Form(order, tuple(order + (delay == 0) for delay in late), late),
        Form(order, (order + 1,) * m, late),
        Form(order, (order + 1,) * m, (0,) * m),
        Form(order, (order,) * m, (1,) * m),
    ]
    return list(dict.fromkeys(forms))


def chosen_linear(candidates: Sequence[Candidate]) -> Candidate:
    """Return the model of least BIC among those nearly as good on held-back blocks as the best.

    A dead time of more than one sample is the best of many and looks better than it is: it counts as a value in BIC,
    and models are compared by their price.

    Parameters
    ----------
    candidates : sequence of Candidate
        At least one; if all are doubtful, the best of them is returned.
    """
    sound = [one for one in candidates if not one.doubt] or list(candidates)
    return smallest_good_candidate(sound, min(one.price for one in sound))


AnyCompared = TypeVar("AnyCompared", bound=ComparedModel)


def smallest_good_candidate(candidates: Sequence[AnyCompared], least: float) -> AnyCompared:
    """Return the model of least BIC among those nearly as good on held-back blocks as the best.

    Parameters
    ----------
    candidates : sequence of ComparedModel
        At least one that is.
    least : float
        Held-back error of the best one [dimensionless].
    """
    near = [one for one in candidates if one.held_back <= (1.0 + CLEAR_GAIN) * least]
    return min(near, key=lambda one: one.bic)
