"""Features of a run: means, deviations, shape and spectrum of every channel, whatever the channels are."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pandas as pd

from estimation.arrays import Array, BoolArray
from plant.errors import HydrostateError

PARTS = 12
"""Default number of parts of a run (judged: a repeated cycle often holds some ten steps)."""

OCTAVES = 8
"""Default number of octaves below half the sampling rate whose power is taken (judged)."""

FLOOR = 1e-4
"""Share of a channel's root-mean-square that counts as rounding and is added before a logarithm [fraction]."""


@dataclass(frozen=True)
class Recipe:
    """Which features are taken.

    Parameters
    ----------
    parts : int
        Number of equal parts of a run that give a mean and a deviation each.
    octaves : int
        Largest number of octaves of power, if no edges are given.
    edges : tuple of float
        Edges of frequency bands instead [Hz].
    """

    parts: int = PARTS
    octaves: int = OCTAVES
    edges: tuple[float, ...] = ()


def channel_features(names: Sequence[str], runs: Sequence[Array], sample_time: float, recipe: Recipe) -> pd.DataFrame:
    """Return features of runs: one row for each run, one column for each feature of each channel.

    For each channel: mean and deviation in equal parts of the run, skewness, kurtosis and crest factor of the whole,
    logarithm of its deviation and of the mean power in bands of frequency (Hann's window).

    Parameters
    ----------
    names : sequence of str
        Channels.
    runs : sequence of ndarray, shape (channels, samples)
        Values without gaps [any unit].
    sample_time : float
        Seconds between samples [s].

    Returns
    -------
    pandas.DataFrame
        Columns are named after channel and feature.

    Raises
    ------
    HydrostateError
        If a run has fewer samples than parts, or a value is not finite.

    Examples
    --------
    >>> found = channel_features(["p"], [np.array([[1.0, 3.0, 5.0, 5.0]])], 1.0, Recipe(parts=2, octaves=0))
    >>> found["p mean 2/2"].tolist(), found["p deviation 1/2"].tolist()
    ([5.0], [1.0])
    """
    if not runs:
        raise HydrostateError("features of at least one run are needed, got none")
    if not (np.isfinite(sample_time) and sample_time > 0.0):
        raise HydrostateError(f"sample_time must be positive and finite, got {sample_time!r}")
    shortest = min(run.shape[1] for run in runs)
    if not 1 <= recipe.parts <= shortest:
        raise HydrostateError(
            f"parts must lie between 1 and the samples of the shortest run, {shortest}, got {recipe.parts}"
        )
    bands = _bands(recipe, shortest, sample_time)
    with np.errstate(over="ignore", invalid="ignore"):  # values that are not finite are refused below
        rows = np.stack([_row(run, sample_time, recipe.parts, bands) for run in runs])
    if not np.isfinite(rows).all():
        where = int(np.flatnonzero(~np.isfinite(rows).all(axis=1))[0])
        raise HydrostateError(f"run {where} must hold finite values, too small and too large ones apart")
    return pd.DataFrame(rows, columns=[f"{name} {one}" for name in names for one in _titles(recipe.parts, bands)])


def _bands(recipe: Recipe, shortest: int, sample_time: float) -> list[tuple[float, float]]:
    """Return bands of frequency [Hz], each of which contains a spectral line of the shortest run."""
    if recipe.edges:
        edges = list(recipe.edges)
        if len(edges) < 2 or edges[0] < 0.0 or any(after <= before for before, after in pairwise(edges)):
            raise HydrostateError(f"bands must be two rising frequencies or more [Hz], got {edges}")
    else:
        half = 0.5 / sample_time
        edges = [half / 2.0**k for k in range(recipe.octaves + 1) if half / 2.0**k >= 0.5 / (shortest * sample_time)]
        edges = edges[::-1]
    lines = np.arange(shortest // 2 + 1) / (shortest * sample_time)
    bands = list(pairwise(edges))
    empty = [band for band in bands if not _is_inside_band(lines, band).any()]
    if empty and recipe.edges:
        low, high = empty[0]
        raise HydrostateError(
            f"the band {low:g} to {high:g} Hz holds no frequency of a run of {shortest} samples at "
            f"{1.0 / sample_time:g} Hz"
        )
    return [band for band in bands if band not in empty]


def _is_inside_band(lines: Array, band: tuple[float, float]) -> BoolArray:
    return (lines > band[0]) & (lines <= band[1] * (1.0 + 1e-9))


def _titles(parts: int, bands: Sequence[tuple[float, float]]) -> list[str]:
    split = [f"{what} {k + 1}/{parts}" for what in ("mean", "deviation") for k in range(parts)]
    return [*split, "skewness", "kurtosis", "crest", "log deviation", *(f"power {a:.4g}-{b:.4g} Hz" for a, b in bands)]


def _row(run: Array, sample_time: float, parts: int, bands: Sequence[tuple[float, float]]) -> Array:
    """Return the features of one run, channel after channel."""
    ends = np.arange(parts + 1) * run.shape[1] // parts
    pieces = [run[:, first:last] for first, last in pairwise(ends)]
    means, deviations = (np.stack([np.asarray(f(one)) for one in pieces], axis=1) for f in (_mean, _deviation))
    left = run - run.mean(axis=1, keepdims=True)
    floor = FLOOR * np.sqrt(np.mean(run**2, axis=1)) + 1e-150
    size = np.sqrt(np.mean(left**2, axis=1)) + floor
    unit = left / size[:, None]
    shape = [np.mean(unit**3, axis=1), np.mean(unit**4, axis=1), np.abs(unit).max(axis=1), np.log(size)]
    lines = np.arange(run.shape[1] // 2 + 1) / (run.shape[1] * sample_time)
    power = np.abs(np.fft.rfft(unit * np.hanning(run.shape[1]), axis=1)) ** 2 / run.shape[1]
    share = (floor / size) ** 2
    spectrum = [
        np.log(power[:, _is_inside_band(lines, band)].mean(axis=1) + share + 1e-12) + 2.0 * np.log(size)
        for band in bands
    ]
    columns = [means, deviations, *(one[:, None] for one in (*shape, *spectrum))]
    return np.concatenate(columns, axis=1).ravel()


def _mean(values: Array) -> Array:
    return values.mean(axis=1)


def _deviation(values: Array) -> Array:
    return values.std(axis=1)
