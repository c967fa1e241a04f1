from collections.abc import Iterator

import numpy as np
import pytest

from plant.errors import LogError, LogWarning
from plant.log.lost_values import IN_A_ROW
from plant.log.stream.csv_rows import CsvStream

HEADER = "time_ms,motor_speed_rpm,position_mm\n"


def _rows(count: int, start: int = 0) -> list[str]:
    return [f"{k},{60 * k},{k}\n" for k in range(start, start + count)]


def _taken(lines: list[str], most: int = 10) -> list[tuple[float, np.ndarray, bool]]:
    return list(CsvStream(lines, source="bench").samples(most))


def test_rows_become_si_samples_on_their_clock() -> None:
    stream = CsvStream([HEADER, *_rows(100)], source="bench")
    pieces = list(stream.samples(30))
    assert stream.channels == ("motor_speed_rad_s", "position_m")
    assert stream.sample_time == pytest.approx(1e-3)
    assert [len(piece) for _, piece, _ in pieces] == [30, 30, 30, 10]
    everything = np.concatenate([piece for _, piece, _ in pieces])
    np.testing.assert_allclose(everything[:, 0], 2.0 * np.pi * np.arange(100))
    np.testing.assert_allclose(everything[:, 1], 1e-3 * np.arange(100))
    assert pieces[-1][0] == pytest.approx(0.099)


def test_samples_come_before_the_stream_ends() -> None:
    def endless() -> Iterator[str]:
        yield HEADER
        k = 0
        while True:
            yield f"{k},1,2\n"
            k += 1

    _, first, _ = next(CsvStream(endless(), source="bench").samples(5))
    assert len(first) == 5


def test_a_short_gap_is_filled_with_missing_samples_and_a_long_one_is_reported() -> None:
    short = _taken([HEADER, *_rows(60), *_rows(40, start=65)], most=1000)
    ((_, samples, gap),) = short
    assert not gap
    assert np.flatnonzero(np.isnan(samples[:, 0])).tolist() == [60, 61, 62, 63, 64]
    before, after = _taken([HEADER, *_rows(60), *_rows(40, start=5000)], most=1000)
    assert (len(before[1]), before[2], len(after[1]), after[2]) == (60, False, 40, True)


def test_empty_cells_are_missing_samples() -> None:
    ((_, samples, _),) = _taken([HEADER, "0,,1\n", "1,NaN,1\n", "2,60,1\n"])
    assert np.isnan(samples[:, 0]).tolist() == [True, True, False]


def test_semicolons_and_decimal_commas_are_read() -> None:
    ((_, samples, _),) = _taken(["time_s;motor_speed_rad_s;position_m\n", "0,0;1,5;2\n", "0,1;1,5;2\n"])
    np.testing.assert_allclose(samples, [[1.5, 2.0], [1.5, 2.0]])


def test_a_row_that_is_still_being_written_is_left_out() -> None:
    stream = CsvStream([HEADER, *_rows(60), "60,1"], source="bench")
    assert sum(len(piece) for _, piece, _ in stream.samples(10)) == 60
    assert stream.cut


GARBAGE = [
    ("100,abc,1\n", "column 'motor_speed_rpm' must hold numbers, got 'abc' in row 101"),
    ("100,inf,1\n", "column 'motor_speed_rpm' must hold numbers, got 'inf' in row 101"),
    (",1,1\n", "column 'time_ms' must hold numbers, got 'an empty cell' in row 101"),
    ("100,1\n", "every row must have 3 cells as the header has, got 2 in row 101"),
    ("50,1,1\n", "time_s must increase from row to row, got 0.05 s after 0.099 s in row 101"),
    (HEADER, "column 'time_ms' must hold numbers, got 'time_ms' in row 101"),
]


@pytest.mark.parametrize(("row", "said"), GARBAGE)
def test_a_row_of_garbage_is_left_out_and_the_stream_goes_on(row: str, said: str) -> None:
    stream = CsvStream([HEADER, *_rows(100), row, *_rows(100, 101)], source="bench")
    ((time, samples, gap),) = stream.samples(1000)
    speed = samples[:, 0] / (2.0 * np.pi)
    assert (len(samples), time, gap) == (201, pytest.approx(0.2), False)
    assert np.isnan(speed[100])
    np.testing.assert_allclose(np.delete(speed, 100), np.delete(np.arange(201.0), 100))
    assert stream.left_out == 1
    assert stream.first_left_out.startswith(said)


@pytest.mark.parametrize("row", [row for row, _ in GARBAGE])
def test_a_stream_that_is_garbage_from_some_row_on_is_refused(row: str) -> None:
    lines = [HEADER, *_rows(20_000), *[row] * 60]
    with pytest.raises(LogError, match=r"bench: .* in row 200[2-5]\d"):
        _taken(lines, most=1000)


def test_a_stream_with_two_rows_of_garbage_in_a_hundred_is_refused_in_the_end() -> None:
    lines = [HEADER, *("garbled\n" if k % 50 == 49 else row for k, row in enumerate(_rows(20_000)))]
    with pytest.raises(LogError, match="every row must have 3 cells as the header has, got 1 in row"):
        _taken(lines, most=1000)


def test_a_stream_with_one_row_of_garbage_in_two_hundred_goes_on() -> None:
    lines = [HEADER, *("garbled\n" if k % 200 == 199 else row for k, row in enumerate(_rows(20_000)))]
    stream = CsvStream(lines, source="bench")
    assert sum(len(piece) for _, piece, _ in stream.samples(1000)) == 19_999
    assert stream.left_out == 100


def test_a_time_that_lost_its_point_is_no_gap() -> None:
    lines = [HEADER, *_rows(100), "100000000,1,1\n", *_rows(100, 101)]
    stream = CsvStream(lines, source="bench")
    ((_, samples, gap),) = stream.samples(1000)
    assert (len(samples), gap, stream.left_out) == (201, False, 1)


@pytest.mark.parametrize("count", [1, 3])
def test_first_rows_whose_time_is_far_ahead_do_not_end_the_stream(count: int) -> None:
    ahead = [f"{5_000_000 + k},1,2\n" for k in range(count)]
    stream = CsvStream([HEADER, *ahead, *_rows(100)], source="bench")
    ((last, samples, gap),) = stream.samples(1000)
    assert (stream.start_time, stream.left_out, last, len(samples), gap) == (
        0.0,
        count,
        pytest.approx(0.099),
        100,
        False,
    )
    assert "5000 s in row 1 is ahead of later rows" in stream.first_left_out


def test_a_clock_that_runs_backwards_from_the_start_is_refused() -> None:
    with pytest.raises(LogError, match="must increase from row to row"):
        CsvStream([HEADER, *reversed(_rows(100))], source="bench")


def test_the_refusal_of_a_stream_of_garbage_counts_the_rows_received() -> None:
    with pytest.raises(LogError, match=r"at least two rows .* got 0, and 3 that were garbage; every row must"):
        CsvStream([HEADER, "a\n", "b\n", "c\n"], source="bench")


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        ([], "a header line is needed"),
        ([HEADER], "at least two rows are needed"),
        ([HEADER, "5,1,1\n", "5,1,1\n"], "time_s must increase"),
        (["motor_speed_rpm,position_mm\n", "1,1\n"], "a column time_s is needed"),
        (["time_furlong,position_mm\n", "1,1\n"], "cannot become time_s"),
    ],
)
def test_a_stream_without_a_header_two_rows_or_a_valid_time_is_refused(lines: list[str], said: str) -> None:
    with pytest.raises(LogError, match=said):
        _taken(lines)


def test_a_long_gap_right_after_a_piece_is_reported_with_the_next_piece() -> None:
    pieces = _taken([HEADER, *_rows(10), *_rows(5, 90_000)], most=10)
    assert [(len(piece), gap) for _, piece, gap in pieces] == [(10, False), (5, True)]


def test_blank_lines_and_quoted_cells_are_read() -> None:
    lines = [HEADER, *(f'{k},"{60 * k}",{k}\n' for k in range(12))]
    lines.insert(6, " \n")
    (time, samples, _), *more = _taken(lines, most=20)
    assert (time, more) == (pytest.approx(0.011), [])
    np.testing.assert_allclose(samples[:, 0], 2.0 * np.pi * np.arange(12))


def test_a_warning_names_an_unread_column_that_may_be_pressure() -> None:
    lines = ["time_ms,motor_speed_rpm,position_mm,Druck [bar]\n", *(f"{k},1,2,3\n" for k in range(5))]
    with pytest.warns(LogWarning, match=r"column 'Druck \[bar\]' was not used, but it may be differential_pressure_pa"):
        CsvStream(lines, source="bench")


def test_a_row_with_a_carriage_return_is_left_out_and_a_long_header_is_quoted_shortened() -> None:
    rows = _rows(300)
    rows[100] = '1.0,"1\r2",3\n'
    (piece,) = (piece for _, piece, _ in _taken([HEADER, *rows], most=1000))
    assert len(piece) == 300
    with pytest.raises(LogError, match=r"^bench: the header cannot be split into names, got "):
        CsvStream(['a\rb,"c\rd"\n'], source="bench")
    with pytest.raises(LogError, match="and 4990 more"):
        CsvStream([",".join(["name"] * 5002) + "\n"], source="bench")


def test_a_number_that_marks_lost_samples_is_missing_unless_it_persists() -> None:
    lines = [HEADER, *(f"{k},{900 + k % 7},{k % 9}\n" for k in range(400))]
    for k in (201, 251, 301):
        lines[k] = f"{k - 1},9999,-9999\n"
    stream = CsvStream(lines, source="bench")
    found = np.concatenate([piece for _, piece, _ in stream.samples(100)])
    assert [np.flatnonzero(np.isnan(found[:, column])).tolist() for column in (0, 1)] == [[200, 250, 300]] * 2
    assert stream.left_out == 6
    assert stream.first_left_out == "column 'motor_speed_rpm' has 9999 in row 201, which stands for a lost sample"
    lines[201:] = [f"{k},9999,{k % 9}\n" for k in range(200, 400)]
    stream = CsvStream(lines, source="bench")
    speed = np.concatenate([piece for _, piece, _ in stream.samples(100)])[:, 0]
    assert np.isnan(speed).sum() == stream.left_out == IN_A_ROW
    assert speed[-1] == pytest.approx(9999 * np.pi / 30)
