"""Predicted gain of each hypothesis beside a fit: first order, from one evaluation of the slopes."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from estimation.fits.greybox.fit import GreyBoxFit
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.hypotheses import Hypothesis
from estimation.fits.hypothesis_search.lost_flow import likeliest_entry, likeliest_step
from estimation.fits.hypothesis_search.wide_log import usual_values, widened_log, with_balance
from estimation.fits.hypothesis_search.wide_problem import hypothesis_problem, parameters_at_end
from plant.arrays import Array
from plant.eha.model import EhaParameters

LIKELIEST = 4
"""Hypotheses that are tried first: those of largest predicted gain [count]."""

STEP_SHARE = 0.25
"""Share of the lost flow's variance that a step of leakage must explain to be tried first [fraction]; judged. A step
that multiplies leakage is too large for slopes to predict."""

AIR_SHARE = 0.1
"""The same for air that enters within the log, relative to oil of constant stiffness [fraction]; judged."""


class PredictedGain(NamedTuple):
    """First-order prediction of the gain in log-likelihood of a hypothesis beside a fit.

    Parameters
    ----------
    gain : float
        In log-likelihood, Rao's score statistic over two [dimensionless].
    size : float
        Predicted change of its first unknown in the fitted coordinate: for a logarithm a relative change
        [dimensionless].
    deviation : float
        Standard deviation of that coordinate then, its prior included [dimensionless].
    """

    gain: float
    size: float
    deviation: float


NO_GAIN = PredictedGain(0.0, 0.0, 0.0)
"""Prediction for a hypothesis that is already part of the fit."""


def predicted_gain(
    log: GreyBoxLog, parameters: EhaParameters, plain: Mapping[str, float], one: Hypothesis, *, by_mass: bool = False
) -> PredictedGain:
    """Return the first-order predicted gain of a hypothesis beside the plain fit.

    Parameters
    ----------
    log : GreyBoxLog
        The log, as the plain flow form sees it.
    plain : Mapping[str, float]
        Parameters of the plain fit [SI].
    one : Hypothesis
        The hypothesis.
    by_mass : bool
        Whether the plain fit balances mass.
    """
    return predicted_gains(log, parameters, plain, (one,), by_mass=by_mass)[0]


def predicted_gains(
    log: GreyBoxLog,
    parameters: EhaParameters,
    plain: Mapping[str, float],
    asked: Sequence[Hypothesis],
    *,
    by_mass: bool = False,
    slopes: Mapping[str, Array] = MappingProxyType({}),
) -> list[PredictedGain]:
    """Return the predicted gain of each of several hypotheses alone, from one evaluation; see `predicted_gain`.

    Parameters
    ----------
    log : GreyBoxLog
        The log, as the plain flow form sees it.
    plain : Mapping[str, float]
        Parameters of the plain fit [SI].
    asked : sequence of Hypothesis
        The hypotheses; none may hold an unknown of the plain form.
    by_mass : bool
        Whether the plain fit balances mass.
    slopes : Mapping[str, ndarray of shape (blocks,)], optional
        Derivatives of the plain fit's normalised residuals, by unknown; computed if not given [dimensionless].
    """
    wide = widened_log(log, parameters, plain)
    return _predicted_gains_beside(with_balance(wide, 1.0 if by_mass else 0.0), (), plain, asked, slopes)


def predicted_gain_beside(
    log: GreyBoxLog, together: tuple[Hypothesis, ...], found: Mapping[str, float], one: Hypothesis, *more: str
) -> PredictedGain:
    """Return the predicted gain of one more hypothesis beside those accepted.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.
    together : tuple of Hypothesis
        The accepted hypotheses.
    found : Mapping[str, float]
        Parameters of the fit under them [SI].
    one : Hypothesis
        The further hypothesis.
    *more : str
        Other unknowns of that fit.
    """
    return _predicted_gains_beside(log, together, found, (one,), more=more)[0]


def by_predicted_gain(
    log: GreyBoxLog, together: tuple[Hypothesis, ...], found: Mapping[str, float], asked: Sequence[Hypothesis]
) -> tuple[list[Hypothesis], list[Hypothesis], dict[str, float]]:
    """Return the hypotheses of largest predicted gain beside those accepted, best first; the others; all gains.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.
    together : tuple of Hypothesis
        The accepted hypotheses.
    found : Mapping[str, float]
        Parameters of the fit so far [SI].
    asked : sequence of Hypothesis
        The further hypotheses.

    Returns
    -------
    tuple of list of Hypothesis, list of Hypothesis, and dict
        The `LIKELIEST`, one at least; the others; and the gain in log-likelihood that each promises, by its name
        [dimensionless].
    """
    promises = _predicted_gains_beside(log.coarsened(), together, found, asked)
    stepped = any(one.from_change for one in asked) and likeliest_step(log).share > STEP_SHARE
    aired = any(one.from_entry for one in asked) and likeliest_entry(log).share > AIR_SHARE
    first = [(stepped and one.from_change) or (aired and one.from_entry) for one in asked]
    order = sorted(range(len(asked)), key=lambda i: (not first[i], -promises[i].gain))
    likely = [asked[i] for i in order if first[i] or not asked[i].far][:LIKELIEST] or [asked[i] for i in order[:1]]
    gains = {one.name: each.gain for one, each in zip(asked, promises, strict=True)}
    return likely, [one for one in asked if one not in likely], gains


def _predicted_gains_beside(
    log: GreyBoxLog,
    together: tuple[Hypothesis, ...],
    found: Mapping[str, float],
    asked: Sequence[Hypothesis],
    slopes: Mapping[str, Array] = MappingProxyType({}),
    more: Sequence[str] = (),
) -> list[PredictedGain]:
    """Return the predicted gain of each hypothesis beside those accepted, from one evaluation."""
    last = *parameters_at_end(together), *more
    problem = hypothesis_problem(log, (*together, *(replace(one, instead=()) for one in asked)), *last)
    theta = problem.model.theta({**usual_values(log), **found})
    point = problem.at_beside(theta, slopes) if slopes else problem.at(theta)
    # an unknown at its bound predicts a gain that only the hypothesis in its place can reach
    held = {name for one in asked for name in one.instead}
    own = [name for name in hypothesis_problem(log, together, *last).model.unknowns if name not in held]

    def step(names: Sequence[str]) -> tuple[float, Array, Array]:
        places = [problem.model.unknowns.index(name) for name in names]
        gradient = point.gradient[places]
        gram = point.gram[np.ix_(places, places)]
        known = np.asarray(np.linalg.pinv(gram, rcond=len(places) * np.finfo(float).eps), dtype=np.float64)
        moved: Array = known @ gradient
        return 0.5 * float(gradient @ moved), moved, np.diag(known)

    before = step(own)[0]
    promises: list[PredictedGain] = []
    for one in asked:
        names = list(dict.fromkeys((*own, *one.free)))
        gain, moved, variances = step(names)
        place = names.index(one.free[0])
        promises.append(PredictedGain(gain - before, -float(moved[place]), float(variances[place]) ** 0.5))
    return promises


def shared_slopes(fit: GreyBoxFit, log: GreyBoxLog) -> Mapping[str, Array]:
    """Return the slopes of a plain fit's residuals that the wide form shares.

    Returns
    -------
    Mapping[str, ndarray]
        By unknown, shape (samples,) [dimensionless]; empty if position noise matters or speed has gaps, since slopes
        are then specific to the fit.
    """
    if log.passes_on or log.gaps.size:
        return {}
    return dict(zip(fit.model.unknowns, fit.slopes.T, strict=False))
