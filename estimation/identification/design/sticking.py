"""Detects a piston that rests while it is driven. No linear model does so, and poles of high order imitate it.

If friction holds a piston at each reversal until the pressure has reversed, velocity stays at zero for 50 to 100 ms and
then breaks loose. Output error of first or second order passes through zero. Each further pole waits a little longer
and fits better, so information criteria accept every order that is offered.
"""

import numpy as np

from estimation.arrays import Array
from estimation.identification.fit.output_error import fit_output_error

AT_REST, DRIVEN = 0.05, 0.5
"""Shares of the 95th percentiles of output and input, below which the output rests, and above which it is driven."""

SMOOTHING_SPAN = 9e-3
"""Span over which the output is averaged first, so that its noise does not hide a rest [s]."""

LEAST_EXCESS, LEAST_RATIO = 0.01, 1.25
"""It is said to rest if it does so in this share of the samples more than a second-order model, and so many times as
often. That flags 17 of 18 logs of a bench with friction (the excess is 1.6 to 10 %, and 0.4 % of the last), and none of
108 records of the linear models of Table 6 at 1 and 10 % noise (0.3 % at most)."""


def rest_shares(u: Array, y: Array, sample_time: float) -> tuple[float, float]:
    """Return the share of the driven samples in which the output rests, and in which a second-order model would rest.

    Parameters
    ----------
    u, y : ndarray, shape (n,)
        Input, no gaps; output, NaN where missing: a velocity, or another output that friction can hold at zero.
    sample_time : float
        Seconds between samples [s].

    Returns
    -------
    tuple of float
        Measured and by the model [fraction].
    """
    from scipy.ndimage import uniform_filter1d

    known = np.isfinite(y)
    driven = known & (np.abs(u) > DRIVEN * np.quantile(np.abs(u), 0.95))
    level = AT_REST * float(np.quantile(np.abs(y[known]), 0.95))
    model = fit_output_error(u, y, sample_time, n_numerator=3, n_denominator=2)
    simulated = model.simulate(u, initial=model.initial_state)
    span = max(1, round(SMOOTHING_SPAN / sample_time))
    shares = [
        float(np.mean(np.abs(uniform_filter1d(signal, span))[driven] < level))
        for signal in (np.where(known, y, simulated), simulated)
    ]
    return shares[0], shares[1]


def is_sticking(measured: float, linear: float) -> bool:
    """Return whether an output rests more than a linear model explains.

    Parameters
    ----------
    measured, linear : float
        As `rest_shares` returns them [fraction].

    Examples
    --------
    >>> is_sticking(0.12, 0.02), is_sticking(0.03, 0.02)
    (True, False)
    """
    return measured > max(linear + LEAST_EXCESS, LEAST_RATIO * linear)
