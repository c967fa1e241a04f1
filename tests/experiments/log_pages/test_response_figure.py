"""A measured response has no phase if its 95 % circle contains zero, since any phase is then possible."""

import numpy as np

from estimation.identification.signals.local_polynomial import FrequencyResponse
from estimation.identification.signals.measured_response import MeasuredResponse
from experiments.log_pages.response_figure import _draw_response


def test_phase_is_drawn_only_at_known_frequencies_and_not_unwrapped_through_noise() -> None:
    """Unwrapped through noise, the phase of this plant rose by more than 1000 degrees."""
    frequency, rng = np.linspace(0.1, 50.0, 500), np.random.default_rng(1)
    noisy = frequency > 25.0
    response = 1.0 / (1.0 + 0.1j * frequency)
    response[noisy] = rng.standard_normal((2, int(noisy.sum()))).T @ np.array([1.0, 1.0j])
    found = FrequencyResponse(frequency, response, np.where(noisy, 1e3, 1e-6), freedom=10)
    figure = _draw_response(MeasuredResponse("local-polynomial", found), "log")
    (curve,) = figure.axes[1].lines
    phase = np.asarray(curve.get_ydata())
    assert np.array_equal(np.isnan(phase), noisy)
    assert -90.0 < np.nanmin(phase) < np.nanmax(phase) < 0.0
