"""`kept_of_means(lost, samples)`: what losses leave of a driving channel's noise in means of an output."""

import math

MOST_LOST = 500.0
"""Losses beyond which nothing is left from one sample to the next, lest exponentials overflow [dimensionless]."""


def kept_of_means(lost: float, samples: int) -> tuple[float, float]:
    """Return what losses leave of a driving channel's white noise in means of an output that it adds to at once.

    An output that follows changes of the drive and loses ``1 - a`` of itself from sample to sample has means of ``n``
    samples with ``2 (1 - a^n) / (1 - a^2) / n`` times the variance that they have without losses; between samples the
    drive is on a straight line. See decision 343.

    Parameters
    ----------
    lost : float
        Sample time over the time constant of the loss [fraction].
    samples : int
        Samples a mean [count].

    Returns
    -------
    tuple of float
        Standard deviation over that without losses [fraction], and the derivative of its logarithm by that of ``lost``
        [dimensionless].

    Examples
    --------
    >>> [round(number, 3) for number in kept_of_means(0.1, 10)]
    [0.795, -0.21]
    """
    if lost <= 0.0:
        return 1.0, 0.0
    short, whole = min(lost, MOST_LOST), min(samples * lost, MOST_LOST)
    variance = -2.0 * math.expm1(-whole) * math.tanh(0.5 * short) / (samples * lost**2)
    return variance**0.5, 0.5 * (whole / math.expm1(whole) + short / math.sinh(short)) - 1.0
