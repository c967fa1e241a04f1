"""The averaged diaphragm motor compared with the fast plant, and its control on the fast plant."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.diaphragm_motor.control import VelocityController, controlled_run
from estimation.diaphragm_motor.maps import MIDDLE, MotorMaps, average_run, motor_maps
from plant.diaphragm_motor.flow import operate
from plant.diaphragm_motor.model import POSITION
from plant.diaphragm_motor.parameters import DiaphragmMotorParameters
from plant.diaphragm_motor.run import RAMP_TIME, SAMPLE_TIME, motor_drive, run_motor
from plant.errors import HydrostateError

HEALTHY = DiaphragmMotorParameters()
PEAK = 480.0


@pytest.fixture(scope="module")
def maps() -> MotorMaps:
    return motor_maps(HEALTHY, (PEAK,))


def step_up(time: float) -> float:
    return 2e-3 if time < 0.6 else 3.5e-3


@pytest.mark.parametrize(("swing", "load"), [(225.0, 0.0), (175.0, 12.0), (275.0, 20.0)])
def test_electrode_and_drive_voltage_give_flow_and_pressure_between_map_points(
    maps: MotorMaps, swing: float, load: float
) -> None:
    point = operate(replace(HEALTHY, load_force=load), PEAK, swing)
    flow, pressure = maps.sensed(PEAK, swing, abs(point.tones[MIDDLE]))
    assert flow == pytest.approx(point.outlet_flow, rel=0.04)
    assert pressure == pytest.approx(point.pressure, abs=3e3)


def test_the_averaged_motor_moves_as_the_fast_plant(maps: MotorMaps) -> None:
    loaded = replace(HEALTHY, load_force=5.0)
    time = 2e-4 * np.arange(1001)
    _, velocity, position = average_run(maps, loaded, PEAK, 200.0 * np.minimum(time / RAMP_TIME, 1.0))
    fast = run_motor(loaded, motor_drive(PEAK, 200.0, 0.2, SAMPLE_TIME), SAMPLE_TIME)[:, POSITION]
    assert velocity[-1] == pytest.approx(operate(loaded, PEAK, 200.0).velocity, rel=0.02)
    np.testing.assert_allclose(position, fast[::10], atol=0.04 * position[-1])


def test_the_map_is_interpolated_linearly_between_frequencies() -> None:
    two = motor_maps(HEALTHY, (400.0, PEAK), (150.0, 200.0), (0.0, 2e4))
    low, middle, high = (two.row(two.flow, frequency, 200.0) for frequency in (400.0, 440.0, PEAK))
    np.testing.assert_allclose(middle, 0.5 * (low + high))


@pytest.mark.parametrize(("frequency", "swing", "said"), [(300.0, 100.0, "frequency"), (PEAK, 301.0, "voltage")])
def test_a_frequency_or_voltage_outside_the_map_is_refused(
    maps: MotorMaps, frequency: float, swing: float, said: str
) -> None:
    with pytest.raises(HydrostateError, match=f"the map's {said} goes from"):
        maps.row(maps.flow, frequency, swing)


def test_the_integral_part_does_not_wind_up_at_the_voltage_limit() -> None:
    control = VelocityController(proportional=0.0, integral=1e6)
    swing, held = 0.0, 0.0
    for _ in range(100):
        swing, held = control.act(1e-3, 0.0, held, 0.01)
    assert swing == 300.0
    assert held <= 300.0
    assert control.act(-1e-3, 0.0, held, 0.01)[0] < 300.0


@pytest.mark.parametrize("sensing", ["encoder", "self"])
def test_velocity_settles_within_half_a_second(maps: MotorMaps, sensing: str) -> None:
    run = controlled_run([(0.0, HEALTHY)], step_up, 1.2, PEAK, maps, np.random.default_rng(1), sensing=sensing)  # pyright: ignore[reportArgumentType] - a parametrised literal
    assert run.settling(0.0, 0.6) < 0.5
    assert run.settling(0.6, 1.2) < 0.5


def test_the_motor_reverses_under_control(maps: MotorMaps) -> None:
    run = controlled_run(
        [(0.0, HEALTHY)], lambda time: 3e-3 if time < 0.5 else -3e-3, 1.0, PEAK, maps, np.random.default_rng(1)
    )
    assert run.settling(0.5, 1.0) < 0.5
    assert run.velocity[-1] == pytest.approx(-3e-3, rel=0.05)


def test_self_sensing_control_misses_leakage_past_the_piston_and_an_encoder_does_not(maps: MotorMaps) -> None:
    leaking = [(0.0, replace(HEALTHY, load_force=15.0, crossport_leakage=2e-12))]
    runs = {
        sensing: controlled_run(leaking, lambda _: 3e-3, 0.8, PEAK, maps, np.random.default_rng(2), sensing=sensing)
        for sensing in ("encoder", "self")
    }
    last = {name: (run.velocity[-20:].mean(), run.measured[-20:].mean()) for name, run in runs.items()}
    assert last["encoder"][0] == pytest.approx(3e-3, rel=0.02)
    assert last["self"][1] == pytest.approx(3e-3, rel=0.02)
    assert last["self"][0] < 0.95 * 3e-3


def test_a_stopped_motor_does_not_reverse(maps: MotorMaps) -> None:
    run = controlled_run(
        [(0.0, HEALTHY)], lambda time: 3e-3 if time < 0.3 else 0.0, 0.4, PEAK, maps, np.random.default_rng(1)
    )
    stopping = run.time > 0.31
    assert run.swing[stopping][0] > 0.0  # the integral part takes some periods to unwind
    assert run.velocity[stopping].min() > -1e-4


def test_the_derivative_gain_acts_on_the_change_of_measured_velocity(maps: MotorMaps) -> None:
    control, period = VelocityController(derivative=2.0), 4.0 / PEAK
    run = controlled_run(
        [(0.0, HEALTHY)], lambda _: 3e-3, 5 * period, PEAK, maps, np.random.default_rng(1), controller=control
    )
    seen, held = np.array([0.0, 0.0, *run.measured]), 0.0
    assert np.ptp(seen) > 1e-4
    for before, last, swing in zip(seen, seen[1:], run.swing, strict=False):
        wanted, held = control.act(3e-3 - last, last - before, held, period)
        assert swing == pytest.approx(wanted)
