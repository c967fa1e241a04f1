"""`conclude(log, parameters, counted, accepted) -> Explanation`: the result of hypotheses that explain a log."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import TypeAlias

from estimation.fits.greybox.fit import GreyBoxFit
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.hypotheses import DELIVERY
from estimation.fits.hypothesis_search.explanation import Explanation, Trial
from estimation.fits.hypothesis_search.final_fits import with_details
from estimation.fits.hypothesis_search.form_fit import weighed
from estimation.fits.hypothesis_search.predicted_gains import NO_GAIN, PredictedGain, predicted_gain_beside
from estimation.fits.hypothesis_search.wide_log import balanced_by, delayed, usual_pressure
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
    parameters : EhaParameters
        The actuator.
    counted : sequence of Trial
        Sets that explain the log about equally well, fitted to the end, the best first.
    accepted : callable
        ``accepted(fit)``: whether a fit explains the log.
    """
    best = counted[0]
    fits = tuple(fit for one in counted for fit in one.fits)
    values = {name: (value, best.fit.std[name]) for name, value in best.fit.values.items()} | dict(weighed(fits))
    if any(name in values for name in GROWTH):  # what is told of a leakage is what it is at the end
        ended = float(grown_leakage(1.0, *(values.get(name, (0.0, 0.0))[0] for name in GROWTH)))
        value, std = values["leakage_coefficient"]
        values["leakage_coefficient"] = ended * value, ended * std
    return Explanation(
        names=tuple(one.name for one in best.together),
        values=values,
        delays=best.delays,
        fits=fits,
        rivals=len(counted) - 1,
        stated_pressure=usual_pressure(log, parameters),
        opening=partial(delivery_beside, log, best),
        detailing=partial(_detailed, log, parameters, counted, accepted),
    )


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
    row = balanced_by(delayed(log, best.delays), float(best.by_mass))
    more = [name for name in (STIFFNESS, *CRACKS) if name in best.values]
    return predicted_gain_beside(row, best.together, best.values, DELIVERY, *more)
