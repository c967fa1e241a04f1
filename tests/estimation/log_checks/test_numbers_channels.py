"""Limits at which a channel is said to have the other sign or another unit, kept in `numbers_channels.json`."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from estimation.log_checks import channel_physics
from estimation.log_checks.channel_blocks import (
    ChannelBlocks,
    channel_blocks,
    correlation_and_ratio,
    path_agreement,
    pressure_flow_correlation,
)
from estimation.log_checks.channel_physics import channel_mistakes
from estimation.log_checks.flow_balance import FlowBalance, flow_balance
from estimation.log_checks.pump_units import pump_unit_notes
from estimation.log_checks.unit_slips import LENGTHS, TURNS, matching_slip
from plant.arrays import Array
from plant.log.record import Record
from plant.notes import Note
from tests.edges import edge
from tests.estimation.log_checks.made_logs import (
    HEALTHY,
    POSITION,
    PRESSURE,
    SPEED,
    VELOCITY,
    N,
    made_log,
    noise,
)
from tests.numbers import Numbers, told

NUMBERS = Numbers(__file__)
WAVE = np.sin(0.31 * np.arange(60)) + 0.4 * np.sin(0.77 * np.arange(60))
OTHER = np.cos(0.53 * np.arange(60) + 1.0)
OTHER = OTHER - WAVE * float(OTHER @ WAVE) / float(WAVE @ WAVE)
BALANCE = FlowBalance(1.0, 0.01, 1.0, 0.05, 0.98, 0.9)


def codes(notes: tuple[Note, ...]) -> list[str]:
    return [f"{one.code} {one.data['channel']} {one.data.get('slip', '')}" for one in notes]


def blocks(**given: Array | None) -> ChannelBlocks:
    names = ("pumped", "slope", "position", "velocity", "velocity_slope", "pressure")
    return ChannelBlocks(0.05, **{**dict.fromkeys(names), **given})  # type: ignore[arg-type]


def mixed(share: float, size: float = 1.0) -> Array:
    """Return a signal whose correlation with the wave is about ``share``."""
    return size * (share * WAVE / np.std(WAVE) + (1.0 - share**2) ** 0.5 * OTHER / np.std(OTHER)) * np.std(WAVE)


def together(share: float, size: float) -> Array:
    """Return a piston whose path correlates with that of the pumped wave by about ``share``."""
    ways = [np.cumsum(one) for one in (WAVE, OTHER)]
    way = share * ways[0] / np.std(ways[0]) + (1.0 - share**2) ** 0.5 * ways[1] / np.std(ways[1])
    return size * np.diff(way, prepend=0.0) * np.std(ways[0])


@NUMBERS.case()
def blocks_of_a_log() -> dict[str, Any]:
    record = made_log(206)
    record = record.replace(**{VELOCITY: np.where(np.arange(206) % 7 < 2, np.nan, record[VELOCITY])})
    shown: dict[str, Any] = {}
    for length in (0.005, 0.02, 0.03):
        made = channel_blocks(record, HEALTHY, length)
        shown[f"of {length:g} s"] = {
            "length [s]": made.length,
            **{name: [len(one), one[:2], one[-1]] for name, one in vars(made).items() if isinstance(one, np.ndarray)},
        }
    gone = channel_blocks(record.replace(position_m=np.full(206, np.nan), velocity_m_s=None), HEALTHY, 0.02)
    return {**shown, "absent": [name for name, one in vars(gone).items() if one is None]}


@NUMBERS.case()
def signals_that_go_together() -> dict[str, Any]:
    still = np.ones(60)
    return {
        "alike": [
            correlation_and_ratio(one, WAVE)
            for one in (3.0 * WAVE + 7.0, -0.5 * WAVE, mixed(0.6), OTHER, still, WAVE[:30][:0])
        ],
        "alike to what is still": correlation_and_ratio(WAVE, still),
        "of 19 and 20": [correlation_and_ratio(WAVE[:count], mixed(0.3)[:count]) for count in (19, 20)],
        "absent": [
            correlation_and_ratio(None, WAVE),
            correlation_and_ratio(WAVE, None),
            path_agreement(None, WAVE),
            path_agreement(WAVE, None),
        ],
        "gone together": [path_agreement(one, WAVE) for one in (0.2 * WAVE, -WAVE + 0.3, mixed(0.6), WAVE + OTHER)],
        "gone together, of 19 and 20": [path_agreement(mixed(0.3)[:count], WAVE[:count]) for count in (19, 20)],
        "power": [
            pressure_flow_correlation(one, WAVE, mixed(0.8)) for one in (WAVE, OTHER + np.cumsum(mixed(0.8)), WAVE**2)
        ],
        "power above a load": pressure_flow_correlation(WAVE + 5.0, WAVE, mixed(0.8)),
        "power of what stands": pressure_flow_correlation(WAVE, mixed(0.5), np.zeros(60)),
        "power of nothing": [
            pressure_flow_correlation(None, WAVE, WAVE),
            pressure_flow_correlation(WAVE, WAVE, None),
            pressure_flow_correlation(WAVE, None, WAVE),
        ],
    }


@NUMBERS.case()
def what_pumped_flow_goes_into() -> dict[str, Any]:
    record, found = made_log(), dict[str, Any]()
    changes = {
        "sound": {},
        "leaky": {PRESSURE: 4.0 * record[PRESSURE]},
        "reversed": {SPEED: -record[SPEED]},
        "noisy": {SPEED: record[SPEED] + np.cumsum(noise(0.5))},
        "by velocity": {POSITION: None},
        "without pressure": {PRESSURE: None},
        "drifting slowly": {SPEED: record[SPEED] + np.cumsum(np.cumsum(noise(0.002)))},
        "a pump that rests": {SPEED: np.zeros(N)},
        "a pump that turns one way": {SPEED: np.full(N, 20.0)},
        "no pressure": {PRESSURE: np.zeros(N)},
    }
    for name, change in changes.items():
        made = flow_balance(record.replace(**change), HEALTHY, 0.02)
        found[name] = None if made is None else {**made._asdict(), "contradicts": made.rig_contradiction}
    found["of a few blocks"] = [flow_balance(made_log(count), HEALTHY, 0.02) is None for count in (200, 201)]
    found["perfect"] = FlowBalance(1.2, 0.0, 1.0, 0.0, 1.0, 0.5).rig_contradiction
    return found


@NUMBERS.case()
def slips_of_units() -> dict[str, Any]:
    near = matching_slip
    return {
        "of a turn": {name: near(size, TURNS) for name, size in (("rpm", 0.1), ("rad/s", 10.0), ("none", 1.0))},
        "of a length, from": edge(lambda size: near(size, LENGTHS), 5.0, 10.0),
        "of a length, to": edge(lambda size: near(size, LENGTHS), 10.0, 20.0),
        "of lengths": [near(1.02 * size, LENGTHS) for size in (10.0, 100.0, 1e3, 1e6, 0.1, 0.01, 1e-3, 1e-6, 1.0)],
        "of what is wide": near(3.0, LENGTHS, 0.1, 10.0),
        "the names": [TURNS[near(0.1, TURNS) or 0.0], TURNS[near(9.6, TURNS) or 0.0]],
    }


@NUMBERS.case()
def channels_that_are_swapped() -> dict[str, Any]:
    def swapped(there: float, ratio: float, here: float) -> list[Any]:
        made = blocks(velocity_slope=mixed(there, ratio), position=WAVE, slope=mixed(here), velocity=WAVE)
        return codes(channel_physics._swapped_notes(made))  # pyright: ignore[reportPrivateUsage]

    return {
        "surely": swapped(0.97, 1.0, 0.1),
        "correlation from which": edge(lambda one: swapped(one, 1.0, 0.1), 0.5, 0.99),
        "ratio from which": edge(lambda one: swapped(0.99, one, 0.1), 0.5, 1.0),
        "ratio to which": edge(lambda one: swapped(0.99, one, 0.1), 1.0, 2.0),
        "as they are named, to which": edge(lambda one: swapped(0.99, 1.0, one), 0.2, 0.9),
    }


@NUMBERS.case()
def motions_that_disagree() -> dict[str, Any]:
    def disagree(same: float, ratio: float, pumps: float = 1.0, by_position: float = 1.0) -> list[Any]:
        short = blocks(slope=mixed(same, ratio), velocity=WAVE)
        pumped = HEALTHY.piston_area / pumps * WAVE
        long = blocks(slope=together(by_position, np.sign(ratio) * abs(ratio)), velocity=WAVE, pumped=pumped)
        return codes(channel_physics._motions_disagree(short, long, HEALTHY))  # pyright: ignore[reportPrivateUsage]

    return {
        "sound": disagree(0.99, 1.0),
        "position reversed": disagree(0.99, -1.0),
        "correlation from which": edge(lambda one: disagree(one, -1.0), 0.5, 0.99),
        "both against the pump": disagree(0.99, -1.0, -1.0),
        "neither against it": disagree(0.99, -1.0, 1.0, 0.1),
        "position against it, from": edge(lambda one: disagree(0.99, -1.0, 1.0, one), 0.2, 0.9),
        "position in mm": disagree(0.99, 1e3),
        "position in mm, other way": disagree(0.99, -1e3),
        "velocity in mm/s": disagree(0.99, 1e-3),
        "velocity in mm/s, piston too far": disagree(0.99, 1e-3, 1e-3),
        "position in cm, one of both too far from": edge(lambda one: disagree(0.99, 10.0, one), 0.02, 2.0),
    }


def reversed_by(share: float, slow: float | None = None, **of: Any) -> list[Any]:
    record = made_log(60)
    given = {key: of.pop(key) for key in ("pressure", "size") if key in of}
    piston = together(share, given.get("size", 1.0)) if slow is None else mixed(slow)
    long = blocks(slope=piston, pumped=WAVE, pressure=given.get("pressure"))
    balance = replace_balance(**of) if of else None
    return codes(channel_physics._wrong_sign_notes(record, long, long, balance))  # pyright: ignore[reportPrivateUsage]


def replace_balance(**of: float) -> FlowBalance:
    return BALANCE._replace(**of)


@NUMBERS.case()
def what_counts_the_other_way() -> dict[str, Any]:
    weak = {"pressure": -WAVE, "compressed": -1.0}
    return {
        "sound": reversed_by(0.95),
        "opposed": reversed_by(-0.95),
        "opposed from": edge(lambda one: reversed_by(one), -0.9, 0.1),
        "opposed from block to block, from": edge(lambda one: reversed_by(0.0, one), -0.9, 0.1),
        "with pressure that goes with the pump": reversed_by(-0.95, swept=-1.0, compressed=1.0),
        "with pressure that opposes it": reversed_by(-0.95, swept=-1.0, **weak),
        "pressure alone": reversed_by(0.95, **weak),
        "pressure, and a piston that hardly follows": reversed_by(0.3, swept=0.1, **weak),
        "pressure, follows from": edge(lambda one: reversed_by(one, swept=0.1, **weak), 0.2, 0.9),
        "pressure, swept from": edge(lambda one: reversed_by(0.3, swept=one, **weak), 0.05, 0.9),
        "pressure, swept surely from": edge(lambda one: reversed_by(0.3, swept=0.8, swept_std=one, **weak), 0.05, 0.9),
        "pressure, compressed from": edge(
            lambda one: reversed_by(0.95, pressure=-WAVE, compressed=-one, compressed_std=0.1), 0.01, 2.0
        ),
        "with pressure, compressed from": edge(
            lambda one: reversed_by(-0.95, swept=-1.0, compressed=one, compressed_std=0.1), 0.01, 2.0
        ),
        "power that opposes, by the share of": edge(
            lambda one: reversed_by(0.95, compressed=-1.0, pressure=mixed(one)), -0.9, 0.9
        ),
        "swept the other way from": edge(lambda one: reversed_by(-0.2, swept=-one), 0.01, 0.9),
        "swept the other way surely from": edge(lambda one: reversed_by(-0.2, swept=-0.8, swept_std=one), 0.01, 0.9),
        "swept the other way, together": edge(lambda one: reversed_by(one, swept=-0.8), -0.25, 0.25),
        "data": [
            told(channel_physics._wrong_sign_notes(made_log(60), shaped, shaped, balance))  # pyright: ignore[reportPrivateUsage]
            for shaped, balance in (
                (blocks(slope=together(-0.9, 1.0), pumped=WAVE, pressure=-WAVE), None),
                (blocks(slope=together(0.9, 1.0), pumped=WAVE, pressure=-WAVE), BALANCE._replace(compressed=-1.0)),
            )
        ],
    }


def units(share: float, size: float, record: Record | None = None, **of: Any) -> list[Any]:
    pumped = HEALTHY.piston_area * WAVE
    given = {key: of.pop(key) for key in ("position",) if key in of}
    long = blocks(slope=together(share, size), pumped=pumped, **given)
    balance = replace_balance(**of) if of else None
    record = made_log(60) if record is None else record
    return told(pump_unit_notes(record, long, HEALTHY, balance))


def unit(share: float, size: float, record: Record | None = None, **of: Any) -> list[str]:
    return [f"{one['channel']} {one['slip']}" for one in units(share, size, record, **of)]


@NUMBERS.case()
def units_that_the_pump_tells() -> dict[str, Any]:
    fast = made_log(60)
    fast = fast.replace(**{SPEED: fast[SPEED] * 3.5 * HEALTHY.motor_speed_limit / np.abs(fast[SPEED]).max()})
    resolved = {"position": np.linspace(0.0, 0.1, 60)}
    alone = made_log(60).replace(velocity_m_s=None)
    return {
        "sound": units(0.99, 1.0),
        "speed in rpm": units(0.99, 0.1, swept=10.0),
        "speed in rad/s": units(0.99, 9.5, swept=0.105),
        "way in mm": units(0.99, 1e3, alone, swept=1e-3),
        "way in km": units(0.99, 1e-3, alone, swept=1e3),
        "way in km, without pressure": units(0.99, 1e-3, alone),
        "rpm from": edge(lambda one: unit(0.99, 1.0 / one, swept=one), 5.0, 9.5),
        "rpm to": edge(lambda one: unit(0.99, 1.0 / one, swept=one), 9.5, 40.0),
        "far, rad/s from": edge(lambda one: unit(0.99, 1.0 / one, swept=one), 0.05, 0.105),
        "far, rad/s to": edge(lambda one: unit(0.99, 1.0 / one, swept=one), 0.105, 0.3),
        "known by": edge(lambda one: unit(0.99, 0.1, swept=10.0, swept_std=one), 0.1, 5.0),
        "not known at all": unit(0.99, 0.1, swept=10.0, swept_std=0.0),
        "refuted by": edge(lambda one: unit(0.99, 0.1, swept=10.0, moving=one), 1e-3, 0.9),
        "gone at most": edge(lambda one: unit(0.99, one, swept=10.0), 0.05, 1.0),
        "gone at most, in mm": edge(lambda one: unit(0.99, one, alone, swept=1e3), 5e-4, 1e-2),
        "misled, speed by its share": edge(lambda one: unit(one, 9.5, swept=0.5), 0.2, 0.95),
        "misled, from": edge(lambda one: unit(0.99, one, swept=0.5), 2.0, 9.5),
        "misled, to": edge(lambda one: unit(0.99, one, swept=0.5), 10.5, 14.0),
        "without pressure, by share": edge(lambda one: unit(one, 1e-3, alone, **resolved), 0.5, 0.99),
        "too fast": units(0.99, 0.1, fast),
        "too fast from": edge(lambda one: unit(0.99, 0.1, fast.replace(**{SPEED: one * fast[SPEED] / 3.5})), 1.0, 3.4),
        "too fast, by share": edge(lambda one: unit(one, 0.1, fast), 0.2, 0.99),
        "too fast, gone to": edge(lambda one: unit(0.99, one, fast), 0.05, 0.5),
        "too far for a pump and long": units(0.99, 11.0, alone, swept=0.1),
        "too far, of two that agree": unit(0.99, 11.0, swept=0.1),
        "resolved, by how far [m]": edge(
            lambda one: unit(0.99, 1e-3, alone, position=np.linspace(0.0, one, 60)), 1e-5, 0.1
        ),
        "far enough from": edge(lambda one: unit(0.99, one, alone, **resolved), 0.8e-3, 0.95e-3),
        "in cm for m, without pressure": unit(0.99, 0.01, alone, **resolved),
        "in mm for m, without pressure, far": unit(0.99, 11.0, alone),
        "a balance that goes 1.5 times as far": unit(0.99, 4.5, swept=1.0 / 1.5),
        "a balance that goes 1.5 times less": unit(0.99, 0.66, swept=1.5, moving=0.9),
        "rpm, two of them": [unit(0.99, 0.01, alone, swept=10.0), unit(0.99, 0.1, alone, swept=10.0)],
        "resolved": unit(0.99, 1e-3, alone, **resolved),
        "tiny to": edge(lambda one: unit(0.99, one, alone, **resolved), 0.95e-3, 0.01),
    }


@NUMBERS.case()
def units_that_pressure_tells() -> dict[str, Any]:
    def pressed(size: float, compressed: float, std: float = 0.0, **of: float) -> list[Any]:
        middle = blocks(pressure=size * np.ones(30))
        balance = BALANCE._replace(compressed=compressed, compressed_std=std)
        p = replace(HEALTHY, **of)
        return told(channel_physics._pressure_units(middle, p, balance))  # pyright: ignore[reportPrivateUsage]

    return {
        "bar": pressed(3.0, 1e5),
        "mPa": pressed(3e8, 1e-3),
        "small to": edge(lambda one: len(pressed(one, 1e5)), 3.0, 1e6),
        "small, compressed from": edge(lambda one: len(pressed(3.0, one)), 1.0, 1e3),
        "large from": edge(lambda one: len(pressed(one, 1e-3)), 1e5, 1e9),
        "large, compressed to": edge(lambda one: len(pressed(3e8, one)), 1e-3, 1.0),
        "surely": edge(lambda one: len(pressed(3.0, 1e5, one)), 1e2, 1e6),
        "without friction, small to": edge(lambda one: len(pressed(one, 1e5, friction_coulomb=0.0)), 3.0, 1e6),
        "none": [
            len(channel_physics._pressure_units(one, HEALTHY, other))  # pyright: ignore[reportPrivateUsage]
            for one, other in ((blocks(), BALANCE), (blocks(pressure=np.ones(30)), None))
        ],
    }


@NUMBERS.case()
def mistakes_of_whole_logs() -> dict[str, Any]:
    record = made_log()
    rpm = 60.0 / (2.0 * np.pi)
    changes: dict[str, dict[str, Any]] = {
        "sound": {},
        "speed reversed": {SPEED: -record[SPEED]},
        "position reversed": {POSITION: -record[POSITION]},
        "velocity reversed": {VELOCITY: -record[VELOCITY]},
        "pressure reversed": {PRESSURE: -record[PRESSURE]},
        "swapped": {POSITION: record[VELOCITY], VELOCITY: record[POSITION]},
        "speed in rpm": {SPEED: rpm * record[SPEED]},
        "speed in rad/s": {SPEED: record[SPEED] / rpm},
        "position in mm": {POSITION: 1e3 * record[POSITION]},
        "velocity in mm/s": {VELOCITY: 1e3 * record[VELOCITY]},
        "way in mm": {POSITION: 1e3 * record[POSITION], VELOCITY: None},
        "pressure in bar": {PRESSURE: 1e-5 * record[PRESSURE]},
        "a pump of its own": {SPEED: record[SPEED] + 20.0 * np.sin(0.03 * np.arange(N))},
    }
    return {
        f"{name}, {view}": told(channel_mistakes(record.replace(**change).replace(**gone), HEALTHY))
        for name, change in changes.items()
        for view, gone in (("all", {}), ("no pressure", {PRESSURE: None}), ("no velocity", {VELOCITY: None}))
    }


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
