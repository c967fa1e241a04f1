"""`simulate(plant, drive, ...) -> Record`: a run of a plant under a drive, measured by its sensors."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from math import ceil
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from plant.arrays import Array
from plant.compiled.functions import Scalar, sign
from plant.components.friction import quadratic_friction
from plant.eha.circuit import (
    STATES,
    circuit_breaches,
    circuit_derivative,
    circuit_scales,
    circuit_step_rate,
    observe_circuit,
)
from plant.eha.circuit_parameters import CircuitParameters, circuit_of, circuit_values
from plant.eha.circuit_start import at_rest
from plant.eha.model import EhaParameters, lumped_step, reduced_derivative
from plant.eha.parameter_path import ParameterPath
from plant.errors import HydrostateError
from plant.log.record import Record
from plant.runs import checked_series, require_finite
from plant.sensors.sensors import IDEAL, Sensors, measure
from plant.solvers.adaptive import ErrorControl, controlled_run
from plant.solvers.steps import StepFunction, parameter_names, parameter_row, ros2_step
from plant.solvers.trajectory import compile_trajectory


def _unchanged(parameters: EhaParameters) -> EhaParameters:
    return parameters


def _zero_state(_row: Array) -> Array:
    return np.zeros(3)


def _no_rate_limit(_rows: Array) -> float:
    return 0.0


def _no_breaches(_states: Array) -> Mapping[str, NDArray[np.bool_]]:
    return {}


@dataclass(frozen=True)
class Plant:
    """An actuator model that can be simulated.

    Parameters
    ----------
    name : str
        Its name in the registry and in metadata.
    states : tuple of str
        State names with their unit.
    step : callable
        ``step(state, speeds, parameters, h)``, see `plant.solvers.steps.StepFunction`.
    observe : callable
        ``observe(state, parameters)``, which returns position, velocity and differential pressure, and more channels if
        the plant has them.
    substeps : int
        Integrator steps per 0.1 ms, enough for relative errors under 1e-4.
    parameter_class : type
        Class of its parameter rows.
    complete : callable
        ``complete(parameters)``, which returns an actuator's parameters as that class.
    start : callable
        ``start(parameter row)``, the state at rest.
    step_rate : callable
        ``step_rate(parameter rows)``, the smallest number of steps per second, if faults can make a plant stiffer.
    breaches : callable
        ``breaches(states)``: by reason, the samples at which the run was outside the model's validity.
    control : ErrorControl, optional
        What error-controlled steps need; these then replace the fixed steps.
    """

    name: str
    states: tuple[str, ...]
    step: StepFunction
    observe: Callable[[Any, Any], Mapping[str, Scalar]]
    substeps: int
    parameter_class: type[EhaParameters] = EhaParameters
    complete: Callable[[EhaParameters], EhaParameters] = _unchanged
    start: Callable[[Array], Array] = _zero_state
    step_rate: Callable[[Array], float] = _no_rate_limit
    breaches: Callable[[Array], Mapping[str, NDArray[np.bool_]]] = _no_breaches
    control: ErrorControl | None = None

    def channels(self, states: Array, rows: Array) -> Mapping[str, Array]:
        """Return the measurable channels; a motor speed among them replaces the command.

        Parameters
        ----------
        states, rows : ndarray, shapes (n, width) and (1 or n, parameters)
            As named in `states`, and parameter rows.

        Returns
        -------
        Mapping[str, ndarray], each of shape (n,)
            Channels by name.
        """
        # a circuit's row begins with the columns of the lumped actuator, followed by its own
        values = {name: rows[:, i] for i, name in enumerate(parameter_names(self.parameter_class))}
        seen = dict(self.observe(tuple(states.T), SimpleNamespace(**values)))
        if np.all(values.get("motor_lag", 0.0) > 0.0):
            seen["motor_speed_rad_s"] = states[:, self.states.index("motor_speed_rad_s")]
        return seen


def _observe_lumped(state: Any, p: Any) -> Mapping[str, Scalar]:
    del p
    return dict(zip(LOGGED[1:], state, strict=True))


def _observe_reduced(state: Any, p: Any) -> Mapping[str, Scalar]:
    """Differential pressure follows from the force balance 5.12; it is not a state of the reduced plant."""
    position, velocity, acceleration = state
    coefficients = p.friction_quadratic, p.friction_linear, p.friction_coulomb
    friction = quadratic_friction(velocity, sign(velocity), *coefficients)
    pressure = (p.moving_mass * acceleration + friction + p.load_force + p.load_stiffness * position) / p.piston_area
    return dict(zip(LOGGED[1:], (position, velocity, pressure), strict=True))


REDUCED = Plant(
    "reduced",
    ("position_m", "velocity_m_s", "acceleration_m_s2"),
    ros2_step(reduced_derivative),
    _observe_reduced,
    8,
)
LUMPED = Plant("lumped", ("position_m", "velocity_m_s", "differential_pressure_pa"), lumped_step, _observe_lumped, 4)


CIRCUIT = Plant(
    "circuit",
    STATES,
    ros2_step(circuit_derivative),
    observe_circuit,
    3,
    CircuitParameters,
    circuit_of,
    lambda row: np.array(at_rest(circuit_values(row)), dtype=np.float64),
    lambda rows: circuit_step_rate(circuit_values(rows)),
    circuit_breaches,
    ErrorControl(
        circuit_derivative,
        lambda row: circuit_scales(circuit_values(row)),
        lambda row: float(circuit_scales(circuit_values(row))[0]),
        lambda rows: 1.0 / (16.0 * max(3e4, circuit_step_rate(circuit_values(rows)))),
    ),
)

PLANTS: Mapping[str, Plant] = {plant.name: plant for plant in (REDUCED, LUMPED, CIRCUIT)}
"""The plants, by name."""


def simulate(
    plant: Plant,
    drive: Array,
    sample_time: float,
    parameters: EhaParameters | ParameterPath,
    *,
    sensors: Sensors = IDEAL,
    rng: np.random.Generator | None = None,
    keep_truth: bool = False,
) -> Record:
    """Run a plant from rest under a drive and return its sensors' log.

    Parameters
    ----------
    plant : Plant
        `REDUCED`, `LUMPED` or `CIRCUIT`.
    drive : ndarray, shape (n,)
        Motor speed at the samples [rad/s], linear between; for a plant with its own motor, the commanded speed.
    sample_time : float
        Seconds between samples [s].
    parameters : EhaParameters or ParameterPath
        The actuator, constant or changing with time; the circuit also takes an actuator without its circuit.
    sensors : Sensors
        Sensors of the bench; `IDEAL` by default.
    rng : numpy.random.Generator, optional
        Source of sensor noise; needed unless the sensors are ideal.
    keep_truth : bool
        Whether the record also holds the noiseless channels as ``true_...``.

    Raises
    ------
    DriveError
        If the drive is not a finite series of at least two samples.
    HydrostateError
        If the simulated state stops being finite or leaves the model's validity.

    Examples
    --------
    >>> record = simulate(LUMPED, np.full(10001, 125.66), 1e-4, EhaParameters())
    >>> round(float(record["velocity_m_s"][-1]), 4)
    0.0431
    """
    path = parameters if isinstance(parameters, ParameterPath) else ParameterPath.constant(parameters)
    path = replace(path, parameters=tuple(map(plant.complete, path.parameters)))
    speed = checked_series(drive)
    rows = np.ascontiguousarray(path.sample(sample_time * np.arange(len(speed))))
    (states,) = run_plant(plant, speed, sample_time, rows[:, None])
    return _record(plant, speed, sample_time, states, path.parameters[0], rows, sensors, rng, keep_truth)


def simulate_each(
    plant: Plant,
    drive: Array,
    sample_time: float,
    parameters: Sequence[EhaParameters],
    *,
    sensors: Sensors = IDEAL,
    rngs: Sequence[np.random.Generator] | None = None,
) -> list[Record]:
    """Run several actuators under one drive, side by side: this takes a third of the time of separate runs.

    Parameters
    ----------
    plant : Plant
        `REDUCED`, `LUMPED` or `CIRCUIT`.
    drive : ndarray, shape (n,)
        Motor speed at the samples [rad/s], linear between.
    sample_time : float
        Seconds between samples [s].
    parameters : sequence of EhaParameters
        The actuators.
    sensors : Sensors
        Sensors of the bench; `IDEAL` by default.
    rngs : sequence of numpy.random.Generator, optional
        Sources of sensor noise.

    Raises
    ------
    DriveError, HydrostateError
        As for `simulate`.
    """
    speed = checked_series(drive)
    complete = [plant.complete(given) for given in parameters]
    rows = np.array([parameter_row(p) for p in complete])
    runs = run_plant(plant, speed, sample_time, rows[None])
    each = zip(runs, complete, rows[:, None], rngs or [None] * len(rows), strict=True)
    return [_record(plant, speed, sample_time, x, p, row, sensors, rng, False) for x, p, row, rng in each]


def run_plant(plant: Plant, speed: Array, sample_time: float, rows: Array) -> Array:
    """Return the states of one run or of several side by side, from rest.

    Parameters
    ----------
    speed : ndarray, shape (n,)
        Motor speed at the samples [rad/s], linear between.
    sample_time : float
        Seconds between samples [s].
    rows : ndarray, shape (1 or n, runs, parameters)
        Parameter rows, complete for the plant.

    Returns
    -------
    ndarray, shape (runs, n, states)
        States at the samples.
    """
    starts = np.array([plant.start(row) for row in rows[0]])
    if plant.control is not None:
        return controlled_run(plant.name, plant.control, starts, speed, rows, sample_time, plant.parameter_class)
    run = compile_trajectory(plant.name, plant.step, len(plant.states), plant.parameter_class)
    substeps = max(1, round(plant.substeps * sample_time / 1e-4), ceil(plant.step_rate(rows) * sample_time))
    each = (np.ascontiguousarray(rows[:, i]) for i in range(rows.shape[1]))
    return np.array([run(start, speed, row, sample_time, substeps) for start, row in zip(starts, each, strict=True)])


def _require_valid_run(plant: Plant, states: Array, sample_time: float) -> None:
    require_finite(states, sample_time, plant.name)
    for reason, broken in plant.breaches(states).items():
        if np.any(broken):
            when = sample_time * int(np.argmax(broken))
            raise HydrostateError(f"the {plant.name} plant stopped at {when:.4f} s: {reason}")


def _record(
    plant: Plant,
    speed: Array,
    sample_time: float,
    states: Array,
    parameters: EhaParameters,
    rows: Array,
    sensors: Sensors,
    rng: np.random.Generator | None,
    keep_truth: bool,
) -> Record:
    """Return the sensors' log of a run."""
    _require_valid_run(plant, states, sample_time)
    metadata = {"plant": plant.name, "parameters": asdict(parameters)}
    channels = {"motor_speed_rad_s": speed, **plant.channels(states, rows)}
    if len(channels) > len(LOGGED):
        channels["motor_voltage_v"] = speed / parameters.motor_speed_per_volt
    truth = Record(sample_time, channels, metadata)
    if sensors == IDEAL and rng is None:
        return truth.replace(**{f"true_{name}": truth[name] for name in truth}) if keep_truth else truth
    if rng is None:
        raise HydrostateError("simulate() needs rng for sensors with noise, got None")
    record = measure(truth, sensors, rng, keep_truth=keep_truth)
    return record.replace(**_further_channels(truth, sensors, rng))


LOGGED = ("motor_speed_rad_s", "position_m", "velocity_m_s", "differential_pressure_pa")
"""Channels that every plant has, and that `plant.sensors.sensors.measure` measures."""


def _further_channels(truth: Record, sensors: Sensors, rng: np.random.Generator) -> Mapping[str, Array]:
    """Return the channels beyond `LOGGED`: the commanded voltage, and each chamber's pressure transducer."""
    beside = {name: truth[name] for name in truth if name == "motor_voltage_v"}
    chambers = [name for name in truth if name in ("pressure_a_pa", "pressure_b_pa")]
    if sensors.pressure:
        for name, stream in zip(chambers, rng.spawn(len(chambers)), strict=True):
            noisy = truth[name] + sensors.pressure_noise * stream.standard_normal(len(truth))
            quantum = sensors.pressure_quantum
            beside[name] = quantum * np.round(noisy / quantum) if quantum > 0.0 else noisy
    return beside
