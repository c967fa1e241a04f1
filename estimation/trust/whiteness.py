"""Whiteness of a filter's innovations as a test of its model: alone, against each other, against the drive.

With 1e5 samples every test of whiteness rejects every model, so significance is not the question. What counts is by how
much an interval is too narrow. A parameter is learnt at frequencies at which the drive has its power. If innovations
have r times the power of white noise there, its standard deviation is too small by up to the root of r, according to
the sandwich covariance for a sensitivity in that band (White 1982, theorem 3.2). Less power than white noise means that
the filter is cautious, and is no objection. The test takes a few Fourier transforms of the kept innovations.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from estimation.arrays import Array, BoolArray
from estimation.filters.run import Estimate
from estimation.log_checks.bridging import bridged
from plant.log.record import Record

SEGMENTS = 8
"""Number of segments whose spectra are averaged: few, so that a line of the drive stands out; enough for a sharp
threshold."""

SETTLING = 0.2
"""Initial share of the log in which a filter settles and its innovations do not count [fraction]."""

LAGS = 20
"""Lags of the Ljung-Box statistic."""

FALSE_ALARMS = 1e-3
"""Probability that white innovations of a whole log exceed the threshold [probability]."""

FEWEST = 32 * SEGMENTS
"""Fewest samples for a verdict on whiteness."""

DRIVEN_SHARE, DRIVEN_REACH = 0.95, 10.0
"""The band that counts: up to this multiple of the frequency below which this share of the drive's power lies. Friction
answers a drive with harmonics, and parameters are learnt at their frequencies."""


ROUNDING_SHARE = 0.5
"""Share of rounding in a channel's predicted variance above which its noise is mostly rounding [fraction]."""

REPEATED_SHARE = 1e-3
"""A channel that repeats its value in at least this share of its samples is quantised [fraction]."""


@dataclass(frozen=True)
class Whiteness:
    """Whiteness of the innovations of one channel.

    Parameters
    ----------
    count : int
        Samples present after settling.
    excess : float
        Largest power of the innovations in the band that counts, over that of white noise of the predicted variance,
        less what the channel's quantum can explain [dimensionless]; 1 on average if the filter is consistent. Apart
        from the drive's frequencies, an encoder's innovations of less than half a step do not count: at a constant
        speed its rounding beats with the clock.
    threshold : float
        Excess that white innovations exceed only with probability `FALSE_ALARMS` [dimensionless].
    frequency : float
        Frequency of the largest power [Hz]; 0 for a drift too slow to resolve.
    resolution : float
        Frequency resolution [Hz].
    driven : bool
        Whether the drive has at least a tenth of its largest power there.
    ljung_box : float
        Probability that white noise has autocorrelations at least as large (Ljung and Box 1978, equation 3)
        [probability].
    autocorrelation : float
        Largest autocorrelation over `LAGS` lags [dimensionless].
    crosses : float
        Largest correlation with the innovation of another channel at the same instant [dimensionless].
    with_drive : float
        Share of the innovations' variance that a linear function of the drive's history explains [fraction].
    """

    channel: str
    count: int
    excess: float
    threshold: float
    frequency: float
    resolution: float
    driven: bool
    ljung_box: float
    autocorrelation: float
    crosses: float
    with_drive: float

    @property
    def exceeded(self) -> bool:
        """Whether the excess is larger than that of white innovations."""
        return self.excess > self.threshold


def whiteness(estimate: Estimate, record: Record) -> tuple[Whiteness, ...]:
    """Test the whiteness of a filter's stored innovations.

    Parameters
    ----------
    record : Record
        The log, for its drive and for the resolution of its sensors.

    Returns
    -------
    tuple of Whiteness
        One for each channel that has samples; none if innovations were not kept or are too few, or the filter diverged.
    """
    from scipy.special import chdtri

    first = int(SETTLING * len(estimate.residuals))
    normal, present = _normalised(estimate, first)
    kept = [c for c in range(normal.shape[1]) if np.count_nonzero(present[:, c]) >= FEWEST]
    if not kept or not np.all(np.isfinite(normal)):
        return ()
    drive = _drive_spectrum(bridged(record[estimate.model.drives[0]])[first:], len(normal) // SEGMENTS)
    resolution = 1.0 / (drive.length * record.sample_time)
    quantile = float(chdtri(2 * SEGMENTS, FALSE_ALARMS / (len(kept) * drive.band)))
    found: list[Whiteness] = []
    for c in kept:
        values, count, channel = normal[:, c], int(np.count_nonzero(present[:, c])), record[estimate.channels[c]]
        power = _counted_power(values, _whole_steps(estimate, first, c, quantum(channel)), count, drive)
        peak = int(np.argmax(power))
        lags = _autocorrelations(values)
        pattern = _quantisation(channel) / float(np.nanmedian(estimate.residual_variances[first:, c]))
        found.append(
            Whiteness(
                channel=estimate.channels[c],
                count=count,
                excess=max(0.0, float(power[peak]) - drive.concentration * pattern * drive.length / 2.0),
                threshold=quantile / (2 * SEGMENTS),
                frequency=peak / (drive.length * record.sample_time),
                resolution=resolution,
                driven=bool(drive.driven[peak]),
                ljung_box=_ljung_box(lags, count),
                autocorrelation=float(lags[np.argmax(np.abs(lags))]),
                crosses=max((_correlation(values, normal[:, o]) for o in kept if o != c), default=0.0, key=abs),
                with_drive=_coherent_share(values, drive.centred, drive.length),
            )
        )
    return tuple(found)


class _DriveSpectrum(NamedTuple):
    """Spectrum of a drive over segments of a ``length`` [samples].

    ``centred`` is the drive without its mean, ``band`` the number of frequencies that count, ``concentration`` the
    share of the largest power in the whole, and ``driven`` where the drive has power.
    """

    centred: Array
    length: int
    band: int
    concentration: float
    driven: BoolArray


def _drive_spectrum(drive: Array, length: int) -> _DriveSpectrum:
    centred = drive - np.mean(drive)
    power = np.mean(np.abs(_spectra(centred, length)) ** 2, axis=0)
    concentration = float(np.max(power) / max(np.sum(power), np.finfo(float).tiny))
    around = np.max([np.roll(np.pad(power, 1), shift)[1:-1] for shift in (-1, 0, 1)], axis=0)
    driven = (around >= 0.1 * np.max(power)) & bool(np.max(power) > 0.0)
    return _DriveSpectrum(centred, length, _counted_frequencies(power), concentration, driven)


def _counted_power(values: Array, steps: Array | None, count: int, drive: _DriveSpectrum) -> Array:
    """Return the power of innovations at the frequencies that count; beside the drive's, of whole ``steps`` if less."""

    def power_of(signal: Array) -> Array:
        power = np.mean(np.abs(_spectra(signal, drive.length)) ** 2, axis=0)[: drive.band]
        return power * (len(values) / count)

    power = power_of(values)
    if steps is not None:
        beside = ~drive.driven[: drive.band]
        beside[0] = False  # the mean is no beat
        power = np.where(beside, np.minimum(power, power_of(steps)), power)
    power[0] *= 0.5  # the mean is real, with half the degrees of freedom; halved, it has the same threshold
    return power


def _normalised(estimate: Estimate, first: int) -> tuple[Array, BoolArray]:
    """Return innovations over their deviations after settling, 0 if a sample is missing; and which are present."""
    residuals, variances = estimate.residuals[first:], estimate.residual_variances[first:]
    present = ~np.isnan(residuals)
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):  # a diverged filter gives NaN
        return np.where(present, residuals / np.sqrt(variances), 0.0), present


def _whole_steps(estimate: Estimate, first: int, channel: int, quantum: float) -> Array | None:
    """Return normalised innovations in whole steps of a channel whose noise is mostly rounding, None for others."""
    residuals, variances = estimate.residuals[first:, channel], estimate.residual_variances[first:, channel]
    if not ROUNDING_SHARE * float(np.nanmedian(variances)) <= quantum**2 / 12.0 < np.inf:
        return None
    return np.where(np.isnan(residuals), 0.0, quantum * np.round(residuals / quantum) / np.sqrt(variances))


def _spectra(values: Array, length: int) -> Array:
    """Return the Fourier transforms of whole segments, scaled so that white noise of variance 1 has power 1."""
    return np.fft.rfft(values[: SEGMENTS * length].reshape(SEGMENTS, length), axis=1) / np.sqrt(length)


def _counted_frequencies(drive: Array) -> int:
    """Return the number of frequencies that count, from 0 upwards; a tenth of them without a drive."""
    total = np.cumsum(drive)
    if not total[-1] > 0.0:
        return max(2, len(drive) // 10)
    highest = int(np.searchsorted(total, DRIVEN_SHARE * total[-1]))
    return int(min(len(drive) - 1, max(2.0, DRIVEN_REACH * highest + 1)))


def _quantisation(values: Array) -> float:
    """Return the variance of quantisation while a channel repeats itself: a pattern like the drive's, not noise."""
    return float(np.mean(np.diff(values) == 0.0)) * quantum(values) ** 2 / 12.0


def quantum(values: Array) -> float:
    """Return the resolution of a channel: its smallest step, if it often repeats itself.

    Parameters
    ----------
    values : ndarray, shape (samples,)
        The channel; NaN is missing [any unit].

    Returns
    -------
    float
        The quantum [unit of the channel]; 0 if there is none, infinite if the channel never moved.

    Examples
    --------
    >>> quantum(np.array([0.0, 0.5, 0.5, 1.0]))
    0.5
    """
    steps = np.abs(np.diff(values))
    moved = steps[steps > 0.0]
    if not len(moved):
        return float("inf")
    return float(np.min(moved)) if np.count_nonzero(steps == 0.0) > REPEATED_SHARE * len(steps) else 0.0


def _autocorrelations(values: Array) -> Array:
    """Return autocorrelations at lags 1 to `LAGS`."""
    power = float(values @ values)
    if power == 0.0:
        return np.zeros(LAGS)
    return np.array([float(values[lag:] @ values[:-lag]) / power for lag in range(1, LAGS + 1)])


def _ljung_box(autocorrelations: Array, count: int) -> float:
    from scipy.special import chdtrc

    lags = np.arange(1, LAGS + 1)
    statistic = count * (count + 2.0) * float(np.sum(autocorrelations**2 / (count - lags)))
    return float(chdtrc(LAGS, statistic))


def _correlation(a: Array, b: Array) -> float:
    spread = float(a @ a) * float(b @ b)
    return float(a @ b) / spread**0.5 if spread > 0.0 else 0.0


def _coherent_share(values: Array, push: Array, length: int) -> float:
    """Return the share of variance coherent with the drive, less the share expected by chance in so few segments."""
    ours, theirs = _spectra(values, length), _spectra(push, length)
    drive, power = np.mean(np.abs(theirs) ** 2, axis=0), np.mean(np.abs(ours) ** 2, axis=0)
    driven = drive > 1e-6 * np.max(drive)
    if not np.any(driven) or not np.any(power > 0.0):
        return 0.0
    coherent = np.abs(np.mean(ours * np.conj(theirs), axis=0))[driven] ** 2 / drive[driven]
    share = np.sum(coherent - power[driven] / SEGMENTS) / np.sum(power) * SEGMENTS / (SEGMENTS - 1.0)
    return float(np.clip(share, 0.0, 1.0))
