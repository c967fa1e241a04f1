"""A batch diagnoses as `diagnose` does."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.diagnosis.population import OUT_OF_MODEL, TEST, draw_logs
from estimation.notes import SensorCode
from experiments.batch.diagnosis import class_row, diagnose_to_row
from experiments.page.condition_names import condition_in_words
from faults.conditions import CONDITIONS, parameters_for
from faults.diagnosis.diagnose import diagnose_log
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.rig import Rig
from plant.eha.simulate import LUMPED, simulate
from plant.errors import LogWarning
from plant.log.record import Record
from plant.sensors.sensors import BENCH

RIG = Rig()


def test_a_batch_finds_the_same_condition_as_diagnose() -> None:
    log = next(iter(draw_logs([TEST], drives=("prbs",), duration=3.0)))
    row, found = diagnose_to_row(log.record, RIG), diagnose_log(log.record, RIG)
    first, second = sorted(found.probabilities, key=lambda name: -found.probabilities[name])[:2]
    assert (row["outcome"], row["found_condition"], row["runner_up"]) == ("ok", first, second)
    assert row["margin"] == pytest.approx(found.probabilities[first] / found.probabilities[second])


@pytest.mark.slow
def test_a_log_outside_the_nine_conditions_is_a_mismatch_with_its_reasons() -> None:
    log = next(iter(draw_logs([TEST], drives=("prbs",), duration=3.0)))
    spoilt = OUT_OF_MODEL["encoder gain, - 30 %"](log)
    row = diagnose_to_row(spoilt, RIG)
    assert row["outcome"] == "mismatch"
    assert row.get("found_condition") is None
    assert "; the nearest of the nine conditions is" in row["reason"]
    assert row["reason"].startswith("; ".join(map(str, diagnose_log(spoilt, RIG).against)))


def test_a_log_at_rest_gets_no_condition_but_a_reason() -> None:
    rng = np.random.default_rng(0)
    still = {"motor_speed_rad_s": np.zeros(2000), "position_m": 1e-7 * rng.standard_normal(2000)}
    row = diagnose_to_row(Record(1e-3, still), RIG)
    assert row["outcome"] in ("not_observable", "mismatch")
    assert row["reason"]


def steps(duration: float = 3.0) -> Record:
    p, rng = parameters_for(CONDITIONS["minor_leakage"]), np.random.default_rng(8)
    return simulate(LUMPED, make_drive("steps", duration, 1e-3, p, rng), 1e-3, p, sensors=BENCH, rng=rng)


def test_a_rig_without_a_possible_circuit_gives_a_failed_row_with_the_reason() -> None:
    row = diagnose_to_row(steps(), Rig("no circuit", replace(EhaParameters(), relief_pressure=1e9)))
    assert (row["outcome"], row["trusted"]) == ("failed", False)
    assert "accumulator_oil must fill both chambers" in row["reason"]
    assert "found_condition" not in row


def test_outliers_left_out_of_a_log_are_warned_about_and_its_condition_is_still_found() -> None:
    velocity = steps()["velocity_m_s"].copy()
    velocity[::150] += 1.0
    with pytest.warns(LogWarning) as caught:
        row = diagnose_to_row(steps().replace(velocity_m_s=velocity), RIG)
    left_out = SensorCode.OUTLIERS_LEFT_OUT.note(channel="velocity_m_s", count=20, total=3000)
    assert [one.message.note for one in caught] == [left_out]
    assert (row["outcome"], row["found_condition"]) == ("ok", "minor_leakage")


def test_two_equally_probable_conditions_make_a_row_not_observable() -> None:
    log = diagnose_log(steps(), RIG)
    best, second = sorted(log.probabilities, key=lambda name: -log.probabilities[name])[:2]
    alike = replace(log, probabilities={**dict.fromkeys(log.probabilities, 0.0), best: 0.5001, second: 0.4999})
    row = class_row(alike)
    assert row["outcome"] == "not_observable"
    assert row["margin"] == pytest.approx(0.5001 / 0.4999)
    assert f"{condition_in_words(best)} and {condition_in_words(second)} look alike" in row["reason"]
    assert "found_condition" not in row
    apart = class_row(replace(alike, probabilities={**alike.probabilities, best: 0.51, second: 0.49}))
    assert (apart["outcome"], apart["found_condition"]) == ("ok", best)
