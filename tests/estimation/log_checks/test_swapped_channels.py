"""Swapped position and velocity of a piston that hardly moves."""

import numpy as np

from estimation.log_checks.channel_names import POSITION, SPEED, VELOCITY
from estimation.log_checks.channel_physics import channel_mistakes
from estimation.notes import ChannelCode
from plant.eha.model import EhaParameters
from plant.log.record import Record


def test_swapped_position_and_velocity_are_found_though_velocity_is_mostly_noise() -> None:
    """`position_velocity_swapped`, validation 25301: a piston moves 0.2 mm, and velocity is mostly noise."""
    time, noise = 1e-3 * np.arange(20000), 1.5e-3 * np.random.default_rng(1).normal(size=20000)
    position, velocity = 2e-4 * np.sin(5.0 * time), 1e-3 * np.cos(5.0 * time) + noise
    sound = Record(1e-3, {SPEED: 50.0 * np.cos(5.0 * time), POSITION: position, VELOCITY: velocity})
    assert channel_mistakes(sound, EhaParameters()) == ()
    (said,) = channel_mistakes(sound.replace(**{POSITION: velocity, VELOCITY: position}), EhaParameters())
    assert said.code is ChannelCode.CHANNELS_SWAPPED
