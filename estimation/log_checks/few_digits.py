"""`with_even_steps(record)`: channels written with few significant digits, whose steps grow with their size.

A logger that prints ``%.4g`` writes 9.999 mm and 41.76 mm: near mid-stroke its steps are a thousand times smaller than
at the end of the travel. Noise determined from the smallest steps is then far too low for the rest of the log, and the
fit finds causes for rounding. Rounded to its largest step, such a channel equals that of a coarse converter.
"""

import numpy as np

from estimation.log_checks.channel_names import POSITION, PRESSURE
from estimation.log_checks.notes import LoggerCode
from plant.arrays import Array
from plant.log.record import Record
from plant.notes import Note

MOST_DIGITS = 5
"""Significant digits up to which a channel is checked [count]; with six, steps are finer than any encoder's."""

SAMPLES_CHECKED_FIRST = 200
"""Samples that are checked first, spread over the log [count]."""

EXACT = 1e-9
"""Share of a value up to which it equals its rounding [fraction]: a change of unit costs 1e-16."""

FEWEST, USED = 50, 0.5
"""Samples of a power of ten that show the number of digits [count], and the share of them whose last digit is not 0:
written digits have 0.9; steps of one size have 0 in the lower one of two powers."""


def with_even_steps(record: Record) -> tuple[Record, tuple[Note, ...]]:
    """Return a log whose position and pressure have steps of one size, and a note for each that was rounded.

    Parameters
    ----------
    record : Record
        The log, as its logger wrote it.

    Returns
    -------
    tuple of Record and tuple of Note
        The log, and no notes if it has more digits.
    """
    rounded: dict[str, Array] = {}
    notes: list[Note] = []
    for channel in (POSITION, PRESSURE):
        if channel in record and (digits := written_digits(record[channel])):
            step = 10.0 ** (_largest_power(record[channel]) - digits + 1)
            rounded[channel] = step * np.rint(record[channel] / step)
            notes.append(LoggerCode.FEW_DIGITS.note(channel=channel, digits=digits))
    return (record.replace(**rounded), tuple(notes)) if rounded else (record, ())


def written_digits(values: Array) -> int:
    """Return the number of significant digits of a channel; 0 if its steps have one size, or it has many digits.

    Parameters
    ----------
    values : ndarray, shape (n,)
        The channel [any unit]; NaN where missing.

    Returns
    -------
    int
        Digits, at most `MOST_DIGITS`.

    Examples
    --------
    >>> course = 0.05 * np.sin(0.01 * np.arange(2000.0))
    >>> written_digits(np.array([float(f"{value:.3g}") for value in course])), written_digits(course.round(4))
    (3, 0)
    """
    there = _sizes(values)
    few = there[:: 1 + len(there) // SAMPLES_CHECKED_FIRST]
    if len(there) < FEWEST or not _has_digits(few, _power(few), MOST_DIGITS):
        return 0
    powers = _power(there)
    digits = next((count for count in range(1, MOST_DIGITS + 1) if _has_digits(there, powers, count)), 0)
    if not digits:
        return 0
    last_used = np.rint(there * 10.0 ** (digits - 1 - powers)) % 10.0 != 0.0
    told = [np.mean(last_used[powers == power]) > USED for power in _common_powers(powers)]
    return digits if sum(told) > 1 else 0


def _largest_power(values: Array) -> float:
    """Return the largest power of ten with enough samples: a spike must not coarsen the whole log."""
    return float(_common_powers(_power(_sizes(values)))[-1])


def _common_powers(powers: Array) -> Array:
    """Return the powers with enough samples, in order."""
    found, counts = np.unique(powers, return_counts=True)  # without counts NumPy imports its masked arrays
    return found[counts >= FEWEST]


def _sizes(values: Array) -> Array:
    return np.abs(values[np.isfinite(values) & (values != 0.0)])


def _has_digits(sizes: Array, powers: Array, digits: int) -> bool:
    """Return whether so many significant digits are all that positive values of these powers of ten have."""
    scaled = sizes * 10.0 ** (digits - 1 - powers)
    return bool(np.all(np.abs(np.rint(scaled) - scaled) <= EXACT * scaled))


def _power(sizes: Array) -> Array:
    """Return the power of ten of positive values; one that rounding has left just below a power counts as it."""
    return np.floor(np.log10(sizes * (1.0 + EXACT)))
