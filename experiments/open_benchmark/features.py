"""Features of a log that need no model of the actuator: simple statistics, and the response of random kernels."""

import numpy as np

from plant.arrays import Array

QUANTILES = (0.02, 0.25, 0.5, 0.75, 0.98)

TAPS = 9
"""Length of a kernel [samples]."""


def simple_features(series: Array) -> Array:
    """Return spread, quantiles and roughness of each channel, and relations between channels.

    Parameters
    ----------
    series : ndarray, shape (logs, 4, samples)
        Motor speed, position, velocity, differential pressure, SI.

    Returns
    -------
    ndarray, shape (logs, 44)
        Each feature in its channel's unit, or a ratio of two channels.
    """
    speed, _, velocity, pressure = np.moveaxis(series, 1, 0)
    each = [np.std(series, axis=2), np.std(np.diff(series, axis=2), axis=2)]
    each += list(np.quantile(series, QUANTILES, axis=2))
    pairs = ((speed, velocity), (speed, pressure), (velocity, pressure))
    slopes = [np.sum(a * b, axis=1) / (np.sum(a * a, axis=1) + 1e-12) for a, b in pairs]
    forward = [np.mean(one * np.sign(speed), axis=1) for one in (speed, velocity, pressure)]
    fast = np.abs(speed) > 0.7 * np.quantile(np.abs(speed), 0.95, axis=1, keepdims=True)
    slow = ~fast & (np.abs(speed) > 0.0)
    when = [np.sum(one * np.sign(speed) * part, axis=1) for one in (velocity, pressure) for part in (fast, slow)]
    counts = [np.sum(part, axis=1) + 1.0 for part in (fast, slow)] * 2
    held = [total / count for total, count in zip(when, counts, strict=True)]
    rest = [np.max(np.abs(pressure), axis=1), np.max(np.abs(velocity), axis=1)]
    tail = [np.mean(np.abs(np.diff(one, axis=1)), axis=1) for one in (velocity, pressure, speed, series[:, 1])]
    return np.column_stack([*each, *slopes, *forward, *held, *rest, *tail])


def random_kernels(count: int, samples: int, rng: np.random.Generator) -> list[tuple[Array, Array, int, float]]:
    """Return kernels drawn as in ROCKET: weights, the channels' shares, dilation [samples] and bias.

    Source: Dempster, Petitjean and Webb, Data Mining and Knowledge Discovery 34 (2020), section 3.1.

    Returns
    -------
    list of tuple
        Weights, shape (9,), shares, shape (4,), dilation and bias of each.
    """
    drawn: list[tuple[Array, Array, int, float]] = []
    for _ in range(count):
        weights = rng.standard_normal(TAPS)
        shares = np.where(rng.random(4) < 0.5, rng.standard_normal(4), 0.0)
        dilation = int(2.0 ** rng.uniform(0.0, np.log2((samples - 1) / (TAPS - 1))))
        drawn.append((weights - weights.mean(), shares, dilation, float(rng.uniform(-1.0, 1.0))))
    return drawn


def kernel_features(series: Array, kernels: list[tuple[Array, Array, int, float]]) -> Array:
    """Return the share of positive responses of each kernel, and its maximum.

    Parameters
    ----------
    series : ndarray, shape (logs, 4, samples)
        Each channel divided by its magnitude in the training logs [dimensionless].
    kernels : list of tuple, weights of shape (9,), shares of shape (4,)
        Kernels from `random_kernels` [dimensionless].

    Returns
    -------
    ndarray, shape (logs, 2 kernels)
        Share of samples with a positive response, and the maximum response [dimensionless].
    """
    out = np.empty((len(series), 2 * len(kernels)))
    for k, (weights, shares, dilation, bias) in enumerate(kernels):
        mixed = np.tensordot(shares, series, axes=(0, 1))
        length = mixed.shape[1] - (TAPS - 1) * dilation
        response = np.full((len(mixed), length), bias)
        for i, weight in enumerate(weights):
            response += weight * mixed[:, i * dilation : i * dilation + length]
        out[:, 2 * k], out[:, 2 * k + 1] = np.mean(response > 0.0, axis=1), np.max(response, axis=1)
    return out
