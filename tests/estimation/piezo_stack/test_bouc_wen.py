"""Bouc-Wen parameters from hysteresis loops of a stack and of the public benchmark."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from benchmarks.plants.bouc_wen_oscillator import (
    OscillatorParameters,
    fit_oscillator,
    linear_start,
    simulate_oscillator,
)
from estimation.piezo_stack.bouc_wen import LOOP, SHAPE, _checked_loop, fit_stack_loop, loop_bounds
from estimation.piezo_stack.bouc_wen_printed import REGIONS, printed_fit
from estimation.tuning.step_sensitivity import sensitivity_step
from plant.arrays import Array
from plant.components.bouc_wen import asymmetric_bouc_wen_rate
from plant.errors import LogError
from plant.piezo_stack.hysteresis import slow_stack_step
from plant.piezo_stack.parameters import PiezoStackParameters
from plant.piezo_stack.trajectory import stack_row
from plant.solvers.trajectory import compile_trajectory

STACK = PiezoStackParameters()
SAMPLES = 2000
NOISE = 2e-8


def slow_loop(swing: float, cycles: int, samples: int = SAMPLES) -> tuple[np.ndarray, np.ndarray]:
    """Return a loop by equation 1 in tiny Euler steps, a method that no package uses."""
    fine = 20
    voltage = 0.5 * swing * (1.0 - np.cos(2.0 * np.pi * np.arange(cycles * samples * fine + 1) / (samples * fine)))
    shape = [getattr(STACK, name) for name in SHAPE]
    h, found = 0.0, [0.0]
    for change in np.diff(voltage).tolist():
        h += asymmetric_bouc_wen_rate(change, h, *shape)
        found.append(h)
    displacement = STACK.free_stroke_a_volt * voltage - np.array(found)
    return voltage[::fine], displacement[::fine]


@pytest.fixture(scope="module")
def loop() -> tuple[np.ndarray, np.ndarray]:
    return slow_loop(100.0, 3)


def test_every_parameter_comes_back_from_three_noisy_cycles_from_rest(loop: tuple[np.ndarray, np.ndarray]) -> None:
    voltage, displacement = loop
    noise = NOISE * np.random.default_rng(1).standard_normal(len(voltage))
    fit = fit_stack_loop(voltage, displacement + noise)
    for name in LOOP:
        assert fit.values[name] == pytest.approx(getattr(STACK, name), abs=4.0 * fit.deviations[name])
        assert fit.deviations[name] < 0.012 * abs(getattr(STACK, name))
    assert fit.error == pytest.approx(2e-8, rel=0.05)


def closed_loop(loop: tuple[np.ndarray, np.ndarray], samples: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the last cycle with the given number of samples."""
    moments = np.linspace(0.0, SAMPLES, samples + 1)
    voltage, displacement = (np.interp(moments, np.arange(SAMPLES + 1), values[-SAMPLES - 1 :]) for values in loop)
    return voltage, displacement


def test_one_closed_loop_at_the_benchs_rate_gives_every_parameter_to_two_percent(
    loop: tuple[np.ndarray, np.ndarray],
) -> None:
    voltage, displacement = closed_loop(loop, 200_000)
    noise = NOISE * np.random.default_rng(1).standard_normal(len(voltage))
    fit = fit_stack_loop(voltage, displacement + noise, from_rest=False)
    bounds = loop_bounds(STACK, voltage, NOISE, from_rest=False)
    for name in LOOP:
        truth = getattr(STACK, name)
        assert fit.values[name] == pytest.approx(truth, rel=0.02)
        assert fit.deviations[name] == pytest.approx(bounds[name] * abs(truth), rel=0.05)


def test_bounds_exceed_two_percent_with_fewer_samples_and_are_infinite_for_a_first_loop() -> None:
    voltage = 50.0 * (1.0 - np.cos(2.0 * np.pi * np.arange(5001) / 5000))
    closed, first = (loop_bounds(STACK, voltage, NOISE, from_rest=from_rest) for from_rest in (False, True))
    assert 0.02 < max(closed.values()) < 0.03
    assert {name for name, bound in first.items() if np.isinf(bound)} == set(SHAPE[1:])


@pytest.mark.slow
def test_intervals_cover_the_truth_at_their_nominal_rate(loop: tuple[np.ndarray, np.ndarray]) -> None:
    voltage, displacement = loop
    covered = 0
    for seed in range(40):
        noise = NOISE * np.random.default_rng(seed).standard_normal(len(voltage))
        fit = fit_stack_loop(voltage, displacement + noise)
        ends = [(*fit.interval(name), getattr(STACK, name)) for name in LOOP]
        covered += sum(low <= truth <= high for low, high, truth in ends)
    assert 0.88 <= covered / (40 * len(LOOP)) <= 1.0


def test_one_cycle_from_rest_is_not_enough() -> None:
    with pytest.raises(LogError, match="two cycles or more"):
        fit_stack_loop(*slow_loop(100.0, 1))


def test_a_loop_that_does_not_end_where_it_began_is_refused(loop: tuple[np.ndarray, np.ndarray]) -> None:
    with pytest.raises(LogError, match="must end at the voltage where it began"):
        fit_stack_loop(loop[0][: SAMPLES // 2], loop[1][: SAMPLES // 2])


def test_the_printed_procedure_underestimates_hysteresis(loop: tuple[np.ndarray, np.ndarray]) -> None:
    small = slow_loop(5.0, 2)
    settled = float(STACK.free_stroke_a_volt - STACK.hysteresis) * 5.0
    last = slice(-SAMPLES - 1, None)
    printed = printed_fit((5.0, settled), (small[0][last], small[1][last]), (loop[0][last], loop[1][last]))
    truth = STACK.free_stroke_a_volt - STACK.hysteresis
    assert printed.values["free_stroke_a_volt"] == pytest.approx(truth, rel=0.01)
    assert abs(printed.values["hysteresis"]) < 0.2 * STACK.hysteresis
    assert min(printed.samples) < 0.02 * SAMPLES
    np.testing.assert_allclose(REGIONS.T @ REGIONS, 4.0 * np.eye(4))


def test_sensitivities_agree_with_differences_of_the_step() -> None:
    run = compile_trajectory("slow_stack", sensitivity_step(slow_stack_step, 1, SHAPE), 6, PiezoStackParameters)
    voltage = 50.0 * (1.0 - np.cos(np.arange(300) / 40.0))

    def end(**changed: float) -> np.ndarray:
        return run(np.zeros(6), voltage, stack_row(replace(STACK, **changed))[None], 1.0, 1)[-1]

    for place, name in enumerate(SHAPE):
        value, change = getattr(STACK, name), 1e-4 * abs(getattr(STACK, name))
        up, down = (float(end(**{name: value + sign * change})[0]) for sign in (1.0, -1.0))
        assert end()[1 + place] == pytest.approx((up - down) / (2.0 * change), rel=1e-5)


@pytest.mark.slow
def test_the_public_benchmark_is_identified_and_predicted(shared: Path) -> None:
    folder = shared / "data" / "bouc_wen"
    if not folder.is_dir():
        pytest.skip(f"no {folder}")
    read = {
        name: pd.read_csv(folder / f"{name}.csv") for name in ("train_multisine", "test_multisine", "test_sinesweep")
    }
    period, sample_time = 8192, 1.0 / 750.0
    force = read["train_multisine"]["u_N"].to_numpy()[:period]
    measured = read["train_multisine"]["y_m"].to_numpy().reshape(-1, period)[1:].mean(axis=0)
    fit = fit_oscillator(force, measured, sample_time, linear_start(force, measured, sample_time))
    for name, truth in (
        ("mass", 2.0),
        ("stiffness", 5e4),
        ("alpha", 5e4),
        ("beta_gamma", 800.0),
        ("beta_delta", -1100.0),
    ):
        assert fit.values[name] == pytest.approx(truth, rel=0.05)
    found = OscillatorParameters(**fit.values)
    for name, most in (("test_multisine", 2e-5), ("test_sinesweep", 3e-5)):
        log = read[name]
        predicted = simulate_oscillator(log["u_N"].to_numpy(), sample_time, found, periodic=name == "test_multisine")
        assert np.sqrt(np.mean((predicted - log["y_m"].to_numpy()) ** 2)) < most


@pytest.mark.parametrize(
    ("voltage", "displacement", "said"),
    [
        (np.zeros(9), np.zeros(8), "samples or more of both"),
        (np.zeros((9, 9)), np.zeros((9, 9)), "samples or more of both"),
        (np.zeros(3), np.zeros(3), "samples or more of both"),
        (np.full(500, np.nan), np.zeros(500), "a loop must be finite"),
        (np.zeros(500), np.full(500, np.inf), "a loop must be finite"),
        (np.arange(500.0), np.zeros(500), r"a gap of 100\.0 % of its swing"),
    ],
)
def test_an_invalid_loop_is_refused(voltage: Array, displacement: Array, said: str) -> None:
    with pytest.raises(LogError, match=said):
        _checked_loop(voltage, displacement)
