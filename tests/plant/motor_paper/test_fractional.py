"""Fractional derivatives agree with known closed forms."""

from math import gamma

import numpy as np
import pytest
from scipy.special import erfcx

from plant.errors import HydrostateError
from plant.motor_paper.fractional import caputo_from_rest, gl_weights, grunwald_letnikov, oustaloup_states

TIME = np.linspace(0.0, 1.0, 2001)
STEP = float(TIME[1])


@pytest.mark.parametrize("order", [0.3, 0.5, 1.0, 1.5, 1.9])
def test_the_derivative_of_a_parabola_is_equation_6(order: float) -> None:
    exact = 2.0 / gamma(3.0 - order)
    ours = caputo_from_rest(np.square(TIME), order, STEP)[-1]
    assert ours == pytest.approx(exact, rel=1.5e-3)


@pytest.mark.parametrize("order", [0.5, 1.0, 1.5])
def test_figures_7_to_9_are_integrals_of_a_parabola(order: float) -> None:
    ours = grunwald_letnikov(np.square(TIME), -order, STEP)[-1]
    assert ours == pytest.approx(2.0 / gamma(3.0 + order), rel=2e-3)


def test_the_error_falls_with_the_step() -> None:
    off = [
        abs(caputo_from_rest(np.square(np.linspace(0.0, 1.0, n + 1)), 0.5, 1.0 / n)[-1] - 2.0 / gamma(2.5))
        for n in (200, 400, 800)
    ]
    assert off[0] / off[1] == pytest.approx(2.0, rel=0.02)
    assert off[1] / off[2] == pytest.approx(2.0, rel=0.02)


def test_two_half_derivatives_make_one_derivative() -> None:
    wave = np.sin(7.0 * TIME) ** 2
    twice = grunwald_letnikov(grunwald_letnikov(wave, 0.5, STEP), 0.5, STEP)
    assert twice == pytest.approx(grunwald_letnikov(wave, 1.0, STEP), rel=1e-9, abs=1e-9)


def test_a_constant_has_no_derivative_from_rest() -> None:
    assert not caputo_from_rest(np.full(50, 7.0), 0.5, STEP).any()


@pytest.mark.parametrize("order", [0.5, 0.8])
def test_relaxation_follows_mittag_leffler(order: float) -> None:
    weights = gl_weights(order, 2001)
    rate = STEP**order
    x = np.ones(2001)
    for n in range(1, 2001):
        history = float(weights[1 : n + 1] @ (x[n - 1 :: -1][:n] - 1.0))
        x[n] = (1.0 - history) / (1.0 + rate)
    exact = [_mittag_leffler(order, -(t**order)) for t in (TIME[500], TIME[-1])]
    assert [x[500], x[-1]] == pytest.approx(exact, rel=3e-4)


def _mittag_leffler(order: float, z: float) -> float:
    if order == 0.5:
        return float(erfcx(-z))
    return sum(z**k / gamma(order * k + 1.0) for k in range(80))


@pytest.mark.parametrize("order", [0.0, 0.25, 0.5, 1.0, 1.5, 1.75])
def test_oustaloup_states_are_right_two_decades_inside_their_band(order: float) -> None:
    states = oustaloup_states(order, 1.0, 1e5, 9)
    frequency = np.geomspace(100.0, 1e3, 20)
    exact = (2j * np.pi * frequency) ** order
    assert states.response(frequency) == pytest.approx(exact, rel=8e-3)


def test_oustaloup_states_settle() -> None:
    assert np.all(np.linalg.eigvals(oustaloup_states(1.5, 1.0, 1e4).A) < 0.0)


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: caputo_from_rest(TIME, -0.5, STEP), "between 0 and 2, got -0.5"),
        (lambda: grunwald_letnikov(TIME, 2.5, STEP), "between -2 and 2, got 2.5"),
        (lambda: grunwald_letnikov(TIME, 0.5, STEP, memory=1), "memory must be 2 samples or more, got 1"),
        (lambda: oustaloup_states(2.0, 1.0, 10.0), "below 2, which is a mass, got 2"),
        (lambda: oustaloup_states(0.5, 10.0, 1.0), "got 10 to 1 Hz"),
    ],
)
def test_invalid_orders_memories_and_bands_are_refused(call: object, said: str) -> None:
    assert callable(call)
    with pytest.raises(HydrostateError, match=said):
        call()
