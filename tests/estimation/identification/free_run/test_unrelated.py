"""An output that its input does not influence is reported as such, however well a slow model follows it."""

import numpy as np
import pytest

from estimation.arrays import Array
from estimation.identification.free_run.data import Channels, channels_from
from estimation.identification.free_run.identify import Identified, identify_channels
from estimation.identification.free_run.unrelated import explains
from estimation.identification.notes import IdentificationCode
from plant.errors import LogWarning

N = 400


def _data(y: Array) -> Channels:
    return channels_from([_input()[:, None]], [y], 0.01, ["u"], "y")


def _input() -> Array:
    return np.repeat(np.random.default_rng(1).choice([-1.0, 1.0], N // 8), 8)


def _noise(seed: int) -> Array:
    return np.random.default_rng(seed).normal(size=N)


def _said(found: Identified) -> bool:
    return any(note.code == IdentificationCode.UNRELATED for note in found.notes)


COURSES = {
    "walk": np.cumsum(_noise(2)),
    "ramp": np.arange(N) / 100.0 + 0.3 * _noise(3),
    "sine": np.sin(2.0 * np.pi * np.arange(N) / 220.0) + 0.2 * _noise(4),
}
"""Outputs that are unrelated to the input, but that slow models follow."""


@pytest.mark.parametrize("course", COURSES)
def test_an_output_that_drifts_by_itself_is_noted_as_unrelated_and_not_sound(course: str) -> None:
    with pytest.warns(LogWarning, match="the output drifts by itself"):
        found = identify_channels(_data(COURSES[course]), order=2, delay=1)
    assert found.quality.fit_percent > 40.0
    assert _said(found)
    assert not found.sound


def test_an_arx_model_of_an_unrelated_output_is_noted_and_not_sound() -> None:
    with pytest.warns(LogWarning):
        found = identify_channels(_data(COURSES["ramp"]), structure="arx", order=2, delay=1)
    assert _said(found)
    assert not found.sound


def test_auto_gives_no_sound_model_of_an_unrelated_output() -> None:
    with pytest.warns(LogWarning):
        found = identify_channels(_data(COURSES["ramp"]), structure="auto", order=1, delay=1)
    assert not found.sound


@pytest.mark.filterwarnings("ignore::plant.errors.LogWarning")
def test_an_integrating_output_and_a_response_with_drift_are_related_to_their_input() -> None:
    summed = 0.02 * np.cumsum(_input()) + 0.05 * _noise(5)
    beside = np.convolve(_input(), 0.2 * 0.8 ** np.arange(N))[:N] + 0.03 * np.cumsum(_noise(6))
    for y in (summed, beside):
        found = identify_channels(_data(y), order=2, delay=1)
        assert found.sound
        assert not _said(found)


def test_inputs_explain_an_output_only_if_every_reordering_of_them_fits_worse() -> None:
    for own, wanted in ((4.0, True), (9.0, False)):
        costs = iter([float("inf"), *[10.0] * 9, 8.0, *[12.0] * 9])
        assert explains(own, lambda _, costs=costs: next(costs), _data(_noise(7))) is wanted  # type: ignore[misc]
