import numpy as np
import pandas as pd
import pytest

from benchmarks.coverage import Case, asked, summarised
from benchmarks.coverage import main as coverage


def test_a_line_tells_how_wide_intervals_are_and_how_often_they_cover() -> None:
    z = [0.5, -0.5, 3.0, float("nan")]
    rows = pd.DataFrame([{"plant": "p", "form": "f", "rate": 1, "quantity": "q", "z": one, "refused": ""} for one in z])
    (line,) = summarised(rows).to_dict("records")
    assert line["logs"] == 4
    assert line["numbers"] == 3
    assert line["z"] == pytest.approx(np.sqrt(9.5 / 3.0))
    assert line["covered_%"] == pytest.approx(200.0 / 3.0)


def test_severities_of_a_log_stand_beside_their_truth() -> None:
    rows = asked(Case("circuit", "severities", 1000, "steps", "minor_leakage", 0))
    assert {row["quantity"] for row in rows} >= {"bulk_modulus", "leakage_flow", "added_friction"}
    assert all(abs(float(str(row["z"]))) < 5.0 for row in rows)


@pytest.mark.slow
def test_lines_outside_what_is_wanted_are_counted(capsys: pytest.CaptureFixture[str]) -> None:
    missed = coverage(["--seeds", "1", "--rates", "1000", "--plants", "circuit"])
    assert f"0.8 to 1.3: {missed}" in capsys.readouterr().out
