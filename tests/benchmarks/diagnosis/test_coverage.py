import numpy as np
import pandas as pd
import pytest

from benchmarks.diagnosis.coverage import HEALTHY, RIG_SPREAD, SPREAD, Case, draw_log, quantity_rows, summarise
from benchmarks.diagnosis.coverage import main as coverage
from faults.conditions import CONDITIONS, parameters_for


def test_a_summary_line_gives_the_rms_z_and_the_coverage_of_the_intervals() -> None:
    z = [0.5, -0.5, 3.0, float("nan")]
    rows = pd.DataFrame([{"plant": "p", "form": "f", "rate": 1, "quantity": "q", "z": one, "refused": ""} for one in z])
    (line,) = summarise(rows).to_dict("records")
    assert line["logs"] == 4
    assert line["numbers"] == 3
    assert line["z"] == pytest.approx(np.sqrt(9.5 / 3.0))
    assert line["covered_%"] == pytest.approx(200.0 / 3.0)


@pytest.mark.parametrize("plant", ["lumped", "circuit"])
def test_the_rig_file_has_the_drawn_sizes_but_the_nominal_bulk_modulus_leakage_and_friction(plant: str) -> None:
    first, second = (draw_log(Case(plant, "severities", 1000, "steps", "minor_friction", seed)) for seed in (0, 1))
    assert first.rig.piston_area == first.true.piston_area != second.rig.piston_area
    for name in ("piston_area", "pump_displacement", "chamber_volume", "moving_mass"):
        assert getattr(first.true, name) / getattr(HEALTHY, name) == pytest.approx(1.0, abs=RIG_SPREAD)
    assert first.rig.bulk_modulus == HEALTHY.bulk_modulus != first.true.bulk_modulus != second.true.bulk_modulus
    nominal = parameters_for(CONDITIONS["minor_friction"], first.rig)
    for name in ("leakage_coefficient", "flow_bias", "friction_quadratic", "friction_coulomb", "bulk_modulus"):
        ratio = getattr(first.true, name) / getattr(nominal, name)
        assert ratio != 1.0
        assert ratio == pytest.approx(1.0, abs=SPREAD)


@pytest.mark.slow
def test_estimated_severities_are_within_five_standard_deviations_of_the_truth() -> None:
    rows = quantity_rows(Case("circuit", "severities", 1000, "steps", "minor_leakage", 0))
    assert {row["quantity"] for row in rows} >= {"bulk_modulus", "leakage_flow", "added_friction"}
    assert all(abs(float(str(row["z"]))) < 5.0 for row in rows)


@pytest.mark.slow
def test_lines_with_a_z_outside_the_wanted_range_are_counted(capsys: pytest.CaptureFixture[str]) -> None:
    missed = coverage(["--seeds", "1", "--rates", "1000", "--plants", "circuit"])
    assert f"0.8 to 1.3: {missed}" in capsys.readouterr().out
