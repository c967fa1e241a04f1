"""Tests of the circuit plant around an input mean, in passes, because a piston driven around a mean runs out of stroke.

After a lead-in that moves the piston towards one end, every pass covers part of the stroke, and the mean changes sign
from pass to pass. The time after each reversal is omitted, backward passes are taken with reversed sign, and the mean
of each pass is removed.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from faults.conditions import find_condition, parameters_for
from plant.eha.circuit_parameters import CircuitParameters, circuit_of
from plant.eha.drive_limits import check_drive
from plant.eha.drives import prbs
from plant.eha.simulate import CIRCUIT, simulate
from plant.sensors.sensors import BENCH

CHANNELS = ("motor_speed_rad_s", "velocity_m_s")

SAMPLE_TIME = 1e-3
"""Sample time of the tests [s]."""


def in_condition(rig: CircuitParameters, condition: str) -> CircuitParameters:
    """Return the circuit in one of the nine conditions.

    Examples
    --------
    >>> in_condition(CircuitParameters(), "major_leakage").flow_bias
    1.465e-05
    """
    return circuit_of(parameters_for(find_condition(condition), rig))


@dataclass(frozen=True)
class Passes:
    """A random binary test around an input mean.

    Parameters
    ----------
    mean_v, amplitude_v : float
        Mean, not negative, and amplitude of the input [V].
    pass_time : float
        Duration of a pass [s].
    hold_time : float
        Time between possible switches [s].
    settling : float
        Time omitted after a reversal [s].
    """

    mean_v: float
    amplitude_v: float
    count: int
    pass_time: float
    hold_time: float
    settling: float


def run_passes(p: CircuitParameters, test: Passes, rng: np.random.Generator) -> list[NDArray[np.float64]]:
    """Run a test and return the bench's sensor readings, pass by pass, with each pass's mean removed.

    Returns
    -------
    list of ndarray, shape (passes, n)
        Motor speed [rad/s] and velocity [m/s].

    Raises
    ------
    DriveError
        If the motor's limit or the stroke would be exceeded.
    """
    mean, amplitude = (volts * p.motor_speed_per_volt for volts in (test.mean_v, test.amplitude_v))
    signs = np.where((np.arange(test.count) % 2 == 0) | (mean == 0.0), 1.0, -1.0)
    lead_in = np.full(round(test.pass_time / SAMPLE_TIME) // 2, -mean)
    signals = [sign * (mean + prbs(test.pass_time, SAMPLE_TIME, amplitude, test.hold_time, rng)) for sign in signs]
    drive = np.concatenate([lead_in, *signals])
    check_drive(drive, SAMPLE_TIME, p)
    record = simulate(CIRCUIT, drive, SAMPLE_TIME, p, sensors=BENCH, rng=rng)
    rows = [record[channel][len(lead_in) :].reshape(test.count, -1) * signs[:, None] for channel in CHANNELS]
    rows = [passes[:, round(test.settling / SAMPLE_TIME) :] for passes in rows]
    return [passes - passes.mean(axis=1, keepdims=True) for passes in rows]
