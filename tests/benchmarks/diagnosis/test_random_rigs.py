"""Tests of the figures and targets for a population of random rigs."""

from typing import Any

import pytest

from benchmarks.diagnosis import random_rigs
from benchmarks.diagnosis.random_rigs import main, print_figures, row_as_text

ROW: dict[str, Any] = {
    "seed": 7,
    "about": "normal; steps",
    "verdict": "right",
    "silent_class": False,
    "outcome": "ok",
    "flagged": False,
    "error": 0.01,
    "z": 1.0,
    "covered": True,
    "covered_total": True,
    "narrow": False,
    "seconds": 2.0,
    "said": ("normal", 0.97),
    "notes": ["end_stop"],
    "reasons": [],
    "failed": [],
}


def missed(rows: list[dict[str, Any]], *, wrong: bool = False) -> set[str]:
    return {check.what for check in print_figures(rows, wrong=wrong) if not check.met}


def test_the_line_of_a_rig_shows_verdict_error_coverage_and_time() -> None:
    assert row_as_text(ROW) == "7 right | ok error 1.00 %, z 1.0 ++ | 2.0 s | normal; steps | end_stop"
    wrong = row_as_text({**ROW, "verdict": "wrong", "flagged": True, "error": None})
    assert wrong.startswith("7 wrong (normal 97 %) | ok, flagged no number  | 2.0 s")


@pytest.mark.parametrize(
    ("changed", "what"),
    [
        ({"verdict": "wrong", "silent_class": True}, "sure of a wrong class"),
        ({"narrow": True}, "bulk modulus wrong without a word"),
        ({"verdict": "unknown"}, "unknown, %"),
        ({"covered_total": False}, "total intervals that cover, %"),
        ({"covered": False}, "intervals given the rig that cover, %"),
    ],
)
def test_each_kind_of_error_misses_its_own_target(changed: dict[str, Any], what: str) -> None:
    rows = [*[ROW] * 15, *[{**ROW, **changed}] * 4]
    assert missed([*[ROW] * 19, {**ROW, "covered": False}]) == set()
    assert what in missed(rows)


def test_intervals_based_on_a_wrong_rig_file_are_not_judged() -> None:
    rows = [{**ROW, "covered": False}] * 20
    assert missed(rows, wrong=True) == set()


def test_a_bulk_modulus_flagged_by_the_check_counts_as_not_estimated(capsys: pytest.CaptureFixture[str]) -> None:
    print_figures([ROW, {**ROW, "flagged": True, "error": 0.5, "covered_total": False}], wrong=False)
    assert "without a believed bulk modulus: 1 of 2" in capsys.readouterr().out


def test_logs_that_do_not_determine_the_bulk_modulus_are_counted(capsys: pytest.CaptureFixture[str]) -> None:
    untold = {**ROW, "outcome": "not_observable", "flagged": True, "error": None, "z": None, "covered": None}
    assert missed([untold] * 3) == set()
    assert "of these not determined by the log: 3 of 3" in capsys.readouterr().out


def test_every_seed_of_the_range_is_run_including_the_last(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[int, bool, bool]] = []

    def one(seed: int, *, wrong: bool, pressure: bool) -> dict[str, Any]:
        asked.append((seed, wrong, pressure))
        return {**ROW, "seed": seed}

    monkeypatch.setattr(random_rigs, "score_rig", one)
    main(["--seeds", "3:5", "--wrong", "--without-pressure"])
    assert asked == [(3, True, False), (4, True, False), (5, True, False)]
