"""The unit of a time column that states none: certain if its values are dates, otherwise the likeliest by its steps."""

import numpy as np

from plant.arrays import Array
from plant.log.plausibility import SAMPLE_TIME_RANGE

_UNITS = (("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9), ("d", 86_400.0))

TICKS = "100 ns"
"""The unit in which Windows counts time."""

_TICK = 1e-7
"""What one of them lasts [s]."""

_DATE_RANGE = (946_684_800.0, 2_524_608_000.0)
"""Beginning of 2000 and of 2050, counted from 1970 [s]."""

_EPOCH_OFFSETS = (
    ("d", 25_569.0),
    ("d", 719_529.0),
    (TICKS, 116_444_736_000_000_000.0),
    (TICKS, 621_355_968_000_000_000.0),
)
"""Where spreadsheets, MATLAB's datenum, Windows and .NET have the beginning of 1970, and their unit."""

STEP_RANGE = (1e-6, 10.0)
"""Steps of a log that dates may have [s]; judged: wider than those of any bench."""

USUAL_STEP = 1e-3
"""Step that logs of hydraulics usually have [s]; of two units that with the nearer step is likely."""

ROUNDING = 1e-6
"""Relative error of a step between times that were rounded [fraction]."""

SHORTEST_LOG, FRACTIONS = 1.0, (0.01, 0.5)
"""Duration of a log below which it is unusual [s], and steps that are rather of seconds than of milliseconds then, as
these are mostly whole numbers [unit of the column]; judged."""

LONGEST_USUAL_STEP = 0.1
"""Step of a log up to which a unit that no file states is usual [s]; judged."""


def unit_of_dates(values: Array) -> tuple[str, str] | None:
    """Return the unit in which values are dates since 2000, and the first date; None if they are not dates.

    Dates count from 1970 in s, ms, us or ns, in days as in spreadsheets and MATLAB, or in ticks of 100 ns as in
    Windows (from 1601) and .NET (from the year 1).

    Parameters
    ----------
    values : ndarray, shape (n,)
        A column of time [unknown unit].

    Examples
    --------
    >>> unit_of_dates(46_000.0 + 1e-8 * np.arange(20.0)), unit_of_dates(46_000.0 + 0.01 * np.arange(20.0))
    (('d', '2025-12-09T00:00:00'), None)
    >>> unit_of_dates(134_176_000_000_000_000.0 + 1e4 * np.arange(20.0))
    ('100 ns', '2026-03-10T07:06:40')
    """
    there = values[np.isfinite(values)]
    step, first = _usual_step(values), float(there[0]) if len(there) else np.nan
    for unit, zero in (*((unit, 0.0) for unit, _ in _UNITS[:4]), *_EPOCH_OFFSETS):
        factor = _TICK if unit == TICKS else dict(_UNITS)[unit]
        since = (first - zero) * factor
        if _DATE_RANGE[0] <= since <= _DATE_RANGE[1] and STEP_RANGE[0] <= step * factor <= STEP_RANGE[1]:
            return unit, str(np.datetime64(0, "s") + np.timedelta64(round(since), "s"))
    return None


def likely_unit(values: Array) -> str | None:
    """Return the unit that gives the most usual steps of a log; None if there are no steps.

    Fractions of a unit, as 0.0, 0.1, 0.2, are seconds rather than milliseconds of a very short log.

    Parameters
    ----------
    values : ndarray, shape (n,)
        A column of time [unknown unit].

    Examples
    --------
    >>> likely_unit(np.arange(9.0)), likely_unit(1e-3 * np.arange(9.0)), likely_unit(500.0 * np.arange(9.0))
    ('ms', 's', 'us')
    >>> likely_unit(0.1 * np.arange(600.0)), likely_unit(0.1 * np.arange(60_000.0))
    ('s', 'ms')
    """
    step = _usual_step(values)
    if not step > 0.0:
        return None
    if are_seconds(values):
        return "s"
    return min(_UNITS, key=lambda one: abs(float(np.log(step * one[1] / USUAL_STEP))))[0]


def are_seconds(values: Array) -> bool:
    """Return whether times rise by fractions of a second, and would end within a second if they were milliseconds.

    Parameters
    ----------
    values : ndarray, shape (n,)
        A column of time [unknown unit].

    Examples
    --------
    >>> are_seconds(0.2 * np.arange(600.0)), are_seconds(0.2 * np.arange(60_000.0)), are_seconds(np.arange(600.0))
    (True, False, False)
    """
    step, there = _usual_step(values) / (1.0 + ROUNDING), values[np.isfinite(values)]
    return FRACTIONS[0] <= step <= FRACTIONS[1] and float(np.ptp(there)) < 1e3 * SHORTEST_LOG


def usual_units(values: Array, step: float) -> list[str]:
    """Return the units among s, ms and us in which a time has a usual step, the likeliest first; else the likeliest.

    Parameters
    ----------
    values : ndarray, shape (n,)
        A column of time [unknown unit].
    step : float
        Its usual step; zero if there is none [unknown unit].

    Examples
    --------
    >>> times = np.arange(600.0)
    >>> usual_units(0.2 * times, 0.2), usual_units(times, 1.0), usual_units(0.01 * times, 0.01)
    (['s', 'ms'], ['ms'], ['s', 'ms'])
    >>> usual_units(0.42 + times / 86.4e6, 1.0 / 86.4e6)
    ['d']
    """
    most = LONGEST_USUAL_STEP * (1.0 + ROUNDING)
    found = [unit for unit, factor in _UNITS[:3] if SAMPLE_TIME_RANGE[0] <= step * factor <= most]
    return list(dict.fromkeys(["s", *found] if are_seconds(values) else found)) or [likely_unit(values) or "s"]


def _usual_step(values: Array) -> float:
    steps = np.diff(values[np.isfinite(values)])
    return float(np.median(steps[steps > 0.0])) if (steps > 0.0).any() else 0.0
