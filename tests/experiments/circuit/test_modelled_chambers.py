"""Figure 11 on the circuit by the filter with two modelled chambers, as its page shows it."""

import pandas as pd
import pytest

from experiments.circuit.modelled_chambers import modelled_chambers
from experiments.papers.eha_claims import _modelled_chambers
from plant.eha.circuit_parameters import CircuitParameters


def test_bulk_modulus_under_an_unknown_condition_is_within_1_percent_and_passes_the_gate() -> None:
    found = modelled_chambers(CircuitParameters(), 3, 5.0, ("major_leakage",))
    assert found["condition"].tolist() == ["major_leakage"]
    assert (found["error_percent"].abs() < 1.0).all()
    assert found["gate_passed"].all()
    assert (
        found["error_percent"] / 100.0 * CircuitParameters().bulk_modulus / found["std_pa"]
    ).tolist() == pytest.approx(found["z"].tolist())


def test_a_missing_estimate_leaves_the_worst_error_without_a_value() -> None:
    table = pd.DataFrame({"error_percent": [0.1, float("nan")], "z": [0.5, float("nan")], "gate_passed": [True, False]})
    ours = _modelled_chambers(table)["chambers_worst"].value
    assert ours != ours
