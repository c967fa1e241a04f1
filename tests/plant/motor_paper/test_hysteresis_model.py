"""Bouc-Wen hysteresis of a diaphragm: the same loop at every frequency, and the linear model about it."""

import numpy as np
import pytest

from plant.errors import RigError
from plant.motor_paper.hysteresis_model import (
    HysteresisParameters,
    describing_function,
    harmonics,
    hysteresis_loop,
    linearised,
    loop_area,
)

DIAPHRAGM = HysteresisParameters()


def _area(frequency: float, samples: int, law: str = "mended", p: HysteresisParameters = DIAPHRAGM) -> float:
    return loop_area(*hysteresis_loop(p, 100.0, frequency, samples, law=law))  # pyright: ignore[reportArgumentType] - one of two words


@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_the_loops_area_is_equal_at_1_and_480_hz(exponent: float) -> None:
    p = HysteresisParameters(exponent=exponent)
    assert _area(1.0, 2000, p=p) == pytest.approx(_area(480.0, 417, p=p), rel=1e-3)


def test_the_printed_laws_loop_vanishes_with_frequency() -> None:
    assert _area(480.0, 417, "printed") < 0.01 * _area(1.0, 417, "printed")


def test_the_area_is_that_of_the_first_harmonic() -> None:
    voltage, hysteresis = hysteresis_loop(DIAPHRAGM, 100.0, 480.0)
    first = describing_function(voltage, hysteresis)
    assert loop_area(voltage, hysteresis) == pytest.approx(np.pi * 100.0**2 * first.imag, rel=1e-4)


def test_a_small_loop_has_the_linearised_gain() -> None:
    first = describing_function(*hysteresis_loop(DIAPHRAGM, 1e-3, 480.0, 200))
    at_rest = DIAPHRAGM.stroke_a_volt * (1.0 - first.real)
    assert float(np.real(linearised(DIAPHRAGM).dcgain())) == pytest.approx(at_rest, rel=1e-4)
    assert abs(first.imag) < 1e-5


def test_hysteresis_makes_odd_harmonics_only() -> None:
    lines = np.abs(harmonics(hysteresis_loop(DIAPHRAGM, 100.0, 480.0)[1], 5))
    assert lines[3] > 0.01 * lines[1]
    assert np.all(lines[[0, 2, 4]] < 1e-3 * lines[1])


def test_impossible_parameters_are_refused() -> None:
    with pytest.raises(RigError, match=r"stiffness must be positive, got 0\.0"):
        HysteresisParameters(stiffness=0.0)
    with pytest.raises(RigError, match=r"exponent must be at least 1, got 0.5"):
        HysteresisParameters(exponent=0.5)
