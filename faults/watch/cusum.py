"""The CUSUM of Page (Biometrika 41, 1954, page 100) on a balance's log NIS, and the threshold for a false-alarm rate.

The logarithm of a block's NIS is standardised by the usual values for its excitation (`faults.watch.excitation`).
`faults.watch.watch` explains why the threshold follows from the peaks of the sum's excursions.
"""

import math

from plant.arrays import Array

SUM, PEAK, THRESHOLD, SQUARES = range(4)
"""Indices in a balance's score: the CUSUM, the peak of its excursion and its threshold [standard deviations]; the
squared innovations of the current block."""


WHITE_SLOPE, WHITE_OFFSET = 0.385, 0.73
"""Threshold of white noise: the slope over the logarithm of the rate, and what is less [standard deviations]. Simulated
for blocks of ten intervals and an allowance of one deviation, in 6e7 blocks: within 0.05 from 1e-3 to 2e-7 alarms per
block."""


def accumulate(score: Array, peaks: Array, u: float, allowance: float, width: float) -> None:
    """Add a block's score to the CUSUM; when an excursion ends, count its peak in a histogram of levels."""
    score[SUM] = max(0.0, score[SUM] + u - allowance)
    if score[SUM] > 0.0:
        score[PEAK] = max(score[PEAK], score[SUM])
    elif score[PEAK] > 0.0:
        peaks[min(int(score[PEAK] / width), peaks.shape[0] - 1)] += 1.0
        score[PEAK] = 0.0


def threshold(peaks: Array, alarms: float, width: float, expected: float) -> float:
    """Return the level that peaks are expected to exceed `expected` times in the time over which they were gathered.

    Parameters
    ----------
    peaks : ndarray, shape (levels,)
        Number of excursions that peaked at each level [count].
    alarms : float
        Number of excursions that passed the threshold [count].
    width : float
        Width of a level [standard deviations].
    expected : float
        Number of excursions allowed to exceed the threshold [count].

    Returns
    -------
    float
        The threshold [standard deviations].
    """
    total = alarms
    for count in peaks:
        total += count
    wanted = max(20.0, total ** (2.0 / 3.0))
    above, place = alarms, len(peaks)
    while place > 0 and above < wanted:
        place -= 1
        above += peaks[place]
    below = alarms
    excess = 0.0
    for i in range(place, len(peaks)):
        excess += peaks[i] * (i - place + 0.5) * width
    gathered = above - below
    if gathered < 1.0:
        return math.inf
    if above <= expected:
        return place * width
    mean = excess / gathered
    if below > 0.0:
        # an alarm cuts its excursion off at the threshold, so the peak is at least that (censored exponential)
        for _ in range(3):
            level = gathered * mean * ((above / expected) ** (1.0 / gathered) - 1.0)
            mean = (excess + below * level) / gathered
    return place * width + gathered * mean * ((above / expected) ** (1.0 / gathered) - 1.0)


def white_threshold(expected: float) -> float:
    """Return the threshold that the CUSUM of white noise exceeds at a given rate: no stream has a lower one.

    A drive that repeats itself has peaks of nearly one height, which tell nothing of the tail beyond them.

    Parameters
    ----------
    expected : float
        Expected alarms per block [count].

    Examples
    --------
    >>> round(white_threshold(1e-5), 2)
    3.7
    """
    return max(WHITE_SLOPE * math.log(1.0 / expected) - WHITE_OFFSET, 1.0)
