import os
import subprocess
import sys
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
import scipy.io
from hypothesis import given
from hypothesis import strategies as st
from pyarrow import csv as arrow_csv
from pyarrow import parquet as pq

from plant.errors import LogError, LogWarning
from plant.log.files import read_record
from plant.log.notes import LogCode
from plant.log.record import Record

N = 100
HEADER = "time_s,motor_speed_rad_s,position_m"
ROWS = [f"{0.001 * k:.3f},{100 * np.sin(0.1 * k):.6f},{0.01 * np.cos(0.1 * k):.8f}" for k in range(N)]


def log(tmp_path: Path, *, header: str = HEADER, rows: list[str] = ROWS, name: str = "run.csv") -> Path:
    path = tmp_path / name
    path.write_text("\n".join([header, *rows]) + "\n")
    return path


def changed(row: int, column: int, cell: str) -> list[str]:
    rows = list(ROWS)
    cells = rows[row].split(",")
    cells[column] = cell
    rows[row] = ",".join(cells)
    return rows


def refused(path: Path, message: str) -> None:
    with pytest.raises(LogError, match=message) as caught:
        read_record(path)
    said = str(caught.value)
    assert said.startswith(str(path))
    assert "\n" not in said
    assert len(said) < len(str(path)) + 300


def test_the_unspoilt_log_is_accepted(tmp_path: Path) -> None:
    assert len(read_record(log(tmp_path))) == N


@pytest.mark.parametrize("name", ["run.csv", "run.txt", "run.parquet", "run.mat", "run.csv.gz"])
def test_an_empty_file_is_refused(tmp_path: Path, name: str) -> None:
    (tmp_path / name).touch()
    refused(tmp_path / name, "empty|cannot be read as gz")


@pytest.mark.parametrize("text", ["\n\n\n", "  \n"])
def test_a_blank_file_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "run.csv").write_text(text)
    refused(tmp_path / "run.csv", "empty")


@pytest.mark.parametrize("end", ["", "\n", "\r\n"])
def test_a_header_alone_is_refused(tmp_path: Path, end: str) -> None:
    (tmp_path / "run.csv").write_bytes((HEADER + end).encode())
    refused(tmp_path / "run.csv", "at least 10 samples are needed, got 0")


def test_one_sample_is_refused(tmp_path: Path) -> None:
    refused(log(tmp_path, rows=ROWS[:1]), "at least 10 samples are needed, got 1")


@pytest.mark.parametrize("name", ["time_s", "motor_speed_rad_s", "position_m"])
def test_a_missing_column_is_named(tmp_path: Path, name: str) -> None:
    refused(log(tmp_path, header=HEADER.replace(name, "other")), f"{name}.* is missing; the log has")


def test_an_unknown_unit_is_refused(tmp_path: Path) -> None:
    refused(
        log(tmp_path, header=HEADER.replace("position_m", "position_smoot")),
        r"column 'position_smoot' cannot become position_m: unit 'smoot' is unknown, wanted one that converts to 'm'",
    )


@pytest.mark.parametrize("cell", ["abc", "1.2.3", "0x10", "1_000", "5-5", "1.#INF", '"1,5"', "12:30"])
@pytest.mark.parametrize("row", [0, 57, N - 1])
def test_text_in_two_of_100_cells_is_refused_with_column_row_and_text(tmp_path: Path, cell: str, row: int) -> None:
    rows = list(ROWS)
    for place in (row, 58, 58 if row < 58 else 59):
        rows[place] = ",".join([*rows[place].split(",")[:2], cell])
    row, text = min(row, 58), cell.strip('"')
    refused(log(tmp_path, rows=rows), rf"column 'position_m' must hold numbers, got '{text}' in row {row + 1}")


def test_text_late_in_a_long_file_is_named_with_its_line(tmp_path: Path) -> None:
    rows = [f"{0.001 * k:.3f},{np.sin(0.1 * k):.6f},{0.01 * np.cos(0.1 * k):.8f}" for k in range(60_000)]
    rows[51_234] = "51.234,oops,0"
    with pytest.warns(LogWarning) as caught:
        read_record(log(tmp_path, rows=rows))
    assert "'oops' in line 51236" in str(caught[0].message)


@pytest.mark.parametrize("cell", ["inf", "-inf", "Infinity", "1e999"])
def test_an_infinite_value_is_refused(tmp_path: Path, cell: str) -> None:
    refused(log(tmp_path, rows=changed(33, 1, cell)), "motor_speed_rad_s must be finite, got -?inf in row 34")


@pytest.mark.parametrize("cell", ["", "nan", "NaN", "NA", "null", "-nan", " "])
def test_an_empty_cell_is_masked_with_a_warning(tmp_path: Path, cell: str) -> None:
    path = log(tmp_path, rows=changed(33, 2, cell))
    with pytest.warns(LogWarning) as caught:
        record = read_record(path)
    (warning,) = [one.message for one in caught]
    assert warning.note == LogCode.SAMPLES_MASKED.note(channel="position_m", count=1, total=100, percent=1.0)
    assert warning.source == str(path)
    assert str(warning) == f"{path}: position_m is missing in 1 of 100 samples (1 %); those samples are not used"
    assert np.flatnonzero(np.isnan(record["position_m"])).tolist() == [33]


def test_a_long_run_of_empty_cells_is_refused(tmp_path: Path) -> None:
    rows = [row if not 20 <= k < 26 else row.rsplit(",", 1)[0] + "," for k, row in enumerate(ROWS)]
    refused(log(tmp_path, rows=rows), "position_m is missing in 6 of 100 samples")


def test_time_that_runs_backward_is_refused(tmp_path: Path) -> None:
    refused(log(tmp_path, rows=changed(50, 0, "0.010")), "time_s must increase, got 0.01 in row 51 after 0.049")


def test_a_copied_row_is_left_out_with_a_warning(tmp_path: Path) -> None:
    with pytest.warns(LogWarning) as caught:
        record = read_record(log(tmp_path, rows=[*ROWS[:40], ROWS[39], *ROWS[40:]]))
    assert [one.message.note.code for one in caught] == [LogCode.TIME_REPEATS]
    assert len(record) == N


def test_uneven_time_is_resampled_with_a_warning(tmp_path: Path) -> None:
    with pytest.warns(LogWarning, match=r"time_s jitters by at most 30 % of the sample time of 0\.001 s"):
        assert len(read_record(log(tmp_path, rows=changed(50, 0, "0.0503")))) == N


def test_left_out_rows_are_masked_with_a_warning(tmp_path: Path) -> None:
    with pytest.warns(LogWarning) as caught:
        record = read_record(log(tmp_path, rows=ROWS[:40] + ROWS[42:]))
    assert [one.message.note for one in caught] == [
        LogCode.SAMPLES_MASKED.note(channel=name, count=2, total=100, percent=2.0)
        for name in ("motor_speed_rad_s", "position_m")
    ]
    assert np.flatnonzero(np.isnan(record["position_m"])).tolist() == [40, 41]


def test_a_log_in_which_nothing_moves_is_accepted_with_a_warning(tmp_path: Path) -> None:
    rows = [",".join([*row.split(",")[:2], "0.01"]) for row in ROWS]
    with pytest.warns(LogWarning) as caught:
        assert np.ptp(read_record(log(tmp_path, rows=rows))["position_m"]) == 0.0
    assert [one.message.note for one in caught] == [LogCode.NOTHING_MOVES.note(channels="position_m")]


def test_millimetres_under_the_name_of_metres_are_noticed(tmp_path: Path) -> None:
    rows = [f"{0.001 * k:.3f},{100 * np.sin(0.1 * k):.6f},{10.0 * np.cos(0.1 * k):.8f}" for k in range(N)]
    with pytest.warns(LogWarning) as caught:
        read_record(log(tmp_path, rows=rows))
    (note,) = [one.message.note for one in caught]
    assert (note.code, note.data["channel"], note.data["slip"]) == (LogCode.CHANNEL_LARGE, "position_m", "mm read as m")
    assert note.data["size"] == pytest.approx(20.0, rel=0.01)


@pytest.mark.parametrize("row", ["0.050,1.0", "0.050,1.0,2.0,3.0", "0.050"])
def test_a_ragged_row_is_refused(tmp_path: Path, row: str) -> None:
    cells = row.count(",") + 1
    refused(
        log(tmp_path, rows=[*ROWS[:50], row, *ROWS[51:]]),
        f"every row must have 3 cells as the header has, got {cells} in row 51",
    )


def test_two_columns_for_one_channel_are_refused(tmp_path: Path) -> None:
    rows = [row + ",1.0" for row in ROWS]
    refused(log(tmp_path, header=HEADER + ",position_mm", rows=rows), "both give position_m")


@pytest.mark.parametrize("name", ["run.csv", "run.parquet", "run.mat"])
def test_a_directory_is_refused(tmp_path: Path, name: str) -> None:
    (tmp_path / name).mkdir()
    refused(tmp_path / name, "a file is needed, got a folder")


@pytest.mark.parametrize("name", ["run.csv", "run.parquet", "run.mat", "no\0name.csv", "x" * 300 + ".csv"])
def test_a_file_that_is_not_there_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(LogError):
        read_record(tmp_path / name)


@pytest.mark.parametrize("name", ["run.dat", "run", "run.xlsx", "run.parquet"])
def test_text_is_read_whatever_the_file_is_called(tmp_path: Path, name: str) -> None:
    assert len(read_record(log(tmp_path, name=name))) == N


@pytest.mark.parametrize("name", ["run.csv", "run.txt", "run.csv.gz", "run.parquet", "run.mat"])
def test_a_binary_file_is_refused_under_any_name(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_bytes(np.random.default_rng(4).bytes(5000))
    refused(tmp_path / name, "binary data|cannot be read as|column .* is missing")


@pytest.mark.parametrize("name", ["run.csv", "run.parquet", "run.mat", "run.csv.gz"])
def test_a_file_cut_short_is_refused_or_loses_its_last_row_with_a_warning(tmp_path: Path, name: str) -> None:
    from plant.log.files import write_record

    write_record(read_record(log(tmp_path)), tmp_path / name)
    content = (tmp_path / name).read_bytes()
    (tmp_path / name).write_bytes(content[: len(content) // 2 - 3])
    if name == "run.csv":
        with pytest.warns(LogWarning, match="the lines after row 49, the last row of data, were left out .lines: 1."):
            assert len(read_record(tmp_path / name)) == 49
    else:
        refused(tmp_path / name, "cannot be read as")


@pytest.mark.skipif(os.geteuid() == 0, reason="the superuser may read every file")
def test_a_file_without_permission_is_refused(tmp_path: Path) -> None:
    path = log(tmp_path)
    path.chmod(0)
    refused(path, "there is no permission to read it")


@pytest.mark.parametrize("name", ["run.csv", "run.parquet", "run.mat"])
def test_a_refusal_of_the_system_is_one_sentence(tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def deny(*_: object, **__: object) -> None:
        raise PermissionError(13, "Permission denied")

    path = log(tmp_path, name=name)
    monkeypatch.setattr(Path, "open", deny)
    refused(path, "there is no permission to read it")


def test_a_column_of_a_mat_that_is_no_vector_is_refused(tmp_path: Path) -> None:
    scipy.io.savemat(
        tmp_path / "run.mat", {"time_s": np.eye(20), "motor_speed_rad_s": np.arange(20), "position_m": np.arange(20)}
    )
    refused(tmp_path / "run.mat", r"column 'time_s' must be one-dimensional, got shape \(20, 20\)")


def test_columns_of_a_mat_that_differ_in_length_are_refused(tmp_path: Path) -> None:
    ramp = np.arange(20.0)
    scipy.io.savemat(tmp_path / "run.mat", {"time_s": ramp, "motor_speed_rad_s": ramp[1:], "position_m": ramp})
    refused(tmp_path / "run.mat", "one length")


def test_a_mat_of_version_7_3_that_is_no_hdf5_is_refused(tmp_path: Path) -> None:
    header = b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM"
    (tmp_path / "run.mat").write_bytes(header.ljust(512, b"\0"))
    refused(tmp_path / "run.mat", "cannot be read as mat")


def test_text_in_a_parquet_column_is_refused_with_its_row(tmp_path: Path) -> None:
    cells = [str(0.1 * k) for k in range(20)]
    cells[4] = "abc"
    ramp = np.arange(20.0)
    table = pa.table({"time_s": 1e-3 * ramp, "motor_speed_rad_s": ramp, "position_m": cells})
    pq.write_table(table, tmp_path / "run.parquet")
    refused(tmp_path / "run.parquet", "column 'position_m' must hold numbers, got 'abc' in row 5")


def only_a_log_error(path: Path, content: bytes) -> None:
    path.write_bytes(content)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LogWarning)
        try:
            assert isinstance(read_record(path), Record)
        except LogError as error:
            assert str(error).startswith(str(path))  # noqa: PT017 (a record is as good as a refusal)


spoil = st.tuples(st.floats(0.0, 1.0), st.binary(max_size=8), st.integers(0, 8))


def spoilt(content: bytes, changes: list[tuple[float, bytes, int]]) -> bytes:
    for where, inserted, removed in changes:
        at = int(where * len(content))
        content = content[:at] + inserted + content[at + removed :]
    return content


@pytest.mark.parametrize("suffix", [".csv", ".csv.gz", ".parquet", ".mat"])
@given(content=st.binary(max_size=400))
def test_random_bytes_give_a_record_or_a_refusal(
    tmp_path_factory: pytest.TempPathFactory, suffix: str, content: bytes
) -> None:
    only_a_log_error(tmp_path_factory.mktemp("random") / f"run{suffix}", content)


@given(body=st.text(st.sampled_from('0123456789.,-+e;\t\r\n" ninfa'), max_size=300))
def test_random_cells_under_a_good_header_give_a_record_or_a_refusal(
    tmp_path_factory: pytest.TempPathFactory, body: str
) -> None:
    only_a_log_error(tmp_path_factory.mktemp("cells") / "run.csv", f"{HEADER}\n{body}".encode())


@pytest.mark.parametrize("suffix", [".csv", ".parquet", ".mat"])
@given(changes=st.lists(spoil, min_size=1, max_size=3))
def test_a_damaged_log_gives_a_record_or_a_refusal(
    tmp_path_factory: pytest.TempPathFactory,
    whole_log: Callable[[str], bytes],
    suffix: str,
    changes: list[tuple[float, bytes, int]],
) -> None:
    path = tmp_path_factory.mktemp("damaged") / f"run{suffix}"
    only_a_log_error(path, spoilt(whole_log(suffix), changes))


@pytest.fixture(scope="module")
def whole_log(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], bytes]:
    from plant.log.files import write_record

    folder = tmp_path_factory.mktemp("whole")
    record = read_record(log(folder))
    content: dict[str, bytes] = {}
    for suffix in (".csv", ".parquet", ".mat"):
        write_record(record, folder / f"run{suffix}")
        content[suffix] = (folder / f"run{suffix}").read_bytes()
    return content.__getitem__


MEASURE = """
import resource, sys
from plant.log.files import read_record
record = read_record(sys.argv[1])
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
print(len(record), len(record.channels), peak)
"""


@pytest.mark.slow
def test_ten_million_rows_are_read_in_under_four_gigabytes(tmp_path: Path) -> None:
    rows, block = 10_000_000, 500_000
    path = tmp_path / "long.csv"
    names = ["time_s", "motor_speed_rad_s", "position_m", "velocity_m_s", "differential_pressure_pa"]
    with arrow_csv.CSVWriter(path, pa.schema([(name, pa.float64()) for name in names])) as writer:
        for first in range(0, rows, block):
            index = np.arange(first, first + block)
            wave = np.sin(1e-3 * index)
            columns = [index * 1e-4, 120.0 * wave, -0.004 * np.cos(1e-3 * index), 0.04 * wave, 3e5 * wave]
            writer.write_table(pa.table(dict(zip(names, columns, strict=True))))
    command = [sys.executable, "-c", MEASURE, str(path)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)  # noqa: S603 (our own command)
    count, channels, peak = (int(part) for part in done.stdout.split())
    assert (count, channels) == (rows, 4)
    assert peak < 4e9
