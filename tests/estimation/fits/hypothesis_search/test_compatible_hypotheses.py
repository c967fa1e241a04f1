"""Which hypotheses may still explain a log, by what all of them together leave of it."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimation.fits.flow.log import flow_log
from estimation.fits.flow.search import flow_starts
from estimation.fits.greybox.descent import Point
from estimation.fits.hypotheses import DELIVERY, HYPOTHESES, LEAKAGE_RISE, OFFSET, PRESSURE_LATE, VOLUME
from estimation.fits.hypothesis_search import compatible_hypotheses as module
from estimation.fits.hypothesis_search.coarse_search import FINEST_DELAY, search_coarsely
from estimation.fits.hypothesis_search.compatible_hypotheses import MUCH, compatible_hypotheses
from estimation.fits.hypothesis_search.decimation import FEW, cost_over_noise
from estimation.fits.hypothesis_search.explanation import Trial
from estimation.fits.hypothesis_search.final_fits import REACHED, UNFINISHED
from estimation.fits.hypothesis_search.screening import screen
from estimation.fits.hypothesis_search.wide_log import widened
from estimation.models.flow import STIFFNESS
from plant.arrays import Array
from tests.estimation.fits.short_logs import PAPER, PRESSURE, VARIANCES, WORN, log

UNSEEN = {
    "position_play",
    "air_midway",
    "relief_low",
    "leakage_step",
    "makeup_blocked",
    "single_rod",
    "port_a_drains",
}


def names(found: Any) -> set[str]:
    return {one.name for one in found}


def asked_beside(left: float, together: float, lag: float, monkeypatch: pytest.MonkeyPatch, samples: int = FEW) -> Any:
    """Return what is asked where the best set leaves this over the noise, and all hypotheses together that."""
    monkeypatch.setattr(module, "cost_over_noise", lambda *_: left)
    lags = {"pressure_lag": lag, "speed_lag": 0.0, "position_lag": 0.0}
    monkeypatch.setattr(module, "_all_together", lambda *_: (together, lags))
    point = Point(np.zeros(1), left, np.zeros(1), np.eye(1))
    made: Any = SimpleNamespace(drives=np.zeros((samples, 1)), gaps=np.zeros(0))
    return compatible_hypotheses(made, Trial((VOLUME,), point, {}, {}, {}), [*HYPOTHESES])


def test_where_all_hypotheses_together_leave_far_more_than_noise_only_what_slopes_do_not_see_is_asked(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert names(asked_beside(2.0, 1.8, 0.0, monkeypatch)) == {*UNSEEN, "port_b_drains"}
    # a lag of theirs may be a delay
    late = asked_beside(2.0, 1.8, 1.1 * FINEST_DELAY, monkeypatch)
    assert names(late) == {*UNSEEN, "port_b_drains", PRESSURE_LATE.name}


@pytest.mark.parametrize(
    ("left", "together"),
    [
        (2.0, REACHED - 0.01),
        (9.0, 1.0 + MUCH * 8.0 - 0.01),  # what they take up is much of what is left
        (REACHED - 0.01, 1.4),
        (UNFINISHED, 9.0),  # so far off, all together end in a wrong valley
        (np.inf, 9.0),  # what was found is not what its hypothesis says
    ],
)
def test_all_are_asked_where_they_may_explain_a_log(
    left: float, together: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert len(asked_beside(left, together, 0.0, monkeypatch)) == len(HYPOTHESES)


def test_a_short_log_is_asked_all(monkeypatch: pytest.MonkeyPatch) -> None:
    assert len(asked_beside(2.0, 1.9, 0.0, monkeypatch, FEW - 1)) == len(HYPOTHESES)


def beside_leakage_that_rises(added: Array, monkeypatch: pytest.MonkeyPatch) -> tuple[float, set[str]]:
    """Return what rising leakage leaves of a log with this added to its pressure, and what is asked beside it."""
    monkeypatch.setattr(module, "FEW", 0)
    record = log(1.0)
    shifted, variances = record.replace(**{PRESSURE: record[PRESSURE] + added}), {**VARIANCES, PRESSURE: 2.4e7}
    row = widened(flow_log(shifted, PAPER, {}, variances), PAPER, {STIFFNESS: 3e7})
    start = {**flow_starts(PAPER, PAPER.bulk_modulus)[2], "leakage_coefficient": WORN.leakage_coefficient}
    (begun,) = screen(row, (LEAKAGE_RISE,), [{**start, "flow_bias": WORN.flow_bias}])
    best = search_coarsely(row, begun)
    return cost_over_noise(row, best.cost), names(compatible_hypotheses(row, best, [OFFSET, DELIVERY]))


def test_a_pressure_that_is_off_is_within_reach_and_bursts_of_noise_are_not(monkeypatch: pytest.MonkeyPatch) -> None:
    samples = len(log(1.0))
    left, asked = beside_leakage_that_rises(np.full(samples, 1.2e4), monkeypatch)
    assert REACHED < left < UNFINISHED
    assert asked == {OFFSET.name, DELIVERY.name}
    bursts = np.random.default_rng(5).normal(0.0, 1e4, samples)
    left, asked = beside_leakage_that_rises(bursts, monkeypatch)
    assert REACHED < left < UNFINISHED
    assert asked == set()


def test_a_search_with_all_hypotheses_that_finds_no_step_down_leaves_all_of_them_to_be_asked(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Air beside a pressure that lags was not asked, and the log refused at 4.3 times the noise."""
    monkeypatch.setattr(module, "descend", lambda at, start, _, bounds, **__: at(np.clip(start, *bounds)))
    bursts = np.random.default_rng(5).normal(0.0, 1e4, len(log(1.0)))
    assert beside_leakage_that_rises(bursts, monkeypatch)[1] == {OFFSET.name, DELIVERY.name}
