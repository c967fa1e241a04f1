"""Inputs that are periodic apart from noise, and inputs that only look alike for a while."""

import numpy as np

from estimation.identification.free_run.data import blocks, channels_from, halves
from estimation.identification.signals.period import common_period

RNG = np.random.default_rng(4)
ONCE = np.repeat(RNG.normal(size=40), 5)


def test_a_period_is_found_in_noise_and_with_an_incomplete_last_period() -> None:
    for count, rest in ((2, 0), (3, 70), (1, 60)):
        u = np.concatenate([np.tile(ONCE, count), ONCE[:rest]])
        assert common_period(u[:, None]) == ONCE.size
        assert common_period((u + 0.05 * RNG.normal(size=u.size))[:, None]) == ONCE.size
    wave = np.sin(2.0 * np.pi * np.arange(900) / 150.0)
    assert common_period(wave[:, None]) == 150
    # if there are two inputs, both must be periodic
    both = np.column_stack([np.tile(ONCE, 3), np.tile(ONCE[:100], 6)])
    assert common_period(both) == ONCE.size
    assert common_period(np.column_stack([both[:, 0], RNG.normal(size=len(both))])) is None


def test_no_period_is_found_in_signals_that_do_not_repeat() -> None:
    step = (np.arange(500) > 100).astype(float)
    slow = np.cumsum(RNG.normal(size=500))
    sweep = np.sin(np.cumsum(np.geomspace(0.02, 1.0, 500)))
    for u in (step, slow, sweep, np.repeat(RNG.normal(size=100), 5), np.zeros(50), np.ones(1)):
        assert common_period(u[:, None]) is None
    nearly = np.tile(ONCE, 2) + 0.2 * ONCE.std() * RNG.normal(size=2 * ONCE.size)
    assert common_period(nearly[:, None]) is None


def test_a_block_is_the_same_part_of_every_period() -> None:
    u = np.tile(ONCE, 3)
    masks = blocks(channels_from([u[:, None]], [u + 1.0], 1.0, ["u"], "y"), 4)
    for index, (mask,) in enumerate(masks):
        assert np.flatnonzero(mask).tolist() == [
            200 * period + 40 * (1 + index) + k for period in range(3) for k in range(40)
        ]
    # inputs contain no more information than one period, and halves of a log would hold back nothing
    data = channels_from([u[:, None], u[:250, None]], [u, u[:250]], 1.0, ["u"], "y")
    assert (data.longest, data.informative_samples) == (600, 200)
    assert [[half[:, 0].tolist() for half in one.u] for one in halves(data)] == [
        [u[400:500].tolist(), u[50:150].tolist()],
        [u[500:].tolist(), u[150:250].tolist()],
    ]
    # a block of a short period would be too short
    short = np.tile(ONCE[:50], 8)
    (mask,) = blocks(channels_from([short[:, None]], [short], 1.0, ["u"], "y"), 4)[0]
    assert np.flatnonzero(mask).tolist() == list(range(80, 160))
