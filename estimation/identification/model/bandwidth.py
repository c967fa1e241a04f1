"""Bandwidth: where a response has fallen by 3 dB, and its standard deviation."""

from typing import TYPE_CHECKING

import numpy as np

from estimation.fits.root import root_between

if TYPE_CHECKING:
    from estimation.identification.model.linear_model import LinearModel

SLOPE_STEP = 1e-5
"""Relative step of the gain's slope at the corner."""


def bandwidth(model: "LinearModel") -> float | None:
    """Return the lowest frequency at which the gain is 3 dB below that at zero frequency.

    Returns
    -------
    float or None
        Frequency [Hz]; None if the gain never falls so far, or has no end at zero frequency.
    """
    top = 100.0 * float(np.abs(model.poles).max()) / (2.0 * np.pi) if model.continuous else 0.5 / model.sample_time
    grid = top * np.concatenate([[0.0], np.logspace(-5.0, -2.0, 300), np.linspace(0.01, 1.0, 2000)[1:]])
    gain = np.abs(model.response_gradient(grid)[0])
    wanted = gain[0] / np.sqrt(2.0)
    below = np.flatnonzero(gain < wanted)
    if below.size == 0 or not np.isfinite(wanted):
        return None

    def excess(frequency: float) -> float:
        return float(np.abs(model.response_gradient([frequency])[0][0]) - wanted)

    return root_between(excess, float(grid[below[0] - 1]), float(grid[below[0]]), 0.0)


def bandwidth_std(model: "LinearModel") -> float | None:
    """Return the standard deviation of the bandwidth, first order in the covariance.

    Returns
    -------
    float or None
        Standard deviation [Hz]; None where there is no bandwidth or no covariance.
    """
    corner = bandwidth(model)
    if corner is None:
        return None
    response, gradient = model.response_gradient(
        [0.0, corner, corner * (1.0 - SLOPE_STEP), corner * (1.0 + SLOPE_STEP)]
    )
    power = np.real(np.conj(response[:2, None]) * gradient[:2])
    slope = (np.abs(response[3]) ** 2 - np.abs(response[2]) ** 2) / (4.0 * SLOPE_STEP * corner)
    if slope == 0.0 or not np.isfinite(model.covariance).all():
        return None
    moved = (power[1] - 0.5 * power[0]) / slope
    return float(np.sqrt(max(float(moved @ model.covariance @ moved), 0.0)))
