"""The volume pumped at turns of a slow log is read from the next samples, and a hypothesis must gain with it too."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from estimation.fits.flow import fit as flow_fit
from estimation.fits.flow import plain as plain_flow
from estimation.fits.flow.asked_hypotheses import wanted_gain_at_turns
from estimation.fits.flow.turns_read import turn_beyond_line, with_turns_read
from estimation.fits.greybox.fit import GreyBoxFit
from estimation.fits.greybox.intersample_doubt import IntersampleDoubt
from estimation.fits.greybox.log import GreyBoxLog
from estimation.fits.hypotheses import PUMP_COMPRESSES
from estimation.fits.hypothesis_search.explanation import Explanation
from plant.arrays import Array
from plant.log.record import Record
from tests.estimation.fits.short_logs import PAPER, POSITION, PRESSURE, SPEED, made_fit, seen

COMMANDS = 0.5 + 0.3 * np.arange(12) + 1e-3 * np.array([3, 8, 1, 6, 9, 4, 2, 7, 5, 8, 3, 6])
"""Times at which the motor's command changes [s]."""


def turned(time: Array, lag: float, commands: Array = COMMANDS) -> tuple[Array, Array]:
    """Return speed [rad/s] and angle [rad] of a first-order motor that turns to and fro."""
    speed, angle = np.zeros_like(time), np.zeros_like(time)
    for k, at in enumerate(commands):
        whole, since = (100.0 if k == 0 else 200.0) * (-1.0) ** k, np.maximum(time - at, 0.0)
        speed += whole * (1.0 - np.exp(-since / lag))
        angle += whole * (since - lag * (1.0 - np.exp(-since / lag)))
    return speed, angle


def off(sample_time: float, lag: float) -> tuple[float, float]:
    """Return the error of the angle between samples with straight lines, and with turns read [rad], as norms."""
    time = np.arange(0.0, 4.5, sample_time)
    speed, angle = turned(time, lag)
    logged = speed + np.random.default_rng(1).normal(0.0, 0.05, len(time))
    straight = np.diff(angle, prepend=0.0) - np.append(0.0, 0.5 * sample_time * (speed[1:] + speed[:-1]))
    read = straight - turn_beyond_line(logged, sample_time, 0.05)
    return float(np.linalg.norm(straight)), float(np.linalg.norm(read))


@pytest.mark.parametrize(("sample_time", "lag"), [(0.01, 3e-3), (0.01, 6e-3), (0.005, 2e-3), (0.005, 6e-3)])
def test_the_volume_pumped_at_a_turn_is_read_from_the_samples_after_it(sample_time: float, lag: float) -> None:
    straight, read = off(sample_time, lag)
    assert read < 0.05 * straight


def test_a_turn_that_is_over_by_the_next_sample_is_left_as_it_is() -> None:
    """At 50 Hz a motor of 3 ms reaches its new speed to a thousandth: noise would decide when the command came."""
    straight, read = off(0.02, 2e-3)
    assert read == straight


def test_a_turn_that_another_command_follows_at_once_is_left_as_it_is() -> None:
    time = np.arange(0.0, 4.5, 0.01)
    hurried = np.sort(np.append(COMMANDS, COMMANDS[5] + 0.012))
    speed, _ = turned(time, 4e-3, hurried)
    beside, at = turn_beyond_line(speed, 0.01, 1e-3), int(COMMANDS[5] / 0.01)
    assert np.any(beside)
    assert not np.any(beside[at - 2 : at + 8])


def slow(sample_time: float = 0.01) -> Record:
    time = np.arange(0.0, 4.5, sample_time)
    speed, angle = turned(time, 4e-3)
    position = PAPER.pump_displacement / PAPER.piston_area * angle
    noise = np.random.default_rng(1).normal(0.0, 1.0, (2, len(time)))
    return Record(sample_time, {SPEED: speed + 0.01 * noise[0], POSITION: position, PRESSURE: 3e3 * noise[1]})


def test_the_volume_pumped_at_turns_is_subtracted_from_positions_of_slow_logs_alone() -> None:
    log = seen(slow())
    read, fast = with_turns_read(log, PAPER), seen(slow(1e-3))
    assert with_turns_read(fast, PAPER) is fast
    speeds, moved = log.drives[:, 0], PAPER.pump_displacement / PAPER.piston_area
    assert read.drives[:, 0] is not speeds
    assert np.array_equal(read.drives[:, 0], speeds)
    pumped = float(np.trapezoid(speeds, dx=0.01)) + float(log.drives[-1, 1] - read.drives[-1, 1]) / moved
    assert pumped == pytest.approx(turned(np.array([4.49]), 4e-3)[1][0], abs=0.02)


def test_the_gain_required_in_a_slow_log_grows_with_its_turns_and_its_residuals() -> None:
    """A gain of 76 at nine turns wrongly showed a pump that compresses its oil, with leakage 66 % low."""
    log = seen(slow())
    turning = replace(log, course=IntersampleDoubt(np.where(np.arange(len(log.drives)) % 30 < 2, 1e6, 0.0)))
    assert wanted_gain_at_turns(log) == 10.0
    assert wanted_gain_at_turns(turning) == pytest.approx(10.0 * turning.turn_count)
    assert turning.turn_count > 10.0
    assert wanted_gain_at_turns(turning, 0.25) == pytest.approx(2.5 * turning.turn_count)
    assert wanted_gain_at_turns(turning, 1.1) == wanted_gain_at_turns(turning)


@pytest.mark.parametrize("gains", [True, False])
def test_a_hypothesis_is_accepted_only_if_it_also_gains_with_turns_read(
    gains: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    read: list[bool] = []
    sound = made_fit(400.0, 2e8, 1e5)

    def fitted(log: GreyBoxLog, *_: object, **__: object) -> Sequence[GreyBoxFit]:
        read.append(not np.array_equal(log.drives, seen(slow()).drives))
        return [replace(sound, values={**sound.values, "bulk_modulus": 3e8 if read[-1] else 2e8})]

    def explain(*_: object, **__: object) -> Explanation:
        values: Mapping[str, Any] = {name: (value, 1.0) for name, value in sound.values.items()}
        return Explanation(
            (PUMP_COMPRESSES.name,), values, {}, (replace(sound, cost=100.0 if gains else 395.0),), (), 1e6
        )

    monkeypatch.setattr(plain_flow, "balance_fits", fitted)
    monkeypatch.setattr(plain_flow, "with_course", lambda log, fitted, *_, **__: (fitted(log), log)[1])
    monkeypatch.setattr(flow_fit, "hypotheses_asked", lambda *_, **__: ((PUMP_COMPRESSES,), ()))
    monkeypatch.setattr(flow_fit, "explain", explain)
    monkeypatch.setattr(flow_fit, "lower_minimum", lambda *_: None)
    answer = flow_fit.fit_flow(slow(), PAPER, PAPER.bulk_modulus, {}, None)
    assert not read[0]
    assert read[-1]
    assert (answer.explanation is not None) == gains
    if not gains:  # without a strange effect the log keeps its value
        assert answer.parameters["bulk_modulus"][0] == pytest.approx(2e8)


def test_a_turn_that_the_next_samples_reverse_is_not_read() -> None:
    rises = [0.0, 0.0, 100.0, 50.0, 25.0, 12.5, *4 * [0.0], 100.0, -50.0, -25.0, -12.0, *4 * [0.0]]
    assert not turn_beyond_line(np.cumsum(rises), 0.01, 0.01)[9:].any()
