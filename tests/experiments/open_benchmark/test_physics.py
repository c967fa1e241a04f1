"""The open benchmark's actuator conserves oil and energy, settles as the equations say, and really sticks."""

import numpy as np
import pytest

from experiments.open_benchmark.equations import rates, stop_force
from experiments.open_benchmark.flows import check_flow, filling, leakage_flow, orifice_flow, pump_flow
from experiments.open_benchmark.friction import SLIPS, friction_force, steady_friction
from experiments.open_benchmark.logger import PLAIN_CHANNELS, Logger
from experiments.open_benchmark.machine import ATMOSPHERE, Machine
from experiments.open_benchmark.oil import specific_volume, stiffness
from experiments.open_benchmark.run import RECORD, TICK, at_rest, run
from plant.arrays import Array
from plant.errors import HydrostateError

LOSSLESS = Machine(
    leakage=0.0, drain=0.0, check_a=0.0, check_b=0.0, flow_bias=0.0, quadratic=0.0, linear=0.0, coulomb=1e-9
)


def course(speed: Array | float, seconds: float, air: float = 0.0) -> Array:
    rows = np.ones((round(seconds / TICK), 5))
    rows[:, 0], rows[:, 3] = speed, air
    return rows


def oil(states: Array, air: float, m: Machine) -> Array:
    """Return the oil in both chambers less that lost by the accumulator, as volume at atmospheric pressure."""
    a, b = (np.array([specific_volume(p, air, m) for p in states[:, i]]) for i in (4, 5))
    x = states[:, 2]
    return (m.volume_a + m.area_a * x) / a + (m.volume_b - m.area_b * x) / b - states[:, 6]


def energy(states: Array, m: Machine) -> Array:
    x, v = states[:, 2], states[:, 3]
    held = 0.0
    for volume, pressure in ((m.volume_a + m.area_a * x, states[:, 4]), (m.volume_b - m.area_b * x, states[:, 5])):
        over = pressure - ATMOSPHERE
        held = held + volume / (1.0 - over / m.bulk_modulus) * over**2 / (2.0 * m.bulk_modulus)
    return held + 0.5 * m.mass * v**2 + 0.5 * m.spring * x**2


@pytest.mark.parametrize(
    ("machine", "air"),
    [
        (Machine(), 0.0),
        (Machine(leakage=6e-11, drain=2e-12, relief=3e5, seat_leak_a=2e-11), 0.02),
        (Machine(check_b=0.0, coulomb=2000.0), 0.0),
        (Machine(area_b=1.064e-3, volume_b=1.512e-3, pilot=3.0, stiffening=8.0), 0.0),
    ],
    ids=["healthy", "leaking, relieved, with air", "boiling", "single rod"],
)
def test_the_volume_of_oil_is_conserved(machine: Machine, air: float) -> None:
    t = TICK * np.arange(2000)
    states = run(machine, course(120.0 * np.sign(np.sin(9.0 * t)), 2.0, air))
    held = oil(states, air, machine)
    pumped = machine.displacement * np.sum(np.abs(states[:, 0])) * RECORD
    assert np.max(np.abs(held - held[0])) < 2e-5 * pumped


def test_a_frictionless_piston_between_sealed_chambers_keeps_its_energy() -> None:
    m = LOSSLESS._replace(spring=2e4)
    start = at_rest(m) + np.array([0.0, 0.0, 0.0, 0.1, 2e5, 0.0, 0.0])
    held = energy(run(m, course(0.0, 0.5), start), m)
    assert np.ptp(held) < 1e-3 * held[0]


def test_friction_and_leakage_only_dissipate_energy() -> None:
    m = LOSSLESS._replace(spring=2e4, leakage=2e-11, linear=50.0, coulomb=20.0)
    start = at_rest(m) + np.array([0.0, 0.0, 0.0, 0.1, 2e5, 0.0, 0.0])
    held = energy(run(m, course(0.0, 0.5), start), m)
    presliding = 20.0 * 3e-5 * max(SLIPS)
    assert np.all(held[100:] <= np.minimum.accumulate(held)[:-100] + presliding)
    assert held[-1] < 0.9 * held[0]


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_the_steady_state_satisfies_the_flow_and_force_balances(sense: float) -> None:
    m = Machine(ripple=0.0, drain=0.0, leakage=2.5e-11)
    states = run(m, course(sense * 125.66, 1.5))
    v, dp = abs(states[-1, 3]), abs(states[-1, 4] - states[-1, 5])
    assert m.area_a * v == pytest.approx(m.displacement * 125.66 - m.flow_bias - m.leakage * dp, rel=2e-3)
    assert m.area_a * dp == pytest.approx(m.quadratic * v**2 + m.linear * v + m.coulomb, rel=2e-3)


def test_a_finer_integration_step_changes_pressure_by_less_than_500_pa() -> None:
    drive = course(100.0 * np.sign(np.sin(20.0 * TICK * np.arange(1000))), 1.0)
    m = Machine(bulk_modulus=1.2e9, quadratic=4.462e6, linear=1.863e4, coulomb=551.0)
    coarse, fine = run(m, drive), run(m, drive, refine=4)
    assert np.max(np.abs(coarse - fine)[:, 4]) < 500.0


def test_a_piston_under_a_load_below_static_friction_stays() -> None:
    m = Machine(load=300.0)
    states = run(m, course(0.0, 1.0))
    assert np.max(np.abs(states[:, 2])) < max(SLIPS) * m.presliding
    assert np.ptp(states[-2000:, 2]) < 1e-6


def test_friction_with_every_block_slipping_follows_the_steady_curve() -> None:
    m = Machine(quadratic=1.162e6, linear=-7440.0, coulomb=500.0)
    slipping = m.presliding * np.array(SLIPS)
    for v in (0.002, 0.01, 0.06):
        assert friction_force(v, slipping, 1.0, 1.0, m) == pytest.approx(500.0 - 7440.0 * v + 1.162e6 * v**2)
        assert min(steady_friction(v, 1.0, m)) >= 0.0


def test_bulk_stiffness_is_the_slope_of_the_specific_volume() -> None:
    for m, air in ((Machine(), 0.0), (Machine(), 0.02), (Machine(stiffening=8.0), 0.0)):
        below, at, above = (specific_volume(p, air, m) for p in (3.999e5, 4e5, 4.001e5))
        assert -at * 200.0 / (above - below) == pytest.approx(stiffness(4e5, air, m), rel=1e-4)


def test_a_chamber_without_make_up_flow_cavitates() -> None:
    states = run(Machine(check_b=0.0, coulomb=3000.0), course(120.0, 0.5))
    emptiest = np.min(states[:, 5])
    assert emptiest < 0.0
    assert specific_volume(emptiest, 0.0, Machine()) < 1.01
    assert filling(Machine().vapour, 0.0, Machine()) == 1.0
    assert 0.9 < filling(-1e7, 0.0, Machine()) < 1.0


def test_valves_open_one_way_unless_a_pilot_opens_them() -> None:
    plain, piloted = (7e-7, 1e4, 0.0, 0.0), (7e-7, 1e4, 0.0, 3.0)
    assert check_flow(4e5, 3e5, 3e5, plain) == 0.0
    assert check_flow(2.95e5, 3e5, 3e5, plain) == 0.0
    assert check_flow(2.5e5, 3e5, 3e5, plain) > 0.0
    assert check_flow(3.1e5, 6e5, 3e5, piloted) < 0.0


def test_pump_losses_never_reverse_the_flow_and_turbulent_leakage_matches_at_its_reference() -> None:
    assert pump_flow(3.0, 0.0, Machine()) == 0.0
    assert pump_flow(-125.66, 0.4, Machine(ripple=0.0)) == pytest.approx(-(5.57e-7 * 125.66 - 2.413e-6))
    m = Machine(turbulent=0.3)
    assert leakage_flow(m.turbulent_pressure, 1e-11, m) == pytest.approx(1e-11 * m.turbulent_pressure, rel=1e-4)
    assert orifice_flow(-1e6, 1e-9) == pytest.approx(-1e-6, rel=1e-4)


def test_the_motor_keeps_to_its_current_limit() -> None:
    m, out = Machine(), np.zeros(7)
    rates(at_rest(m), np.zeros(4), np.array([0.0, 1.0, 1.0, 0.0, 1.0]), 1e4, m, out)
    assert out[0] == m.acceleration


def test_end_stops_only_push_the_piston_inwards() -> None:
    m = Machine()
    end = 0.5 * m.stroke
    assert [stop_force(x, 5.0, m) for x in (0.0, 0.999 * end, -0.999 * end)] == [0.0] * 3
    assert stop_force(end + 1e-4, 0.0, m) == pytest.approx(-m.stop_stiffness * 1e-4)
    assert stop_force(-end - 1e-4, 0.0, m) == pytest.approx(m.stop_stiffness * 1e-4)
    inward, outward = (stop_force(end + 1e-4, v, m) for v in (-0.01, 0.01))
    assert outward == pytest.approx(-m.stop_stiffness * 1e-4 - 0.01 * m.stop_damping)
    assert inward > outward
    assert stop_force(end + 1e-6, -10.0, m) == 0.0  # the piston leaves faster than the stop can follow


def test_a_run_that_diverged_is_refused_as_a_log() -> None:
    states = run(Machine(), course(50.0, 0.2))
    logger = Logger(sample_time=1e-3, channels=PLAIN_CHANNELS)
    assert len(logger.log(states, np.random.default_rng(0))) > 0
    states[-1, 2] = np.nan
    with pytest.raises(HydrostateError, match="must stay finite, got one that ran away"):
        logger.log(states, np.random.default_rng(0))
