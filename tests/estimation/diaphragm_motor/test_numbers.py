"""Results from logs of the diaphragm motor, by tones and maps, kept in `numbers.json`."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from estimation.diaphragm_motor import estimate, finding, track
from estimation.diaphragm_motor.card import flow_change, motor_card
from estimation.diaphragm_motor.estimate import MotorEstimate, estimate_motor
from estimation.diaphragm_motor.finding import MotorCode, motor_finding, motor_prospect
from estimation.diaphragm_motor.signature import (
    Drive,
    fitted_tones,
    logged_signature,
    modelled_signature,
    require_channels,
    steady_drive,
    tolerance,
    whole_cycles,
)
from estimation.diaphragm_motor.track import Block, HealthyMaps, MotorTrack, healthy_maps, motor_blocks, track_leakage
from estimation.finding import Finding
from plant.diaphragm_motor.parameters import DiaphragmMotorParameters
from plant.diaphragm_motor.run import BENCH_SENSORS, SAMPLE_TIME, motor_drive, simulate_motor
from plant.log.record import Record
from tests.edges import edge
from tests.numbers import Numbers, or_refused

NUMBERS = Numbers(__file__)
MOTOR = DiaphragmMotorParameters()
WORN = replace(MOTOR, load_force=12.0, crossport_leakage=3e-12)
DRIVE = Drive(480.0, 200.0, 0.0)


@cache
def log(*, worn: bool = True) -> Record:
    drive = motor_drive(480.0, 200.0, 0.26, SAMPLE_TIME)
    return simulate_motor(
        WORN if worn else replace(MOTOR, load_force=10.0),
        drive,
        SAMPLE_TIME,
        sensors=BENCH_SENSORS,
        rng=np.random.default_rng(3),
    )


@NUMBERS.case()
def signatures() -> dict[str, Any]:
    seen = logged_signature(log())
    scatter = tolerance(MOTOR, 480.0, 200.0)
    slow = tolerance(replace(MOTOR, load_force=40.0), 480.0, 60.0)
    return {
        "of a log [V], [m/s]": seen.values,
        "deviations": np.sqrt(np.diag(seen.covariance)),
        "drive": vars(seen.drive),
        "from 0.2 s on": logged_signature(log(), 0.2).values[[0, 3, 10, -1]],
        "tones": seen.tones[[0, 3, 6]],
        "velocity [m/s]": seen.velocity,
        "of the model": modelled_signature(WORN, 480.0, 200.0),
        "tolerance": np.sqrt(np.diag(scatter)),
        "tolerance of some together": [scatter[0, 3], scatter[2, 9], scatter[5, 28], scatter[16, 20]],
        "tolerance of one that stands": [np.sqrt(slow[-1, -1]), slow[3, 3]],
    }


@NUMBERS.case()
def steady_drives() -> dict[str, Any]:
    time = 1e-4 * np.arange(3000)
    wave = np.sin(2.0 * np.pi * 123.4 * time + 0.7)

    def found(voltage: Any, sample_time: float = 1e-4) -> Any:
        return or_refused(lambda: list(vars(steady_drive(voltage, sample_time)).values()))

    def refused(voltage: Any) -> bool:
        return isinstance(found(voltage), str)

    return {
        "a sine": found(60.0 * wave + 3.0),
        "a short one": found(60.0 * wave[:301]),
        "a slow one": found(60.0 * np.sin(2.0 * np.pi * 9.7 * time + 2.0)),
        "beside another of": edge(lambda one: refused(60.0 * wave + one * np.sin(2600.0 * time)), 0.1, 5.0, 16),
        "largest [V]": edge(lambda one: refused(one * wave), 60.0, 300.0, 16),
        "highest [Hz]": edge(lambda one: refused(60.0 * np.sin(2.0 * np.pi * one * time)), 100.0, 3000.0, 12),
        "of seven and eight": [refused(wave[:count]) for count in (7, 8)],
        "still": found(np.ones(100)),
    }


@NUMBERS.case()
def tones_and_cycles() -> dict[str, Any]:
    angle = 0.31 * np.arange(400.0)
    values = np.column_stack(
        [2.0 + 0.5 * np.sin(angle) + 0.1 * np.cos(6.0 * angle), 0.01 * np.arange(400.0) + np.cos(7.0 * angle)]
    )
    fit, noise = fitted_tones(values, angle, trend=1)
    few, left = fitted_tones(values[:14], angle[:14], trend=1)
    changes: dict[str, Any] = {
        "whole": {},
        "without a channel": {"electrode_4_v": None},
        "without a drive": {"drive_voltage_v": None},
        "with a gap": {"position_m": np.where(np.arange(len(log())) == 7, np.nan, log()["position_m"])},
    }
    return {
        "coefficients": fit.T,
        "left": noise,
        "left of few": left,
        "few": few[0],
        "whole cycles": [or_refused(lambda one=one: whole_cycles(one, 1e-4, 480.0)) for one in (416, 417, 500, 2000)],
        "a whole number of cycles": whole_cycles(1000, 1e-3, 30.0),
        "channels": {
            name: or_refused(lambda one=one: require_channels(log().replace(**one))) for name, one in changes.items()
        },
        "length [s]": [
            or_refused(lambda one=one: require_channels(log().slice(0, one)))
            for one in (round(0.1 / SAMPLE_TIME), round(0.1 / SAMPLE_TIME) + 1)
        ],
    }


MADE = HealthyMaps(Polynomial([1e-6, 4e-6, -1e-6], domain=[0.5, 2.0]), Polynomial([4e4, -3e4, 5e3], domain=[0.5, 2.0]))


def block(k: int, amplitude: float, velocity: float = 3e-3, size: float = 1e-3) -> Block:
    return Block(0.1 + 0.04 * (k + 1), 0.04, amplitude, velocity, np.array([size, 1e-6]))


@NUMBERS.case()
def leakage_that_is_tracked() -> dict[str, Any]:
    def told(found: MotorTrack) -> dict[str, Any]:
        return dict(vars(found))

    steady = [block(k, 1.2 + 1e-4 * np.sin(9.0 * k)) for k in range(9)]
    stepped = [block(k, 1.2 if k < 4 else 1.5, 3e-3 if k < 4 else 1e-3) for k in range(10)]
    p = replace(MOTOR, crossport_leakage=1e-13)

    def held(size: float, noisy: float = 1e-6) -> list[bool]:
        moved = [block(k, 1.2 if k < 3 else 1.2 + size, 3e-3, noisy) for k in range(9)]
        return track_leakage(moved, p, MADE).held.tolist()

    def alarm(leak: float, std: float = 1e-14, gone: int = 9, count: int = 6) -> float | None:
        known = np.where(np.arange(count) == gone, 0.0, leak)
        return MotorTrack(
            np.arange(count) + 1.0, known, np.full(count, std), known, known, np.arange(count) == 0
        ).alarm_time

    return {
        "steady": told(track_leakage(steady, p, MADE)),
        "stepped": told(track_leakage(stepped, p, MADE)),
        "stepped, trusted": told(track_leakage(stepped, p, MADE, 0.2))["leakage_std"],
        "held from an amplitude of [V]": edge(held, 1e-5, 0.1),
        "held from an amplitude of, noisy [V]": edge(lambda one: held(one, 3e-3), 1e-5, 0.1),
        "balances": [list(one) for one in track._balances(block(0, 1.4, -2e-4), 3e4, p, MADE)],  # pyright: ignore[reportPrivateUsage]
        "tilts": track._tolerance_errors(block(0, 1.4), np.array([2e-12, 5.0]), p, MADE),  # pyright: ignore[reportPrivateUsage]
        "tilts at no pressure": track._tolerance_errors(
            block(0, 2.0), np.array([2e-12, 5.0]), p, replace(MADE, pressure=Polynomial([100.0, 5.0]))
        ),  # pyright: ignore[reportPrivateUsage]
        "alarm [s]": [
            alarm(2e-12),
            alarm(2e-12, gone=2),
            alarm(2e-12, gone=3),
            alarm(2e-12, count=3),
            alarm(2e-12, count=4),
        ],
        "alarm from [m^3/(s Pa)]": edge(alarm, 1e-13, 2e-12),
        "alarm to a deviation of [m^3/(s Pa)]": edge(lambda one: alarm(2e-12, one), 1e-14, 2e-12),
    }


@NUMBERS.case(relative=1e-5)
def healthy_maps_and_blocks() -> dict[str, Any]:
    maps = healthy_maps(MOTOR, DRIVE)
    blocks = motor_blocks(log(), DRIVE)
    return {
        "flow [m^3/s]": [float(maps.flow(one)) for one in maps.flow.domain],
        "pressure [Pa]": [float(maps.pressure(one)) for one in maps.pressure.domain],
        "middle": [float(one(np.mean(one.domain))) for one in (maps.flow, maps.pressure)],
        "amplitudes [V]": list(maps.flow.domain),
        "degree": [maps.flow.degree(), maps.pressure.degree()],
        "a weak drive": or_refused(lambda: healthy_maps(MOTOR, Drive(480.0, 20.0, 0.0))),
        "drive that is just strong enough [V]": edge(
            lambda one: isinstance(or_refused(lambda: healthy_maps(MOTOR, Drive(480.0, one, 0.0))), str), 40.0, 120.0, 4
        ),
        "blocks": [[one.end, one.length, one.amplitude, one.velocity, *one.deviations] for one in blocks],
        "of a short log": or_refused(lambda: len(motor_blocks(log().slice(0, 3000), DRIVE))),
    }


@NUMBERS.case(relative=1e-4)
def what_a_log_says() -> dict[str, Any]:
    calibration = logged_signature(log(worn=False))
    found = estimate_motor(log(), MOTOR)
    calibrated = estimate_motor(log(), replace(MOTOR, load_force=10.0), calibration=calibration)

    def told(one: MotorEstimate) -> dict[str, Any]:
        return {
            "values": dict(one.values),
            "deviations": dict(one.deviations),
            "pattern": one.pattern,
            "holds": one.pattern_holds,
            "leakage": one.parameters.crossport_leakage,
            "gas": one.parameters.gas_fraction[3],
        }

    airy = replace(MOTOR, gas_fraction=tuple(3.0 * one for one in MOTOR.gas_fraction), load_force=8.0)
    seen = replace(calibration, values=modelled_signature(airy, 480.0, 200.0))
    clogged = replace(calibration, values=calibration.values * np.linspace(0.9, 1.1, 29))
    return {
        "worn": told(found),
        "worn, calibrated": told(calibrated),
        "gains": estimate._gains(calibration, replace(MOTOR, load_force=10.0)),  # pyright: ignore[reportPrivateUsage]
        "gas, fitted": list(estimate._gas_and_load_fit(seen, MOTOR)),  # pyright: ignore[reportPrivateUsage]
        "gas, fitted to what is no healthy pump": list(estimate._gas_and_load_fit(clogged, MOTOR)),  # pyright: ignore[reportPrivateUsage]
        "finding": told_finding(motor_finding(log(), MOTOR)),
        "prospect": told_finding(motor_prospect(WORN, 480.0, 200.0)),
    }


def told_finding(one: Finding) -> dict[str, Any]:
    return {
        "outcome": str(one.outcome.name),
        "quantities": {name: list(vars(each).values()) for name, each in one.quantities.items()},
        "channels": list(one.channels),
        "faults": [str(note.code) for note in one.faults],
        "not told": [str(note.code) for note in one.not_told],
        "gate": [one.gate.passed, [str(note.code) for note in one.gate.reasons]],
    }


@NUMBERS.case()
def doubts_of_an_estimate() -> dict[str, Any]:
    made = estimate_motor(log(), MOTOR)

    def doubts(leakage: float, *, holds: bool = True) -> list[str]:
        values, deviations = {"crossport_leakage": leakage}, {"crossport_leakage": 1e-13}
        one = replace(made, values=values, deviations=deviations, pattern_holds=holds)
        return [str(note.code) for note in finding._pattern_notes(one, MOTOR)]  # pyright: ignore[reportPrivateUsage]

    def told(name: str, value: float, std: float) -> bool:
        one = replace(made, values={name: value}, deviations={name: std})
        return finding._quantity(name, one, told=True).value is None  # pyright: ignore[reportPrivateUsage]

    sizes = {"crossport_leakage": 2e-12, "load_force": 10.0, "gas_fraction": 0.01}
    return {
        "a pattern that is broken": doubts(0.0, holds=False),
        "too fast from [m^3/(s Pa)]": edge(lambda one: doubts(-one), 1e-14, 1e-12),
        **{
            f"{name}, uncertain from": [
                edge(lambda one, n=name, v=share * size: told(n, v, one), 1e-3 * size, 9.0 * size)
                for share in (0.1, 3.0, -4.0)
            ]
            for name, size in sizes.items()
        },
        "not told": finding._quantity("load_force", made, told=False).value,  # pyright: ignore[reportPrivateUsage]
        "codes": [str(one) for one in MotorCode],
    }


@NUMBERS.case(relative=1e-5)
def cards() -> dict[str, Any]:
    card = motor_card(WORN, 480.0, 200.0)
    return {
        "relative deviations": dict(card.relative_std),
        "correlation": card.correlation,
        "weakest": {name: abs(one) for name, one in card.weakest.items()},
        "weakest deviation": card.weakest_std,
        "friction, stuck": [card.friction_force, card.stuck],
        "flow by bulk modulus": [flow_change(WORN, 480.0, 200.0, factor) for factor in (0.5, 2.0)],
    }


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
