import numpy as np
import pandas as pd
import pytest

from experiments.batch.compare import compare_studies, in_sentences
from experiments.batch.pages import render_comparison
from plant.errors import HydrostateError


def study(seeds: int, error: float, method: str = "ekf", seed: int = 1, **changes: object) -> pd.DataFrame:
    """Return rows whose errors consist of a large part shared by seed, and a small part of their own."""
    rng, own = np.random.default_rng(7), np.random.default_rng(seed)
    shared = 5.0 + rng.standard_normal(seeds)
    rows = [
        {
            "plant": "lumped",
            "file": None,
            "drive": "sine",
            "sensors": "bench",
            "condition": condition,
            "seed": number,
            "duration_s": 1.0,
            "sample_time_s": 1e-3,
            "verb": "filter",
            "form": "pressure",
            "method": method,
            "pressure": True,
            "told": "condition",
            "start_pa": start,
            "start_std_pa": 3e8,
            "outcome": "ok",
            "found_condition": None,
            "error_percent": shared[number] + error + 0.1 * own.standard_normal(),
            **changes,
        }
        for condition in ("normal", "major_leakage")
        for number in range(seeds)
        for start in (0.0, 2e8)
    ]
    return pd.DataFrame(rows)


def overall(table: pd.DataFrame, measure: str = "error of bulk modulus") -> dict[str, object]:
    (row,) = table[(table["condition"] == "all") & (table["measure"] == measure)].to_dict("records")
    return {str(name): value for name, value in row.items()}


@pytest.mark.parametrize(("change", "verdict"), [(-0.3, "better"), (0.3, "worse")])
def test_a_small_change_is_detected_despite_noise_that_both_studies_share(change: float, verdict: str) -> None:
    row = overall(compare_studies(study(20, 0.0), study(20, change, seed=2)))
    assert row["verdict"] == verdict
    assert row["difference"] == pytest.approx(change, abs=0.05)
    assert (row["cases"], row["series"]) == (80, 40)


def test_equal_studies_are_rarely_called_different() -> None:
    verdicts = [
        overall(compare_studies(study(20, 0.0, seed=2 * number), study(20, 0.0, seed=2 * number + 1)))["verdict"]
        for number in range(15)
    ]
    assert sum(verdict != "no difference shown" for verdict in verdicts) <= 4  # 5 or more by chance: 1 in 1500


def test_repeated_first_guesses_on_the_same_noise_do_not_narrow_the_interval() -> None:
    first, second = study(20, 0.0), study(20, 0.0, seed=2)
    repeated = [pd.concat([frame.assign(start_pa=start) for start in (0.0, 1e8, 2e8)]) for frame in (first, second)]
    narrow, wide = (overall(compare_studies(*pair)) for pair in ((first, second), repeated))
    widths = [float(str(row["high"])) - float(str(row["low"])) for row in (narrow, wide)]
    assert widths[1] > 0.9 * widths[0]


def test_two_studies_with_one_method_each_are_compared_by_method() -> None:
    row = overall(compare_studies(study(6, 0.0), study(6, 1.0, "ukf")))
    assert (row["changed"], row["verdict"], row["cases"]) == ("method: ekf to ukf", "worse", 24)


def test_cases_without_an_answer_are_counted_and_not_averaged() -> None:
    table = compare_studies(study(6, 0.0), study(6, 0.0, outcome="diverged", error_percent=float("nan")))
    assert overall(table, "cases with an answer")["verdict"] == "worse"
    assert "error of bulk modulus" not in set(table["measure"])


def test_few_series_get_no_interval_and_no_verdict() -> None:
    row = overall(compare_studies(study(2, 0.0), study(2, 9.0)))
    assert (row["low"], row["verdict"]) == (None, "no difference shown")


def test_studies_without_a_case_in_common_are_an_error() -> None:
    with pytest.raises(HydrostateError, match="must have cases in common"):
        compare_studies(study(3, 0.0, condition="normal"), study(3, 0.0, condition="minor_friction"))


def test_the_sentence_about_few_series_gives_no_interval() -> None:
    few, many = (compare_studies(study(seeds, 0.0), study(seeds, -0.3, seed=2)) for seeds in (2, 20))
    for table, there in ((few, False), (many, True)):
        sentences = in_sentences(table, ("A", "B"))
        (about,) = [one for one in sentences if "error of bulk modulus" in one]
        assert ("95 % interval" in about) is there
        assert about.endswith("better" if there else "no difference shown")


def test_a_small_difference_is_not_shown_as_nought_beside_an_interval_of_noughts() -> None:
    """Before, the page showed "0.02, 0.02, 0.00, 0.00 to 0.00" for a difference of 0.0012 (0.0009 to 0.0032)."""
    row = {"verb": "filter", "measure": "error of bulk modulus", "condition": "all", "cases": 9, "series": 9}
    amounts = {"first": 0.0167, "second": 0.0179, "difference": 0.00119, "low": -0.00092, "high": 0.00323}
    table = pd.DataFrame([{**row, **amounts, "unit": "%", "changed": "", "verdict": "no difference shown"}])
    page = render_comparison(table, ("A", "B"))
    for shown in ("0.0167", "0.0179", "0.0012", "\N{MINUS SIGN}0.0009", "0.0032"):
        assert f'<td class="number">{shown}</td>' in page
