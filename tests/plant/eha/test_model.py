"""The lumped model sticks, breaks loose, loses energy and settles as the paper's equations require."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from faults.conditions import CONDITIONS, Condition, parameters_for
from plant.arrays import Array
from plant.compiled.elimination import eliminated_jacobian
from plant.compiled.expression import symbol
from plant.eha.model import (
    EhaParameters,
    _implicit_stage,
    lumped_step,
    pressure_rate,
    reduced_derivative,
)
from plant.errors import RigError
from plant.solvers.steps import parameter_names, parameter_row, parameter_symbols
from plant.solvers.trajectory import compile_trajectory
from tests.kernels import computed
from tests.thinned import thinned

RIG = EhaParameters()
STEP = 1e-4
EVERY_CONDITION = pytest.mark.parametrize("condition", CONDITIONS.values(), ids=CONDITIONS)


def lumped(initial: tuple[float, float, float], speed: Array, p: EhaParameters, substeps: int = 4) -> Array:
    run = compile_trajectory("lumped", lumped_step, 3, EhaParameters)
    return run(np.array(initial), speed, parameter_row(p)[None], STEP, substeps)


def energy(states: Array, p: EhaParameters) -> Array:
    """Return the kinetic energy of the piston plus the energy stored in the oil [J]."""
    _, v, dp = states.T
    return 0.5 * p.moving_mass * v**2 + 0.5 * p.chamber_volume / p.bulk_modulus * dp**2


def settled_at(volts: float, p: EhaParameters) -> tuple[float, float, float]:
    """Return speed, velocity and pressure after ten seconds of constant drive."""
    speed = volts * p.motor_speed_per_volt
    _, v, dp = lumped((0.0, 0.0, 0.0), np.full(100_001, speed), p)[-1]
    return speed, float(v), float(dp)


@EVERY_CONDITION
def test_below_the_coulomb_force_the_piston_sticks_exactly_and_stays(condition: Condition) -> None:
    p = replace(parameters_for(condition), leakage_coefficient=0.0)
    pressure = 0.999 * p.friction_coulomb / p.piston_area
    states = lumped((0.1, 0.0, pressure), np.zeros(5_000), p)
    assert np.all(states[:, 1] == 0.0)
    assert np.all(states[:, 0] == 0.1)
    np.testing.assert_allclose(states[:, 2], pressure, rtol=1e-12)


@EVERY_CONDITION
@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_above_the_coulomb_force_the_piston_breaks_loose_in_the_direction_of_the_pressure(
    condition: Condition, direction: float
) -> None:
    p = parameters_for(condition)
    pressure = 1.1 * direction * p.friction_coulomb / p.piston_area
    states = lumped((0.0, 0.0, pressure), np.zeros(100), p)
    assert states[1, 1] * direction > 0.0


@EVERY_CONDITION
def test_a_moving_piston_comes_to_rest_at_exactly_zero(condition: Condition) -> None:
    states = lumped((0.0, 0.03, 0.0), np.zeros(3_000), parameters_for(condition))
    (resting,) = np.nonzero(states[:, 1] == 0.0)
    assert np.all(states[resting[-1] - 500 :, 1] == 0.0)


@EVERY_CONDITION
def test_stored_energy_never_rises_with_the_pump_stopped(condition: Condition) -> None:
    p = parameters_for(condition)
    rng = np.random.default_rng(4)
    for substeps in (1, 4):
        for _ in range(40):
            start = (0.0, rng.uniform(-0.1, 0.1), rng.choice((-1.0, 1.0)) * 10.0 ** rng.uniform(4.0, 6.8))
            stored = energy(lumped(start, np.zeros(400), p, substeps), p)
            assert np.all(np.diff(stored) <= 4.0 * np.finfo(float).eps * stored[:-1])


def test_the_pressure_is_limited_by_the_relief_valve_of_a_blocked_piston() -> None:
    p = replace(RIG, friction_coulomb=1e5)
    speed = p.rated_speed
    pumped = p.pump_displacement * speed - p.flow_bias
    for sense in (1.0, -1.0):
        states = lumped((0.0, 0.0, 0.0), np.full(20_000, sense * speed), p)
        peak = float(np.max(np.abs(states[:, 2])))
        spilt = (pumped - p.leakage_coefficient * peak) / p.relief_conductance
        assert peak == pytest.approx(p.relief_pressure + spilt, rel=1e-9)
        assert np.all(states[:, 1] == 0.0)


@pytest.mark.parametrize(("level", "loose"), [("minor_leakage", 1.20), ("major_leakage", 1.82)], ids=["minor", "major"])
def test_leakage_makes_the_dead_zone_of_erratum_8(level: str, loose: float) -> None:
    p = parameters_for(CONDITIONS[level])
    assert settled_at(loose - 0.01, p)[1] == 0.0
    assert settled_at(loose + 0.01, p)[1] > 0.0


@EVERY_CONDITION
def test_the_leakage_coefficient_follows_from_the_steady_state(condition: Condition) -> None:
    p = parameters_for(condition)
    speed, v, dp = settled_at(2.5, p)
    assert abs(dp) < p.relief_pressure
    leaked = p.pump_displacement * speed - p.flow_bias - p.piston_area * v  # equation 5.7
    assert leaked / dp == pytest.approx(p.leakage_coefficient, rel=1e-6, abs=0.0)


@EVERY_CONDITION
def test_the_steady_pressure_carries_the_friction_force(condition: Condition) -> None:
    p = parameters_for(condition)
    _, v, dp = settled_at(3.0, p)
    force = p.friction_quadratic * v**2 + p.friction_linear * v + p.friction_coulomb  # equation 5.11
    assert p.piston_area * dp == pytest.approx(force, rel=1e-6)


def test_without_leakage_the_piston_follows_the_pump() -> None:
    p = replace(RIG, leakage_coefficient=0.0, flow_bias=0.0)
    speed, v, _ = settled_at(4.0, p)
    assert v == pytest.approx(p.pump_displacement * speed / p.piston_area, rel=1e-9)


def test_without_friction_and_leakage_the_piston_follows_the_pump_on_average_and_rings_at_its_own_frequency() -> None:
    none = {"friction_quadratic": 0.0, "friction_linear": 0.0, "friction_coulomb": 0.0}
    p = replace(RIG, leakage_coefficient=0.0, flow_bias=0.0, **none)
    ideal = p.pump_displacement * p.rated_speed / p.piston_area
    v = lumped((0.0, 0.0, 0.0), np.full(10_000, p.rated_speed), p)[:, 1]
    assert np.mean(v) == pytest.approx(ideal, rel=0.01)
    rising = np.nonzero((v[:-1] < ideal) & (v[1:] >= ideal))[0]
    natural = p.piston_area * np.sqrt(p.bulk_modulus / (p.chamber_volume * p.moving_mass)) / (2.0 * np.pi)
    assert 1.0 / (STEP * np.mean(np.diff(rising))) == pytest.approx(natural, rel=2e-3)


@EVERY_CONDITION
def test_the_reduced_model_is_the_lumped_one_differentiated_while_it_slides(condition: Condition) -> None:
    p = replace(parameters_for(condition), relief_conductance=0.0)
    for v, a in ((0.02, 0.7), (-0.03, 0.4)):
        direction = np.sign(v)
        friction = p.friction_quadratic * v**2 * direction + p.friction_linear * v + p.friction_coulomb * direction
        dp = (p.moving_mass * a + friction) / p.piston_area
        slope = p.friction_linear + 2.0 * p.friction_quadratic * v * direction
        jerk = (p.piston_area * pressure_rate(v, dp, 100.0, p) - slope * a) / p.moving_mass
        assert reduced_derivative((0.0, v, a), 100.0, p)[2] == pytest.approx(jerk, rel=1e-9)


def test_the_step_is_odd_in_state_and_drive() -> None:
    forth = lumped_step((0.01, 0.03, 5e5), (100.0, 110.0), RIG, STEP)
    back = lumped_step((-0.01, -0.03, -5e5), (-100.0, -110.0), RIG, STEP)
    assert [float(a) for a in forth] == [-float(b) for b in back]


def test_the_step_takes_many_runs_at_once() -> None:
    v, dp = np.array([0.0, 0.02, -0.03]), np.array([1e5, 5e5, -4e6])
    many = lumped_step((np.zeros(3), v, dp), (100.0, 101.0), RIG, STEP)
    for run in range(3):
        one = lumped_step((0.0, v[run], dp[run]), (100.0, 101.0), RIG, STEP)
        assert [float(state[run]) for state in many] == [float(state) for state in one]


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("piston_area", 0.0, "piston_area must be positive, got 0.0"),
        ("bulk_modulus", float("nan"), "bulk_modulus must be a finite number, got nan"),
        ("moving_mass", True, "moving_mass must be a finite number, got True"),
        ("flow_bias", -1e-6, "flow_bias must not be negative, got -1e-06"),
        ("chamber_volume", "1", "chamber_volume must be a finite number, got '1'"),
    ],
)
def test_a_parameter_that_no_actuator_can_have_is_refused_by_name(field: str, value: object, message: str) -> None:
    with pytest.raises(RigError, match=f"^{message}$"):
        replace(RIG, **{field: value})


def test_linear_friction_may_be_negative_as_in_table_4() -> None:
    assert replace(RIG, friction_linear=-7440.0).friction_linear == -7440.0  # errata E12


class EventDriven:
    """The lumped model by LSODA between events: the piston slips at the Coulomb force and stops at zero velocity."""

    def __init__(self, speed: Callable[[float], float], p: EhaParameters) -> None:
        self.speed, self.p = speed, p

    def rates(self, t: float, y: Array, sense: float) -> list[float]:
        p, (_, v, dp) = self.p, y
        friction = p.friction_linear * v + sense * (p.friction_quadratic * v * v + p.friction_coulomb)
        pumped = max(abs(p.pump_displacement * self.speed(t)) - p.flow_bias, 0.0) * np.sign(self.speed(t))
        relieved = p.relief_conductance * max(abs(dp) - p.relief_pressure, 0.0) * np.sign(dp)
        flow = pumped - p.piston_area * v - p.leakage_coefficient * dp - relieved
        moving = abs(sense)
        push = (p.piston_area * dp - friction) / p.moving_mass
        return [moving * v, moving * push, p.bulk_modulus / p.chamber_volume * flow]

    def slopes(self, t: float, y: Array, sense: float) -> list[list[float]]:
        del t
        p, (_, v, dp) = self.p, y
        stiffness, moving = p.bulk_modulus / p.chamber_volume, abs(sense)
        damping = (p.friction_linear + 2.0 * p.friction_quadratic * v * sense) / p.moving_mass
        loss = p.leakage_coefficient + (p.relief_conductance if abs(dp) > p.relief_pressure else 0.0)
        by_force = moving * p.piston_area / p.moving_mass
        return [
            [0.0, moving, 0.0],
            [0.0, -moving * damping, by_force],
            [0.0, -stiffness * p.piston_area, -stiffness * loss],
        ]

    def run(self, times: Array, knots: list[float]) -> Array:
        """Return the states at the given times, starting at rest; the drive is smooth between the knots."""
        p = self.p

        def slips(t: float, y: Array, sense: float) -> float:
            del t, sense
            return abs(p.piston_area * y[2]) - p.friction_coulomb

        def stops(t: float, y: Array, sense: float) -> float:
            del t
            return sense * y[1]

        slips.terminal, slips.direction, stops.terminal, stops.direction = True, 1.0, True, -1.0
        states = np.zeros((len(times), 3))
        t, y, sense = 0.0, np.zeros(3), 0.0
        for end in knots:
            while t < end:
                event = slips if sense == 0.0 else stops
                found = solve_ivp(
                    self.rates, (t, end), y, method="LSODA", jac=self.slopes, args=(sense,), events=event,
                    dense_output=True, rtol=1e-9, atol=[1e-12, 1e-11, 1e-3], max_step=5e-3,
                )  # fmt: skip
                inside = (times > t) & (times <= found.t[-1])
                states[inside] = found.sol(times[inside]).T
                t, y = float(found.t[-1]), found.y[:, -1].copy()
                if found.status == 1:
                    y[1] = 0.0
                    held = abs(p.piston_area * y[2]) <= p.friction_coulomb
                    sense = 0.0 if sense != 0.0 and held else float(np.sign(y[2]))
        return states


@pytest.mark.parametrize("drive", ["sine", "step"])
@pytest.mark.parametrize("condition", thinned(CONDITIONS, ["minor_friction", "major_leakage_major_friction"]))
def test_the_lumped_step_agrees_with_an_event_driven_solution(condition: str, drive: str) -> None:
    p = parameters_for(CONDITIONS[condition])
    times = STEP * np.arange(4_001)
    if drive == "sine":
        speed, knots = lambda t: p.rated_speed * np.sin(4.0 * np.pi * t), [times[-1]]
    else:
        ramp, levels = [0.0, times[2_500], times[2_501], times[-1]], p.rated_speed * np.array([1.0, 1.0, 0.0, 0.0])
        speed, knots = lambda t: np.interp(t, ramp, levels), ramp[1:]
    wanted = EventDriven(speed, p).run(times, knots)
    got = lumped((0.0, 0.0, 0.0), np.array([speed(t) for t in times]), p)
    assert np.any(got[1:, 1] == 0.0)
    assert np.any(got[:, 1] > 0.0)
    relative = np.sqrt(np.mean((got - wanted) ** 2, axis=0) / np.mean(wanted**2, axis=0))
    assert np.all(relative < 1e-4)


@pytest.mark.parametrize(
    "state",
    [
        *((3e-3, 0.02, 6e5), (-3e-3, -0.025, -6e5), (3e-3, 0.003, 2.9e5)),
        *((0.0, 0.0, 1e5), (0.01, 0.04, 4e6), (0.01, 0.0, -4e6)),
    ],
    ids=["slides", "slides back", "creeps", "sticks", "relieves", "relieves, held fast"],
)
def test_the_steps_derivatives_equal_numerical_derivatives(state: tuple[float, float, float]) -> None:
    names = parameter_names(EhaParameters)
    p = replace(RIG, load_stiffness=2e4, friction_coulomb=1e4 if state[1] == 0.0 else 436.0)
    values = dict(zip((*"xvd", *names), (*state, *parameter_row(p).tolist()), strict=True))
    inputs = [symbol(name) for name in values]
    stepped = lumped_step(tuple(inputs[:3]), (90.0, 95.0), parameter_symbols(EhaParameters), STEP)
    slopes = eliminated_jacobian(stepped, inputs)
    told = computed({f"{i} {name}": row[k] for i, row in enumerate(slopes) for k, name in enumerate(values)}, **values)
    outputs = {str(i): value for i, value in enumerate(stepped)}
    for name in values:
        d = 1e-6 * max(abs(values[name]), {"x": 1e-2, "v": 1e-2, "d": 1e5}.get(name, 1e-9))
        if np.isfinite(d):
            up, down = (computed(outputs, **(values | {name: values[name] + sign * d})) for sign in (1.0, -1.0))
            for i, size in enumerate((1e-2, 1e-2, 1e6)):
                seen = (up[str(i)] - down[str(i)]) / (2.0 * d)
                assert told[f"{i} {name}"] == pytest.approx(seen, rel=2e-5, abs=1e-9 * size / d), (i, name)


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("velocity", [-0.3, 0.3])
@pytest.mark.parametrize("beyond", [-5e4, -2e4, 2e4, 5e4])
def test_an_implicit_stage_opens_the_relief_valve_by_the_pressure_at_its_end(
    side: float, velocity: float, beyond: float
) -> None:
    p, h = EhaParameters(), 2e-3  # the piston's motion changes the pressure by more than its distance from the setting
    base = (0.0, side * velocity, side * (p.relief_pressure + beyond))
    _, moves, pressure = _implicit_stage(base, 0.0, p, h)
    relieved = p.relief_conductance * max(abs(pressure) - p.relief_pressure, 0.0) * np.sign(pressure)
    flow = -p.leakage_coefficient * pressure - relieved - p.piston_area * moves
    gained = h * p.bulk_modulus / p.chamber_volume * flow
    assert pressure - base[2] == pytest.approx(gained, rel=1e-9, abs=1e-3)


def test_an_actuator_with_an_area_difference_of_either_sign_is_single_rod() -> None:
    assert [EhaParameters(area_difference=one).single_rod for one in (-0.2, 0.0, 0.2)] == [True, False, True]
