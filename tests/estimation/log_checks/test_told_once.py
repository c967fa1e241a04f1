"""What an encoder repeats while the piston rests is told once; what only happens to be equal is not."""

import numpy as np
import pytest

from benchmarks.diagnosis.coverage import Case, logged
from estimation.eha.bulk_modulus import estimate_bulk_modulus
from estimation.log_checks.told_once import REST, middles, told_once
from plant.log.record import Record

NAN = np.nan


def test_a_repeated_value_stands_in_the_middle_of_its_rows_and_what_is_missing_stays_so() -> None:
    told = middles(np.repeat([3.0, NAN, 4.0, 5.0], [REST + 1, 2, REST, REST - 1]))
    at_rest = np.full(2 * REST + 3, NAN)
    at_rest[[0, REST // 2, REST + 3 + (REST - 1) // 2]] = 3.0, 3.0, 4.0
    np.testing.assert_array_equal(told, np.append(at_rest, np.full(REST - 1, 5.0)))


def test_readings_that_are_equal_by_chance_all_count() -> None:
    rng = np.random.default_rng(1)
    noisy = Record(1e-3, {"position_m": np.round(rng.normal(0.0, 2.0, 5000)) * 1e-6})
    assert np.count_nonzero(np.diff(noisy["position_m"]) == 0.0) > 100
    assert told_once(noisy) is noisy
    still = Record(1e-3, {"position_m": np.zeros(5000)})
    assert told_once(still) is still


@pytest.mark.slow
@pytest.mark.parametrize(("drive", "condition", "seed"), [("steps", "major_leakage", 102), ("prbs", "normal", 201)])
def test_the_interval_of_a_tuned_filter_covers_where_the_piston_rests_between_moves(
    drive: str, condition: str, seed: int
) -> None:
    log = logged(Case("lumped", "pressure", 1000, drive, condition, seed))
    found = estimate_bulk_modulus(log.record, log.true, form="pressure", tuned=True)
    assert found.gate.passed
    assert found.std is not None
    assert found.value == pytest.approx(log.true.bulk_modulus, abs=2.5 * found.std)
    assert found.nis["position_m"] == pytest.approx(1.0, abs=0.05)  # 0.97 and 0.58 with every row of a rest counted
