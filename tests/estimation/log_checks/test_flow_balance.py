"""Balance of the pumped flow if the piston hardly moves, and if a single motor speed hides the flow bias."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.log_checks.channel_physics import MIDDLE, channel_mistakes
from estimation.log_checks.flow_balance import flow_balance
from faults.conditions import CONDITIONS, parameters_for
from plant.eha.circuit_parameters import circuit_of
from plant.eha.drives import make_drive
from plant.eha.model import piston_areas
from plant.eha.simulate import CIRCUIT, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH
from tests.estimation.log_checks.made_logs import HEALTHY, POSITION, PRESSURE, SPEED


def test_the_balance_is_correct_for_a_piston_that_only_yields_on_its_seals() -> None:
    """The balance found 6 to 45 times the piston's motion, 3 to 33 deviations from the true one."""
    p, rng = parameters_for(CONDITIONS["minor_leakage"]), np.random.default_rng(5)
    log = simulate(CIRCUIT, make_drive("sine", 1.0, 1e-3, p, rng), 1e-3, p, sensors=BENCH, rng=rng)
    found = flow_balance(log, HEALTHY, MIDDLE)
    assert found is not None
    assert abs(found.swept - 1.0) < 4.0 * found.swept_std
    assert found.compressed == pytest.approx(1.0, abs=0.3)
    assert channel_mistakes(log, HEALTHY) == ()


@pytest.mark.parametrize("times", [1.0, 9.55])
def test_at_a_single_motor_speed_the_flow_bias_does_not_absorb_the_pumps_flow(times: float) -> None:
    """The sign of the speed gives the flow, so a bias explained all flow if noise hid the motion of the piston."""
    rng = np.random.default_rng(1)
    speed = np.repeat(rng.choice([-100.0, 100.0], 300), 30) + rng.normal(0.0, 0.05, 9000)
    lost = 0.2 * HEALTHY.pump_displacement * HEALTHY.rated_speed * np.sign(speed)
    velocity = 0.9 * (HEALTHY.pump_displacement * speed - lost) / HEALTHY.piston_area
    way = 1e-3 * np.cumsum(velocity) + rng.normal(0.0, 2e-5, 9000)
    pressure = rng.normal(0.0, 5e4, 9000)
    log = Record(1e-3, {SPEED: times * speed, POSITION: way, PRESSURE: pressure})
    found = flow_balance(log, HEALTHY, MIDDLE)
    assert found is not None
    assert 0.8 * times < found.swept < 1.3 * times


def test_at_a_single_motor_speed_the_unknown_flow_bias_widens_the_deviations() -> None:
    """A bias absorbed a quarter of all flow, and the piston's factor was 0.75, 23 deviations from the true one."""
    rng = np.random.default_rng(4)
    log = simulate(CIRCUIT, make_drive("prbs", 4.0, 1e-3, HEALTHY, rng), 1e-3, HEALTHY, sensors=BENCH, rng=rng)
    found = flow_balance(log, HEALTHY, MIDDLE)
    assert found is not None
    assert abs(found.swept - 1.0) < 3.0 * found.swept_std < 0.6
    assert abs(found.compressed - 1.0) < 3.0 * found.compressed_std


def test_a_still_piston_has_an_infinite_deviation_of_swept_flow() -> None:
    """If every other flow bias was ruled out, the deviation was not a number, and NumPy warned of it."""
    rng = np.random.default_rng(1)
    speed = np.repeat(100.0 * rng.choice([-1.0, 1.0], 3000) * rng.uniform(0.2, 1.0, 3000), 30)
    pressure = 1e7 * HEALTHY.pump_displacement * np.cumsum(speed)
    log = Record(1e-3, {SPEED: speed, POSITION: np.zeros_like(speed), PRESSURE: pressure})
    found = flow_balance(log, HEALTHY, MIDDLE)
    assert found is not None
    assert found.swept_std == np.inf
    assert 0.0 < found.compressed_std < 0.1


@pytest.mark.parametrize("load", [0.0, 500.0])
def test_the_balance_of_a_single_rod_uses_the_area_of_the_loaded_side(load: float) -> None:
    """With its mean area, a rod with 35 % on either side seemed to move by 0.72 and 0.9 times the pumped flow."""
    rod = replace(circuit_of(HEALTHY), area_difference=0.35, pilot_share=1.0, load_force=load)
    log = simulate(CIRCUIT, make_drive("steps", 6.0, 1e-3, rod, np.random.default_rng(2)), 1e-3, rod)
    found, by_mean = (flow_balance(log, one, MIDDLE) for one in (rod, replace(rod, pilot_share=0.0)))
    assert found is not None
    assert by_mean is not None
    assert abs(found.swept - 1.0) < 0.06
    assert abs(by_mean.swept - 1.0) > 0.1


def test_pressure_noise_does_not_switch_the_loaded_side_of_a_single_rod() -> None:
    """By the sign of each sample, a sixth of them belonged to the other side, and the factor was 0.9."""
    rng = np.random.default_rng(6)
    rod = replace(HEALTHY, area_difference=0.35, pilot_share=1.0)
    speed = np.repeat(rng.uniform(20.0, 120.0, 120) * np.tile([1.0, -1.0], 60), 100)
    held = np.where(speed > 0.0, *piston_areas(rod))
    way = 1e-3 * np.cumsum(rod.pump_displacement * speed / held)
    pressure = 1e5 * np.sign(speed) + rng.normal(0.0, 1e5, len(speed))
    found = flow_balance(Record(1e-3, {SPEED: speed, POSITION: way, PRESSURE: pressure}), rod, MIDDLE)
    assert found is not None
    assert found.swept == pytest.approx(1.0, abs=0.02)
