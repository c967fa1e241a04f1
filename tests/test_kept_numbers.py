"""Kept numbers: a number that moved is reported, but a rounding difference between processors is not."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests import numbers
from tests.numbers import Found, Numbers, Roughly

TOLD: Mapping[str, Any] = {
    "pressure [Pa]": 2.0e6,
    "flows [m^3/s]": np.array([1e-5, -2e-5, 0.0]),
    "modulus [Pa]": Found(2e8, 1e6),
    "points": Roughly(200, 0.1),
    "alarm": True,
    "count": 3,
    "condition": "normal",
    "nothing known": Found(5.0, np.inf),
    "not a number": Found(np.nan, 1.0),
    "none": None,
}


def moved(folder: Path, **changes: Any) -> list[str]:
    """Keep `TOLD`, and return what is reported after some entries change; ``_`` in their names stands for a blank."""
    now = dict(TOLD)
    kept = Numbers(str(folder / "test_numbers.py"))
    kept.case()(_told(now))
    kept.write()
    now |= {
        next(name for name in now if name.startswith(key.replace("_", " "))): value for key, value in changes.items()
    }
    return kept.moved("told")


def _told(now: Mapping[str, Any]) -> Any:
    def told() -> Mapping[str, Any]:
        return now

    return told


@pytest.mark.parametrize(
    "change",
    [
        {"pressure": 2.0e6 * (1.0 + 0.9e-6)},
        {"flows": np.array([1e-5, -2e-5, 1e-17])},
        {"modulus": Found(2.00025e8, 1.009e6)},
        {"points": Roughly(215, 0.1)},
        {"nothing_known": Found(9.0, np.inf)},
        {"not_a": Found(np.nan, 1.0)},
    ],
)
def test_rounding_differences_between_processors_are_not_reported_as_moved(
    tmp_path: Path, change: Mapping[str, Any]
) -> None:
    assert moved(tmp_path, **change) == []


@pytest.mark.parametrize(
    "change",
    [
        {"pressure": 2.0e6 * (1.0 + 1.1e-6)},
        {"pressure": np.nan},
        {"pressure": None},
        {"flows": np.array([1e-5, -2e-5, 1e-16])},
        {"flows": np.array([1e-5, -2e-5])},
        {"modulus": Found(2.00035e8, 1e6)},
        {"modulus": Found(2e8, 1.011e6)},
        {"points": Roughly(225, 0.1)},
        {"alarm": False},
        {"alarm": 1},
        {"count": 4},
        {"condition": "minor_leakage"},
        {"nothing_known": Found(5.0, 1.0)},
        {"not_a": Found(5.0, 1.0)},
        {"none": 0},
    ],
)
def test_a_number_that_moved_is_reported_once_by_its_name(tmp_path: Path, change: Mapping[str, Any]) -> None:
    (line,) = moved(tmp_path, **change)
    assert line.startswith(f"told: {next(iter(change)).replace('_', ' ')}")
    assert "->" in line


def test_an_added_or_removed_number_is_reported(tmp_path: Path) -> None:
    kept = Numbers(str(tmp_path / "test_numbers.py"))
    now: dict[str, Any] = {"a": 1.0}
    kept.case()(_told(now))
    kept.write()
    now["b"] = now.pop("a")
    assert kept.moved("told") == ["told: a: 1.0 -> 'nothing'", "told: b: 'nothing' -> 1.0"]
    with pytest.raises(AssertionError, match="python -m tests"):
        kept.check("told")


def test_the_file_of_kept_numbers_has_one_line_for_each_number(tmp_path: Path) -> None:
    kept = Numbers(str(tmp_path / "test_numbers_flow.py"))
    kept.case()(_told(TOLD))
    kept.write()
    lines = (tmp_path / "numbers_flow.json").read_text("utf-8").splitlines()
    assert '    "flows [m^3/s]": [1e-05, -2e-05, 0.0],' in lines
    assert len(lines) == len(TOLD) + 4


def test_the_command_reports_that_nothing_moved_and_refuses_a_path_without_kept_numbers(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert numbers.main(["tests/plant/components"]) == 0
    assert capsys.readouterr().out == "nothing moved\n"
    assert len(numbers.modules(["tests"])) >= 14
    with pytest.raises(SystemExit):
        numbers.main(["tests/plant/components", "estimation/trust"])
    assert "no numbers are kept under estimation/trust" in capsys.readouterr().err


def test_the_kept_cases_are_exactly_the_cases_of_the_code() -> None:
    for kept in numbers.modules(["tests"]):
        assert set(kept.kept()) == set(kept.cases), kept.file
