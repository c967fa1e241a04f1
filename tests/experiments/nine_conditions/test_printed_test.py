"""Tables 5 and 6 on circuits: section 4's experiment exactly as printed, and errors if the plant is not the model."""

from dataclasses import replace

import pandas as pd
import pytest

from estimation.finding import NORMAL_95
from experiments.nine_conditions.printed_test import printed_test
from experiments.nine_conditions.settings import StudySettings
from experiments.nine_conditions.transfer_functions import COEFFICIENTS
from experiments.nine_conditions.validation_on_circuit import validation_on_circuit
from experiments.page.frames import cell
from experiments.published import load
from experiments.published.library import read_library
from faults.conditions import CONDITIONS
from plant.eha.model import EhaParameters

RIG = EhaParameters()

# the printed experiment filters only the output, and that raises a warning
pytestmark = pytest.mark.filterwarnings("ignore::plant.errors.LogWarning")


@pytest.fixture(scope="module")
def table() -> pd.DataFrame:
    return printed_test(RIG, 1, 4.0).set_index("condition")


def test_printed_coefficients_far_outside_their_interval_are_not_counted_as_covered(table: pd.DataFrame) -> None:
    printed = load("transfer_functions").set_index("condition")
    for name in CONDITIONS:
        far = sum(
            abs(cell(table, name, key) - cell(printed, name, key))
            > (NORMAL_95 + 1.0) * cell(table, name, f"{key}_std") + 1e-3
            for key in COEFFICIENTS
        )
        assert 0 <= cell(table, name, "held") <= len(COEFFICIENTS) - far


def test_more_leakage_lowers_the_gain_that_the_printed_test_finds(table: pd.DataFrame) -> None:
    gains = [cell(table, name, "dc_gain") for name in ("normal", "minor_leakage", "major_leakage")]
    assert gains == sorted(gains, reverse=True)


def test_on_circuits_the_mathematical_model_has_the_smaller_error_in_most_conditions() -> None:
    settings = replace(StudySettings(seed=3), seeds=2)
    found = validation_on_circuit(RIG, read_library(), settings).set_index("condition")
    assert (found["circuits"] == 2).all()
    assert found["rmse_mathematical_m_s"].max() > 1.5 * found["rmse_mathematical_m_s"].min()
    assert (found["rmse_mathematical_m_s"] < found["rmse_transfer_function_m_s"]).sum() >= 7
    assert (found["least_mathematical_m_s"] <= found["rmse_mathematical_m_s"]).all()
