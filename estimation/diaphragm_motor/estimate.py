"""Leakage across the diaphragm motor's piston, load on its rod and gas in its pump, from electrodes and encoder.

Gas and load are first fitted to the tones of all electrodes. If that leaves no misfit, the pump is healthy apart from
its gas, and `estimation.diaphragm_motor.track` determines flow and pressure from the middle electrode.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import sqrt

import numpy as np
from scipy.special import chdtri

from estimation.diaphragm_motor.signature import (
    SETTLING_TIME,
    Drive,
    Signature,
    logged_signature,
    modelled_signature,
    require_channels,
    tolerance,
)
from estimation.diaphragm_motor.track import MotorTrack, healthy_maps, motor_blocks, track_leakage
from plant.arrays import Floats
from plant.diaphragm_motor.parameters import DiaphragmMotorParameters
from plant.diaphragm_motor.run import ELECTRODES
from plant.log.record import Record

CALIBRATED_SHARE = 0.2
"""Share of both tolerances that remains after a healthy run of the same motor has set the gains, judged
[dimensionless]."""

LEAST_PATTERN_PROBABILITY = 1e-3
"""Probability of the chi-square of the electrodes' pattern below which the maps are not used."""


@dataclass(frozen=True)
class MotorEstimate:
    """Estimate from a log of the diaphragm motor.

    Parameters
    ----------
    values, deviations : Mapping[str, float]
        ``crossport_leakage`` [m^3/(s Pa)], ``load_force`` [N] and ``gas_fraction``, with standard deviations.
    pattern : float
        Chi-square of the electrodes' pattern over its degrees of freedom [dimensionless].
    pattern_holds : bool
        Whether the pump is healthy apart from gas, so that the maps hold.
    velocity : float
        Mean velocity of the rod [m/s].
    """

    values: Mapping[str, float]
    deviations: Mapping[str, float]
    pattern: float
    pattern_holds: bool
    drive: Drive
    velocity: float
    track: MotorTrack
    parameters: DiaphragmMotorParameters


def estimate_motor(
    record: Record, healthy: DiaphragmMotorParameters, *, calibration: Signature | None = None
) -> MotorEstimate:
    """Estimate leakage across the piston, load and gas from a run under a steady sine.

    Parameters
    ----------
    record : Record
        Drive, seven electrodes, position.
    healthy : DiaphragmMotorParameters
        The healthy motor; at the calibration's load, if there is one.
    calibration : Signature, optional
        Signature of this motor when it was healthy, under the same drive: it corrects the electrodes' gains.

    Raises
    ------
    LogError
        If the log cannot be used.
    """
    require_channels(record)
    length = len(record) * record.sample_time
    gains = np.ones(len(ELECTRODES)) if calibration is None else _gains(calibration, healthy)
    read = record.replace(**{name: record[name] / gain for name, gain in zip(ELECTRODES, gains, strict=True)})
    seen = logged_signature(read, max(SETTLING_TIME, length - _PATTERN_TIME))
    gas, gas_std, pattern, freedom = _gas_and_load_fit(seen, healthy)
    more = gas if abs(gas - 1.0) > _SURE_GAS * gas_std else 1.0
    pump = replace(healthy, gas_fraction=tuple(more * share for share in healthy.gas_fraction))
    trust = 1.0 if calibration is None else CALIBRATED_SHARE
    track = track_leakage(motor_blocks(read, seen.drive), pump, healthy_maps(pump, seen.drive), trust)
    share = float(np.mean(healthy.gas_fraction))
    ends = (track.leakage, track.leakage_std, track.load, track.load_std)
    leakage, leakage_std, load, load_std = (float(one[-1]) for one in ends)
    return MotorEstimate(
        {"crossport_leakage": leakage, "load_force": load, "gas_fraction": gas * share},
        {"crossport_leakage": leakage_std, "load_force": load_std, "gas_fraction": gas_std * share},
        pattern / freedom,
        pattern <= float(chdtri(freedom, LEAST_PATTERN_PROBABILITY)),
        seen.drive,
        seen.velocity,
        track,
        replace(pump, crossport_leakage=max(0.0, leakage), load_force=load),
    )


def _gains(calibration: Signature, healthy: DiaphragmMotorParameters) -> Floats:
    """Return the electrodes' gains by which a healthy run differs from its model."""
    drive = calibration.drive
    model = modelled_signature(healthy, drive.frequency, drive.peak_to_peak)
    return np.abs(calibration.tones) / np.hypot(model[:7], model[7:14])


def _gas_and_load_fit(seen: Signature, healthy: DiaphragmMotorParameters) -> tuple[float, float, float, int]:
    """Fit gas, as a factor, and load to the tones: factor, its deviation, chi-square, degrees of freedom."""
    point = seen.drive.frequency, seen.drive.peak_to_peak
    tones = slice(0, len(seen.values) - 1)

    def shown(theta: Floats) -> Floats:
        gas = tuple(float(np.exp(theta[0])) * share for share in healthy.gas_fraction)
        return modelled_signature(replace(healthy, gas_fraction=gas, load_force=float(theta[1])), *point)[tones]

    whitening = np.linalg.inv(np.linalg.cholesky((tolerance(healthy, *point) + seen.covariance)[tones, tones]))

    def linearised(theta: Floats) -> tuple[Floats, Floats]:
        base = shown(theta)
        slopes = np.column_stack([(shown(theta + step) - base) / step.sum() for step in np.diag(_SLOPE_STEPS)])
        return whitening @ (seen.values[tones] - base), whitening @ slopes

    theta = np.array([0.0, healthy.load_force])
    for _ in range(_ITERATIONS):
        left, slopes = linearised(theta)
        theta = theta + np.clip(np.linalg.lstsq(slopes, left, rcond=None)[0], -_LONGEST, _LONGEST)
    left, slopes = linearised(theta)
    known = np.linalg.inv(slopes.T @ slopes)
    factor = float(np.exp(theta[0]))
    return factor, factor * sqrt(known[0, 0]), float(left @ left), len(left) - len(theta)


_PATTERN_TIME = 0.2
_ITERATIONS = 5
_SLOPE_STEPS = (0.02, 0.2)
_LONGEST = np.array([1.0, 10.0])
_SURE_GAS = 3.0
