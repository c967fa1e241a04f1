"""Kinds whose actuator matches the rig file, with a peculiarity of sensors or logger."""

from experiments.open_benchmark.drives import CLOSED
from experiments.open_benchmark.kind import OWN_OR_UNKNOWN, UNKNOWN, Draw, Kind
from experiments.open_benchmark.logger import (
    DIFFERENCE,
    POSITION,
    PRESSURE_A,
    PRESSURE_B,
    PRESSURES,
    SPEED,
    VELOCITY,
)


def _channels(*names: str) -> Draw:
    return lambda setup, _: setup.with_logger(channels=names)


def _pressure(**changes: float) -> Draw:
    return lambda setup, _: setup.with_sensor(PRESSURES, **changes)


def _speed(**changes: float) -> Draw:
    return lambda setup, _: setup.with_sensor((SPEED,), **changes)


RPM = 30.0 / 3.141592653589793
"""Conversion from radians per second to revolutions per minute."""

LATE_WORDS = r"\b(?:lags?|late|delay)"
"""Words for a channel that lags the others."""

REVERSED_WORDS = r"\bsign\b|reversed|other way|opposite"
"""Words for a channel with reversed sign."""

LOGGER_KINDS = (
    Kind("plain", "nothing: the paper's actuator, travel up to 200 mm"),
    Kind("closed_loop", "closed position loop, no load", drives=tuple(CLOSED)),
    Kind("no_velocity", "no velocity column", _channels(SPEED, POSITION, DIFFERENCE)),
    Kind(
        "chamber_pressures",
        "two chamber pressures in place of their difference",
        _channels(SPEED, POSITION, VELOCITY, PRESSURE_A, PRESSURE_B),
    ),
    Kind(
        "coarse_converters",
        "16-bit encoder over 500 mm, 12-bit pressure over ±250 bar",
        lambda setup, _: setup.with_sensor((POSITION,), quantum=0.5 / 2**16).with_sensor(
            PRESSURES, quantum=5e7 / 2**12
        ),
    ),
    Kind("logged_at_5_kHz", "logged at 5 kHz", lambda setup, _: setup.with_logger(sample_time=2e-4)),
    Kind(
        "clock_jitters",
        "sampling instants jitter by 20 % of a period, logged truly",
        lambda setup, _: setup.with_logger(jitter=0.2),
    ),
    Kind(
        "begins_in_motion",
        "the log begins 1 to 3 s after the machine",
        lambda setup, rng: setup.with_logger(begin=round(rng.uniform(1.0, 3.0), 3)),
    ),
    Kind(
        "pressure_lags_2_ms",
        "2 ms first-order lag in differential pressure",
        _pressure(lag=2e-3),
        named=LATE_WORDS,
    ),
    Kind("pressure_5_ms_late", "differential pressure 5 ms late", _pressure(delay=5e-3), named=LATE_WORDS),
    Kind(
        "pressure_1_bar_off",
        "differential pressure 1 bar high",
        _pressure(offset=1e5),
        named=r"\boffset|zero point|\bbar (?:high|off)",
    ),
    Kind("pressure_gain_3_percent_high", "pressure reads 3 % high", _pressure(gain=1.03)),
    Kind(
        "pressure_gain_20_percent_high",
        "pressure reads 20 % high",
        _pressure(gain=1.2),
        OWN_OR_UNKNOWN,
        r"\bgain\b",
        severity=False,
    ),
    Kind(
        "pressure_held",
        "differential pressure comes every 4 to 10 ms and is repeated in between",
        lambda setup, rng: setup.with_sensor(PRESSURES, hold=int(rng.integers(4, 11))),
        named=r"\brepeat|\bheld\b|\bslow",
    ),
    Kind(
        "pressure_averaged",
        "differential pressure is a moving average over 2 to 6 ms",
        lambda setup, rng: setup.with_sensor(PRESSURES, average=int(rng.integers(2, 7))),
        OWN_OR_UNKNOWN,
        named=r"\bfilter|\baverag",
    ),
    Kind(
        "position_held",
        "position comes every 2 to 5 ms and is repeated in between",
        lambda setup, rng: setup.with_sensor((POSITION, VELOCITY), hold=int(rng.integers(2, 6))),
        OWN_OR_UNKNOWN,
        named=r"\brepeat|\bheld\b|\bslow",
    ),
    Kind(
        "pressure_behind_30_hz",
        "differential pressure behind a second-order low-pass of 30 Hz",
        _pressure(corner=30.0),
        OWN_OR_UNKNOWN,
        named=LATE_WORDS,
    ),
    Kind(
        "pressure_offset_drifts",
        "the offset of differential pressure drifts by 0.3 to 2 bar",
        lambda setup, rng: setup.with_sensor(PRESSURES, drift=float(rng.choice((-1.0, 1.0)) * rng.uniform(3e4, 2e5))),
        named=r"\bdrift",
    ),
    Kind(
        "position_has_play",
        "play of 20 to 100 um between piston and position sensor",
        lambda setup, rng: setup.with_sensor((POSITION,), play=rng.uniform(2e-5, 1e-4)),
        OWN_OR_UNKNOWN,
        named=r"\bplay\b|backlash",
        severity=False,
    ),
    Kind(
        "position_zero_at_stop",
        "encoder homed at the end stop, 60 to 260 mm from the middle",
        lambda setup, _: setup.with_sensor((POSITION,), offset=0.5 * setup.machine.stroke),
        named=r"\boffset|\bzero|\bhomed",
    ),
    Kind(
        "speed_sign_reversed",
        "motor speed counts the other way",
        _speed(gain=-1.0),
        (UNKNOWN,),
        REVERSED_WORDS,
    ),
    Kind(
        "speed_in_rpm",
        "rpm under the heading of rad/s",
        _speed(gain=RPM),
        (UNKNOWN,),
        r"\brpm\b|revolutions|r/min",
    ),
    Kind(
        "pressure_reversed",
        "differential pressure counts the other way",
        _pressure(gain=-1.0),
        (UNKNOWN,),
        REVERSED_WORDS,
    ),
    Kind(
        "position_velocity_swapped",
        "position and velocity under each other's headings",
        lambda setup, _: setup.with_logger(headings={POSITION: VELOCITY, VELOCITY: POSITION}),
        (UNKNOWN,),
        r"swap|exchang|mixed up|each other",
    ),
)
"""Kinds with a peculiarity of sensor or logger; the rig file describes their actuator."""
