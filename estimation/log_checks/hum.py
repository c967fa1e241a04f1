"""Hum: mains tones that a cable picks up in a pressure channel, removed before anything is fitted.

A tone is a line in the spectrum. If motor speed or position has the line too, it is motion, and stays. It also stays if
it vanishes while the motor turns at other speeds: teeth of the pump, in a drive that stays at its speed limit.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from estimation.fits.convolution import smooth_length
from estimation.log_checks.bridging import bridged
from estimation.log_checks.channel_names import POSITION, PRESSURE, SPEED
from estimation.log_checks.order import medians, stacked
from estimation.notes import SensorCode
from plant.arrays import Array
from plant.log.record import Record
from plant.notes import Note

CHANNELS_OF_MOTION = (SPEED, POSITION)
"""Channels whose lines are motion."""

LOWEST = 40.0
"""Frequency below which no hum is looked for [Hz]: mains have 50 or 60 Hz, and the piston is slower."""

HIGHEST = 0.4
"""Frequency times sample time above which none is looked for [dimensionless]: corners of a drive alternate there."""

STANDS_OUT, SHARED = 200.0, 0.1
"""Power of a hum's line over the usual one near it, and the largest share of that ratio in a line of motion at the same
frequency [dimensionless]. Noise reaches 27 in 204 logs of all kinds, a hum of 0.1 bar 5,000; an uncorrected one of 600
raises the balance's residuals to 1.3 times the noise."""

REPEATS = 1e3
"""The same for the line of a periodic drive [dimensionless]."""

ALONE, AROUND, WIDTH = 0.05, 30.0, 1.0
"""Largest share of a hum's line in others [dimensionless], within this distance of it and outside its own width [Hz]: a
periodic drive has a row of lines, none of which is hum."""

NEARBY = 100
"""Lines from which the usual power is computed [count]."""

MOST_TONES = 8
"""Most tones that are removed: the mains and its harmonics."""

TEETH = range(5, 31)
"""Possible pump tones per turn of the motor [count]: from the pistons of an axial pump to two per tooth of a gear
pump."""

AT_TEETH = 0.02
"""Distance of a tone from a whole number of tones per turn within which the motor may cause it [fraction]; judged."""

UNSEEN, GONE = 10.0, 0.1
"""Power over the usual one up to which there is no line, and the largest share of what a hum would have left
[dimensionless]: of teeth at a speed limit up to 3 was left while the motor turned otherwise, of hums 15 and more."""

STRETCH = 25.0
"""Periods over which a tone keeps amplitude and phase [periods]: mains frequency varies by some hundredths of a
hertz."""


def without_hum(record: Record) -> tuple[Record, tuple[Note, ...]]:
    """Return a log whose differential pressure has no hum.

    Returns
    -------
    tuple of (Record, tuple of Note)
        The log, and a note for each tone that was removed.
    """
    if PRESSURE not in record or not np.any(np.isfinite(record[PRESSURE])):
        return record, ()
    motion = [
        _lines(record[name]) for name in CHANNELS_OF_MOTION if name in record and np.any(np.isfinite(record[name]))
    ]
    pressure, notes, of_teeth = record[PRESSURE], list[Note](), list[float]()
    while len(notes) < MOST_TONES and len(of_teeth) < MOST_TONES:
        lines = _lines(pressure)
        frequencies = np.arange(len(lines)) / (2 * (len(lines) - 1) * record.sample_time)
        moved = np.max(motion, axis=0, initial=0.0) if motion else np.zeros(len(lines))
        within = (frequencies > LOWEST) & (frequencies < HIGHEST / record.sample_time)
        for known in of_teeth:
            within &= np.abs(frequencies - known) > WIDTH
        hums = np.where(within & (moved < SHARED * lines), lines, 0.0)
        place = int(np.argmax(hums))
        if hums[place] < STANDS_OUT or not _is_single_line(frequencies, lines, place):
            break
        frequency = _line_frequency(frequencies, lines, place)
        if _is_of_teeth(record, pressure, frequency, lines, place):
            of_teeth.append(frequency)
            continue
        tone = _tone(pressure, frequency * record.sample_time)
        pressure = pressure - tone
        amplitude = float(np.sqrt(2.0 * np.mean(tone**2)))
        notes.append(SensorCode.HUM.note(channel=PRESSURE, amplitude_pa=amplitude, frequency_hz=frequency))
    return (record.replace(**{PRESSURE: pressure}), tuple(notes)) if notes else (record, ())


def _is_of_teeth(record: Record, pressure: Array, frequency: float, lines: Array, place: int) -> bool:
    """Return whether a line vanishes in the rows in which the motor does not turn at the line's tooth frequency.

    Hum does not depend on the motor. If the motor hardly ever turns otherwise, the two cannot be told apart, and the
    line is hum.
    """
    if SPEED not in record or not np.any(np.isfinite(record[SPEED])):
        return False
    turns = np.abs(bridged(record[SPEED])) / (2.0 * np.pi)
    others = min((np.abs(count * turns - frequency) > AT_TEETH * frequency for count in TEETH), key=np.count_nonzero)
    left = np.max(_lines(pressure, others)[max(place - 1, 0) : place + 2])
    return bool(left < UNSEEN < GONE * np.mean(others) * lines[place])


def _lines(values: Array, rows: NDArray[np.bool_] | None = None) -> Array:
    """Return the power of each line of a channel's second differences over the usual power near it, by rows.

    Parameters
    ----------
    values : ndarray, shape (n,)
        The channel.
    rows : ndarray of bool, shape (n,), optional
        Those that count.
    """
    bends = np.diff(bridged(values), n=2)
    bends = bends if rows is None else bends * rows[1:-1]
    length = smooth_length(len(bends), (2, 3, 5))
    length += length % 2
    power = np.abs(np.fft.rfft(bends * _window(len(bends)), length)) ** 2
    parts = stacked(power, max(1, len(power) // NEARBY))
    usual = np.concatenate([np.repeat(medians(part), part.shape[1]) for part in parts])
    return power / np.maximum(usual, np.finfo(float).tiny)


@lru_cache(maxsize=1)
def _window(length: int) -> Array:
    """Return a Hann window, cached for the next log of that length."""
    return np.hanning(length)


def _is_single_line(frequencies: Array, lines: Array, place: int) -> bool:
    """Return whether a spectral line has no others near it, and is no harmonic of a periodic drive.

    Harmonics come in rows, every one or every other: a line of a slow drive has others of its row near it. Only those
    of a fast drive are as far apart as tones of the mains.
    """
    apart = np.abs(frequencies - frequencies[place])
    others = lines[(apart > WIDTH) & (apart < AROUND)]
    slow = np.where((frequencies > 0.0) & (frequencies < LOWEST), lines, 0.0)
    driven = int(np.argmax(slow))
    if slow[driven] > REPEATS and 2.0 * frequencies[driven] > AROUND - WIDTH:
        off = frequencies[place] % frequencies[driven]
        if min(off, frequencies[driven] - off) < WIDTH:
            return False
    return bool(np.max(others, initial=0.0) < ALONE * lines[place])


def _line_frequency(frequencies: Array, lines: Array, place: int) -> float:
    """Return the frequency of a line between two of the spectrum [Hz], by a parabola through logarithms."""
    if not 0 < place < len(lines) - 1:
        return float(frequencies[place])
    before, here, after = np.log(np.maximum(lines[place - 1 : place + 2], np.finfo(float).tiny))
    bend = before - 2.0 * here + after
    off = 0.5 * (before - after) / bend if bend < 0.0 else 0.0
    return float(frequencies[place] + off * (frequencies[1] - frequencies[0]))


def _tone(values: Array, per_sample: float) -> Array:
    """Return the tone of a frequency [1/samples] in a channel, fitted in separate parts."""
    phase = 2.0 * np.pi * per_sample * np.arange(len(values))
    waves: Array = np.column_stack([np.cos(phase), np.sin(phase)]).astype(np.float64)
    parts = np.array_split(np.arange(len(values)), max(1, round(len(values) * per_sample / STRETCH)))
    return np.concatenate([_least_squares_fit(waves[part], values[part]) for part in parts])


def _least_squares_fit(waves: Array, values: Array) -> Array:
    """Return the least-squares fit by columns; second differences are compared, in which motion is small."""
    bends = np.diff(values, n=2)
    there = np.isfinite(bends)
    if np.count_nonzero(there) <= waves.shape[1]:
        return np.zeros(len(values))
    found = np.linalg.lstsq(np.diff(waves, n=2, axis=0)[there], bends[there], rcond=None)[0]
    return np.asarray(waves @ found, dtype=np.float64)
