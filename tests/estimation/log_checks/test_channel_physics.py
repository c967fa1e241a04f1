"""A channel with a wrong sign, unit or name is named; a sound log is not accused, whatever its actuator's condition."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest

from estimation.eha import bulk_modulus
from estimation.eha.estimate import estimate_log
from estimation.finding import Outcome
from estimation.fits.hypothesis_search.form_fit import FormFit
from estimation.log_checks import channel_physics, pump_units
from estimation.log_checks.channel_physics import channel_mistakes
from estimation.log_checks.flow_balance import FlowBalance
from estimation.notes import ChannelCode
from faults.conditions import CONDITIONS, parameters_for
from faults.diagnosis.diagnose import diagnose_log
from faults.notes import AdviceCode
from plant.eha.drives import DRIVES, make_drive
from plant.eha.model import EhaParameters
from plant.eha.rig import Rig
from plant.eha.simulate import LUMPED, REDUCED, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH
from tests.thinned import thinned

HEALTHY = EhaParameters()
SPEED, POSITION, VELOCITY = "motor_speed_rad_s", "position_m", "velocity_m_s"
PRESSURE = "differential_pressure_pa"
RPM = 60.0 / (2.0 * np.pi)
VIEWS = ((), (PRESSURE,), (VELOCITY,), (POSITION,), (PRESSURE, VELOCITY))
"""Sets of channels that are not logged."""


@cache
def run(condition: str = "normal", drive: str = "steps", leakage: float = 1.0, load: float = 0.0) -> Record:
    p, rng = parameters_for(CONDITIONS[condition]), np.random.default_rng(3)
    p = replace(p, leakage_coefficient=leakage * p.leakage_coefficient)
    log = simulate(LUMPED, make_drive(drive, 6.0, 1e-3, p, rng), 1e-3, p, sensors=BENCH, rng=rng)
    return log.replace(**{PRESSURE: log[PRESSURE] + load / p.piston_area})


def scaled(channel: str, factor: float) -> Callable[[Record], Record]:
    return lambda log: log.replace(**{channel: factor * log[channel]})


def swapped(log: Record) -> Record:
    return log.replace(**{POSITION: log[VELOCITY], VELOCITY: log[POSITION]})


def unsigned(log: Record) -> Record:
    return log.replace(**{SPEED: np.abs(log[SPEED])})


@pytest.mark.parametrize("speed", [0.0, 50.0])
def test_a_stuck_piston_at_constant_motor_speed_is_no_unsigned_speed(speed: float) -> None:
    noise = 2e-6 * np.random.default_rng(0).normal(size=6000)
    log = Record(1e-3, {SPEED: np.full(6000, speed), POSITION: noise})
    assert channel_mistakes(log, HEALTHY) == ()


@pytest.mark.parametrize("leakage", thinned([1.0, 8.0], [8.0]))
@pytest.mark.parametrize("drive", list(DRIVES))
@pytest.mark.parametrize(
    "condition",
    thinned(
        ["normal", "major_leakage", "major_friction", "major_leakage_major_friction"], ["normal", "major_friction"]
    ),
)
def test_sound_logs_are_not_accused(condition: str, drive: str, leakage: float) -> None:
    for absent, load in product(VIEWS, (0.0, 2e3)):
        log = run(condition, drive, leakage, load)
        assert channel_mistakes(log.replace(**dict.fromkeys(absent)), HEALTHY) == ()


@pytest.mark.parametrize("condition", list(CONDITIONS))
def test_a_slow_sine_accuses_no_channel_in_any_condition(condition: str) -> None:
    p, rng = parameters_for(CONDITIONS[condition]), np.random.default_rng(3)
    log = simulate(REDUCED, make_drive("sine", 6.0, 1e-3, p, rng), 1e-3, p, sensors=BENCH, rng=rng)
    assert channel_mistakes(log, HEALTHY) == ()


@pytest.mark.parametrize(
    "wrong",
    [
        {"piston_area": 0.96 * HEALTHY.piston_area},
        {"chamber_volume": 0.75 * HEALTHY.chamber_volume},
        {"pump_displacement": 1.25 * HEALTHY.pump_displacement},
        {"piston_area": HEALTHY.piston_area / 3.0},
        {"piston_area": 3.0 * HEALTHY.piston_area, "chamber_volume": 3.0 * HEALTHY.chamber_volume},
        {"pump_displacement": 4.0 * HEALTHY.pump_displacement},
        {"bulk_modulus": 4.0 * HEALTHY.bulk_modulus},
    ],
    ids=str,
)
def test_a_wrong_rig_file_accuses_no_channel(wrong: dict[str, float]) -> None:
    for condition, drive, absent in product(("normal", "major_leakage"), ("steps", "prbs"), VIEWS):
        log = run(condition, drive).replace(**dict.fromkeys(absent))
        assert channel_mistakes(log, replace(HEALTHY, **wrong)) == ()


@pytest.mark.parametrize("condition", ["normal", "minor_leakage", "minor_friction"])
@pytest.mark.parametrize(
    ("mistake", "code", "channel"),
    [
        (scaled(SPEED, -1.0), ChannelCode.CHANNEL_REVERSED, SPEED),
        (scaled(PRESSURE, -1.0), ChannelCode.CHANNEL_REVERSED, PRESSURE),
        (scaled(VELOCITY, -1.0), ChannelCode.CHANNEL_REVERSED, VELOCITY),
        (scaled(POSITION, -1.0), ChannelCode.CHANNEL_REVERSED, POSITION),
        (unsigned, ChannelCode.SPEED_UNSIGNED, SPEED),
        (swapped, ChannelCode.CHANNELS_SWAPPED, POSITION),
        (scaled(SPEED, RPM), ChannelCode.CHANNEL_UNIT, SPEED),
        (scaled(SPEED, 1.0 / RPM), ChannelCode.CHANNEL_UNIT, SPEED),
        (scaled(SPEED, 0.5 / np.pi), ChannelCode.CHANNEL_UNIT, SPEED),
        (scaled(POSITION, 1e3), ChannelCode.CHANNEL_UNIT, POSITION),
        (scaled(POSITION, 0.1), ChannelCode.CHANNEL_UNIT, POSITION),
        (scaled(VELOCITY, 1e3), ChannelCode.CHANNEL_UNIT, VELOCITY),
        (scaled(PRESSURE, 1e-5), ChannelCode.CHANNEL_UNIT, PRESSURE),
        (scaled(PRESSURE, 1e3), ChannelCode.CHANNEL_UNIT, PRESSURE),
    ],
)
def test_a_wrong_sign_unit_or_name_is_named_with_its_channel(
    mistake: Callable[[Record], Record], code: ChannelCode, channel: str, condition: str
) -> None:
    for drive in ("steps", "prbs"):
        (said,) = channel_mistakes(mistake(run(condition, drive)), HEALTHY)
        assert (said.code, said.data["channel"]) == (code, channel)


def test_a_piston_swung_by_its_load_through_a_leak_is_no_unsigned_speed() -> None:
    time, leakage = 1e-3 * np.arange(6000), 2e-11
    speed, pressure = 40.0 + 10.0 * np.sin(3.0 * time), 1.1e6 + 1e6 * np.sin(9.0 * time)
    velocity = (HEALTHY.pump_displacement * speed - leakage * pressure) / HEALTHY.piston_area
    noise = 5e3 * np.random.default_rng(3).standard_normal(len(time))
    channels = {SPEED: speed, POSITION: 1e-3 * np.cumsum(velocity), VELOCITY: velocity, PRESSURE: pressure + noise}
    assert np.mean(velocity < 0.0) > 0.3
    assert channel_mistakes(Record(1e-3, channels), HEALTHY) == ()


@pytest.mark.parametrize("condition", ["normal", "minor_leakage", "minor_friction"])
@pytest.mark.parametrize(
    ("channel", "factor", "lacking", "accused"),
    [
        (POSITION, 201.0, (), POSITION),
        (VELOCITY, 39.37, (), VELOCITY),
        (VELOCITY, 1.0 / 30.0, (), f"{POSITION} or {VELOCITY}"),
        (POSITION, 201.0, (VELOCITY,), f"{POSITION} or {SPEED}"),
        (SPEED, 1.0 / 25.0, (), SPEED),
    ],
)
def test_an_unusual_factor_is_named_as_another_unit(
    channel: str, factor: float, lacking: tuple[str, ...], accused: str, condition: str
) -> None:
    """A furlong read as a metre took 17 s to be refused, and only a reader's warning named the channel."""
    for drive in ("steps", "prbs"):
        log = scaled(channel, factor)(run(condition, drive)).replace(**dict.fromkeys(lacking))
        (said,) = channel_mistakes(log, HEALTHY)
        assert (said.code, said.data["channel"]) == (ChannelCode.CHANNEL_UNIT, accused)
        assert said.data["slip"].startswith("inches read as m" if factor == 39.37 else "another unit")


def test_an_impossible_piston_travel_names_the_unit_though_the_balance_is_misled(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    misled = FlowBalance(
        swept=0.0457, swept_std=0.0035, compressed=0.083, compressed_std=0.004, explained=0.998, moving=0.9
    )
    monkeypatch.setattr(channel_physics, "flow_balance", lambda *_: misled)
    (said,) = channel_mistakes(scaled(SPEED, 1.0 / RPM)(run("normal", "prbs")), HEALTHY)
    assert (said.code, said.data["channel"]) == (ChannelCode.CHANNEL_UNIT, SPEED)
    assert said.data["slip"] == "rad/s read as rpm"


@pytest.mark.parametrize("power", [3, 4])
def test_a_pump_at_constant_speed_that_delivers_more_than_is_swept_is_no_unit_error(power: int) -> None:
    """Without its mean and trend a path at constant speed is only noise, and any piston goes farther."""
    rng, time = np.random.default_rng(0), 1e-3 * np.arange(1001)
    position = -0.0095 * time**power
    channels = {
        "motor_speed_rad_s": -102.0 * (1.0 - np.exp(-time / 0.004)) + 0.05 * rng.standard_normal(len(time)),
        "position_m": position,
        "velocity_m_s": np.gradient(position, 1e-3) + 1e-3 * rng.standard_normal(len(time)),
        "differential_pressure_pa": -4e5 * (1.0 - np.exp(-time / 0.3)),
    }
    assert channel_mistakes(Record(1e-3, channels), HEALTHY) == ()


@pytest.mark.parametrize(("share", "named"), [(9.0, True), (3.2, True), (2.5, False), (0.8, False)])
def test_an_impossible_pump_delivery_is_a_speed_in_another_unit(
    share: float, named: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    delivered = {"pump_displacement": (share * HEALTHY.pump_displacement, 1e-9), "bulk_modulus": (2e8, 1e5)}
    explanation = SimpleNamespace(values=delivered, names=())
    fit = FormFit(delivered, 5e-4, 1.0, (), {}, explanation)
    monkeypatch.setattr(bulk_modulus, "_fit", lambda *_, **__: fit)
    found = bulk_modulus.estimate_bulk_modulus(run(), HEALTHY)
    assert (found.outcome is Outcome.MISMATCH) == named
    assert [note.data["channel"] for note in found.gate.reasons] == ([SPEED] if named else [])
    assert (found.value is None) == named


@pytest.mark.parametrize("mistake", [scaled(SPEED, -1.0), swapped, scaled(POSITION, -1.0), scaled(VELOCITY, 1e3)])
def test_a_wrong_sign_unit_or_name_is_also_found_without_pressure(mistake: Callable[[Record], Record]) -> None:
    for drive in ("steps", "prbs"):
        assert channel_mistakes(mistake(run(drive=drive)).replace(**{PRESSURE: None}), HEALTHY)


RADIANS, TURNS_A_SECOND = "rad/s read as rpm", "rev/s read as rad/s"


@pytest.mark.parametrize(
    ("condition", "factor", "accused", "slip"),
    [
        ("normal", 0.5 / np.pi, SPEED, f"{RADIANS} or {TURNS_A_SECOND}"),
        ("minor_leakage", 0.5 / np.pi, SPEED, TURNS_A_SECOND),
        ("normal", 1.0 / RPM, SPEED, RADIANS),
        ("minor_leakage", 1.0 / RPM, SPEED, f"{RADIANS} or {TURNS_A_SECOND}"),
        ("major_leakage_major_friction", 1e-3, f"{POSITION} and {VELOCITY} or {SPEED}", pump_units.LOSSY_UNIT),
    ],
)
def test_without_pressure_several_unit_errors_may_explain_the_lost_flow(
    condition: str, factor: float, accused: str, slip: str
) -> None:
    (said,) = channel_mistakes(scaled(SPEED, factor)(run(condition)).replace(**{PRESSURE: None}), HEALTHY)
    assert (said.data["channel"], said.data["slip"]) == (accused, slip)


@pytest.mark.parametrize("pressure", [True, False], ids=["with pressure", "without"])
def test_a_log_with_a_channel_mistake_gets_no_values_and_no_class(*, pressure: bool) -> None:
    log = scaled(SPEED, -1.0)(run())
    log = log if pressure else log.replace(**{PRESSURE: None})
    for found in (estimate_log(log, Rig()), diagnose_log(log, Rig())):
        assert found.outcome is Outcome.MISMATCH
        assert not found.gate.passed
        assert [note.code for note in found.gate.reasons] == [ChannelCode.CHANNEL_REVERSED]
        assert {name: one.value for name, one in found.quantities.items()} == {"bulk_modulus": None}
        assert not found.severities
        assert not found.probabilities
    assert found.unknown
    assert [note.code for note in found.advice] == [AdviceCode.MEND_COLUMNS]


def test_a_flow_balance_that_explains_too_little_is_not_used(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[FlowBalance | None] = []
    poor = FlowBalance(*([0.5] * len(FlowBalance._fields)))
    monkeypatch.setattr(channel_physics, "_wrong_sign_notes", lambda *given: seen.append(given[-1]) or ())
    for explained in (0.99 * channel_physics.EXPLAINED, 1.01 * channel_physics.EXPLAINED):
        balance = poor._replace(explained=explained)
        monkeypatch.setattr(channel_physics, "flow_balance", lambda *_, balance=balance: balance)
        channel_mistakes(run(), HEALTHY)
    assert seen[0] is None
    assert seen[1] is not None


@pytest.mark.parametrize(("share", "told"), [(0.45, True), (0.006, False)])
def test_a_piston_that_hardly_moves_is_no_evidence_of_a_unit_error(share: float, *, told: bool) -> None:
    """In a leaky actuator the unexplained part of the balance looks like ten times the real motion."""
    rng = np.random.default_rng(2)
    held = np.repeat(rng.choice([-1.0, 1.0], 6000), 20) * np.repeat(rng.uniform(20.0, 120.0, 6000), 20)
    flow = HEALTHY.pump_displacement * held
    moved = share * flow * np.abs(held) / 120.0
    velocity = moved / (RPM * HEALTHY.piston_area)
    leaked = (flow - moved) / 6e-11
    record = Record(1e-3, {SPEED: held, VELOCITY: velocity, PRESSURE: leaked + 1e4 * rng.standard_normal(len(flow))})
    codes = [note.code for note in channel_mistakes(record, HEALTHY)]
    assert codes == ([ChannelCode.CHANNEL_UNIT] if told else [])


@pytest.mark.parametrize("absent", [(), (VELOCITY,), (PRESSURE,)])
def test_milliseconds_read_as_seconds_are_a_unit_error_of_time_not_position(absent: tuple[str, ...]) -> None:
    log = run().replace(**dict.fromkeys(absent))
    (said,) = channel_mistakes(replace(log, sample_time=1e3 * log.sample_time), HEALTHY)
    assert (said.code, said.data["channel"]) == (ChannelCode.CHANNEL_UNIT, "time_s")
    assert said.data["slip"] == "ms read as s"


def test_a_logger_that_repeats_one_row_is_named_at_once() -> None:
    log = run()
    stuck = log.replace(**{name: np.full(len(log), log[name][3000]) for name in log})
    (said,) = channel_mistakes(stuck, HEALTHY)
    assert said.code == ChannelCode.NOTHING_CHANGES
    found = diagnose_log(stuck, Rig("rig", HEALTHY))
    assert found.outcome is Outcome.MISMATCH
    assert [note.code for note in found.advice] == [AdviceCode.CHECK_LOGGER]


def test_agreeing_position_and_velocity_are_not_accused_of_a_factor_of_ten() -> None:
    """A piston that sticks in one direction drifts, and went 11 times too far if motor speed was in rev/s."""
    (said,) = channel_mistakes(scaled(SPEED, 1.0 / 12.4)(run()).replace(**{PRESSURE: None}), HEALTHY)
    assert (said.code, said.data["channel"]) == (ChannelCode.CHANNEL_UNIT, SPEED)


@pytest.mark.parametrize(("times", "slip"), [(RPM, "rpm"), (180.0 / np.pi, "deg/s")])
@pytest.mark.parametrize(("limit", "rod"), [(1.0, 0.0), (3.0, 0.0), (1.0, 0.33)])
def test_a_speed_in_degrees_is_not_taken_for_revolutions(times: float, slip: str, limit: float, rod: float) -> None:
    area, most = HEALTHY.piston_area / (1.0 - rod), limit * HEALTHY.motor_speed_limit
    p = replace(HEALTHY, motor_speed_limit=most, piston_area=area, area_difference=rod)
    (said,) = channel_mistakes(scaled(SPEED, times)(run()), p)
    assert (said.data["channel"], said.data["slip"]) == (SPEED, f"{slip} read as rad/s")


def test_a_pressure_below_friction_shows_no_unit_error_of_speed() -> None:
    log = scaled(POSITION, 0.1)(scaled(VELOCITY, 0.1)(run("major_leakage")))
    (note,) = channel_mistakes(log, HEALTHY)
    assert note.data["slip"] == "rpm read as rad/s"
    most = 0.7 * HEALTHY.friction_coulomb / HEALTHY.piston_area
    stuck = scaled(PRESSURE, most / float(np.max(np.abs(log[PRESSURE]))))(log)
    assert channel_mistakes(stuck, HEALTHY) == ()


def test_a_piston_moving_back_against_its_pump_is_no_reversed_channel(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The pump leaks all that it delivers; the flow balance still shows that pump and piston have the same sign."""
    time = 1e-3 * np.arange(6000)
    speed = -60.0 + 2.0 * np.cos(2.0 * time)
    channels = {SPEED: speed, POSITION: 1e-5 * time - 1e-6 * np.sin(2.0 * time), PRESSURE: np.full(6000, -5e6)}
    record = Record(1e-3, channels)
    sound = FlowBalance(swept=1.0, swept_std=0.02, compressed=1.0, compressed_std=0.01, explained=0.999, moving=0.5)
    monkeypatch.setattr(channel_physics, "flow_balance", lambda *_: sound)
    short, long = (channel_physics.channel_blocks(record, HEALTHY, length) for length in (0.02, 0.05))
    before = channel_physics._wrong_sign_notes(record, short, long, None)
    assert [note.code for note in before] == [ChannelCode.CHANNEL_REVERSED]
    assert channel_mistakes(record, HEALTHY) == ()


@pytest.mark.parametrize(("begins", "sign", "named"), [(-80.0, 1.0, False), (0.0, 1.0, False), (0.0, -1.0, True)])
def test_a_piston_that_lags_a_sine_is_no_reversed_channel(begins: float, sign: float, *, named: bool) -> None:
    """A long block is half a period: its means depend on where blocks begin, and a lag reverses their sign."""
    angle = 20.0 * np.pi * 1e-3 * np.arange(3001) + np.deg2rad(begins)
    position = -sign * 1e-3 * np.cos(angle - np.deg2rad(60.0))
    found = channel_mistakes(Record(1e-3, {SPEED: 100.0 * np.sin(angle), POSITION: position}), HEALTHY)
    assert (ChannelCode.CHANNEL_REVERSED in [note.code for note in found]) == named
