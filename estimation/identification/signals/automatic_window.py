"""Blackman-Tukey estimates whose window is chosen at each frequency by comparing resolutions.

A long lag window resolves a resonance and is noisy, a short one is smooth and flattens it. From the longest window
down, shorter ones are accepted for as long as they agree, within their noise, with every longer one (Lepski 1991). The
band is widened by what the accepted window differs from the longer ones: what of its bias can be seen.
"""

import numpy as np
from numpy.typing import ArrayLike

from estimation.arrays import Array, ComplexArray
from estimation.identification.signals.etfe import (
    FrequencyResponse,
    checked_signals,
    correlations,
    gain_std,
    smoothed_spectra,
)
from plant.errors import HydrostateError

WINDOW_RATIO = 2.0**0.5
"""Ratio of neighbouring window lengths."""

WINDOW_COUNT = 8
"""Window lengths compared."""

LONGEST = 10
"""The longest window is this part of the record."""

AGREEMENT_DEVIATIONS = 1.0
"""Two estimates agree if they differ by less than this many standard deviations of the noisier one."""


def automatic_response(u: ArrayLike, y: ArrayLike, sample_time: float) -> FrequencyResponse:
    """Return the frequency response with the window that suits each frequency.

    Parameters
    ----------
    u, y : array_like, shape (n,)
        Input and output, no gaps; means are removed.
    sample_time : float
        Seconds between samples [s].

    Returns
    -------
    FrequencyResponse
        On the longest window's frequencies; `resolution_hz` says the width at each.

    Raises
    ------
    HydrostateError
        If the arrays do not match, hold unusable values, or are too short.

    Examples
    --------
    >>> u = np.random.default_rng(1).standard_normal(4000)
    >>> bool(np.allclose(automatic_response(u, 2.0 * u, 0.01).response, 2.0))
    True
    """
    inputs, outputs = checked_signals(u, y, sample_time)
    longest = inputs.size // LONGEST
    windows = sorted({max(int(longest / WINDOW_RATIO**k), 4) for k in range(WINDOW_COUNT)}, reverse=True)
    if longest < 16:
        raise HydrostateError(f"an automatic window needs {16 * LONGEST} samples or more, got {inputs.size}")
    size = 2 * longest
    known = correlations(inputs, outputs)
    responses, deviations, coherences = _estimates(known, windows, size, inputs.size)
    # one window longer than the accepted one: its bias is then small compared with its noise, as a band assumes
    chosen = np.maximum(_accepted(responses, deviations) - 1, 0)
    at = (chosen, np.arange(size // 2 + 1))
    # a difference between the chosen window and a longer one is bias or noise, so the band must include it
    apart = np.where(
        np.arange(len(windows))[:, None] < chosen, np.abs(np.abs(responses) - np.abs(responses[at])), 0.0
    ).max(axis=0)
    spread = np.hypot(deviations[at], 0.8 * apart)
    usable = np.isfinite(spread) & np.isfinite(responses[at])
    frequency = np.arange(size // 2 + 1) / (size * sample_time)
    resolution = 1.0 / (np.array(windows)[chosen] * sample_time)
    return FrequencyResponse(
        frequency[usable], responses[at][usable], coherences[at][usable], spread[usable], resolution[usable]
    )


def _estimates(
    known: tuple[Array, Array, Array], windows: list[int], size: int, n: int
) -> tuple[ComplexArray, Array, Array]:
    """Return response, gain deviation and coherence by window and frequency; NaN where the input has no power."""
    n_frequencies = size // 2 + 1
    responses = np.full((len(windows), n_frequencies), np.nan, dtype=np.complex128)
    deviations, coherences = np.full(responses.shape, np.nan), np.full(responses.shape, np.nan)
    for row, window in enumerate(windows):
        power_u, power_y, cross = smoothed_spectra(known, window, size)
        usable = (power_u > 0.0) & (power_y > 0.0)
        squared = np.clip(np.abs(cross[usable]) ** 2 / (power_u[usable] * power_y[usable]), 0.0, 1.0)
        responses[row, usable] = cross[usable] / power_u[usable]
        coherences[row, usable] = squared
        # near the ends of the axis fewer independent values are averaged: values at the ends are real
        edge = np.ones(n_frequencies)
        width = int(size / (2 * window)) + 1
        edge[:width] = edge[-width:] = np.sqrt(2.0)
        deviations[row, usable] = gain_std(responses[row, usable], squared, n / (0.75 * window)) * edge[usable]
    return responses, deviations, coherences


def _accepted(responses: ComplexArray, deviations: Array) -> np.ndarray:
    """Return for each frequency the row of the shortest window that agrees with all longer ones."""
    n_rows, n_frequencies = responses.shape
    chosen = np.zeros(n_frequencies, dtype=np.intp)
    open_still = np.isfinite(deviations[0])
    for row in range(1, n_rows):
        agrees = open_still & np.isfinite(deviations[row])
        for longer in range(row):
            difference = np.abs(responses[row] - responses[longer])
            with np.errstate(invalid="ignore"):
                agrees &= difference <= AGREEMENT_DEVIATIONS * deviations[longer]
        chosen[agrees] = row
        open_still = agrees
    return chosen
