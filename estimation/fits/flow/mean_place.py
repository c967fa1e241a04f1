"""`placed_means(logged, ...)`: whether the means of an averaged pressure lie before their rows or about them."""

from collections.abc import Callable, Sequence
from dataclasses import replace

from estimation.fits.flow.agreement import LogAnswer
from estimation.fits.flow.mean_rows import PressureMean
from estimation.fits.flow.misread import CorrectedLogs
from estimation.fits.flow.plain import FitStart, Logged, plain_fits
from estimation.log_checks.averaged import FAST

MOST_ROWS = 20_000
"""Rows of a log from which the place is told [count]."""

SURE_PLACE = 7.0
"""Difference in log-likelihood from which a less likely place no longer counts [dimensionless]: odds of 1000."""


def placed_means(logged: Logged, start: FitStart, rows: int) -> tuple[Sequence[Logged], float]:
    """Return a log with each place that the means of its pressure may have, the likeliest first.

    Loggers and filters average the last rows, ``movmean`` in MATLAB those about each row.

    Parameters
    ----------
    logged : Logged
        The log, with one mean in so many rows.
    start : FitStart
        Where searches begin.
    rows : int
        Rows of a mean; 1 if the pressure was not averaged [count].

    Returns
    -------
    tuple of (sequence of Logged, float)
        The log, once if the plain form explains it; and the uncertainty of bulk modulus if it then does not tell the
        place [fraction].
    """
    if rows == 1:
        return [logged], 0.0
    part = replace(logged, record=logged.record.slice(0, MOST_ROWS))
    first = rows // 2 + 1 if logged.record.sample_time < FAST else 0
    places = [PressureMean(rows, after, first) for after in sorted({rows - 1, rows // 2, (rows - 1) // 2})]
    fits = [(plain_fits(replace(part, mean=one), start), replace(logged, mean=one)) for one in places]
    fits.sort(key=lambda one: one[0].best.cost)
    likeliest = fits[0][0]
    if not likeliest.explains(likeliest.best):
        return [one for _, one in fits], 0.0
    moduli = [
        one.swinging.values["bulk_modulus"] for one, _ in fits if one.best.cost < likeliest.best.cost + SURE_PLACE
    ]
    return [fits[0][1]], max(abs(one / moduli[0] - 1.0) for one in moduli)


def first_explained(
    placed: Sequence[CorrectedLogs], answer_of: Callable[[CorrectedLogs], LogAnswer]
) -> tuple[CorrectedLogs, LogAnswer]:
    """Return the first place with which a log is explained, or else the likeliest, and what the log then says.

    Parameters
    ----------
    placed : sequence of CorrectedLogs
        The log with each place.
    answer_of : callable
        ``answer_of(log)``: what a log says.
    """
    answers = list[tuple[float, CorrectedLogs, LogAnswer]]()
    for one in placed:
        answer = answer_of(one)
        if answer.strange is not None or answer.plain.explains(answer.plain.best):
            return one, answer
        answers.append((answer.plain.best.cost, one, answer))
    return min(answers, key=lambda one: one[0])[1:]
