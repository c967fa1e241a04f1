"""Tests of the stack alone."""

import numpy as np
import pytest

from plant.piezo_stack.free import loop_width, run_free_stack, stack_loop
from plant.piezo_stack.parameters import PiezoStackParameters

STACK = PiezoStackParameters()


def test_loops_widen_with_frequency_up_to_400_hz() -> None:
    widths = [loop_width(*stack_loop(STACK, frequency, 100.0)) for frequency in (50.0, 200.0, 400.0)]
    assert widths == sorted(widths)
    assert widths[-1] > 2.0 * widths[0]


def test_the_loop_closes_without_hysteresis_and_lag() -> None:
    voltage, displacement = stack_loop(PiezoStackParameters(hysteresis=0.0, stack_lag=1e-6), 50.0, 100.0)
    assert abs(loop_width(voltage, displacement)) < 2e-3
    assert np.ptp(displacement) == pytest.approx(100.0 * STACK.free_stroke_a_volt, rel=1e-3)


def test_a_small_step_settles_at_the_free_stroke_minus_the_small_signal_hysteresis() -> None:
    voltage = np.append(0.0, np.full(800, 1.0))
    settled = run_free_stack(STACK, voltage, 5e-6)[-1]
    assert settled == pytest.approx(STACK.free_stroke_a_volt - STACK.hysteresis, rel=0.02)
