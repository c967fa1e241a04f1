"""`motion_log(record, parameters, ...) -> GreyBoxLog`: a log as the motion form is fitted to it."""

from collections.abc import Mapping
from dataclasses import fields

import numpy as np
from numpy.typing import NDArray

from estimation.fits.greybox.block_averages import means_across, samples_a_block
from estimation.fits.greybox.log import GreyBoxLog, OutputNoise
from estimation.fits.hypothesis_search.form_fit import LONGEST_STEP
from estimation.log_checks.bridging import bridged
from estimation.log_checks.coarse_means import coarse_mean_variance
from estimation.log_checks.measurement_noise import position_variance
from estimation.log_checks.still_beginning import without_still_beginning
from estimation.models.motion import MotionParameters
from plant.arrays import Array
from plant.eha.model import EhaParameters
from plant.log.record import Record
from plant.runs import steps_a_sample
from plant.solvers.steps import parameter_row

FINEST_STEP = 6.25e-5
"""Longest step while the piston reverses, yields or starts [s]: the bristle's state passes through zero there."""

TURNING = 0.3
"""Speed below which the piston counts as reversing, over the log's root mean square [fraction]."""

LEAST_SPEED_CHANGE = 1.0
"""Change of motor speed between samples from which the pump counts as starting the piston [rad/s]."""

SHORTEST_SAMPLE = 1e-3
"""Logs at a shorter sample time are averaged to about this one [s]: nothing faster in the model is visible."""

MOST_SAMPLES = 30_000
"""A longer log is fitted on its beginning, which gives an interval under a percent long before."""


def motion_log(
    record: Record, p: EhaParameters, uncertainties: Mapping[str, float], speed_variance: float
) -> GreyBoxLog:
    """Return a log as the motion form is fitted to it.

    Parameters
    ----------
    record : Record
        The log, with position.
    uncertainties : Mapping[str, float]
        Relative standard deviation of the actuator's parameters [fraction].
    speed_variance : float
        Measurement variance of motor speed [rad^2/s^2].

    Returns
    -------
    GreyBoxLog
        Its beginning of at most `MOST_SAMPLES`, from just before it first moves, averaged to `SHORTEST_SAMPLE`.
    """
    block = samples_a_block(record.sample_time, SHORTEST_SAMPLE)
    sample_time = block * record.sample_time
    record = without_still_beginning(record, MOST_SAMPLES * sample_time)
    logged = record["position_m"]
    means, samples = means_across(logged, block)
    position, speed = means[:MOST_SAMPLES], means_across(record["motor_speed_rad_s"], block)[0][:MOST_SAMPLES]
    variance = max(position_variance(logged) / samples, coarse_mean_variance(logged, block))
    drives = np.column_stack([bridged(speed), bridged(position)])
    drift = (p.pump_displacement / p.piston_area) ** 2 * speed_variance * record.sample_time
    return GreyBoxLog(
        drives=drives,
        measured=(position - drives[0, 1])[:, None],
        parameters=parameter_row(MotionParameters(**{one.name: getattr(p, one.name) for one in fields(p)})),
        sample_time=sample_time,
        steps=_steps(drives, sample_time),
        noise=(OutputNoise(variance, drift),),
        uncertainties=uncertainties,
    )


def _steps(drives: Array, sample_time: float) -> NDArray[np.int64]:
    """Return the model steps up to each sample: short ones where the piston reverses or starts."""
    reach = max(1, round(5e-3 / sample_time))
    sums = np.cumsum(np.pad(drives[:, 1] - drives[0, 1], (reach + 1, reach), mode="symmetric"))
    pace = np.gradient(sums[2 * reach + 1 :] - sums[: -2 * reach - 1])  # proportional to the mean velocity
    turning = np.abs(pace) < TURNING * np.sqrt(np.mean(pace**2))
    set_off = np.abs(np.diff(drives[:, 0], prepend=drives[0, 0])) > LEAST_SPEED_CHANGE
    fine, coarse = (steps_a_sample(sample_time, step) for step in (FINEST_STEP, LONGEST_STEP))
    return np.where(turning | set_off, fine, coarse)
