"""The residual of a polynomial over neighbouring lines of a periodic test is the distortion and nothing else."""

import numpy as np
import pytest

from estimation.identification.signals.distortion import NEIGHBOURS_A_SIDE, POLYNOMIAL_DEGREE, _polynomial_residual

RNG = np.random.default_rng(4)


def drawn(count: int) -> np.ndarray:
    return RNG.normal(size=count) + 1j * RNG.normal(size=count)


def test_a_response_no_more_curved_than_the_polynomial_leaves_no_residual() -> None:
    inside = drawn(40)
    lines = np.arange(40) / 40.0
    output = (1.0 + 2.0j * lines + 0.5 * lines**2) * inside
    assert np.abs(_polynomial_residual(output, inside)).max() < 1e-10


@pytest.mark.parametrize("place", [0, 2, 11, 19])
def test_the_residual_of_a_line_is_its_prediction_error_from_its_neighbours_scaled_to_its_own_noise(place: int) -> None:
    inside, output = drawn(20), drawn(20)
    span = 2 * NEIGHBOURS_A_SIDE + 1
    begin = min(max(place - NEIGHBOURS_A_SIDE, 0), 20 - span)
    window = slice(begin, begin + span)
    powers = (np.arange(begin, begin + span) - place)[:, None] ** np.arange(POLYNOMIAL_DEGREE + 1.0)
    columns = powers * inside[window, None]
    others = np.arange(span) != place - begin
    without = np.linalg.lstsq(columns[others], output[window][others], rcond=None)[0]
    # prediction error from the other lines over its deviation: error and variance are larger by 1 / (1 - leverage)
    hat = columns @ np.linalg.pinv(columns)
    missed = (output[place] - columns[place - begin] @ without) * np.sqrt(1.0 - hat[place - begin, place - begin].real)
    assert _polynomial_residual(output, inside)[place] == pytest.approx(missed)


def test_with_fewer_lines_than_the_polynomial_spans_the_residual_is_nan() -> None:
    span = 2 * NEIGHBOURS_A_SIDE + 1
    assert np.isnan(_polynomial_residual(drawn(span - 1), drawn(span - 1))).all()
    assert np.isfinite(_polynomial_residual(drawn(span), drawn(span))).all()
