"""Tests of strange logs of rigs other than the paper's: each strangeness is scaled to the size of the rig."""

import numpy as np
import pytest

from benchmarks.diagnosis import strange_rigs
from benchmarks.diagnosis.strange_rigs import (
    DIFFERENCE,
    LOG_MISTAKES,
    NAMES,
    RIGS,
    SPEED,
    UNSCALED_KINDS,
    draw_strange_log,
    draws_for_rig,
    rig_of,
)
from experiments.open_benchmark.kinds import KINDS


def test_every_kind_is_unique_and_from_the_open_benchmark_or_made_from_a_written_log() -> None:
    assert len(set(NAMES)) == len(NAMES)
    assert set(NAMES) - set(LOG_MISTAKES) <= set(KINDS)
    assert not set(UNSCALED_KINDS) & set(draws_for_rig(rig_of("laboratory")[0]))


@pytest.mark.parametrize("rig", RIGS)
def test_every_rig_has_a_stroke_and_a_use(rig: str) -> None:
    healthy, use = rig_of(rig)
    assert healthy.stroke is not None
    assert use.gas > 0.0


@pytest.mark.parametrize("rig", ["laboratory", "random 1793"])
def test_an_offset_is_a_share_of_the_rigs_own_relief_pressure(rig: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(strange_rigs, "DURATION", 0.5)
    healthy, _ = rig_of(rig)
    table, truth, setup = draw_strange_log(rig, "pressure_1_bar_off", 2)
    assert 0.005 <= setup.logger.sensors[DIFFERENCE].offset / healthy.relief_pressure <= 0.03
    assert truth["accept"] == truth["condition"] == setup.condition
    again, *_ = draw_strange_log(rig, "pressure_1_bar_off", 2)
    assert again.equals(table)


def test_a_frozen_speed_in_a_written_log_leaves_the_pressure_unfrozen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(strange_rigs, "DURATION", 0.5)
    table, truth, _ = draw_strange_log("laboratory", "speed_freezes", 1)
    assert np.count_nonzero(np.diff(table[SPEED]) == 0.0) >= 0.19 * len(table)
    assert np.count_nonzero(np.diff(table[DIFFERENCE]) == 0.0) < 0.1 * len(table)
    assert "unknown" in truth["accept"]
