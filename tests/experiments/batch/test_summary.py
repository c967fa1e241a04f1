"""Tables of a study's rows: counts, and quantiles of errors that are calculated by hand here."""

import numpy as np
import pandas as pd
import pytest

from experiments.batch.figures import draw_classes
from experiments.batch.summary import NEAR_PERCENT, bulk_modulus_table

TRUTH = 2e8


def rows(errors: list[float | None], std: float = 1e6) -> pd.DataFrame:
    found = [None if one is None else TRUTH * (1.0 + one / 100.0) for one in errors]
    same = {"verb": "filter", "form": "pressure", "method": "ekf", "pressure": True, "told": "condition"}
    return pd.DataFrame(
        {
            **{name: [value] * len(errors) for name, value in same.items()},
            "plant": "lumped",
            "drive": "sine",
            "sensors": "bench",
            "condition": "normal",
            "true_bulk_modulus_pa": TRUTH,
            "bulk_modulus_pa": found,
            "bulk_modulus_std_pa": std,
            "error_percent": errors,
        }
    )


def test_errors_are_summarized_by_median_rms_and_shares_of_the_estimates() -> None:
    errors = [-2.0, -0.5, 0.0, 0.5, 6.0]
    (row,) = bulk_modulus_table(rows([*errors, None])).to_dict("records")
    assert (row["cases"], row["estimates"]) == (6, 5)
    assert row["median_percent"] == 0.0
    assert row["rms_percent"] == pytest.approx(np.sqrt(np.mean(np.square(errors))))
    assert row["near_percent"] == pytest.approx(100.0 * np.mean(np.abs(errors) <= NEAR_PERCENT))
    # a deviation of 1e6 Pa is 0.5 %, so errors up to 0.98 % are covered
    assert row["covered_percent"] == pytest.approx(60.0)


def test_a_method_without_any_estimate_has_counts_but_no_error_statistics() -> None:
    (row,) = bulk_modulus_table(rows([None, None])).to_dict("records")
    assert (row["cases"], row["estimates"]) == (2, 0)
    assert row["median_percent"] is None
    assert row["covered_percent"] is None


def test_every_class_has_a_bar_as_long_as_its_count() -> None:
    figure = draw_classes(pd.DataFrame({"class": ["normal", "major_leakage"], "logs": [7, 2]}))
    (axis,) = figure.axes
    lengths = {
        label.get_text(): bar.get_width() for label, bar in zip(axis.get_yticklabels(), axis.patches, strict=True)
    }
    assert sorted(lengths.values()) == [2.0, 7.0]
    assert {text.get_text() for text in axis.texts} >= {"7", "2"}
