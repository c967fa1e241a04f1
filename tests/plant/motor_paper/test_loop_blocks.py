"""Noise, relay, delay and PID do what their names say, alone and in a loop."""

import numpy as np
import pytest

from plant.errors import RigError
from plant.motor_paper.loop_blocks import (
    LoopRun,
    Pid,
    PidMemory,
    band_limited_noise,
    pid_step,
    relay,
    run_loop,
    ultimate_point,
)
from plant.motor_paper.vibration_model import Matrices, VibrationParameters, massless_matrices

STEP = 1e-3
LAG: Matrices = (np.array([[-10.0]]), np.array([[10.0]]), np.array([[1.0]]), np.zeros((1, 1)))


def _pid_run(pid: Pid, reference: np.ndarray, delay: int = 0) -> LoopRun:
    def controller(memory: PidMemory, error: float) -> tuple[float, PidMemory]:
        return pid_step(pid, memory, error, STEP)

    return run_loop(LAG, controller, PidMemory(), reference, STEP, delay=delay)


def test_noise_has_its_density_at_every_sample_time() -> None:
    for sample_time in (1e-3, 1e-5):
        noise = band_limited_noise(np.random.default_rng(1), 200_000, sample_time, 4e-6)
        assert np.var(noise) * sample_time == pytest.approx(4e-6, rel=0.02)


def test_a_proportional_loop_keeps_the_error_of_its_gain() -> None:
    assert _pid_run(Pid(4.0), np.ones(3000)).output[-1] == pytest.approx(0.8, rel=1e-6)


def test_an_integral_loop_leaves_no_error() -> None:
    assert _pid_run(Pid(1.0, 20.0), np.ones(3000)).output[-1] == pytest.approx(1.0, rel=1e-6)


def test_a_pid_step_follows_its_equation() -> None:
    pid, memory, error = Pid(2.0, 3.0, 0.5), PidMemory(integral=0.25, error=0.1), 0.4
    command, after = pid_step(pid, memory, error, 0.1)
    assert command == pytest.approx(2.0 * 0.4 + 0.25 + 3.0 * 0.4 * 0.1 + 0.5 * 3.0)
    assert after == PidMemory(pytest.approx(0.37), pytest.approx(0.4))


def test_the_integral_waits_while_a_limit_holds_the_command() -> None:
    reference = np.concatenate([np.full(2000, 5.0), np.full(2000, 0.5)])
    waiting = _pid_run(Pid(1.0, 20.0, high=1.0, low=-1.0), reference)
    assert waiting.command.max() == 1.0
    assert waiting.output[2150] < 0.6  # with integrator windup it would stay at 1 for seconds


def test_a_delayed_command_acts_later_by_its_delay() -> None:
    prompt, late = _pid_run(Pid(0.0, 1.0), np.ones(100)), _pid_run(Pid(0.0, 1.0), np.ones(100), delay=7)
    assert np.flatnonzero(late.output)[0] == np.flatnonzero(prompt.output)[0] + 7


def test_noise_is_added_to_the_measurement_and_not_to_the_output() -> None:
    noise = np.random.default_rng(2).normal(0.0, 1.0, 50)
    run = run_loop(LAG, lambda memory, _: (0.0, memory), None, np.zeros(50), STEP, noise=noise)
    assert not run.output.any()
    assert run.measured == pytest.approx(noise)


def test_a_relay_loop_oscillates_at_180_degrees_phase_lag_of_model_and_delay() -> None:
    matrices, delay, step = massless_matrices(VibrationParameters()), 20, 1e-5

    def controller(high: bool, error: float) -> tuple[float, bool]:
        now = relay(high, error)
        return (1.0 if now else -1.0), now

    gain, frequency = ultimate_point(run_loop(matrices, controller, True, np.zeros(6000), step, delay=delay), 1.0)
    s = 2j * np.pi * frequency
    A, B, C, _ = matrices
    response = (C @ np.linalg.solve(s * np.eye(2) - A, B))[0, 0] * np.exp(-s * step * (delay + 0.5))
    assert np.angle(-response, deg=True) == pytest.approx(0.0, abs=3.0)
    assert gain * abs(response) == pytest.approx(1.0, rel=0.03)


def test_a_run_without_oscillation_has_no_ultimate_point() -> None:
    with pytest.raises(RigError, match="two periods in its second half, got 0"):
        ultimate_point(_pid_run(Pid(1.0), np.ones(100)), 1.0)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Pid(float("nan")), "gains must be finite"),
        (lambda: Pid(1.0, low=1.0, high=1.0), "low must be below high"),
        (lambda: Pid(1.0, filter_time=-1.0), "filter_time must not be negative"),
    ],
)
def test_impossible_controllers_are_refused(make: object, said: str) -> None:
    assert callable(make)
    with pytest.raises(RigError, match=said):
        make()
