"""An inspection reports what a log holds: numbers, dates and text, and the clock of its rows."""

import numpy as np
import pytest

from plant.log.headings import Heading
from plant.log.inspection import ColumnFacts, clock_facts, inspect_table
from plant.log.table import table_of

STAMPS = np.datetime64("2026-03-01T12:00:00", "ns") + np.arange(6) * np.timedelta64(10, "ms")


def test_numbers_dates_and_text_are_told_apart() -> None:
    values = np.array([1.0, np.nan, 3.0, 2.0, np.inf, 0.0])
    stamps = STAMPS.copy()
    stamps[2] = np.datetime64("NaT")
    found = inspect_table(table_of("log", {"when": stamps, "way": values, "who": np.array(["a b"] * 6)}))
    assert found.rows == 6
    dated, number, text = found.columns
    assert (dated.heading.stamped, number.heading.stamped, text.heading.stamped) == (True, False, False)
    assert (dated.span, number.span, text.span) == (None, (0.0, 3.0), None)
    assert (dated.missing, number.missing, text.missing) == (1, 2, 0)
    assert sorted(found.numbers) == [0, 1]


def test_a_table_of_text_has_no_rows_of_numbers() -> None:
    found = inspect_table(table_of("log", {"who": np.array(["a", "b"])}))
    assert (found.rows, found.numbers) == (0, {})
    assert inspect_table(table_of("log", {})).columns == ()


def test_a_column_without_a_number_has_no_span() -> None:
    assert ColumnFacts(Heading("way"), np.full(3, np.nan)).span is None


def test_the_time_step_and_duration_of_dates_are_in_seconds() -> None:
    facts = clock_facts(np.insert(STAMPS, 3, np.datetime64("NaT")))
    assert facts is not None
    assert (facts.step, facts.duration) == (pytest.approx(0.01), pytest.approx(0.05))


def test_repeats_and_steps_back_are_counted() -> None:
    facts = clock_facts(np.array([0.0, 1.0, 1.0, 2.0, 1.5, 2.5, 3.5, 9.5]))
    assert facts is not None
    assert (facts.repeats, facts.backward, facts.gaps) == (1, 1, 1)


@pytest.mark.parametrize(
    "stamps",
    [
        np.array([0.0, 1.0, np.nan]),
        np.array([2.0, 1.0, 0.0]),
        np.array([-1.7e308, 1.7e308, 1.7e308]),
        np.full(4, np.datetime64("NaT", "ns")),
    ],
    ids=["two", "backward", "no finite step", "no date"],
)
def test_an_invalid_clock_has_no_facts(stamps: np.ndarray) -> None:
    assert clock_facts(stamps) is None


def test_excel_day_numbers_are_recognised_by_their_size_and_even_steps() -> None:
    days = 46082.5 + 1e-3 * np.arange(50) / 86400.0
    speeds = 46082.5 + np.sin(np.arange(50.0))
    facts = inspect_table(table_of("log.csv", {"Time": days, "speed": speeds}))
    assert [one.heading.unit for one in facts.columns] == ["d", None]
