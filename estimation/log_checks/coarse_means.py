"""`coarse_mean_variance(values, rows) -> float`: what averaging leaves of a coarse encoder's error.

Between two counts of an encoder the reading stays, and so does its error: a mean over samples of one count is as wrong
as one of them. Noise of a count or more, and motion over several counts, spread the readings; only that averages.
"""

import numpy as np

from estimation.log_checks.measurement_noise import is_coarse, position_variance
from plant.arrays import Array


def coarse_mean_variance(position: Array, rows: int) -> float:
    """Return the variance of means of a position whose encoder is too coarse for its noise to average out.

    Parameters
    ----------
    position : ndarray, shape (n,)
        Position [m]; NaN where missing.
    rows : int
        Samples a mean.

    Returns
    -------
    float
        Variance [m^2]; 0 for a finer encoder, whose noise averages as that of any sensor.

    Examples
    --------
    >>> path = np.linspace(0.0, 1e-3, 10_000)
    >>> coarse, fine = np.round(path / 1e-4) * 1e-4, path + np.random.default_rng(1).normal(0.0, 1e-6, 10_000)
    >>> round((12.0 * coarse_mean_variance(coarse, 10)) ** 0.5 * 1e6, 1), coarse_mean_variance(fine, 10)
    (100.0, 0.0)
    """
    known = position[np.isfinite(position)]
    variance = position_variance(known)
    if rows < 2 or len(known) < 2 or not is_coarse(known, variance):
        return 0.0
    counts = rows * float(np.mean(np.diff(known) != 0.0))  # that pass while a mean is taken
    return variance / float(np.clip(counts, 1.0, rows))
