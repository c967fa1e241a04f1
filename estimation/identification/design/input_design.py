"""Test signals for identification: made for a bandwidth, kept within limits, ranked by predicted accuracy."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.signal import max_len_seq

from estimation.arrays import Array
from estimation.identification.model.linear_model import LinearModel
from estimation.identification.search.criterion import Structure, sensitivities
from plant.errors import HydrostateError

if TYPE_CHECKING:
    import pandas as pd

CLOCK_SHARE = 0.4
"""A PRBS's power is 3 dB down at this over its clock; the clock is chosen so that it is the bandwidth."""

CLIPPINGS, CLIPPED_AT = 200, 0.85
"""Rounds in which a multisine's peaks are clipped, and at what share of the highest."""

PERIODS_OF_SLOWEST = 5.0
"""A sequence should last as many of the slowest time constants."""


@dataclass(frozen=True)
class Limits:
    """Limits of a drive signal.

    Parameters
    ----------
    speed : float
        Highest input, either way [input unit].
    dead_zone : float
        Input below which nothing moves [input unit].
    stroke : float
        Range of the output's integral, from end to end [output unit times s]; infinite by default.
    output : float
        Highest output, either way, e.g. where a relief valve opens [output unit]; infinite by default.
    """

    speed: float
    dead_zone: float = 0.0
    stroke: float = float("inf")
    output: float = float("inf")

    def __post_init__(self) -> None:
        if not 0.0 <= self.dead_zone < self.speed or self.stroke <= 0.0 or self.output <= 0.0:
            raise HydrostateError(
                "limits need 0 <= dead_zone < speed and positive stroke and output, "
                f"got {self.dead_zone}, {self.speed}, {self.stroke} and {self.output}"
            )


def prbs_for(bandwidth_hz: float, sample_time: float, limits: Limits, *, slowest: float, duration: float) -> Array:
    """Return a maximum-length binary signal whose clock and length suit a bandwidth.

    The clock period is 0.4 / bandwidth, so that the power is 3 dB lower at the bandwidth. The register is the shortest
    whose sequence lasts five of the slowest time constants. The sequence repeats for the given duration.

    Parameters
    ----------
    bandwidth_hz : float
        Highest frequency of interest [Hz].
    sample_time : float
        Seconds between samples [s].
    limits : Limits
        The level is the highest speed; it must exceed the dead zone.
    slowest : float
        Slowest time constant expected [s].
    duration : float
        Length of the test [s].

    Returns
    -------
    ndarray, shape (round(duration / sample_time),)
        Input [input unit].

    Raises
    ------
    HydrostateError
        If the clock would be shorter than a sample.

    Examples
    --------
    >>> u = prbs_for(25.0, 1e-3, Limits(125.66), slowest=0.1, duration=1.0)
    >>> u.size, int(np.diff(np.flatnonzero(np.diff(u))).min())
    (1000, 16)
    """
    hold = int(np.floor(CLOCK_SHARE / (bandwidth_hz * sample_time) + 1e-9))
    if hold < 1:
        raise HydrostateError(
            f"a bandwidth of {bandwidth_hz:g} Hz needs samples of {CLOCK_SHARE / bandwidth_hz:.3g} s or shorter, "
            f"got {sample_time:g} s"
        )
    wanted = max(PERIODS_OF_SLOWEST * slowest / (hold * sample_time), 7.0)
    bits = int(np.clip(np.ceil(np.log2(wanted + 1.0)), 3, 16))
    n = round(duration / sample_time)
    sequence = max_len_seq(bits, length=n // hold + 1)[0].astype(np.float64)
    return limits.speed * np.repeat(2.0 * sequence - 1.0, hold)[:n]


def multisine_for(frequencies_hz: Array, sample_time: float, limits: Limits, *, duration: float) -> Array:
    """Return sines of equal power with a low crest factor, scaled to the highest speed.

    The phases are Schroeder's, then repeatedly those of the clipped signal (Van der Ouderaa and others 1988).

    Parameters
    ----------
    frequencies_hz : ndarray, shape (k,)
        Frequencies [Hz]; rounded to whole periods of the test.
    sample_time : float
        Seconds between samples [s].
    duration : float
        Length of the test [s].

    Returns
    -------
    ndarray, shape (round(duration / sample_time),)
        Input [input unit].

    Raises
    ------
    HydrostateError
        If a frequency is not between one period of the test and Nyquist.
    """
    n = round(duration / sample_time)
    bins = np.unique(np.rint(np.asarray(frequencies_hz, dtype=np.float64) * n * sample_time).astype(int))
    if bins.size == 0 or bins[0] < 1 or bins[-1] >= n / 2:
        raise HydrostateError(
            f"frequencies must lie between {1.0 / duration:g} and {0.5 / sample_time:g} Hz, got {frequencies_hz}"
        )
    k = np.arange(1, bins.size + 1)
    phase = -np.pi * k * (k - 1) / bins.size
    spectrum = np.zeros(n // 2 + 1, dtype=np.complex128)
    spectrum[bins] = np.exp(1j * phase)
    best = np.fft.irfft(spectrum, n)
    for _ in range(CLIPPINGS):
        signal = np.fft.irfft(spectrum, n)
        if np.abs(signal).max() < np.abs(best).max():
            best = signal
        clipped = np.clip(signal, -CLIPPED_AT * np.abs(signal).max(), CLIPPED_AT * np.abs(signal).max())
        spectrum[bins] = np.exp(1j * np.angle(np.fft.rfft(clipped)[bins]))
    return limits.speed * best / np.abs(best).max()


def violations(model: LinearModel, u: Array, limits: Limits) -> list[str]:
    """Return the limits that a test would violate in a simulation; empty if it may be run.

    Parameters
    ----------
    model : LinearModel
        From the input to the output that `limits` bounds.
    u : ndarray, shape (n,)
        Input [input unit].
    """
    output = model.simulate(u)
    path = np.cumsum(output) * model.sample_time
    swept = float(path.max() - path.min())
    idle = float(np.mean(np.abs(u) <= limits.dead_zone)) if limits.dead_zone > 0.0 else 0.0
    reached, given = float(np.abs(u).max()), float(np.abs(output).max())
    checks = (
        (reached > limits.speed * (1.0 + 1e-12), f"the input reaches {reached:.4g}, its limit is {limits.speed:.4g}"),
        (given > limits.output, f"the output reaches {given:.4g}, its limit is {limits.output:.4g}"),
        (swept > limits.stroke, f"the stroke needed is {swept:.4g}, there is {limits.stroke:.4g}"),
        (idle > 0.5, f"the input is inside the dead zone for {100.0 * idle:.0f} % of the time"),
    )
    return [said for broken, said in checks if broken]


def predicted_covariance(model: LinearModel, u: Array, noise_std: float) -> Array:
    """Return the covariance of an efficient fit to a test: the Cramér-Rao bound at the model.

    Parameters
    ----------
    u : ndarray, shape (n,)
        Input [input unit].
    noise_std : float
        Standard deviation of white output noise [output unit].

    Returns
    -------
    ndarray, shape (p, p)
        Of ``[b[delay:], f[1:]]``, the initial state estimated along.
    """
    form = Structure(model.free_numerator.size, model.denominator.size - 1, model.delay)
    theta = np.concatenate([model.free_numerator, model.denominator[1:], np.zeros(form.n_initial)])
    jacobian = sensitivities(form, theta, np.asarray(u, dtype=np.float64))
    scale = np.linalg.norm(jacobian, axis=0)
    scale[scale == 0.0] = 1.0
    triangle = np.linalg.qr(jacobian / scale, mode="r")
    inverse = np.linalg.pinv(triangle)
    n_main = form.n_numerator + form.n_denominator
    covariance = noise_std**2 * (inverse @ inverse.T) / np.outer(scale, scale)
    return covariance[:n_main, :n_main]


def rank_inputs(
    model: LinearModel,
    candidates: Mapping[str, Array],
    noise_std: float,
    frequencies_hz: Array,
    limits: Limits,
) -> "pd.DataFrame":
    """Return the accuracy of the response for each test, best first.

    Parameters
    ----------
    candidates : Mapping of ndarray, shape (n,)
        Inputs by name [input unit].
    noise_std : float
        Standard deviation of white output noise [output unit].
    frequencies_hz : ndarray, shape (k,)
        Where the response is wanted [Hz].

    Returns
    -------
    pandas.DataFrame
        Indexed by name: relative standard deviation of the gain at each frequency (``at_25_hz`` and so on), of the
        steady-state gain, ``worst`` of all, and ``violations``.
    """
    rows: dict[str, dict[str, object]] = {}
    frequencies = np.concatenate([[0.0], np.asarray(frequencies_hz, dtype=np.float64)])
    response, gradient = model.response_gradient(frequencies)
    turned = np.real(gradient * (np.conj(response) / np.abs(response))[:, None])
    for name, u in candidates.items():
        covariance = predicted_covariance(model, u, noise_std)
        spread = np.sqrt(np.einsum("ij,jk,ik->i", turned, covariance, turned)) / np.abs(response)
        row: dict[str, object] = {f"at_{f:g}_hz": float(s) for f, s in zip(frequencies[1:], spread[1:], strict=True)}
        rows[name] = row | {
            "steady_state": float(spread[0]),
            "worst": float(spread.max()),
            "violations": "; ".join(violations(model, u, limits)),
        }
    import pandas as pd

    return pd.DataFrame.from_dict(rows, orient="index").rename_axis("input").sort_values("worst")
