"""`conclude(log, parameters, counted, accepted) -> Explanation`: the result of hypotheses that explain a log."""

import math
import sys
from collections.abc import Callable, Sequence
from functools import partial
from typing import TypeAlias

from estimation.fits.greybox.fit import GreyBoxFit
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.hypotheses import DELIVERY, VOLUME
from estimation.fits.hypothesis_search.explanation import Explanation, Trial
from estimation.fits.hypothesis_search.final_fits import with_details
from estimation.fits.hypothesis_search.form_fit import TEMPER, likelihood_mean
from estimation.fits.hypothesis_search.predicted_gains import NO_GAIN, PredictedGain, predicted_gain_beside
from estimation.fits.hypothesis_search.wide_log import usual_pressure, with_balance, without_delays
from estimation.models.completed_flow import CRACKS
from estimation.models.flow import STIFFNESS
from estimation.models.wide_flow import GROWTH, grown_leakage
from plant.eha.model import EhaParameters

Accepted: TypeAlias = Callable[[GreyBoxFit], bool]


def conclude(log: GreyBoxLog, parameters: EhaParameters, counted: Sequence[Trial], accepted: Accepted) -> Explanation:
    """Return the explanation of a log by the best set of hypotheses, its values weighted over rivals.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.
    counted : sequence of Trial
        Sets that explain the log alike, fitted to the end.
    accepted : callable
        ``accepted(fit)``: whether a fit explains the log.
    """
    weighted = [(one, prior_weight(log, one)) for one in counted]
    weighted.sort(key=lambda pair: pair[0].cost - TEMPER * math.log(pair[1]))
    best, *rivals = (one for one, _ in weighted)
    fits = tuple(fit for one, _ in weighted for fit in one.fits)
    likely = tuple(weight for one, weight in weighted for _ in one.fits)
    values = {name: (value, best.fit.std[name]) for name, value in best.fit.values.items()}
    values |= dict(likelihood_mean(fits, priors=likely))
    if any(name in values for name in GROWTH):  # the reported leakage is that at the end of the log
        ended = float(grown_leakage(1.0, *(values.get(name, (0.0, 0.0))[0] for name in GROWTH)))
        value, std = values["leakage_coefficient"]
        values["leakage_coefficient"] = ended * value, ended * std
    return Explanation(
        names=tuple(one.name for one in best.together),
        values=values,
        delays=best.delays,
        fits=fits,
        rivals=tuple(name for name in dict.fromkeys(map(_names_of_set, rivals)) if name != _names_of_set(best)),
        stated_pressure=usual_pressure(log, parameters),
        opening=partial(delivery_beside, log, best),
        detailing=partial(_detailed, log, parameters, (best, *rivals), accepted),
        priors=likely,
    )


def _names_of_set(tried: Trial) -> str:
    return " and ".join(one.name for one in tried.together)


def prior_weight(log: GreyBoxLog, tried: Trial) -> float:
    """Return the prior weight of a set of hypotheses: how likely the rig file makes its chamber volume.

    If the piston moves only one way, a wrong chamber volume looks like a wrong zero of the encoder. The rig file states
    the uncertainty of its volume: 1.8 times that volume is unlikely if another set explains the log as well.

    Parameters
    ----------
    log : GreyBoxLog
        The log, with the relative uncertainties of the rig file.
    tried : Trial
        The set, with its final fit.

    Returns
    -------
    float
        1 if the volume is that of the file, or is not in the set [dimensionless].
    """
    (name,) = VOLUME.free
    told = any(one.name == VOLUME.name for one in tried.together)
    if not told or not (doubt := log.uncertainties.get(name, 0.0)):
        return 1.0
    off = math.log(tried.values[name] / tried.rig[name]) / doubt
    return max(math.exp(-0.5 * off**2), sys.float_info.min)


def is_explained(tried: Trial, accepted: Accepted) -> bool:
    """Return whether a set of hypotheses, fitted to the end, explains a log and keeps its meaning."""
    return not tried.void and bool(tried.fits) and accepted(tried.fit)


def _detailed(
    log: GreyBoxLog, parameters: EhaParameters, counted: Sequence[Trial], accepted: Accepted
) -> Explanation | None:
    """Return the explanation with cracking drops of make-up valves and accumulator free; None if it then fails."""
    best, *rivals = (with_details(log, one) for one in counted)
    return conclude(log, parameters, (best, *rivals), accepted) if is_explained(best, accepted) else None


def delivery_beside(log: GreyBoxLog, best: Trial) -> PredictedGain:
    """Return the predicted gain of another pump delivery beside an explanation of a log, where its fit ended.

    Parameters
    ----------
    log : GreyBoxLog
        The log, widened.
    best : Trial
        The explanation, fitted to the end.
    """
    if DELIVERY.free[0] in best.values:
        return NO_GAIN
    row = with_balance(without_delays(log, best.delays), float(best.by_mass))
    more = [name for name in (STIFFNESS, *CRACKS) if name in best.values]
    return predicted_gain_beside(row, best.together, best.values, DELIVERY, *more)
