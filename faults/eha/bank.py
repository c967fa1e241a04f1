"""Banks of models, one for each condition: the lumped mathematical model, and the identified transfer functions."""

import warnings
from collections.abc import Mapping
from functools import lru_cache
from types import MappingProxyType

import numpy as np

from estimation.identification.model.linear_model import LinearModel
from estimation.log_checks.bridging import bridged
from faults.conditions import CONDITIONS, Condition, parameters_for
from plant.arrays import Array
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import CIRCUIT, LUMPED, Plant, simulate
from plant.errors import CovarianceWarning
from plant.log.record import Record
from plant.runs import steps_a_sample
from plant.sensors.sensors import BENCH, Sensors
from plant.solvers.adaptive import LANES
from plant.solvers.fixed_step_kernel import compile_fixed_step
from plant.solvers.steps import parameter_row
from plant.solvers.trajectory import compile_trajectory

STEP = 2.5e-4
"""Longest step of the lumped models on a log [s]. With 0.1 ms no error of a nominal model changes by more than two
parts in 10,000."""

IDENTIFICATION_TIME = 0.001
"""Sample time of the transfer functions [s]: inferred for Table 6 (errata E14)."""

IDENTIFICATION_DURATION = 20.0
"""Length of the identification run [s]."""

LIBRARY_DURATION = 60.0
"""Length of each test behind a saved library [s]."""


@lru_cache(maxsize=16)
def mathematical_bank(rig: EhaParameters) -> Mapping[str, EhaParameters]:
    """Return the actuator's parameters in each of the nine conditions, cached for the next log."""
    return MappingProxyType({name: parameters_for(condition, rig) for name, condition in CONDITIONS.items()})


def predict_run(record: Record, parameters: EhaParameters) -> Mapping[str, Array]:
    """Return the run of the lumped model from rest under a record's drive.

    Parameters
    ----------
    record : Record
        The log; only its motor speed is used.

    Returns
    -------
    Mapping[str, ndarray of shape (n,)]
        Position, velocity and differential pressure in SI.
    """
    run = compile_trajectory(LUMPED.name, LUMPED.step, len(LUMPED.states), LUMPED.parameter_class)
    rows = parameter_row(parameters)[None]
    speed = bridged(record["motor_speed_rad_s"])
    substeps = steps_a_sample(record.sample_time, STEP)
    states = run(np.zeros(len(LUMPED.states)), speed, rows, record.sample_time, substeps)
    return LUMPED.channels(states, rows)


def predict_runs(record: Record, bank: Mapping[str, EhaParameters]) -> Mapping[str, Mapping[str, Array]]:
    """Return the runs of a bank of lumped models from rest under a record's drive, side by side.

    Parameters
    ----------
    record : Record
        The log; only its motor speed is used.
    bank : Mapping[str, EhaParameters]
        Parameters by condition name.

    Returns
    -------
    Mapping[str, Mapping[str, ndarray of shape (n,)]]
        By condition, as in `predict_run`.
    """
    names = list(bank)
    together, alone = names[: len(names) // LANES * LANES], names[len(names) // LANES * LANES :]
    found = {name: predict_run(record, bank[name]) for name in alone}
    for first in range(0, len(together), LANES):
        some = together[first : first + LANES]
        rows = np.array([parameter_row(bank[name]) for name in some])
        states = _states_by_lanes(record, rows)
        found |= {name: LUMPED.channels(states[..., i], rows[i : i + 1]) for i, name in enumerate(some)}
    return {name: found[name] for name in names}


def _states_by_lanes(record: Record, rows: Array) -> Array:
    """Return the states of `LANES` lumped models at the samples, shape (n, states, lanes)."""
    width, speed = len(LUMPED.states), bridged(record["motor_speed_rad_s"])
    run = compile_fixed_step(LUMPED.name, LUMPED.step, width, LUMPED.parameter_class, LANES)
    drives, states = np.repeat(speed[:, None], LANES, axis=1), np.empty((len(speed), width, LANES))
    run(np.zeros((width, LANES)), drives, rows, record.sample_time, steps_a_sample(record.sample_time, STEP), states)
    return states


def identification_run(
    rig: EhaParameters,
    condition: Condition,
    rng: np.random.Generator,
    *,
    sensors: Sensors = BENCH,
    duration: float = IDENTIFICATION_DURATION,
    plant: Plant = LUMPED,
) -> Record:
    """Simulate the identification test of section 4: a pseudo-random binary signal of 4 V.

    Parameters
    ----------
    rig : EhaParameters
        The healthy actuator.
    rng : numpy.random.Generator
        Source of the drive and of sensor noise.
    duration : float
        Length of the test [s].
    plant : Plant
        The plant to simulate.

    Returns
    -------
    Record
        The run, at `IDENTIFICATION_TIME`.
    """
    parameters = parameters_for(condition, rig)
    drive = make_drive("prbs", duration, IDENTIFICATION_TIME, parameters, rng)
    return simulate(plant, drive, IDENTIFICATION_TIME, parameters, sensors=sensors, rng=rng)


def identify_bank(
    rig: EhaParameters, rng: np.random.Generator, *, duration: float = IDENTIFICATION_DURATION
) -> Mapping[str, LinearModel]:
    """Identify the nine transfer functions from simulated tests of the circuit, as section 4 does from its bench.

    Each test is fitted with an output-error model of Table 6's structure: three numerator coefficients, second order.
    Input and output are used alike (errata E15).

    Parameters
    ----------
    rig : EhaParameters
        The healthy actuator.
    rng : numpy.random.Generator
        Source of the drives and of sensor noise; each condition draws from its own stream.
    duration : float
        Length of each test [s].

    Returns
    -------
    Mapping[str, LinearModel]
        Motor speed [rad/s] to velocity [m/s], by condition name.
    """
    from estimation.identification.from_record import identify_record

    models: dict[str, LinearModel] = {}
    for (name, condition), stream in zip(CONDITIONS.items(), rng.spawn(len(CONDITIONS)), strict=True):
        record = identification_run(rig, condition, stream, duration=duration, plant=CIRCUIT)
        with warnings.catch_warnings():
            # the structure is that of Table 6 in every condition, and the bank needs predictions, not intervals
            warnings.simplefilter("ignore", CovarianceWarning)
            models[name] = identify_record(record, sample_time=IDENTIFICATION_TIME, covariance="coloured")
    return MappingProxyType(models)
