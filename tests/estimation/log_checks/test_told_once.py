"""Values that an encoder repeats while the piston rests are used once; values that are equal by chance all count."""

import numpy as np
import pytest

from benchmarks.diagnosis.coverage import Case, draw_log
from estimation.eha.bulk_modulus import estimate_bulk_modulus
from estimation.log_checks.told_once import REST, changes_and_rests, with_repeats_used_once
from plant.arrays import Array
from plant.log.record import Record

NAN = np.nan


def test_a_rest_is_reduced_to_its_middle_sample_and_missing_samples_stay_missing() -> None:
    rest = np.full(2 * REST + 3, NAN)
    rest[[0, REST // 2, REST + 3 + (REST - 1) // 2]] = 3.0, 3.0, 4.0
    told = changes_and_rests(np.repeat([3.0, NAN, 4.0, 5.0], [REST + 1, 2, REST, 1]))
    np.testing.assert_array_equal(told, np.append(rest, 5.0))


def test_rows_beside_a_slow_change_are_kept_and_those_between_dropped() -> None:
    told = changes_and_rests(np.repeat([1.0, 2.0, 3.0, 4.0, 5.0], [1, 2, 4, REST, 1]))
    rest = np.full(REST, NAN)
    rest[[0, (REST - 1) // 2]] = 4.0  # its last row is off by half a step only if the piston was slow
    np.testing.assert_array_equal(told, np.concatenate([[1.0, 2.0, 2.0, 3.0, NAN, NAN, 3.0], rest, [5.0]]))


def test_kept_rows_around_a_turning_point_have_a_small_mean_error() -> None:
    time = 1e-4 * np.arange(-200, 501)
    turning = -1e6 * np.maximum(np.maximum(-time, time - 0.03), 0.0) ** 2  # rests for 30 ms [um]
    assert abs(mean_error(turning)) < 0.3  # -1.3 with all rows of motion and one of the rest


def test_an_empty_channel_stays_empty() -> None:
    assert changes_and_rests(np.empty(0)).shape == (0,)


def mean_error(position: Array) -> float:
    """Return the sum of the errors of the rows that are kept, averaged over the position of the steps [steps]."""
    true = position + np.linspace(-0.495, 0.495, 100)[:, None]
    return float(np.mean([np.nansum(changes_and_rests(np.round(one))[1:] - one[1:]) for one in true]))


def test_equal_readings_of_a_noisy_or_still_encoder_are_all_kept() -> None:
    rng = np.random.default_rng(1)
    noisy = Record(1e-3, {"position_m": np.round(rng.normal(0.0, 2.0, 5000)) * 1e-6})
    assert np.count_nonzero(np.diff(noisy["position_m"]) == 0.0) > 100
    assert with_repeats_used_once(noisy) is noisy
    still = Record(1e-3, {"position_m": np.zeros(5000)})
    assert with_repeats_used_once(still) is still


@pytest.mark.slow
@pytest.mark.parametrize(("drive", "condition", "seed"), [("steps", "major_leakage", 102), ("prbs", "normal", 201)])
def test_a_tuned_filters_interval_covers_if_the_piston_rests_between_moves(
    drive: str, condition: str, seed: int
) -> None:
    log = draw_log(Case("lumped", "pressure", 1000, drive, condition, seed))
    found = estimate_bulk_modulus(log.record, log.true, form="pressure", tuned=True)
    assert found.gate.passed
    assert found.std is not None
    assert found.value == pytest.approx(log.true.bulk_modulus, abs=2.5 * found.std)
    assert found.nis["position_m"] == pytest.approx(1.0, abs=0.05)  # 0.97 and 0.58 with every row of a rest counted
