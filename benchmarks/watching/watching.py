"""Detection delay of a watch, and its errors, on the circuit while its oil warms and cools."""

from copy import deepcopy
from dataclasses import dataclass, replace

import numpy as np

from experiments.running.random_streams import stream
from faults.conditions import find_condition, parameters_for, severity
from faults.watch.events import Alarm
from faults.watch.watch import Watch
from plant.arrays import Array
from plant.eha.circuit_parameters import CircuitParameters
from plant.eha.drives import HOLD_TIME, prbs
from plant.eha.simulate import CIRCUIT
from plant.errors import HydrostateError
from plant.log.record import Record
from plant.sensors.sensors import RIG, measure
from plant.solvers.adaptive import controlled_run
from plant.solvers.steps import parameter_row

SAMPLE_TIME = 1e-3
"""Time between samples of the log [s]."""

PIECE = 60.0
"""Time simulated at once; oil properties vary linearly through it [s]."""

PERIOD = 10.0
"""Length of a random binary sequence, after which the piston has returned [s]."""

SWING = 15.0
"""Largest deviation of oil temperature from the one at which the parameters hold [K]."""

DUTY = 1200.0
"""Time during which the oil approaches one temperature [s]."""

THERMAL_LAG = 900.0
"""Time constant of the oil's temperature [s], judged: some litres with their metal."""

VISCOSITY_SLOPE = 0.03
"""Relative decrease of viscosity per kelvin [1/K]: an ISO VG 46 oil has 46 mm^2/s at 40 degC and 6.8 at 100 degC."""

MODULUS_SLOPE = 0.005
"""Relative decrease of bulk modulus per kelvin [1/K], judged."""


def at_oil_temperature(base: CircuitParameters, warmer: float) -> CircuitParameters:
    """Return the circuit with warmer oil: leakage is inverse to viscosity, viscous friction proportional to it.

    Parameters
    ----------
    base : CircuitParameters
        The circuit at its usual temperature.
    warmer : float
        Temperature above the usual one [K].

    Examples
    --------
    >>> round(at_oil_temperature(CircuitParameters(), 10.0).leakage_coefficient * 1e12, 3)
    6.458
    """
    thinner = float(np.exp(VISCOSITY_SLOPE * warmer))
    return replace(
        base,
        bulk_modulus=base.bulk_modulus * (1.0 - MODULUS_SLOPE * warmer),
        leakage_coefficient=base.leakage_coefficient * thinner,
        pump_crossport_leakage=base.pump_crossport_leakage * thinner,
        pump_case_leakage=base.pump_case_leakage * thinner,
        friction_linear=base.friction_linear / thinner,
    )


class CircuitStream:
    """The circuit under an endless random binary drive; its oil approaches a new temperature at intervals.

    Parameters
    ----------
    seed : int
        Seed of drive, temperatures and sensor noise.
    condition : str
        Initial condition.

    Attributes
    ----------
    growth : float
        Growth rate of the severity of leakage, up to minor, which is 1; only from ``condition`` "normal" [1/s].
    """

    def __init__(self, seed: int, condition: str = "normal") -> None:
        self._rng = stream(seed, "watching")
        self.condition = condition
        self.growth = self.grown = 0.0
        self.warmer, self._target, self._time, self._command = 0.0, 0.0, 0.0, 0.0
        self._state: Array | None = None

    def run(self, seconds: float) -> Array:
        """Continue the run.

        Parameters
        ----------
        seconds : float
            Duration [s], at most `PIECE`.

        Returns
        -------
        ndarray, shape (n, 3)
            Motor speed [rad/s], position [m] and differential pressure [Pa], as the rig's sensors measure them.
        """
        if not 0.0 < seconds <= PIECE:
            raise HydrostateError(f"a piece must be over 0 and at most {PIECE:g} s, got {seconds:g} s")
        base = self._circuit()
        before = parameter_row(at_oil_temperature(base, self.warmer))
        self._warm_oil(seconds)
        self.grown = min(1.0, self.grown + self.growth * seconds)
        after = parameter_row(at_oil_temperature(self._circuit(), self.warmer))
        count = round(seconds / SAMPLE_TIME)
        share = np.arange(count + 1)[:, None] / count
        rows = before * (1.0 - share) + after * share
        drive = np.concatenate([[self._command], self._drive(count, base)])
        start = np.array([CIRCUIT.start(rows[0])]) if self._state is None else self._state
        if CIRCUIT.control is None:
            raise HydrostateError("the circuit must have steps of controlled error")
        (states,) = controlled_run(
            CIRCUIT.name, CIRCUIT.control, start, drive, rows[:, None], SAMPLE_TIME, CIRCUIT.parameter_class
        )
        self._state, self._command = states[-1:].copy(), float(drive[-1])
        seen = CIRCUIT.channels(states[1:], rows[1:])  # the first sample repeats the last of the previous piece
        record = measure(Record(SAMPLE_TIME, dict(seen)), RIG, self._rng)
        names = ("motor_speed_rad_s", "position_m", "differential_pressure_pa")
        return np.column_stack([record[name] for name in names])

    def reseed(self, rng: np.random.Generator) -> None:
        """Continue from here with different drive and noise."""
        self._rng = rng

    def _circuit(self) -> CircuitParameters:
        healthy = CircuitParameters()
        condition = find_condition(self.condition)
        base = severity(self.grown, 0.0, healthy) if self.grown > 0.0 else parameters_for(condition, healthy)
        if not isinstance(base, CircuitParameters):
            raise HydrostateError("the circuit must stay a circuit in every condition")
        return base

    def _warm_oil(self, seconds: float) -> None:
        if self._time % DUTY < seconds:
            self._target = float(self._rng.uniform(-SWING, SWING))
        self._time += seconds
        self.warmer += (self._target - self.warmer) * (1.0 - float(np.exp(-seconds / THERMAL_LAG)))

    def _drive(self, count: int, p: CircuitParameters) -> Array:
        pieces = int(np.ceil(count * SAMPLE_TIME / PERIOD))
        parts = [prbs(PERIOD, SAMPLE_TIME, p.rated_speed, HOLD_TIME, self._rng) for _ in range(pieces)]
        return np.concatenate(parts)[:count]


@dataclass(frozen=True)
class DetectedFault:
    """Result of a watch for an abrupt fault.

    Parameters
    ----------
    condition : str
        The fault.
    delay : float
        From the fault to the alarm [s]; infinite if there was none.
    balance : str
        Balance that raised the alarm, empty if none.
    late : float
        Delay of the estimated change time after the fault [s].
    covered : bool
        Whether its interval covers the time of the fault.
    """

    condition: str
    delay: float
    balance: str = ""
    late: float = float("nan")
    covered: bool = False


def learnt_watch(seed: int, hours: float, false_alarms: float = 1.0) -> tuple[CircuitStream, Watch]:
    """Return a healthy circuit and a watch that has learnt it.

    Parameters
    ----------
    seed : int
        Seed of the run.
    hours : float
        Length of the run [h].
    false_alarms : float
        Set rate of false alarms [1/h].
    """
    running = CircuitStream(seed)
    watch = Watch(CircuitParameters(), SAMPLE_TIME, false_alarms=false_alarms, learning=3600.0 * hours)
    for _ in range(round(3600.0 * hours / PIECE)):
        watch.take(running.run(PIECE))
    return running, watch


def false_alarms(running: CircuitStream, watch: Watch, hours: float) -> list[Alarm]:
    """Return the alarms of a healthy stream.

    Parameters
    ----------
    watch : Watch
        Watch of the stream, after learning.
    hours : float
        Length of the run [h].
    """
    events = [event for _ in range(round(3600.0 * hours / PIECE)) for event in watch.take(running.run(PIECE))]
    return [event for event in events if isinstance(event, Alarm)]


def detect_fault(
    running: CircuitStream, watch: Watch, condition: str, seed: int, seconds: float = 5.0
) -> DetectedFault:
    """Introduce a fault into a copy of a healthy stream, at a time drawn from the seed.

    Parameters
    ----------
    running : CircuitStream
        The healthy stream; it is not advanced.
    watch : Watch
        Watch of the stream.
    condition : str
        The faulty condition.
    seed : int
        Seed of the fault's time, and of drive and noise from here on.
    seconds : float
        How long to wait for an alarm [s].
    """
    running, watch = deepcopy((running, watch))
    rng = stream(seed, "watching", condition)
    running.reseed(rng)
    watch.take(running.run(round(float(rng.uniform(2.0, 12.0)) / SAMPLE_TIME) * SAMPLE_TIME))
    fault = watch.last
    running.condition = condition
    alarms = [event for event in watch.take(running.run(seconds)) if isinstance(event, Alarm)]
    if not alarms:
        return DetectedFault(condition, float("inf"))
    first = alarms[0]
    low, high = first.interval
    return DetectedFault(condition, first.time - fault, first.balance, first.since - fault, low <= fault <= high)
