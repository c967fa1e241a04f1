"""A make-up valve that opens far later than the other may be one that never opens."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from estimation.fits.flow.fit import fit_flow
from estimation.fits.greybox.descent import Point
from estimation.fits.hypotheses import (
    CHECKS_CRACK,
    CHECKS_HIDDEN,
    DELIVERY,
    MAKEUP_BLOCKED,
    MAKEUP_HIDDEN,
    UNLIKE_CRACKS,
    Hypothesis,
)
from estimation.fits.hypothesis_search import stuck_valve
from estimation.fits.hypothesis_search.decimation import NO_DECIMATION
from estimation.fits.hypothesis_search.explanation import Trial
from experiments.open_benchmark.kinds import make
from plant.eha.model import EhaParameters
from plant.log.record import Record
from tests.estimation.fits.short_logs import made_fit

NOTHING: Any = None


def trial(together: Sequence[Hypothesis], cost: float, later: float = 0.0) -> Trial:
    point = Point(np.zeros(1), cost, np.zeros(1), np.eye(1))
    return Trial(tuple(together), point, {"crack_difference": later}, {}, {}, fits=(made_fit(cost, 2e8, 1e5),))


def stuck(
    monkeypatch: pytest.MonkeyPatch, cost: float, later: float, *beside: Hypothesis, crack: Hypothesis = CHECKS_CRACK
) -> list[tuple[Hypothesis, ...]]:
    """Return the sets that replace a late valve of cost 1000, if a stuck one has the given cost."""
    monkeypatch.setattr(stuck_valve, "without_delays", lambda log, _: log)
    monkeypatch.setattr(stuck_valve, "screen", lambda _, together, *__, **___: iter([trial(together, cost)]))
    monkeypatch.setattr(stuck_valve, "likeliest_sets", lambda _, tried, *__: [way for one in tried for way in one])
    best = trial([crack, *beside], 1000.0, later)
    return [one.together for one in stuck_valve.stuck_instead(NOTHING, best, NO_DECIMATION)]


def test_a_stuck_valve_replaces_a_late_one_that_is_hardly_likelier(monkeypatch: pytest.MonkeyPatch) -> None:
    """`makeup_check_stuck_shut`, training 17011: 47 kPa late was likelier by 2, "major leakage, major friction"."""
    late = -2.0 * UNLIKE_CRACKS
    assert stuck(monkeypatch, 1002.0, late) == [(MAKEUP_BLOCKED,)]
    assert stuck(monkeypatch, 1002.0, late, DELIVERY) == [(DELIVERY, MAKEUP_BLOCKED)]
    assert stuck(monkeypatch, 1002.0, late, crack=CHECKS_HIDDEN) == [(MAKEUP_HIDDEN,)]
    assert stuck(monkeypatch, 1011.0, late) == []


def test_a_set_with_a_stuck_valve_is_not_given_a_second_one(monkeypatch: pytest.MonkeyPatch) -> None:
    assert stuck(monkeypatch, 900.0, 2.0 * UNLIKE_CRACKS, MAKEUP_BLOCKED) == []


def test_valves_with_similar_cracking_pressures_are_not_tested_as_stuck(monkeypatch: pytest.MonkeyPatch) -> None:
    assert stuck(monkeypatch, 900.0, 0.5 * UNLIKE_CRACKS) == []
    assert stuck_valve.stuck_instead(NOTHING, trial([DELIVERY], 1000.0), NO_DECIMATION) == []


@pytest.mark.slow
@pytest.mark.parametrize("index", [16301, 17011])
def test_a_valve_that_stays_shut_throughout_a_log_is_identified_as_stuck(index: int) -> None:
    """Both logs got a class: one as plain, with a drop of 11 kPa (67 %), one with valves that open late (99.9 %)."""
    log = make("makeup_check_stuck_shut", "training", index).log
    fit = fit_flow(Record.from_frame(log), EhaParameters(), EhaParameters().bulk_modulus)
    assert fit.explanation is not None
    assert fit.explanation.names == (MAKEUP_BLOCKED.name,)
