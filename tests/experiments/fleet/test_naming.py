"""Actuator and date of a log, from file names or from a table."""

import unicodedata
from pathlib import Path

import pytest

from experiments.fleet.naming import UNNAMED, ActuatorAndDate, by_dates, by_pattern, by_table, place_of
from plant.errors import HydrostateError


@pytest.mark.parametrize(
    ("pattern", "file", "actuator", "date"),
    [
        ("{actuator}_{date}.csv", "hall/P-12_2026-11-22.csv", "P-12", "2026-11-22"),
        ("{actuator}/{date}.csv", "hall/P-12/20261122.csv", "P-12", "20261122"),
        ("{actuator}_{date}*", "P_1_812.5_steps.csv", "P_1", "812.5"),
        ("run-{date}-{actuator}.csv", "run-7-B3.csv", "B3", "7"),
        ("{actuator}.csv", "hall\\P-12.csv", "P-12", ""),
        ("{actuator}_{date}.csv", "P_12_20261122_143000.csv", "P_12", "20261122_143000"),
        ("{actuator}_{date}*", "P-12_2026-11-22_14-30_steps.csv", "P-12", "2026-11-22_14-30"),
    ],
)
def test_a_pattern_reads_file_names(pattern: str, file: str, actuator: str, date: str) -> None:
    found = by_pattern([file], pattern)[file]
    assert (found.actuator, found.date) == (actuator, date)


@pytest.mark.parametrize("pattern", [None, "{actuator}_{date}.csv", "{actuator}/*{date}.csv"])
def test_actuators_of_one_name_in_two_folders_are_two_if_their_logs_are_of_the_same_time(pattern: str | None) -> None:
    """Before, they were one: a sick one was hidden behind the last log of a sound one."""
    middle = "P-12/log" if pattern is not None and "/" in pattern else "P-12"
    sites = [f"site {site}/{middle}_2026-11-{day}.csv" for day in (21, 22) for site in "AB"]
    months = [f"2026-{month}/{middle}_2026-{month}-{day}.csv" for month in (10, 11) for day in (21, 22)]
    apart, together = (by_dates(files) if pattern is None else by_pattern(files, pattern) for files in (sites, months))
    assert [apart[file].actuator for file in sites] == ["site A/P-12", "site B/P-12"] * 2
    assert {one.actuator for one in together.values()} == {"P-12"}


def test_logs_of_one_folder_keep_the_name_of_their_actuator() -> None:
    found = by_pattern(["P-1_1.csv", "P-1_2.csv", "A/P-1_1.csv", "A/P-2_1.csv"], "{actuator}_{date}.csv")
    assert [one.actuator for one in found.values()] == ["P-1", "P-1", "A/P-1", "P-2"]


@pytest.mark.parametrize(
    ("stamp", "hours"),
    [
        ("2026-03-29T06-30-00+0200", 4.5),
        ("20260329T063000Z", 6.5),
        ("20260329_063000.500-0330", 10.0 + 0.5 / 3600.0),
        ("2026-03-29T06:30+05:45", 0.75),
        ("2026-03-29_06-30-00.1234", 6.5 + 0.1234 / 3600.0),
    ],
)
def test_a_zone_and_a_fraction_of_a_second_belong_to_the_date_not_to_the_actuator(stamp: str, hours: float) -> None:
    """Before, an actuator fell in two when summer time began, and each log with milliseconds was an actuator."""
    files = [f"P-12_{stamp}.csv", "P-12_20260101.csv"]
    for found in (by_dates(files), by_pattern(files, "{actuator}_{date}.csv")):
        assert [found[file].actuator for file in files] == ["P-12", "P-12"]
        assert found[files[0]].place == pytest.approx(place_of("2026-03-29", "log") + hours / 24.0, abs=1e-7)
        assert found[files[0]].shown == "2026-03-29 06:30"


def test_a_file_that_does_not_match_has_no_name() -> None:
    assert by_pattern(["notes.txt"], "{actuator}_{date}.csv") == {"notes.txt": UNNAMED}


@pytest.mark.parametrize("pattern", ["{date}.csv", "{actuator}{actuator}.csv", "{actuator}_{serial}.csv", "x.csv"])
def test_a_pattern_that_cannot_be_used_is_refused(pattern: str) -> None:
    with pytest.raises(HydrostateError, match=r"--pattern must hold \{actuator\} once"):
        by_pattern(["a.csv"], pattern)


def test_a_later_date_has_a_larger_place_in_every_date_format() -> None:
    places = [
        place_of(date, "log") for date in ("20261121", "2026-11-22", "2026-11-22T12:00", "2026-11-22T14:00+01:00")
    ]
    assert places == sorted(places)
    assert place_of("2026-11-23", "log") - place_of("20261122", "log") == 1.0
    assert (
        place_of("20261122_180000", "log") == place_of("2026-11-22_18-00", "log") == place_of("20261122", "log") + 0.75
    )


def test_a_date_is_shown_in_iso_form_and_another_number_unchanged() -> None:
    named = [ActuatorAndDate("P-1", date, place_of(date, "log")) for date in ("20261122_143000", "2026-11-22", "812.5")]
    assert [one.shown for one in named] == ["2026-11-22 14:30", "2026-11-22", "812.5"]
    assert [one.day for one in named] == ["2026-11-22", "2026-11-22", "812.5"]
    assert [one.has_calendar_date for one in named] == [True, True, False]


@pytest.mark.parametrize(
    ("files", "actuators"),
    [
        (["A-2026-11-21.csv", "A-2026-11-22.csv", "B-2026-11-22.csv"], ["A", "A", "B"]),
        (["hall/20261122_0800_P-12.csv.gz", "hall/20261122_0900_P-12.csv.gz"], ["P-12", "P-12"]),
        (["P-7/log 2026-11-21.csv", "P-7/2026.11.22.csv", "P-8/log 2026-11-22.csv"], ["P-7", "P-7", "P-8"]),
        (["log_20261121.csv", "log_20261122.csv"], ["press 4", "press 4"]),
        (["P-7_08.05.2026.csv", "P-7_01.06.2026_14-30-00.csv"], ["P-7", "P-7"]),
        (["A_20261121.csv", "A_20261122.csv", "A_20261123.csv", "A_20261124.csv", "notes.csv"], ["A"] * 4 + [""]),
    ],
)
def test_file_names_with_one_date_each_give_the_actuator(files: list[str], actuators: list[str]) -> None:
    found = by_dates(files, "press 4")
    assert [found[file].actuator for file in files] == actuators
    assert all(found[file].place is not None for file in files if found[file].actuator)


@pytest.mark.parametrize(
    "files",
    [
        ["run1_20261122.csv", "run2_20261122.csv"],  # nothing shows that both are of one actuator
        ["A_20261322.csv", "A_20261323.csv"],
        ["serial 120261122.csv", "serial 120261123.csv"],
        ["A_20261122-20261123.csv", "A_20261124-20261125.csv"],
        ["log_20261121.csv", "log_20261122.csv"],
        [],
    ],
)
def test_file_names_that_do_not_group_logs_by_date_give_no_actuator(files: list[str]) -> None:
    assert by_dates(files) == {}


def test_logs_without_a_date_separate_no_others() -> None:
    dated = ["A_20261122.csv", "A_20261123.csv"]
    found = by_dates([*dated, *(f"notes {place}.csv" for place in range(20))])
    assert [found[file].actuator for file in dated] == ["A", "A"]
    assert {one.actuator for file, one in found.items() if file not in dated} == {""}


def test_an_invalid_date_excludes_only_its_own_log() -> None:
    found = by_pattern(["P_2026-13-45.csv", "P_2026-11-22.csv"], "{actuator}_{date}.csv")
    assert found["P_2026-11-22.csv"].actuator == "P"
    assert found["P_2026-13-45.csv"].actuator == ""
    assert found["P_2026-13-45.csv"].problem.startswith("its name: date must be ISO 8601")


def test_file_names_without_any_readable_date_are_refused_by_the_file(tmp_path: Path) -> None:
    with pytest.raises(HydrostateError, match=r"P_22-11-2026.csv: its name: date must be ISO 8601"):
        by_pattern(["P_22-11-2026.csv", "notes.txt"], "{actuator}_{date}.csv")
    table = tmp_path / "names.csv"
    table.write_text("file,actuator,date\na.csv,P-1,22 Nov\n", encoding="utf-8")
    with pytest.raises(HydrostateError, match=r"a.csv: names.csv: date must be ISO 8601"):
        by_table([], table)


def test_a_table_of_names_lists_files_by_path_or_by_file_name(tmp_path: Path) -> None:
    table = tmp_path / "names.csv"
    table.write_text("\ufefffile,actuator,date\na.csv,P-1,2026-11-22\nhall/b.csv,P-2,\n", encoding="utf-8")
    found = by_table(["x/a.csv", "hall/b.csv", "c.csv"], table)
    assert [found[one].actuator for one in found] == ["P-1", "P-2", ""]
    assert found["hall/b.csv"].place is None


def test_a_table_without_the_needed_columns_is_refused_with_a_list_of_its_columns(tmp_path: Path) -> None:
    table = tmp_path / "names.csv"
    table.write_text("log,actuator\n", encoding="utf-8")
    with pytest.raises(HydrostateError, match="must have a column 'file', it has log, actuator"):
        by_table([], table)
    with pytest.raises(HydrostateError, match="must be a CSV table"):
        by_table([], tmp_path / "absent.csv")


def test_dates_with_dots_have_the_day_first() -> None:
    found = by_pattern(["P_02.11.2026.csv", "P_2026-11-03.csv"], "{actuator}_{date}.csv")
    first, second = found.values()
    assert (first.date, first.day, second.place) == ("2026-11-02", "2026-11-02", (first.place or 0.0) + 1.0)


def test_a_date_years_away_from_the_others_excludes_its_log() -> None:
    files = [f"P_2026-11-{day}.csv" for day in range(10, 22)]
    wrong = ["P_1970-01-01.csv"]
    found = by_pattern([*files, *wrong], "{actuator}_{date}.csv")
    assert {found[file].actuator for file in files} == {"P"}
    assert (found[wrong[0]].actuator, found[wrong[0]].place) == ("", None)
    assert "its date 1970-01-01 is years away" in found[wrong[0]].problem
    late = by_pattern([*files, "P_2062-11-01.csv"], "{actuator}_{date}.csv")["P_2062-11-01.csv"]
    assert "its date 2062-11-01 is years away" in late.problem


def test_a_gap_of_ten_years_within_a_fleet_does_not_exclude_logs() -> None:
    files = [f"P_{year}-11-{day}.csv" for year in (2016, 2026) for day in range(10, 14)]
    assert {one.actuator for one in by_pattern(files, "{actuator}_{date}.csv").values()} == {"P"}


@pytest.mark.parametrize("pattern", [None, "{actuator}_{date}.csv"])
def test_actuators_named_in_other_alphabets_in_one_folder_stay_apart(pattern: str | None) -> None:
    """Before, a name without Latin letters and digits was none, and all of a folder were one actuator."""
    files = [f"logs/{name}_2026-01-0{day}.csv" for name in ("Αντλία", "Άξονας", "泵") for day in (1, 2)]
    found = by_dates(files) if pattern is None else by_pattern(files, pattern)
    assert [found[file].actuator for file in files] == ["Αντλία"] * 2 + ["Άξονας"] * 2 + ["泵"] * 2


def test_a_name_with_its_accent_apart_as_macos_writes_it_is_the_same_actuator(tmp_path: Path) -> None:
    together, apart = (unicodedata.normalize(form, "Αντλία-ή") for form in ("NFC", "NFD"))
    assert together != apart
    files = [f"{name}_2026-01-0{day}.csv" for name, day in ((together, 1), (apart, 2), (apart, 3))]
    assert {one.actuator for one in by_dates(files).values()} == {together}
    assert {one.actuator for one in by_pattern(files, f"{apart[:4]}{{actuator}}_{{date}}.csv").values()} == {
        together[4:]
    }
    table = tmp_path / "names.csv"
    table.write_text("file,actuator\n" + "".join(f"{together}_2026-01-0{day}.csv,{apart}\n" for day in (1, 2, 3)))
    assert {one.actuator for one in by_table(files, table).values()} == {together}


@pytest.mark.parametrize(
    ("file", "actuator", "day"),
    [
        ("P-12_22-Nov-2026.csv", "P-12", "2026-11-22"),
        ("P-12_22-Nov-2026 14-30-05.csv", "P-12", "2026-11-22"),
        ("P-12_5 january 2026.csv", "P-12", "2026-01-05"),
        ("2号泵_2026年1月5日.csv", "2号泵", "2026-01-05"),
        ("2号泵_2026年11月12日8时05分.csv", "2号泵", "2026-11-12"),
        ("펌프_2026년 1월 5일.csv", "펌프", "2026-01-05"),
    ],
)
def test_dates_with_the_name_of_a_month_or_with_signs_are_read(file: str, actuator: str, day: str) -> None:
    other = file.replace("2026", "2027")
    for found in (by_dates([file, other])[file], by_pattern([file], "{actuator}_{date}.csv")[file]):
        assert (found.actuator, found.day) == (actuator, day)
        assert found.has_calendar_date


def test_a_number_behind_a_hyphen_is_the_actuator_s_and_no_day_of_a_month() -> None:
    assert by_dates(["P-12-Nov-2026.csv", "P-13-Nov-2026.csv", "P-12-Dec-2026.csv"]) == {}
