"""Order and dead time of a linear model by its free run on blocks held back, information criteria beside."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from estimation.arrays import Array
from estimation.identification.free_run.data import Channels
from estimation.identification.free_run.dead_times import estimate_delays
from estimation.identification.free_run.held_back import BLOCKS, NEAR, Compared, held_back_blocks
from estimation.identification.free_run.integrating import fit_integrating
from estimation.identification.free_run.linear_fit import extended, fit_linear
from estimation.identification.free_run.linear_problem import Form, LinearFit

CLEARLY = 0.01
"""Share by which a larger model must do better on what was held back."""

DEAD_TIME = 0.03
"""Share by which a dead time of more than one sample must do better."""

INTEGRATING = 0.7
"""A pole at one is believed where it leaves less than this share of the best other model's held-back error."""

PATIENCE = 2
"""Orders without gain after which no higher one is tried."""


@dataclass(frozen=True, eq=False)
class Candidate(Compared):
    """A form with what speaks for it.

    Parameters
    ----------
    aic : float
        Information criterion of the free run [dimensionless].
    doubt : str
        Why it may not be taken; empty where it may.
    """

    fit: LinearFit
    aic: float
    doubt: str

    @property
    def price(self) -> float:
        """Held-back error by which candidates are compared [dimensionless]: a dead time has its price."""
        return self.held_back * (1.0 + DEAD_TIME * (max(self.form.delays) > 1))

    @property
    def form(self) -> Form:
        """Size of the model."""
        return self.fit.form

    def outlasts_block(self, data: Channels) -> bool:
        """Return whether a time constant is longer than a held-back block.

        What such a pole does in a block is pinned by the outputs on both sides, so blocks do not miss it where it
        follows the drift of one record.

        Parameters
        ----------
        data : Channels
            That it was judged on.
        """
        return slowest_pole(self.fit.f) > np.exp(-(BLOCKS + 1.0) / data.told)


def slowest_pole(f: Array) -> float:
    """Return the largest modulus of the roots of a denominator.

    Parameters
    ----------
    f : ndarray, shape (order + 1,)
        Monic.

    Returns
    -------
    float
        Distance from the origin; zero where there is no root [dimensionless].
    """
    return float(np.abs(np.roots(f)).max()) if f.size > 1 else 0.0


def candidate(fit: LinearFit, data: Channels) -> Candidate:
    """Return a fit with its held-back error, criteria, and what is doubtful in it."""
    # a dead time that was searched is one more value
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
        How many values were fitted, to how many samples [count].

    Returns
    -------
    tuple of float
        Both [dimensionless]; less is better.
    """
    deviance = samples * float(np.log(max(cost, 1e-300) / samples))
    return deviance + values * float(np.log(samples)), deviance + 2.0 * values


def doubt_of(fit: LinearFit, data: Channels) -> str:
    """Return why a linear model may not be taken: ``time_constant``, ``no_fit``, or nothing."""
    output, n = np.concatenate(data.y), data.n_samples
    spread = float(np.nansum((output - np.nanmean(output)) ** 2))
    if spread == 0.0:  # beside one huge value all others are rounded to one number
        return "no_fit"
    gained = n * float(np.log(spread / max(fit.cost, 1e-300 * spread, np.finfo(float).tiny)))
    if gained < fit.theta.size * float(np.log(n)):
        return "no_fit"
    radius = slowest_pole(fit.f)
    if radius >= 1.0 or (radius > 0.0 and -1.0 / np.log(radius) > data.told):
        return "time_constant"
    return ""


def linear_candidates(
    data: Channels, orders: Sequence[int], delays: tuple[int, ...] | None, sizes: int | None = None
) -> list[Candidate]:
    """Return linear models over orders and dead times, each judged on blocks held back.

    Parameters
    ----------
    data : Channels
        Scaled.
    orders : sequence of int
        Orders tried, rising; ended early where two in a row bring nothing.
    delays : tuple of int or None
        Dead time of each input [samples]; None estimates it, and tries none and one sample beside.
    sizes : int, optional
        Numerator coefficients of each input; as many as the order, or one more, unless told.
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
        tried += [_within_record(one, data) for one in beyond]
        tried += [other for one in beyond for other in _integrating(one, data)]
        found += tried
        previous = [start for fit in fits for start in extended(fit)]
        now = _least(found)
        idle = 0 if now < (1.0 - CLEARLY) * best else idle + 1
        best = min(best, now)
        if idle >= PATIENCE:
            break
    return found


def _least(candidates: Sequence[Candidate]) -> float:
    """Return the least held-back error of models that may be taken: of those with a pole at 1, if one is believed."""
    sound = min((one.held_back for one in candidates if not one.doubt), default=np.inf)
    integrating = min((one.held_back for one in candidates if one.fit.integrates), default=np.inf)
    return integrating if integrating < INTEGRATING * sound else sound


def _best_start(form: Form, data: Channels, previous: Sequence[Array]) -> LinearFit:
    fits = [fit_linear(form, data, least_gain=NEAR)]
    if previous:
        fits.append(fit_linear(form, data, previous, least_gain=NEAR))
    return min(fits, key=lambda fit: fit.cost)


def _within_record(one: Candidate, data: Channels) -> Candidate:
    """Return the best model of the same form whose time constants the record can hold."""
    return candidate(fit_linear(one.form, data, [one.fit.f], bounded=True), data)


def _integrating(one: Candidate, data: Channels) -> list[Candidate]:
    """Return the best model of the same form with a pole at 1; none where it cannot be written."""
    fit = fit_integrating(one.form, data, [one.fit.f], search=True, least_gain=NEAR)
    return [candidate(fit, data)] if np.isfinite(fit.cost) else []


def _forms(order: int, late: tuple[int, ...], m: int, sizes: int | None) -> list[Form]:
    """Return forms of one order: behind the estimated dead time, and behind none or one sample."""
    if sizes is not None:
        return [Form(order, (sizes,) * m, late)]
    forms = [
        Form(order, tuple(order + (delay == 0) for delay in late), late),
        Form(order, (order + 1,) * m, late),
        Form(order, (order + 1,) * m, (0,) * m),
        Form(order, (order,) * m, (1,) * m),
    ]
    return list(dict.fromkeys(forms))


def chosen(candidates: Sequence[Candidate]) -> Candidate:
    """Return, of the models that do nearly as well on held-back blocks as the best one, that of the least BIC.

    A dead time of more than one sample was searched among many and looks better than it is: it counts as a value in
    BIC, and its price is what others are measured by.

    Parameters
    ----------
    candidates : sequence of Candidate
        One at least; where all are doubtful, the best of them is returned.
    """
    sound = [one for one in candidates if not one.doubt] or list(candidates)
    return smallest(sound, min(one.price for one in sound))


Some = TypeVar("Some", bound=Compared)


def smallest(candidates: Sequence[Some], least: float) -> Some:
    """Return, of the models that do nearly as well on held-back blocks as the best one, that of the least BIC.

    Parameters
    ----------
    candidates : sequence of Compared
        One at least that does.
    least : float
        Held-back error of the best one [dimensionless].
    """
    near = [one for one in candidates if one.held_back <= (1.0 + CLEARLY) * least]
    return min(near, key=lambda one: one.bic)
