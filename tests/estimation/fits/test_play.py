"""Which way the piston last pushed its encoder, read off the encoder itself."""

import numpy as np
import pytest

from estimation.fits.play import side_of_play
from plant.arrays import Array

QUANTUM = 1e-6


def read(position: Array) -> Array:
    return QUANTUM * np.round(position / QUANTUM)


def test_play_is_crossed_between_the_last_movement_one_way_and_the_first_one_back() -> None:
    up = np.linspace(0.0, 1e-2, 500)
    side = side_of_play(read(np.concatenate([up, np.full(50, 1e-2), up[::-1]])))
    assert side[10:490] == pytest.approx(1.0)
    assert side[560:] == pytest.approx(-1.0)
    assert side[525] == pytest.approx(0.5, abs=0.1)  # a quarter of the way in half of the time
    assert np.all(np.diff(side[490:560]) <= 0.0)


def test_noise_of_a_piston_that_stands_or_moves_turns_nothing() -> None:
    noise = QUANTUM * np.random.default_rng(1).standard_normal(5000)
    assert not np.any(side_of_play(read(noise)))
    moved = side_of_play(read(noise + np.linspace(0.0, 1e-2, 5000)))
    assert moved[100:] == pytest.approx(1.0)


def test_a_dead_encoder_is_at_no_side() -> None:
    assert not np.any(side_of_play(np.full(100, 0.3)))
