"""Whether a model rings above the band that its inputs excite.

The log does not show the plant's behaviour there, so a slow pole there is fitted to noise and distortion only. It costs
nothing on held-back blocks, whose inputs are in the same band, and everything for an input that goes beyond.
"""

import numpy as np

from estimation.identification.free_run.choose_linear import Candidate
from estimation.identification.free_run.data import Channels
from estimation.identification.free_run.held_back import BLOCKS

EXCITED_SHARE = 1e-3
"""Share of an input's largest spectral density from which it shows the plant's behaviour: 30 dB less is lost in noise
of 3 % of the output."""

SMOOTHING_BANDS = 64
"""Bands of half the sampling rate over which a spectral density is averaged; lines of a multisine are closer."""


def band_end(data: Channels) -> float:
    """Return the highest frequency that an input excites.

    Parameters
    ----------
    data : Channels
        Scaled.

    Returns
    -------
    float
        Angle from one sample to the next [rad]; that of half the sample rate if no input moves.

    Examples
    --------
    >>> t = np.arange(640.0)
    >>> slow = np.sin(0.2 * t)[:, None]
    >>> round(band_end(Channels(("u",), "y", 1.0, (slow,), (t,))), 1)
    0.2
    """
    n, moves = data.longest, np.any([np.ptp(u, axis=0) > 0.0 for u in data.u], axis=0)
    if not np.any(moves):
        return np.pi
    windowed = [(u - u.mean(axis=0))[:, moves] * np.hanning(len(u))[:, None] for u in data.u]
    power = np.sum([np.abs(np.fft.rfft(u, n, axis=0)) ** 2 for u in windowed], axis=0)
    width = max(len(power) // SMOOTHING_BANDS, 1)
    smooth = [np.convolve(one, np.full(width, 1.0 / width), "same") for one in power.T]
    last = max(int(np.flatnonzero(one >= EXCITED_SHARE * one.max())[-1]) for one in smooth)
    return np.pi * last / max(len(power) - 1, 1)


def rings_above_band(one: Candidate, data: Channels, end: float) -> bool:
    """Return whether a model has a pole above the band of its inputs that rings longer than a block.

    Parameters
    ----------
    data : Channels
        The data on which it was judged.
    end : float
        Result of `band_end` [rad].
    """
    poles = np.roots(one.fit.f)
    return bool(
        np.any((np.abs(np.angle(poles)) > end) & (np.abs(poles) > np.exp(-(BLOCKS + 1.0) / data.informative_samples)))
    )
