"""filterpy's filter and ours agree in the study, and the table would show a difference."""

from dataclasses import replace

import numpy as np

from estimation.filters.methods import METHODS
from estimation.filters.run import Estimate, run_filter
from estimation.log_checks.first_belief import first_belief
from estimation.models.eha_forms import BULK_MODULUS, FORMS
from experiments.nine_conditions.filterpy_column import EQUALITY_TOLERANCE, track_comparison, verdict_counts
from experiments.running.study import StudyResult
from faults.conditions import CONDITIONS
from plant.eha.drives import sine
from plant.eha.model import EhaParameters
from plant.eha.simulate import LUMPED, simulate
from plant.sensors.sensors import BENCH

P = EhaParameters()


def test_filterpy_gives_the_same_estimates_as_our_filter_in_nine_conditions(study: StudyResult) -> None:
    table = study.tables["filterpy"]
    assert len(table) == 3 * len(CONDITIONS)
    assert (table["steps"] == 99).all()
    assert (table["verdict"] == "equal").all(), table[table["verdict"] != "equal"]
    assert (table["largest_difference"] <= EQUALITY_TOLERANCE).all()
    assert verdict_counts(table) == {"equal": 27, "differs": 0, "fails": 0}
    assert table["ours_pa"].nunique() == 27


def _filtered() -> Estimate:
    drive = sine(0.05, 1e-3, P.rated_speed, 4.0)
    record = simulate(LUMPED, drive, 1e-3, P, sensors=BENCH, rng=np.random.default_rng(2))
    model = FORMS["pressure"]
    return run_filter(METHODS["ekf"], model, first_belief(model, record, 2e8, 3e8), record, P)


def test_a_filter_that_fails_or_differs_gets_that_verdict() -> None:
    ours = _filtered()
    assert track_comparison(ours, ours)["verdict"] == "equal"
    column = ours.model.index(BULK_MODULUS)
    shifted = ours.mean.copy()
    shifted[30:, column] *= 1.0 + 3.0 * EQUALITY_TOLERANCE
    found = track_comparison(ours, replace(ours, mean=shifted))
    assert found["verdict"] == "differs"
    assert 2.9 * EQUALITY_TOLERANCE < float(str(found["largest_difference"])) < 3.1 * EQUALITY_TOLERANCE
    lost = ours.mean.copy()
    lost[30:, column] = np.nan
    assert track_comparison(ours, replace(ours, mean=lost))["verdict"] == "filterpy fails at 0.03 s"
    assert track_comparison(replace(ours, mean=lost), ours)["verdict"] == "ours fails"
