"""Kinds of sensors and loggers added after the first 51. Pairs of the first 51 are drawn as before."""

import numpy as np

from experiments.open_benchmark.kind import OWN_OR_UNKNOWN, Kind
from experiments.open_benchmark.logger import POSITION, PRESSURE_A, PRESSURE_B, PRESSURES, SPEED, VELOCITY
from experiments.open_benchmark.setup import Setup


def _with_hum(setup: Setup, rng: np.random.Generator) -> Setup:
    frequency = float(rng.choice((50.0, 60.0)) * (1.0 + rng.uniform(-1e-3, 1e-3)))
    return setup.with_sensor(PRESSURES, hum=rng.uniform(1e4, 5e4), hum_frequency=frequency)


def _with_held_channels(setup: Setup, _: np.random.Generator) -> Setup:
    held = setup.with_sensor((SPEED,), hold=4).with_sensor((POSITION, VELOCITY), hold=2)
    return held.with_sensor(PRESSURES, hold=5)


def _with_gauge_difference(setup: Setup, rng: np.random.Generator) -> Setup:
    half = float(rng.choice((-1.0, 1.0)) * rng.uniform(0.003, 0.01))
    gauges = setup.with_sensor((PRESSURE_A,), gain=1.0 + half).with_sensor((PRESSURE_B,), gain=1.0 - half)
    return gauges.with_logger(channels=(SPEED, POSITION, VELOCITY, PRESSURE_A, PRESSURE_B))


ADDED_KINDS = (
    Kind(
        "pressure_hums",
        "0.1 to 0.5 bar of mains hum in pressure, and a fifth of it at three times the frequency",
        _with_hum,
        named=r"\bhum\b|\bmains\b",
    ),
    Kind(
        "speed_held",
        "motor speed comes every 5 to 10 ms and is repeated in between",
        lambda setup, rng: setup.with_sensor((SPEED,), hold=int(rng.integers(5, 11))),
        OWN_OR_UNKNOWN,
        named=r"\brepeat|\bheld\b|\bslow",
    ),
    Kind(
        "held_apart",
        "motor speed comes every 4 ms, position every 2, pressure every 5, each repeated in between",
        _with_held_channels,
        OWN_OR_UNKNOWN,
        named=r"\brepeat|\bheld\b|\bslow",
    ),
    Kind(
        "speed_offset",
        "motor speed reads 0.1 to 3 rad/s too much or too little",
        lambda setup, rng: setup.with_sensor(
            (SPEED,), offset=float(rng.choice((-1.0, 1.0)) * np.exp(rng.uniform(np.log(0.1), np.log(3.0))))
        ),
        OWN_OR_UNKNOWN,
        named=r"\boffset|zero point|\breads?\b",
    ),
    Kind(
        "pressure_gauges_differ",
        "two chamber pressures, of which one reads 0.6 to 2 % more than the other",
        _with_gauge_difference,
        OWN_OR_UNKNOWN,
    ),
    Kind(
        "clock_stalls",
        "a busy computer stamps rows that waited for 10 to 50 ms, 5 to 15 times",
        lambda setup, rng: setup.with_logger(stalls=int(rng.integers(5, 16)), stall=rng.uniform(0.01, 0.05)),
        named=r"\bclock\b|\bcatches up|\bstamps\b",
    ),
    Kind("logged_at_200_Hz", "logged at 200 Hz", lambda setup, _: setup.with_logger(sample_time=5e-3)),
)
"""Kinds with a change of sensor or logger; the rig file describes their actuator."""
