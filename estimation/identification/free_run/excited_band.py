"""Whether a model answers most where its inputs hardly move: above the band that they excite.

What a plant does there is not in the log, so a pole that rings there is fitted to noise and distortion alone. It costs
nothing on held-back blocks, whose inputs lie in the same band, and everything on an input that goes beyond.
"""

import numpy as np

from estimation.arrays import Array
from estimation.identification.free_run.data import Channels
from estimation.identification.free_run.linear_dynamics import LinearDynamics
from estimation.identification.free_run.linear_problem import LinearFit

SHOWN = 1e-3
"""Share of an input's largest spectral density from which on it shows what a plant does: 30 dB less is lost in noise of
3 % of the output."""

SMOOTHED = 64
"""Parts of half the sampling rate over which a spectral density is a mean; lines of a multisine lie closer."""

FREQUENCIES = np.linspace(0.0, np.pi, 513)
"""At which gains are compared, beside the angles of poles [rad/sample]."""


def band_ends(data: Channels) -> list[float]:
    """Return the highest frequency that each input excites [rad/sample].

    Parameters
    ----------
    data : Channels
        Scaled.

    Examples
    --------
    >>> t = np.arange(640.0)
    >>> slow = np.sin(0.2 * t)[:, None]
    >>> [round(end, 1) for end in band_ends(Channels(("u",), "y", 1.0, (slow,), (t,)))]
    [0.2]
    """
    n = data.longest
    windowed = [(u - u.mean(axis=0)) * np.hanning(len(u))[:, None] for u in data.u]
    power = np.sum([np.abs(np.fft.rfft(u, n, axis=0)) ** 2 for u in windowed], axis=0)
    width = max(len(power) // SMOOTHED, 1)
    smooth = [np.convolve(one, np.full(width, 1.0 / width), "same") for one in power.T]
    return [np.pi * float(np.flatnonzero(one >= SHOWN * one.max())[-1]) / max(len(power) - 1, 1) for one in smooth]


def answers_beyond(fit: LinearFit, ends: list[float]) -> bool:
    """Return whether the gain from an input is largest above the band that it excites.

    Parameters
    ----------
    fit : LinearFit
        A linear model.
    ends : list of float
        As `band_ends` returns them [rad/sample].

    Returns
    -------
    bool
        Of any input.
    """
    poles = np.abs(np.angle(np.roots(fit.f)))
    frequencies: Array = np.concatenate([FREQUENCIES, poles])
    back = np.exp(-1j * frequencies)
    for (b, f), end in zip(LinearDynamics.of(fit).transfer_functions(), ends, strict=True):
        gain = np.abs(np.polyval(b[::-1], back)) / np.maximum(np.abs(np.polyval(f[::-1], back)), 1e-300)
        if frequencies[int(np.argmax(gain))] > end:
            return True
    return False
