"""Tests of the population on which diagnosis is calibrated and judged."""

import numpy as np
import pytest

from benchmarks.diagnosis.population import OUT_OF_MODEL, TEST, TRAINING, DrawnLog, draw_logs, draw_parameters
from faults.conditions import CONDITIONS, parameters_for


@pytest.fixture(scope="module")
def logs() -> list[DrawnLog]:
    return list(draw_logs([TRAINING], drives=("steps",), duration=1.0))


def test_every_seed_gives_the_nine_conditions_under_one_drive(logs: list[DrawnLog]) -> None:
    assert [log.condition for log in logs] == list(CONDITIONS)
    assert all(np.array_equal(log.drive, logs[0].drive) for log in logs)
    assert {log.record.metadata["drive"] for log in logs} == {"steps"}


def test_training_and_test_share_no_seed() -> None:
    assert set(range(TRAINING, TRAINING + 10_000)).isdisjoint(range(TEST, TEST + 10_000))


@pytest.mark.parametrize("name", ["normal", "major_leakage_minor_friction"])
def test_drawn_parameters_spread_up_to_the_stated_width(name: str) -> None:
    nominal = parameters_for(CONDITIONS[name])
    rng = np.random.default_rng(3)
    drawn = [draw_parameters(name, rng, 0.1) for _ in range(400)]
    for field, width in (("leakage_coefficient", 0.1), ("friction_coulomb", 0.1), ("bulk_modulus", 0.2)):
        shares = np.array([getattr(p, field) / getattr(nominal, field) - 1.0 for p in drawn])
        assert 0.9 * width < np.max(np.abs(shares)) <= width
    assert {p.piston_area for p in drawn} == {nominal.piston_area}


def test_each_of_at_least_twelve_out_of_model_kinds_changes_the_log(logs: list[DrawnLog]) -> None:
    assert len(OUT_OF_MODEL) >= 12
    for kind, changed in OUT_OF_MODEL.items():
        other = changed(logs[0])
        assert any(not np.array_equal(other[name], logs[0].record[name]) for name in other), kind
