"""Quantities on a terminal, with enough digits to distinguish the ends of an interval."""

from typing import Any

import pytest
from rich.console import Console

from experiments.log_pages.screens import MOST_REASONS, message_in_lines, messages_shown, quantities_shown


def shown(said: dict[str, Any] | None = None, **entry: Any) -> str:
    result = {
        "file": "run.csv",
        "plant": "a",
        "quantities": {"spring_stiffness": {"unit": "N/m", **entry}},
        "outcome": "ok",
        "message": "said",
        **(said or {}),
    }
    console = Console(width=200)
    with console.capture() as caught:
        for one in quantities_shown([result], {}):
            console.print(one)
    return caught.get()


@pytest.mark.parametrize(
    ("value", "ends", "words"),
    [
        (1e4, [9999.3, 10000.7], ["10000", "9999.3 to 10000.7"]),
        (2e-12, [1.5e-12, 2.5e-12], ["2e-12", "1.5e-12 to 2.5e-12"]),
        (-5.0, [-5.00002, -4.99998], ["-5", "-5.00002 to -4.99998"]),
        (3.0, [3.0, 3.0], ["3", "3 to 3"]),
        (None, None, ["-"]),
    ],
)
def test_interval_ends_have_enough_digits_to_differ(
    value: float | None, ends: list[float] | None, words: list[str]
) -> None:
    found = shown(value=value, ci95=ends)
    assert all(word in found.replace("  ", " ") for word in words)
    assert "with rig error" not in found


def test_the_interval_with_rig_error_has_its_own_column() -> None:
    found = shown(value=1e4, ci95=[9999.3, 10000.7], ci95_total=[9000.0, 11000.0])
    assert "with rig error" in found
    assert "9000 to 11000" in found


def test_a_diagnosis_is_shown_with_its_probability_and_the_next_step() -> None:
    said = {
        "condition": "leaking",
        "probabilities": {"normal": 0.127, "leaking": 0.873},
        "advice": ["look at the seal"],
    }
    found = shown(said, value=1e4, ci95=None)
    assert "run.csv: ok: said, probability 87.3 %" in found
    assert "run.csv: next: look at the seal" in found
    assert "probability" not in shown({**said, "condition": None}, value=1e4, ci95=None)


def test_fractions_are_shown_in_percent_and_pressures_in_mpa() -> None:
    entries = {
        "air_fraction": {"value": 0.049, "ci95": [0.0489, 0.0491], "unit": "1"},
        "bulk_modulus": {"value": 2.07e8, "ci95": [2.06e8, 2.08e8], "unit": "Pa"},
    }
    lines = shown({"quantities": entries}).splitlines()
    air, oil = (next(line.split() for line in lines if name in line) for name in ("air", "bulk"))
    assert air == ["air", "fraction", "4.9", "4.89", "to", "4.91", "%"]
    assert oil == ["bulk", "modulus", "207", "206", "to", "208", "MPa"]


def test_a_file_name_with_a_line_break_is_shown_on_one_line() -> None:
    (line,) = messages_shown([{"file": "a\nb: no fault.csv", "message": "said", "advice": []}])
    assert line == "a\\x0ab: no fault.csv: said"


def test_each_reason_has_one_line_and_reasons_beyond_the_maximum_are_counted() -> None:
    many = [f"reason {number}" for number in range(MOST_REASONS + 2)]
    told = {"message": "; ".join(["no value", *many, "nothing else"]), "gate": {"reasons": many}, "reasons": many[:1]}
    first, *lines = message_in_lines(told, "run.csv").splitlines()
    assert first == "run.csv: no value; nothing else"
    assert [line.removeprefix("  reasons ").strip() for line in lines] == [
        *many[:MOST_REASONS],
        "and 2 more, see --json",
    ]


def test_a_message_with_one_reason_alone_is_one_line() -> None:
    alone = {"message": "the sign is wrong", "gate": {"reasons": ["the sign is wrong."]}}
    assert message_in_lines(alone, "run.csv") == "run.csv: the sign is wrong"
    both = {"message": "the sign is wrong; it lags", "gate": {"reasons": ["the sign is wrong", "it lags"]}}
    assert message_in_lines(both, "run.csv").splitlines()[0] == "run.csv: no result"
