"""If commands come at samples of a slow log, the motor leads straight lines between them; circuits find the lead."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.fits.flow.log import MOST_LEAD
from faults.conditions import CONDITIONS, parameters_for
from faults.diagnosis.circuits.actuator import actuator_of
from faults.diagnosis.circuits.between_samples import _lead_step, nuisance_unknowns, with_fitted_lead, with_motor_lead
from faults.diagnosis.circuits.blocks import Blocks, blocks_of
from faults.diagnosis.circuits.circuit_runs import COORDINATES, coordinates_of, parameter_rows, predicted_outputs
from faults.diagnosis.circuits.class_fit import fit_freely
from faults.diagnosis.circuits.model_doubt import seldom_known_slopes
from faults.eha.inject import varied_actuator
from plant.eha.circuit_parameters import circuit_of
from plant.eha.model import EhaParameters
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH

SLOW, FINE, LAG = 0.01, 5e-4, 5e-3
"""Sample times of the log and of the simulation, and the motor's lag [s]."""

RISEN = 1.0 - float(np.exp(-(SLOW - 0.5 * FINE) / LAG))
AHEAD = (SLOW - 0.5 * FINE - LAG * RISEN) / RISEN - 0.5 * SLOW
"""Lead of that motor if commands come at samples [s]: its angle within one sample over its rise in speed, less half of
the sample time. A command takes one step of the simulation."""

CHANNELS = ("motor_speed_rad_s", "position_m", "differential_pressure_pa")
CONDITION = "minor_leakage_minor_friction"
TRUE = replace(
    circuit_of(varied_actuator(parameters_for(CONDITIONS[CONDITION]), np.random.default_rng(3), 0.1, 0.1, 0.1)),
    motor_lag=LAG,
)
ACTUATOR = actuator_of(EhaParameters())


def binary(shift: float = 0.0) -> Record:
    """Return a log at 100 Hz under a binary signal of 50 ms whose commands come ``shift`` before samples [s]."""
    every, late = round(SLOW / FINE), round((SLOW - FINE + shift) / FINE)
    speed = np.repeat(np.random.default_rng(1).choice((-90.0, 90.0), 160), round(0.05 / FINE))
    run = simulate(CIRCUIT, speed, FINE, TRUE, sensors=BENCH, rng=np.random.default_rng(2))
    return Record(SLOW, {name: run[name][late::every] for name in CHANNELS})


def error(blocks: Blocks, name: str) -> float:
    """Return the error of a coordinate of the circuit that fits best."""
    place = COORDINATES.index(name)
    fit = fit_freely(blocks, ACTUATOR, CONDITION)
    return abs(float(fit.coordinates[place] - coordinates_of(TRUE, ACTUATOR.rated)[place]))


def test_the_lead_of_the_motor_is_estimated_if_commands_come_at_samples() -> None:
    found = with_fitted_lead(blocks_of(binary()), ACTUATOR)
    assert found.lead == pytest.approx(AHEAD, rel=0.15)
    assert found.lead > 1e-3


def test_a_command_in_the_middle_of_samples_leaves_less_lead() -> None:
    assert with_fitted_lead(blocks_of(binary(0.5 * SLOW)), ACTUATOR).lead < 0.5 * AHEAD


def test_the_lead_makes_the_friction_of_a_slow_log_more_accurate() -> None:
    blocks = blocks_of(binary())
    found = with_fitted_lead(blocks, ACTUATOR)
    assert error(found, "friction_rated") < 0.3 * error(blocks, "friction_rated")


def test_speeds_inserted_halfway_deliver_the_volume_that_the_lead_requires() -> None:
    blocks = blocks_of(binary())
    logged, found = blocks.speed, with_motor_lead(blocks, 1e-3)
    assert (found.block, found.rows) == (2 * blocks.block, blocks.block)
    np.testing.assert_array_equal(found.speed[::2], logged)
    pumped = 0.25 * (found.speed[:-2:2] + 2.0 * found.speed[1::2] + found.speed[2::2])
    turned = np.abs(np.diff(logged)) > 20.0
    lines = 0.5 * (logged[1:] + logged[:-1])
    assert (pumped - lines)[turned] == pytest.approx(0.1 * np.diff(logged)[turned], abs=0.2)
    np.testing.assert_array_equal(with_motor_lead(with_motor_lead(blocks, 3e-3), 1e-3).speed, found.speed)


def test_speeds_inserted_halfway_keep_the_mean_of_a_smooth_curve() -> None:
    blocks = blocks_of(binary())
    time = SLOW * np.arange(len(blocks.speed))
    found = with_motor_lead(replace(blocks, speed=50.0 * np.sin(8.0 * time)), 0.0).speed
    pumped = 0.25 * (found[:-2:2] + 2.0 * found[1::2] + found[2::2])
    curve = -50.0 / 8.0 * np.diff(np.cos(8.0 * time)) / SLOW
    lines = 50.0 * 0.5 * (np.sin(8.0 * time)[1:] + np.sin(8.0 * time)[:-1])
    off, straight = (np.sqrt(np.mean((one - curve)[2:-2] ** 2)) for one in (pumped, lines))
    assert off < 0.2 * straight


def test_a_course_of_leakage_is_interpolated_with_the_speed() -> None:
    blocks = replace(blocks_of(binary()), leakage_course=np.linspace(0.5, 1.0, len(blocks_of(binary()).speed)))
    found = with_motor_lead(blocks, 0.0)
    assert found.leakage_course is not None
    assert len(found.leakage_course) == len(found.speed)
    rows = parameter_rows(ACTUATOR.conditions[:1], ACTUATOR.circuit, ACTUATOR.rated)
    fine = predicted_outputs(found, rows)[0]
    ended = predicted_outputs(replace(found, leakage_course=None), rows)[0]
    assert np.sqrt(np.mean((fine - ended)[:100, 0] ** 2)) > 3.0 * np.sqrt(np.mean((fine - ended)[-100:, 0] ** 2))
    assert np.all(np.sqrt(np.mean((fine - predicted_outputs(blocks, rows)[0]) ** 2, axis=0)) < 0.05 * blocks.rms)


def test_a_lead_of_which_a_log_shows_nothing_goes_back_to_none() -> None:
    logged = blocks_of(binary())
    still = with_motor_lead(replace(logged, speed=np.zeros_like(logged.speed)), AHEAD)
    fit = fit_freely(still, ACTUATOR, CONDITION)
    assert _lead_step(still, fit, ACTUATOR) == pytest.approx(-AHEAD)


def test_fast_logs_and_logs_without_pressure_get_no_lead() -> None:
    without = blocks_of(binary().replace(differential_pressure_pa=None))
    assert with_fitted_lead(without, ACTUATOR) is without
    run = simulate(CIRCUIT, np.full(1000, 50.0), 1e-3, TRUE, sensors=BENCH, rng=np.random.default_rng(0))
    fast = blocks_of(run)
    assert with_fitted_lead(fast, ACTUATOR) is fast


def test_only_a_log_with_a_lead_has_it_among_the_uncertain_parameters() -> None:
    blocks = blocks_of(binary())
    fit = fit_freely(blocks, ACTUATOR, CONDITION)
    assert len(nuisance_unknowns(fit, blocks, ACTUATOR)[0]) == len(seldom_known_slopes(fit, blocks, ACTUATOR))
    found = with_motor_lead(blocks, AHEAD)
    fit = fit_freely(found, ACTUATOR, CONDITION)
    slopes, spreads = nuisance_unknowns(fit, found, ACTUATOR)
    assert len(slopes) == len(spreads) == len(seldom_known_slopes(fit, found, ACTUATOR)) + 1
    assert spreads[-1] == MOST_LEAD
    ahead = predicted_outputs(
        with_motor_lead(found, AHEAD + 1e-4), parameter_rows(fit.coordinates[None], ACTUATOR.circuit, ACTUATOR.rated)
    )
    moved, promised = ahead[0] - fit.fitted, 1e-4 / SLOW * slopes[-1]
    assert np.all(np.abs(moved - promised).max(axis=0) < 0.2 * np.abs(promised).max(axis=0))
