"""`logged_on_change(record)`: channels of which only changes above a threshold were logged (dead band, compression).

A historian or a bus that reports by exception repeats the last value until the quantity has moved by a threshold.
Repeated values are wrong by up to that, and always late: bulk modulus was up to 5 % off and passed the gate. The
smallest steps of such a channel are alike, as those of a coarse converter are, but its values are on no grid. Steps of
a ramp are alike too, but follow each other in every row.
"""

import numpy as np

from estimation.log_checks.channel_names import POSITION, PRESSURE, SPEED
from estimation.log_checks.notes import LoggerCode
from plant.arrays import Array
from plant.log.record import Record
from plant.notes import Note

REPEATED = 0.3
"""Least share of rows that repeat the last value for a channel to be checked [fraction]."""

FEWEST_STEPS = 50
"""Least steps of a channel for a judgement [count]."""

ALIKE, EDGE = 0.25, 2.0
"""Least share of steps between the smallest and this multiple of it [fraction, dimensionless]. In a channel that is
logged in every row it is a few percent."""

AFTER_REPEAT = 0.1
"""Least share of those steps that follow a row which repeats the last value [fraction]; judged. In logs on change it is
0.2 to 1; for ramps between levels, a pump that starts and stops, or a clipped pressure at most 0.02."""

OFF_GRID = 0.15
"""Root mean square distance of values from a grid of the smallest step, above which they are not a converter's [steps];
random values have 0.29."""

NEARBY, LIKE, GRIDS = 100.0, 0.03, 121
"""Steps from the first value within which values are checked [steps], share by which the grid's step may differ from
the smallest one, if that was rounded again [fraction], and the number of grids that are tried [count]."""

LEAST_THRESHOLD = 0.01
"""Threshold over the channel's standard deviation from which it matters [fraction]; judged. At 0.05 bulk modulus is up
to 1.3 % off, more than its interval."""


def logged_on_change(record: Record) -> tuple[Note, ...]:
    """Return a note for each channel of which only changes above a threshold were logged.

    Parameters
    ----------
    record : Record
        The log, as its logger wrote it.

    Returns
    -------
    tuple of Note
        Empty for a log with a measurement in every row.
    """
    found = []
    for channel in (SPEED, POSITION, PRESSURE):
        if channel in record and (threshold := dead_band(record[channel])) > 0.0:
            share = threshold / float(np.nanstd(record[channel]))
            if share > LEAST_THRESHOLD:
                found.append(LoggerCode.LOGGED_ON_CHANGE.note(channel=channel, percent=100.0 * share))
    return tuple(found)


def dead_band(values: Array) -> float:
    """Return the threshold above which changes of a channel were logged.

    Parameters
    ----------
    values : ndarray, shape (n,)
        A channel [any unit].

    Returns
    -------
    float
        Its threshold, in its unit; 0 if every row is a measurement.

    Examples
    --------
    >>> course, logged = 5.0 * np.sin(0.01 * np.arange(9000.0)), [0.0]
    >>> for value in course[1:]:
    ...     logged.append(value if abs(value - logged[-1]) > 0.2 else logged[-1])
    >>> round(dead_band(np.array(logged)), 1), dead_band(course), dead_band(0.2 * np.rint(course / 0.2))
    (0.2, 0.0, 0.0)
    """
    there = values[np.isfinite(values)]
    changes = there[1:] != there[:-1]
    if not FEWEST_STEPS <= np.count_nonzero(changes) <= (1.0 - REPEATED) * len(changes):
        return 0.0
    steps = np.abs(np.diff(there))
    made = np.sort(steps[changes])
    least = float(made[len(made) // 100])
    alike = (steps >= least) & (steps < EDGE * least)
    count, after_repeat = np.count_nonzero(alike), np.count_nonzero(alike[1:] & ~changes[:-1])
    if count < ALIKE * len(made) or after_repeat < AFTER_REPEAT * count:
        return 0.0
    return 0.0 if _on_grid(there, float(np.mean(made[(made >= least) & (made < 1.001 * least)]))) else least


def _on_grid(values: Array, step: float) -> bool:
    """Return whether values are on a grid of about this step, as a converter's are, whether rounded again or not."""
    places = (np.unique(values) - values[0]) / step
    places = places[np.abs(places) < NEARBY] * np.linspace(1.0 - LIKE, 1.0 + LIKE, GRIDS)[:, None]
    return float(np.min(np.mean((places - np.rint(places)) ** 2, axis=1))) < OFF_GRID**2
