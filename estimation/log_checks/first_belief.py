"""Initial state, initial covariance and default noise of a filter."""

from collections.abc import Mapping

import numpy as np

from estimation.log_checks.channel_names import POSITION, PRESSURE, SPEED, VELOCITY
from estimation.log_checks.measurement_noise import measurement_variances
from estimation.models.eha_forms import BULK_MODULUS
from estimation.models.gaussian import Gaussian
from estimation.models.model import ProcessModel
from plant.log.record import Record

PRESSURE_NOISE_LOGGED = 3e8
"""Process-noise density of differential pressure if it is logged [Pa^2/s]. It stands for the flows that a lumped model
omits (make-up, changing volumes); without the sensor, the model's own small density is used."""

START_STD = 3e8
"""Standard deviation of the first guess [Pa]: it drives convergence (errata E10)."""

TURNING = 0.2
"""Share of a log's motor speed, root mean square, above which the motor turns [fraction]."""

AT_REST = 3e4
"""Largest differential pressure of an actuator at rest, beside five deviations of noise [Pa]."""


def first_belief(model: ProcessModel, record: Record, start: float, start_std: float) -> Gaussian:
    """Return the belief before the first sample: at the first position, at rest, at the guessed bulk modulus.

    Parameters
    ----------
    model : ProcessModel
        The process model.
    start : float
        First guess of effective bulk modulus [Pa].
    start_std : float
        Its standard deviation [Pa].
    """
    firsts = {POSITION: _first_sample(record, POSITION), BULK_MODULUS: start}
    firsts[PRESSURE] = _first_sample(record, PRESSURE)
    spreads = {
        POSITION: 1e-5,
        VELOCITY: 1e-3,
        "acceleration_m_s2": 10.0,
        PRESSURE: 1e5,
        BULK_MODULUS: start_std,
    }
    mean = np.array([firsts.get(state.name, 0.0) for state in model.states])
    return Gaussian(mean, np.diag([spreads[state.name] * spreads[state.name] for state in model.states]))


def first_load(record: Record, variances: Mapping[str, float] | None = None) -> float:
    """Return the differential pressure at the beginning of a log, zero if it is small enough for rest.

    Parameters
    ----------
    record : Record
        The log, with differential pressure.
    variances : Mapping[str, float], optional
        Measurement variances of its channels [SI squared]; read off the log if not given.

    Returns
    -------
    float
        Pressure in chamber A less that in chamber B at the first sample that has it [Pa].

    Examples
    --------
    >>> first_load(Record(1e-3, {"differential_pressure_pa": np.array([np.nan, -4e5, -5e5, -6e5])}))
    -400000.0
    """
    first = _first_sample(record, PRESSURE)
    noise = (variances or measurement_variances(record, (PRESSURE,)))[PRESSURE] ** 0.5
    return first if abs(first) > AT_REST + 5.0 * noise else 0.0


def begins_in_motion(record: Record, share: float = TURNING) -> bool:
    """Return whether the motor turns when a log begins; its chambers may then be off the accumulator's pressure.

    Parameters
    ----------
    share : float
        Share of the log's motor speed, root mean square, from which the motor turns [fraction].

    Returns
    -------
    bool
        Whether the first motor speed exceeds that.
    """
    speed = record[SPEED]
    first = abs(_first_sample(record, SPEED))
    return first > 0.0 and first > share * float(np.sqrt(np.nanmean(speed**2)))


def _first_sample(record: Record, channel: str) -> float:
    if channel not in record:
        return 0.0
    present = record[channel][np.isfinite(record[channel])]
    return float(present[0]) if len(present) else 0.0
