"""A batch diagnoses as `diagnose` does."""

import numpy as np
import pytest

from experiments.batch.diagnosis import diagnosed
from faults.class_fit import Actuator
from faults.diagnosis import diagnose_log
from faults.population import OUT_OF_MODEL, TEST, draw_logs
from plant.eha import EhaParameters
from plant.record import Record

RIG = EhaParameters()


@pytest.mark.slow
def test_a_batch_finds_what_diagnose_finds() -> None:
    log = next(iter(draw_logs([TEST], drives=("prbs",), duration=3.0)))
    row, found = diagnosed(log.record, RIG), diagnose_log(log.record, Actuator.of(RIG))
    first, second = sorted(found.probabilities, key=lambda name: -found.probabilities[name])[:2]
    assert (row["outcome"], row["found_condition"], row["runner_up"]) == ("ok", first, second)
    assert row["margin"] == pytest.approx(found.probabilities[first] / found.probabilities[second])


@pytest.mark.slow
def test_a_log_in_none_of_the_nine_conditions_is_a_mismatch_with_a_reason() -> None:
    log = next(iter(draw_logs([TEST], drives=("prbs",), duration=3.0)))
    row = diagnosed(OUT_OF_MODEL["encoder gain, - 30 %"](log), RIG)
    assert row["outcome"] == "mismatch"
    assert row.get("found_condition") is None
    assert row["reason"].startswith("in none of the nine conditions, the nearest is")


@pytest.mark.slow
def test_a_log_at_rest_is_in_no_class() -> None:
    rng = np.random.default_rng(0)
    still = {"motor_speed_rad_s": np.zeros(2000), "position_m": 1e-7 * rng.standard_normal(2000)}
    assert diagnosed(Record(1e-3, still), RIG)["outcome"] in ("not_observable", "mismatch")
