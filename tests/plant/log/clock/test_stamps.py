from datetime import date

import numpy as np
import pytest

from plant.log.clock.stamps import is_stamp, read_stamps


def read(*cells: str) -> list[str]:
    return (
        read_stamps(cells, lambda row, cell: ValueError(f"{row} {cell}")).astype("datetime64[ms]").astype(str).tolist()
    )


@pytest.mark.parametrize(
    "cell",
    [
        "2026-03-01 12:00:00.250",
        "2026-03-01T12:00:00.250Z",
        "2026-03-01T14:00:00.250+02:00",
        "01.03.2026 12:00:00,250",
        "3/1/2026 12:00:00.250 PM",
        "2026/03/01 12:00:00.250",
        "1.3.26 12:00:00.25",
        "01-Mar-2026 12:00:00.250",
        "1 Mar 2026 12:00:00.25 PM",
        "1-Mar-26 12:00:00.25 PM",
        "20260301T120000.250",
        "20260301_120000_250",
        "1 March 2026 12:00:00.250",
        "01-MAR-2026 12:00:00.250",
        "1. März 2026 12:00:00,25",
        "01-Mrz-2026 12:00:00.250",
        "So, 1. Mär. 2026 12:00:00,25",
        "dim. 1 mars 2026 12:00:00,25",
        "1 de marzo de 2026 12:00:00,25",
        "Mar 01, 2026 12:00:00.250 PM",
        "01/Mar/2026:12:00:00.250 +0000",
        "dimanche 1er mars 2026 à 12:00:00,25",
        "1 mars 2026 à 12 h 00 min 00,25 s",
        "01.03.2026 à 12h00:00,250",
        "1 de marzo del 2026, 12:00:00.25 p. m.",
        "01-mar.-2026 a las 12:00:00,25",
        "domenica 1° marzo 2026 alle 12:00:00,25",
        "1 marzo 2026, 12:00:00,25",
        "1. März 2026 um 12:00:00,25 Uhr",
        "Sun Mar 1 12:00:00.250 2026",
        "Sun, 01 Mar 2026 12:00:00.25 +0000",
        "01.03.2026-12:00:00.250",
        "2026-060T12:00:00.250",
        "2026:060:12:00:00.250",
        "20260301T140000.250+0200",
    ],
)
def test_one_date_and_time_is_read_in_every_notation(cell: str) -> None:
    assert is_stamp(cell)
    assert read(cell) == ["2026-03-01T12:00:00.250"]


def test_a_first_number_above_12_shows_that_the_day_precedes_the_month() -> None:
    assert read("1/2/2026 0:00:00", "13/2/2026 0:00:00") == ["2026-02-01T00:00:00.000", "2026-02-13T00:00:00.000"]


@pytest.mark.parametrize(
    ("evening", "morning"),
    [("4/3/2026", "5/3/2026"), ("3/4/2026", "3/5/2026"), ("11/11/2026", "12/11/2026"), ("31/3/2026", "1/4/2026")],
)
def test_day_and_month_are_read_in_the_order_that_makes_consecutive_days(evening: str, morning: str) -> None:
    last, first = (np.datetime64(one) for one in read(f"{evening} 23:59:59.5", f"{morning} 00:00:00.5"))
    assert first - last == np.timedelta64(1, "s")


def test_a_day_of_the_year_without_the_year_counts_days() -> None:
    last, first = (np.datetime64(one) for one in read("060:23:59:59.5", "061:00:00:00.5"))
    assert first - last == np.timedelta64(1, "s")


def test_times_of_day_continue_past_midnight() -> None:
    assert read("23:59:59.9", "00:00:00.1") == ["1970-01-01T23:59:59.900", "1970-01-02T00:00:00.100"]


def test_the_end_of_summer_time_does_not_set_back_stamps_with_a_time_zone() -> None:
    before, after = read("2026-10-25T02:59:59+02:00", "2026-10-25T02:00:00+01:00")
    assert (np.datetime64(after) - np.datetime64(before)) == np.timedelta64(1, "s")


@pytest.mark.parametrize(
    "cell",
    [
        "2026-13-01 00:00:00",
        "9999-01-01 00:00:00",
        "25:00:00",
        "1:2:3:4",
        "2026-366T12:00:00",
        "9999-001T12:00:00",
        "x",
        "9" * 500,
    ],
)
def test_an_invalid_date_or_time_is_refused_with_its_row(cell: str) -> None:
    with pytest.raises(ValueError, match=r"^1 "):
        read("2026-01-01 00:00:00", cell)


def test_an_empty_cell_is_missing() -> None:
    assert read("2026-01-01 00:00:00", "")[1] == "NaT"


def test_minutes_and_seconds_without_hours_are_read() -> None:
    stamps = read_stamps(["01:02.5", "01:03.25", "02:00.0"], lambda row, cell: ValueError(f"{row} {cell}"))
    assert np.diff(stamps).astype("timedelta64[ms]").astype(int).tolist() == [750, 56_750]


@pytest.mark.parametrize(
    ("names", "month"),
    [
        ("Jänner janv. enero gennaio gen", 1),
        ("févr. fevrier Feb.", 2),
        ("avril abril", 4),
        ("Mai mayo maggio", 5),
        ("juin Juni junio giugno", 6),
        ("juil. Juli julio luglio", 7),
        ("août aout agosto", 8),
        ("septiembre setiembre \u017fept Sept.", 9),
        ("Oktober octubre ottobre", 10),
        ("Dezember déc. diciembre", 12),
    ],
)
def test_months_are_read_in_german_french_spanish_and_italian(names: str, month: int) -> None:
    stamps = read_stamps([f"1 {name} 2026 12:00:00" for name in names.split()], lambda _, text: ValueError(text))
    assert set(stamps.astype("M8[D]").tolist()) == {date(2026, month, 1)}


def test_days_that_have_elapsed_are_counted() -> None:
    assert read("0 days 00:00:00", "0 days 23:59:59.500000", "1 day, 0:00:00.5", "2 days +00:00:01") == [
        "1970-01-01T00:00:00.000",
        "1970-01-01T23:59:59.500",
        "1970-01-02T00:00:00.500",
        "1970-01-03T00:00:01.000",
    ]
    assert not is_stamp("2 pieces 00:00:01")


@pytest.mark.parametrize("apart", [":", "-", "/", " ", "T"])
def test_a_day_of_the_year_goes_on_in_the_next_one(apart: str) -> None:
    days = read(*(f"{day}{apart}{clock}" for day, clock in (("365", "23:59:59.5"), ("001", "00:00:00.5"))))
    assert [one[:19] for one in days] == ["1970-12-31T23:59:59", "1971-01-01T00:00:00"]
    leap = read(f"366{apart}23:59:59.5", f"001{apart}00:00:00.5", f"002{apart}00:00:00")
    assert [one[:10] for one in leap] == ["1971-01-01", "1971-01-02", "1971-01-03"]
    assert read(f"063{apart}23:59:59", f"062{apart}00:00:00")[1] == "1970-03-03T00:00:00.000"
