"""Fits of steady logs return the true parameters, with intervals that match the errors."""

import numpy as np
import pytest

from estimation.fits.steady_state_fit import SteadyFit, SteadyPoints, fit_friction, fit_leakage, steady_points
from faults.eha.physical import with_throttles
from plant.arrays import Array
from plant.eha.circuit_parameters import CircuitParameters
from plant.eha.model import EhaParameters
from plant.eha.simulate import CIRCUIT, simulate
from plant.eha.steady_state import steady_state
from plant.errors import LogError
from plant.log.record import Record
from plant.sensors.sensors import BENCH, measure

RIG = EhaParameters()
CIRCUIT_RIG = CircuitParameters(stroke=1.2)


def exact_points(p: EhaParameters, speeds: Array) -> SteadyPoints:
    velocity, pressure = np.array([steady_state(float(speed), p) for speed in speeds]).T
    none = np.zeros(len(speeds))
    tiny = np.full(len(speeds), 1e-9)
    return SteadyPoints(speeds, velocity, pressure, none, tiny * speeds, tiny * velocity, tiny * pressure, none)


def held(p: CircuitParameters, volts: float, seconds: float = 8.0) -> Record:
    return simulate(CIRCUIT, np.full(round(seconds * 1e3), volts * p.motor_speed_per_volt), 1e-3, p)


def leaking_logs(a_volts: float) -> tuple[CircuitParameters, list[Record]]:
    circuits = [with_throttles(CIRCUIT_RIG, a_volts, b_volts) for b_volts in (0.0, 2.2, 2.3, 2.4)]
    return circuits[0], [held(p, 4.0) for p in circuits]


def rubbing_logs(b_volts: float) -> tuple[CircuitParameters, list[Record]]:
    p = with_throttles(CIRCUIT_RIG, 10.0, b_volts)
    return p, [held(p, volts) for volts in (0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5)]


def coverage(fits: list[SteadyFit], truth: dict[str, float]) -> dict[str, float]:
    return {
        name: float(np.mean([fit.coefficients[name].covers(value) for fit in fits])) for name, value in truth.items()
    }


def test_exact_steady_states_give_the_friction_exactly() -> None:
    fit = fit_friction(exact_points(RIG, np.linspace(20.0, 200.0, 12)), RIG)
    for name in ("friction_quadratic", "friction_linear", "friction_coulomb"):
        assert fit.coefficients[name].value == pytest.approx(getattr(RIG, name), rel=1e-6)


def test_exact_steady_states_give_the_leakage_exactly() -> None:
    fit = fit_leakage(exact_points(RIG, np.linspace(20.0, 250.0, 12)), RIG)
    assert fit.coefficients["leakage_coefficient"].value == pytest.approx(RIG.leakage_coefficient, rel=1e-6, abs=0.0)
    assert fit.coefficients["flow_bias"].value == pytest.approx(RIG.flow_bias, rel=1e-6)


def test_windows_that_are_not_steady_are_left_out() -> None:
    logs = [held(CIRCUIT_RIG, 3.0), held(CIRCUIT_RIG, -3.0)]
    points = steady_points(measure(log, BENCH, np.random.default_rng(1)) for log in logs)
    assert 10 <= len(points) <= 15
    assert np.all(points.velocity > 0.0)
    assert np.ptp(points.pressure) < 0.01 * np.mean(points.pressure)


def test_a_sticking_piston_gives_no_steady_point() -> None:
    assert len(steady_points([measure(held(CIRCUIT_RIG, 0.05), BENCH, np.random.default_rng(1))])) == 0


def test_velocity_is_used_if_position_is_not_logged() -> None:
    log = measure(held(CIRCUIT_RIG, 3.0), BENCH, np.random.default_rng(1))
    with_position, without = (steady_points([one]) for one in (log, log.replace(position_m=None)))
    assert np.mean(without.velocity) == pytest.approx(np.mean(with_position.velocity), rel=1e-3)
    assert np.all(without.velocity_error > 10.0 * with_position.velocity_error)


@pytest.mark.parametrize("a_volts", [10.0, 1.75])
def test_leakage_is_recovered_from_circuit_logs(a_volts: float) -> None:
    p, logs = leaking_logs(a_volts)
    fits = [
        fit_leakage(steady_points(measure(log, BENCH, rng) for log in logs), p)
        for rng in np.random.default_rng(3).spawn(8)
    ]
    mean = np.mean([fit.coefficients["leakage_coefficient"].value for fit in fits])
    assert mean == pytest.approx(p.settled_leakage, rel=2e-3, abs=0.0)
    assert max(fit.misfit for fit in fits) < 3.0


@pytest.mark.parametrize("b_volts", [0.0, 2.3, 2.5])
def test_the_friction_parabola_is_recovered_from_circuit_logs(b_volts: float) -> None:
    p, logs = rubbing_logs(b_volts)
    fits = [
        fit_friction(steady_points(measure(log, BENCH, rng) for log in logs), p)
        for rng in np.random.default_rng(3).spawn(8)
    ]
    for name in ("friction_quadratic", "friction_linear", "friction_coulomb"):
        mean = np.mean([fit.coefficients[name].value for fit in fits])
        assert mean == pytest.approx(getattr(p, name), rel=1e-2)


@pytest.mark.slow
@pytest.mark.parametrize("a_volts", [10.0, 2.0, 1.75])
def test_intervals_of_leakage_cover_the_truth_in_nine_of_ten_seeds(a_volts: float) -> None:
    p, logs = leaking_logs(a_volts)
    fits = [
        fit_leakage(steady_points(measure(log, BENCH, np.random.default_rng(seed)) for log in logs), p)
        for seed in range(100)
    ]
    found = coverage(fits, {"leakage_coefficient": p.settled_leakage, "flow_bias": p.flow_bias})
    assert min(found.values()) >= 0.9, found


@pytest.mark.slow
@pytest.mark.parametrize("b_volts", [0.0, 2.3, 2.5])
def test_intervals_of_friction_cover_the_truth_in_nine_of_ten_seeds(b_volts: float) -> None:
    p, logs = rubbing_logs(b_volts)
    fits = [
        fit_friction(steady_points(measure(log, BENCH, np.random.default_rng(seed)) for log in logs), p)
        for seed in range(100)
    ]
    names = ("friction_quadratic", "friction_linear", "friction_coulomb")
    found = coverage(fits, {name: float(getattr(p, name)) for name in names})
    assert min(found.values()) >= 0.9, found


def test_too_few_points_are_refused_with_their_count() -> None:
    points = exact_points(RIG, np.array([50.0, 100.0]))
    with pytest.raises(LogError, match="needs more than 2 steady points, got 2"):
        fit_leakage(points, RIG)
    with pytest.raises(LogError, match="needs more than 3 steady points, got 2"):
        fit_friction(points, RIG)


def test_points_that_are_all_alike_are_refused() -> None:
    with pytest.raises(LogError, match="needs steady points that differ more"):
        fit_friction(exact_points(RIG, np.full(6, 100.0)), RIG)


def test_a_window_of_too_few_samples_is_refused() -> None:
    log = simulate(CIRCUIT, np.full(100, 50.0), 1e-2, CIRCUIT_RIG)
    with pytest.raises(LogError, match="at least 8 samples, got 5"):
        steady_points([log], window=0.05)
