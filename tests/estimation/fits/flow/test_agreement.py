"""Conclusions from fits of a slow log with straight lines between samples and with turns read from the log."""

from types import SimpleNamespace
from typing import Any

import pytest

from estimation.fits.flow.agreement import LogAnswer, agreed_answer, wanted_gain
from estimation.fits.hypothesis_search.explain import REQUIRED_GAIN
from estimation.notes import RigCode

TURNS = 9.0
"""Number of turns of the motor in these logs [count]."""


def said(name: str, gain: float = 0.0, *, explained: bool = False) -> LogAnswer:
    log = SimpleNamespace(turn_count=TURNS, course=True)
    plain: Any = SimpleNamespace(best=SimpleNamespace(cost=1000.0), log=log, explains=lambda _: explained)
    strange: Any = SimpleNamespace(names=(name,), fit=SimpleNamespace(cost=1000.0 - gain, chi_square=(1.0,)))
    return LogAnswer(plain, (), (), strange if name else None)


def test_if_both_fits_agree_the_one_with_straight_lines_is_reported() -> None:
    straight = said("delivery", 51.0)
    assert agreed_answer(straight, said("delivery", 69.0)) is straight
    plain = said("", explained=True)
    assert agreed_answer(plain, said("", explained=True)) == plain
    refused, read = said(""), said("", explained=True)
    assert agreed_answer(refused, said("")) == refused
    assert agreed_answer(refused, read) is read


@pytest.mark.parametrize("explained", [True, False])
def test_a_hypothesis_accepted_with_straight_lines_alone_is_dropped(explained: bool) -> None:
    """Oil compressed by the pump gained 76 with straight lines, and leakage was 66 % low."""
    straight, read = said("pump_compresses", 76.0, explained=explained), said("", explained=True)
    told = agreed_answer(straight, read)
    assert told.strange is None
    assert told.plain is (straight.plain if explained else read.plain)


@pytest.mark.parametrize("name", ["delivery", ""])
@pytest.mark.parametrize("left", [0.05, 0.0])
def test_pump_wear_that_is_excluded_with_turns_read_is_not_reported_as_possible(name: str, left: float) -> None:
    """In a plain log at 200 Hz a sound pump was 99 % likely to deliver 73 %: ten deviations, 0.6 with turns read."""
    told = RigCode.WEAR_NOT_EXCLUDED.note(percent=37.0, half_width=6.2)
    by_turns = (RigCode.WEAR_NOT_EXCLUDED.note(percent=100.0 * left, half_width=3.6),) if left else ()
    straight, read = (said(one, 80.0, explained=True) for one in (name, ""))
    assert agreed_answer(straight._replace(open_ends=(told,)), read._replace(open_ends=by_turns)).open_ends == by_turns
    assert agreed_answer(straight, read._replace(open_ends=by_turns)).open_ends == ()


def test_if_the_search_with_turns_read_is_cut_short_the_plain_fit_with_straight_lines_is_reported() -> None:
    straight = said("delivery", 51.0)
    told = agreed_answer(straight, said("")._replace(ended=True))
    assert (told.plain, told.strange, told.ended) == (straight.plain, None, True)


@pytest.mark.parametrize("gain", [0.9, 1.1])
def test_a_hypothesis_accepted_with_turns_read_alone_must_gain_at_each_turn(gain: float) -> None:
    straight, read = said("air_midway", 173.0), said("single_rod", gain * TURNS * REQUIRED_GAIN)
    assert agreed_answer(straight, read).names == (("single_rod",) if gain > 1.0 else ())


@pytest.mark.parametrize(("told", "read", "turns"), [(True, False, 1.0), (False, True, 1.0), (False, False, TURNS)])
def test_a_hypothesis_tested_with_and_without_turns_read_need_not_gain_at_each_turn(
    told: bool, read: bool, turns: float
) -> None:
    plain: Any = SimpleNamespace(turns_readable=told, start=SimpleNamespace(turns_read=read), log=said("").plain.log)
    assert wanted_gain(plain) == turns * REQUIRED_GAIN
