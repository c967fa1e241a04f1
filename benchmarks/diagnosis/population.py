"""The population for scoring and calibrating diagnosis: varying circuits, varying drives, rig sensors."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from faults.conditions import CONDITIONS, parameters_for
from faults.eha.inject import varied_actuator
from faults.eha.physical import aerated, with_drifted_relief
from plant.arrays import Array
from plant.eha.circuit_parameters import CircuitParameters, circuit_of
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import CIRCUIT, simulate, simulate_each
from plant.log.record import Record
from plant.sensors.faults import Kind, SensorFault, with_fault
from plant.sensors.sensors import RIG, Sensors, differentiated

DRIVES = ("steps", "prbs")
"""The two drives of the population: the paper's nine steps and its random binary signal."""

DURATION = 10.0
"""Length of a log [s]."""

SAMPLE_TIME = 1e-3
"""Time between samples [s]."""

TRAINING, TEST = 1_000_000, 2_000_000
"""First seeds for calibration and for evaluation."""


@dataclass(frozen=True, eq=False)
class DrawnLog:
    """One log of the population with its truth.

    Parameters
    ----------
    condition : str
        Its true condition.
    parameters : CircuitParameters
        Its true actuator.
    record : Record
        What the sensors logged.
    drive : ndarray, shape (n,)
        Commanded motor speed [rad/s].
    """

    condition: str
    parameters: CircuitParameters
    record: Record
    drive: Array


def draw_parameters(
    condition: str, rng: np.random.Generator, width: float, rig: EhaParameters | None = None
) -> CircuitParameters:
    """Return one actuator in a condition: leakage, flow bias, friction and presliding vary; geometry and pump do not.

    Parameters
    ----------
    condition : str
        One of `CONDITIONS`.
    rng : numpy.random.Generator
        Source of the spread.
    width : float
        Half-width of leakage, flow bias, a_1 to a_3 and presliding [dimensionless]; bulk modulus has twice that.
    rig : EhaParameters, optional
        The healthy actuator; the paper's if not given.

    Returns
    -------
    CircuitParameters
        The circuit; the pump's share of the total leakage is unchanged.

    Examples
    --------
    >>> drawn = draw_parameters("normal", np.random.default_rng(0), 0.1)
    >>> 0.9 < drawn.friction_coulomb / 436.0 < 1.1
    True
    """
    faulty = parameters_for(CONDITIONS[condition], EhaParameters() if rig is None else rig)
    drawn = circuit_of(varied_actuator(faulty, rng, leakage=width, friction=width, bulk_modulus=2.0 * width))
    factor = 1.0 + width * float(rng.uniform(-1.0, 1.0))
    return replace(drawn, presliding_displacement=factor * drawn.presliding_displacement)


def other_circuit(p: CircuitParameters, rng: np.random.Generator) -> CircuitParameters:
    """Return an actuator whose circuit differs from the one that a diagnosis fits.

    Seals, make-up valves, motor, moving mass, accumulator and the pump's share of the leakage are drawn at random from
    wide ranges. The quantities that a diagnosis estimates, geometry and pump are unchanged.

    Examples
    --------
    >>> other = other_circuit(CircuitParameters(), np.random.default_rng(0))
    >>> other.leakage_coefficient == CircuitParameters().leakage_coefficient, other.motor_lag == 2e-3
    (True, False)
    """
    factors = {
        name: float(np.exp(rng.uniform(-np.log(most), np.log(most)))) for name, most in OTHER_CIRCUIT_FACTORS.items()
    }
    drawn = {name: factor * getattr(p, name) for name, factor in factors.items()}
    case = float(rng.uniform(0.0, 2.0)) * p.pump_case_leakage
    within = float(rng.uniform(0.05, 0.95)) * (p.leakage_coefficient - 1.5 * case)
    return replace(p, **drawn, pump_case_leakage=case, pump_crossport_leakage=within)


OTHER_CIRCUIT_FACTORS: Mapping[str, float] = MappingProxyType(
    {
        "presliding_displacement": 4.0,
        "presliding_damping": 2.5,
        "makeup_opening": 5.0,
        "motor_lag": 3.0,
        "moving_mass": 1.3,
        "accumulator_pressure": 1.5,
    }
)
"""Largest factors by which `other_circuit` multiplies or divides [dimensionless], judged: seldom in rig files."""


def draw_logs(
    seeds: Sequence[int],
    *,
    width: float = 0.1,
    like: bool = True,
    drives: Sequence[str] = DRIVES,
    sensors: Sensors = RIG,
    duration: float = DURATION,
    sample_time: float = SAMPLE_TIME,
) -> Iterator[DrawnLog]:
    """Yield nine logs, one for each condition, for every seed and drive; the nine logs of a seed share its drive.

    Parameters
    ----------
    seeds : sequence of int
        From `TRAINING` or from `TEST` on.
    width : float
        Half-width of the spread [dimensionless], see `draw_parameters`.
    like : bool
        Whether the circuits are of the kind that a diagnosis fits; if not, see `other_circuit`.
    drives : sequence of str
        Names of drives.
    sensors : Sensors
        Sensors of the bench.
    duration, sample_time : float
        Length of a log and time between samples [s].

    Raises
    ------
    HydrostateError
        If a drive or a time is unusable.
    """
    for seed in seeds:
        for which, drive in enumerate(drives):
            rng = np.random.default_rng([seed, which])
            speed = make_drive(drive, duration, sample_time, EhaParameters(), rng)
            actuators = [draw_parameters(name, rng, width) for name in CONDITIONS]
            actuators = actuators if like else [other_circuit(p, rng) for p in actuators]
            records = simulate_each(CIRCUIT, speed, sample_time, actuators, sensors=sensors, rngs=rng.spawn(9))
            for name, parameters, record in zip(CONDITIONS, actuators, records, strict=True):
                yield DrawnLog(name, parameters, record.annotate(drive=drive, seed=seed), speed)


def _faulty_sensor(record: Record, channel: str, kind: Kind, size: float = 0.0, start: float = 0.0) -> Record:
    """Return the log with a faulty sensor; velocity derived from the encoder has the same fault."""
    faulty = with_fault(record, SensorFault(channel=channel, kind=kind, size=size, start=start))
    if channel != "position_m":
        return faulty
    velocity = differentiated(faulty["position_m"], record.sample_time, RIG.velocity_window)
    return faulty.replace(velocity_m_s=velocity)


def _share_of_peak(record: Record, channel: str, share: float) -> float:
    return share * float(np.max(np.abs(record[channel])))


PRESSURE, SPEED, POSITION = "differential_pressure_pa", "motor_speed_rad_s", "position_m"

OUT_OF_MODEL: Mapping[str, Callable[[DrawnLog], Record]] = MappingProxyType(
    {
        "pressure bias, 15 % of its peak": lambda log: _faulty_sensor(
            log.record, PRESSURE, "bias", _share_of_peak(log.record, PRESSURE, 0.15)
        ),
        "pressure gain, + 60 %": lambda log: _faulty_sensor(log.record, PRESSURE, "gain", 0.6),
        "pressure frozen half-way": lambda log: _faulty_sensor(
            log.record, PRESSURE, "freeze", start=0.5 * log.record.duration
        ),
        "pressure saturates at 60 %": lambda log: _faulty_sensor(
            log.record, PRESSURE, "saturation", _share_of_peak(log.record, PRESSURE, 0.6)
        ),
        "speed bias, 8 % of its peak": lambda log: _faulty_sensor(
            log.record, SPEED, "bias", _share_of_peak(log.record, SPEED, 0.08)
        ),
        "speed gain, + 25 %": lambda log: _faulty_sensor(log.record, SPEED, "gain", 0.25),
        "speed frozen half-way": lambda log: _faulty_sensor(
            log.record, SPEED, "freeze", start=0.5 * log.record.duration
        ),
        "speed saturates at 70 %": lambda log: _faulty_sensor(
            log.record, SPEED, "saturation", _share_of_peak(log.record, SPEED, 0.7)
        ),
        "encoder gain, - 30 %": lambda log: _faulty_sensor(log.record, POSITION, "gain", -0.3),
        "encoder frozen half-way": lambda log: _faulty_sensor(
            log.record, POSITION, "freeze", start=0.5 * log.record.duration
        ),
        "air, 5 % of the oil": lambda log: _log_of_circuit(log, aerated(log.parameters, 0.05)),
        "relief valve at 60 % of the pressure that the log reaches": lambda log: _log_of_circuit(
            log,
            with_drifted_relief(
                log.parameters, _share_of_peak(log.record, PRESSURE, 0.6) / log.parameters.relief_pressure
            ),
        ),
        "a foreign actuator, piston 40 % larger": lambda log: _log_of_circuit(
            log, replace(log.parameters, piston_area=1.4 * log.parameters.piston_area)
        ),
    }
)
"""Logs in none of the nine conditions, by kind: each function maps a log in a condition to one outside them."""


def _log_of_circuit(log: DrawnLog, parameters: CircuitParameters) -> Record:
    """Return the log that another circuit would give under the same drive."""
    rng = np.random.default_rng(int(log.record.metadata["seed"]))
    return simulate(CIRCUIT, log.drive, log.record.sample_time, parameters, sensors=RIG, rng=rng)
