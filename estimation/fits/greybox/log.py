"""A log for a fit of a grey-box model, with its noise."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from estimation.arrays import Array, IntArray
from estimation.fits.greybox.leaked_noise import LeakedNoise
from estimation.log_checks.bridging import bridged
from estimation.log_checks.measurement_noise import measurement_variances
from estimation.models.greybox import GreyBoxModel
from plant.log.record import Record
from plant.runs import steps_a_sample
from plant.solvers.steps import Parameters, parameter_row

if TYPE_CHECKING:
    from estimation.fits.greybox.intersample_doubt import IntersampleDoubt
    from estimation.fits.greybox.pump_ripple import Ripple

BLOCK = 1e-3
"""Usual length over which residuals are averaged before they are squared [s]."""


@dataclass(frozen=True)
class OutputNoise:
    """Noise of an output.

    Parameters
    ----------
    variance : float
        Of its white noise, a sample [SI squared].
    walk : float
        Variance per time of its random walk [SI squared per second]; white noise of a rate, such as measured speed,
        that the model integrates.
    passed_on : float
        Standard deviation that a driving channel's noise adds at once, over `passed_by` [SI].
    passed_by : str
        The unknown by which the driving channel's noise is multiplied, fitted as a logarithm.
    passed_over : tuple of str and float
        The parameter by which it is divided, with the value that `passed_on` already includes [SI].
    lost_by : tuple of str
        Parameters that make it leak off before the next samples.
    lost : float
        Loss from one sample to the next per unit of `passed_by` and of these, if it is small [SI].
    lost_from : LeakedNoise, optional
        The noise that remains after losses in the means by which a fit is judged.
    """

    variance: float
    walk: float = 0.0
    passed_on: float = 0.0
    passed_by: str = ""
    passed_over: tuple[str, float] = ("", 1.0)
    lost_by: tuple[str, ...] = ()
    lost: float = 0.0
    lost_from: LeakedNoise | None = None

    def passed_noise(self, values: Mapping[str, float]) -> tuple[float, dict[str, float]]:
        """Return the output noise due to a driving channel's noise, and its slope by each unknown.

        Parameters
        ----------
        values : Mapping[str, float]
            The unknowns [SI].

        Returns
        -------
        tuple of float and dict
            Standard deviation [SI], and the derivative of its logarithm by the logarithm of each unknown
            [dimensionless].
        """
        divisor, usual = self.passed_over
        felt = values.get(self.passed_by, 0.0) * usual / values.get(divisor, usual)
        losses = {name: self.lost * felt * values.get(name, 0.0) for name in self.lost_by}
        total = sum(losses.values())
        kept, bent = (1.0, 0.0) if self.lost_from is None else self.lost_from.remaining_noise(total)
        goes = {name: bent * loss / total for name, loss in losses.items() if loss > 0.0}
        goes |= {
            name: slope for name, slope in ((self.passed_by, 1.0 + bent), (divisor, -1.0 - bent)) if name in values
        }
        return self.passed_on * felt * kept, goes

    def scaled(self, variance: float, walk: float = 1.0) -> "OutputNoise":
        """Return the noise times a factor.

        Parameters
        ----------
        variance, walk : float
            Factors on the white noise's variance and on the random walk's [dimensionless].
        """
        return replace(
            self,
            variance=variance * self.variance,
            walk=walk * self.walk,
            passed_on=variance**0.5 * self.passed_on,
        )


@dataclass(frozen=True, eq=False)
class GreyBoxLog:
    """A log for a grey-box fit.

    Parameters
    ----------
    drives : ndarray, shape (n, channels)
        Driving channels in SI, without missing samples.
    measured : ndarray, shape (n, outputs)
        Outputs in SI; NaN is missing.
    parameters : ndarray, shape (parameters,)
        The actuator's parameters; the entries of unknowns are not used.
    sample_time : float
        Seconds between samples [s].
    steps : ndarray of int, shape (n,)
        Model steps up to each sample.
    noise : tuple of OutputNoise
        Noise of each output.
    drive_std : tuple of float
        Standard deviation of each driving channel's noise, unless the outputs' noise already includes it [SI].
    uncertainties : Mapping[str, float]
        Relative standard deviation of the actuator's parameters [fraction]; those of unknowns are not used.
    gaps : ndarray, shape (gaps, 3)
        First and last sample that a gap in the drives affects, and the variance that it adds to the state from one
        sample to the next, in units of `GreyBoxModel.jump`; in order of time, without overlap.
    presumed : Mapping[str, tuple of float]
        Prior of unknowns: value [SI] and standard deviation of the coordinate.
    within : Mapping[str, float]
        Standard deviation of a coordinate about the value at which its search ends. It counts in deviations only.
    block : float
        Length over which residuals are averaged before they are squared [s].
    timed : tuple of str
        Channels whose delay a fit tests.
    counts : tuple of int
        Tooth counts of the pump that a fit tests, see `estimation.fits.greybox.pump_ripple`.
    teeth : tuple of Ripple
        Pump ripple that the drives include; its size remains uncertain.
    speed_offset : float
        Offset subtracted from motor speed [rad/s]; if it is not 0, it remains uncertain too.
    course : IntersampleDoubt, optional
        Uncertainty of motor speed between the samples of a slow log [Pa].
    stands_for : float
        Number of residuals of a longer log that each one represents, in `FreedProblem` [count].
    stiff : bool
        Whether model steps are implicit, since an open valve fills a chamber within one step.
    mean_rows : int
        Rows of which each measured value is the mean; they all have it, and `block` holds whole means.
    sampled : tuple of (ndarray, shape (samples,), and float), optional
        Motor speed of an averaged log before it was averaged, and its sample time [rad/s, s].
    """

    drives: Array
    measured: Array
    parameters: Array
    sample_time: float
    steps: IntArray
    noise: tuple[OutputNoise, ...]
    drive_std: tuple[float, ...] = ()
    uncertainties: Mapping[str, float] = field(default_factory=dict[str, float])
    gaps: Array = field(default_factory=lambda: np.empty((0, 3)))
    presumed: Mapping[str, tuple[float, float]] = field(default_factory=dict[str, tuple[float, float]])
    within: Mapping[str, float] = field(default_factory=dict[str, float])
    block: float = BLOCK
    timed: tuple[str, ...] = ()
    counts: tuple[int, ...] = ()
    teeth: tuple["Ripple", ...] = ()
    speed_offset: float = 0.0
    course: "IntersampleDoubt | None" = None
    stands_for: float = 1.0
    stiff: bool = False
    mean_rows: int = 1
    sampled: tuple[Array, float] | None = None

    def beginning(self, samples: int) -> "GreyBoxLog":
        """Return the first part of the log.

        Parameters
        ----------
        samples : int
            Its length [samples].

        Returns
        -------
        GreyBoxLog
            The shorter log.
        """
        return replace(self, drives=self.drives[:samples], measured=self.measured[:samples], steps=self.steps[:samples])

    def stepped(self, steps: IntArray | None) -> "GreyBoxLog":
        """Return the log with other model steps.

        Parameters
        ----------
        steps : ndarray of int, shape (n,), or None
            Up to each sample [count]; None keeps those of the log.

        Returns
        -------
        GreyBoxLog
            The log; the same object if nothing changes.
        """
        return self if steps is None or steps is self.steps else replace(self, steps=steps)

    def coarsened(self) -> "GreyBoxLog":
        """Return the log with one model step per sample: faster and less exact.

        Returns
        -------
        GreyBoxLog
            The same log.
        """
        return self.stepped(np.ones_like(self.steps))

    @property
    def passes_on(self) -> bool:
        """Whether noise of a driving channel matters, multiplied by an unknown."""
        return any(noise.passed_on > 0.0 for noise in self.noise)

    @property
    def count_measured(self) -> int:
        """Number of measured values of the first output [count]."""
        return int(np.count_nonzero(np.isfinite(self.measured[:, 0]))) // self.mean_rows

    @property
    def measured_rms(self) -> float:
        """Root mean square of the measured outputs [output unit]."""
        return float(np.sqrt(np.nanmean(self.measured**2)))

    @property
    def turn_count(self) -> float:
        """Number of bends of a slow log's motor speed, at least 1; 1 for any other log [count].

        The motor passes all turns alike. So what one form gains on another at one turn, it gains at all, without more
        evidence.
        """
        return 1.0 if self.course is None else self.course.turn_count(self.noise[0].variance)

    def walk_variances(self, block: int) -> tuple[Array, Array, float]:
        """Return each output's random-walk variance per block, its other variance, and the share of its level kept.

        Parameters
        ----------
        block : int
            Samples per block [count].

        Returns
        -------
        ndarray, shape (outputs, walks)
            What it gains; the last number counts for all blocks that follow [SI squared].
        ndarray, shape (outputs, places)
            What else is open of each block's mean; likewise [SI squared].
        float
            What is left of its level after a block [fraction].
        """
        walk = np.array([[noise.walk * block * self.sample_time] for noise in self.noise])
        beside = np.zeros_like(walk)
        if self.course is None:
            return walk, beside, 1.0
        samples, course = len(self.measured), self.course
        return walk + course.walk(samples, block), beside + course.beside(samples, block), course.kept**block

    def with_noise_at(self, value: float) -> "GreyBoxLog":
        """Return the log with the noise passed on by driving channels fixed at a value of the unknown.

        The variance then does not depend on any unknown, so a search from far away finds no minimum with infinite
        noise.

        Parameters
        ----------
        value : float
            Value of the unknown by which the driving channels' noise is multiplied [SI].

        Returns
        -------
        GreyBoxLog
            The same log with noise of its outputs only.
        """
        noise = tuple(OutputNoise(one.variance + (value * one.passed_on) ** 2, one.walk) for one in self.noise)
        return replace(self, noise=noise)

    def with_larger_noise(self, variance: float, walk: float) -> "GreyBoxLog":
        """Return the log with larger assumed noise, which smooths the way to the optimum.

        Parameters
        ----------
        variance, walk : float
            Factors on the white noise's variance and on the random walk's [dimensionless].

        Returns
        -------
        GreyBoxLog
            The same log under that noise.
        """
        return replace(self, noise=tuple(noise.scaled(variance, walk) for noise in self.noise))


def greybox_log(
    model: GreyBoxModel,
    record: Record,
    parameters: Parameters,
    *,
    longest_step: float,
    variances: Mapping[str, float] | None = None,
    uncertainties: Mapping[str, float] | None = None,
) -> GreyBoxLog:
    """Return a record as the log of a grey-box fit.

    Parameters
    ----------
    record : Record
        The log, with the model's drives and outputs.
    parameters : dataclass
        The plant's known values, with the fields of the model's parameters.
    longest_step : float
        Longest step of the model [s].
    variances : Mapping[str, float], optional
        Noise variance of channels [SI squared]; by default read from the log for outputs, and zero for drives.
    uncertainties : Mapping[str, float], optional
        Relative standard deviation of the plant's parameters [fraction]; none by default.

    Returns
    -------
    GreyBoxLog
        The log, its drives without gaps.
    """
    noise = dict(variances or {})
    if unknown := [channel for channel in model.outputs if channel not in noise]:
        noise |= measurement_variances(record, unknown)
    return GreyBoxLog(
        drives=np.column_stack([bridged(record[channel]) for channel in model.drives]),
        measured=np.column_stack([record[channel] for channel in model.outputs]),
        parameters=parameter_row(parameters, model.parameters),
        sample_time=record.sample_time,
        steps=np.full(len(record), steps_a_sample(record.sample_time, longest_step)),
        noise=tuple(OutputNoise(noise[channel]) for channel in model.outputs),
        drive_std=tuple(noise.get(channel, 0.0) ** 0.5 for channel in model.drives),
        uncertainties=uncertainties or {},
    )
