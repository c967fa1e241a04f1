"""Files made to hang, to fill the memory or to cause an internal error are refused in one sentence."""

import gzip
import os
import re
import socket
import struct
import subprocess
import sys
import warnings
import zlib
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZipFile

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import scipy.io

from experiments.command.logs import read_log
from plant.errors import LogError, LogWarning
from plant.log.checks import checked_log
from plant.log.files import read_record
from plant.log.notes import LogCode
from tests.log_formats.written import SI, mdf4

N = 400
TIME = 1e-3 * np.arange(N)
HEADER = "time_s,motor_speed_rad_s,position_m"


def log(path: Path, time: np.ndarray = TIME, speed: float = 1.0) -> Path:
    rows = (f"{t!r},{speed * (k % 7)},{1e-3 * (k % 5)}\n" for k, t in enumerate(time.tolist()))
    path.write_text(f"{HEADER}\n{''.join(rows)}")
    return path


def refused(path: Path, said: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LogWarning)
        with pytest.raises(LogError, match=said):
            read_log(path, {}, {})


def test_a_pipe_and_a_socket_named_csv_are_refused_without_waiting(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "x.csv")
    refused(tmp_path / "x.csv", "a file is needed, got a pipe")
    place = Path(os.path.relpath(tmp_path / "s.csv")) if len(str(tmp_path)) < 90 else tmp_path / "s.csv"
    with socket.socket(socket.AF_UNIX) as one:
        one.bind(str(place))
        refused(place, "a file is needed, got a socket")


def test_a_device_is_not_read() -> None:
    refused(Path("/dev/zero"), "a file is needed, got a device")


PEAK = """
import sys
from pathlib import Path
import pyarrow.csv, pyarrow.parquet
from plant.errors import LogError
from plant.log.formats import packed
from plant.log.files import read_record
from plant.log.formats.detect import READERS, import_module
for reader in READERS.values():
    import_module(reader.partition(":")[0])
packed.ALWAYS_ALLOWED = 1 << 20

def peak():
    return int(Path("/proc/self/status").read_text().partition("VmHWM:")[2].split()[0])

before = peak()
try:
    read_record(Path(sys.argv[1]))
except LogError as error:
    print(peak() - before, error)
"""
"""Prints how much the peak of memory has grown [kB], and how the log was refused."""


@pytest.mark.skipif(sys.platform != "linux", reason="the peak of memory is read from /proc")
@pytest.mark.parametrize("kind", ["gz", "zst", "mat", "xlsx", "parquet"])
def test_a_decompression_bomb_is_refused_at_the_unpacking_limit(tmp_path: Path, kind: str) -> None:
    path, zeros = tmp_path / f"bomb.{kind}", bytes(60 << 20)
    if kind == "gz":
        path.write_bytes(gzip.compress(f"{HEADER}\n".encode() + b"0,0,0\n" * (8 << 20)))
    elif kind == "zst":
        with pa.CompressedOutputStream(str(path), "zstd") as file:
            file.write(f"{HEADER}\n".encode() + b"0,0,0\n" * (8 << 20))
    elif kind == "mat":
        inner = struct.pack("<II", 14, len(zeros)) + zeros
        squeezed = zlib.compress(inner)
        head = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"
        path.write_bytes(head + struct.pack("<II", 15, len(squeezed)) + squeezed)
    elif kind == "xlsx":
        with ZipFile(path, "w", ZIP_DEFLATED) as archive:
            archive.writestr("xl/workbook.xml", zeros)
    else:
        columns = dict.fromkeys(HEADER.split(","), pa.array(np.zeros(4 << 20)))
        pq.write_table(pa.table(columns), path, compression="zstd")
    # in a separate process with its own memory peak (tracing allocations crashes alongside threads that read ahead)
    ended = subprocess.run(  # noqa: S603
        [sys.executable, "-c", PEAK, str(path)], capture_output=True, text=True, check=True, timeout=120
    )
    grown, _, said = ended.stdout.partition(" ")
    assert re.search("it unpacks to more than .* MB, the most that is read of a packed file", said)
    assert int(grown) < 40 << 10


STAMPS = {
    "a stamp of 1e308": np.concatenate([TIME[:50], [1e308], TIME[51:]]),
    "stamps from -1e308 to 1e308": np.concatenate([-1e308 * np.linspace(1.0, 0.1, 200), 1e306 * np.arange(90)]),
    "steps of 1 ns and a gap": np.concatenate([1e-9 * np.arange(10), 1.0 + 1e-9 * np.arange(N - 10)]),
    "a jump of thirty years": np.concatenate([TIME[:100], 1e9 + TIME[100:]]),
    "exponential": np.exp(1.5 * np.arange(N)),
    "a sample time of 1.6e11 s": 1.6e11 * np.arange(N),
    "a sample time of 1e-300 s": 1e-300 * np.arange(N),
}


@pytest.mark.parametrize("kind", STAMPS)
def test_impossible_time_stamps_are_refused(tmp_path: Path, kind: str) -> None:
    refused(log(tmp_path / "a.csv", STAMPS[kind]), "time_s")


@pytest.mark.parametrize("speed", [1e200, 1e-200, 1e17])
def test_values_beyond_any_sensor_are_refused(tmp_path: Path, speed: float) -> None:
    refused(log(tmp_path / "a.csv", speed=speed), "motor_speed_rad_s reaches .*, no sensor gives")


@pytest.mark.parametrize("field", ["9" * 200_000, '"' + "x" * 200_000 + '"', "x" * 200_000])
def test_a_field_of_200_kb_is_refused_with_a_short_sentence(tmp_path: Path, field: str) -> None:
    lines = log(tmp_path / "a.csv").read_text().splitlines()
    (tmp_path / "a.csv").write_text("\n".join([*lines[:20], f"0.019,{field},0", *lines[21:]]))
    with pytest.raises(LogError) as caught:
        read_record(tmp_path / "a.csv")
    assert len(str(caught.value)) < 600


@pytest.mark.parametrize("name", ["x" * 200_000, "position_" + "m*" * 100_000])
def test_a_header_of_200_kb_is_refused_with_a_short_sentence(tmp_path: Path, name: str) -> None:
    text = log(tmp_path / "a.csv").read_text().replace("position_m", name)
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(LogError) as caught:
        read_record(tmp_path / "a.csv")
    assert len(str(caught.value)) < 1000


def test_lines_that_end_in_carriage_returns_are_read(tmp_path: Path) -> None:
    path = log(tmp_path / "a.csv")
    path.write_bytes(path.read_bytes().replace(b"\n", b"\r"))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LogWarning)
        assert len(read_record(path)) == N


def test_complex_numbers_are_refused(tmp_path: Path) -> None:
    columns = {"time_s": TIME, "motor_speed_rad_s": np.arange(N) + 0j, "position_m": TIME + 1j}
    scipy.io.savemat(tmp_path / "a.mat", columns)
    refused(tmp_path / "a.mat", r"column 'position_m' must hold numbers, got '.*1j\)?' in row 1")


@pytest.mark.parametrize(
    ("block", "at", "was", "written", "said"),
    [
        (b"##CN", 92, 32, 1 << 19, "channel 'Differential pressure' lies outside its records; the file is damaged"),
        (b"##CG", 96, 40, 0xFF000000, "it unpacks to more than"),
    ],
)
def test_an_mdf_file_with_damaged_record_sizes_is_refused(
    block: bytes, at: int, was: int, written: int, said: str, tmp_path: Path
) -> None:
    pytest.importorskip("asammdf")
    path = mdf4(pd.DataFrame(dict.fromkeys(SI, 1e-3 * np.arange(60))), tmp_path)
    content = bytearray(path.read_bytes())
    # the fields that state where a channel begins or how long a record is
    places = [one.start() + at for one in re.finditer(block, content)]
    (place,) = (one for one in places if struct.unpack_from("<I", content, one) == (was,))
    struct.pack_into("<I", content, place, written)
    path.write_bytes(content)
    refused(path, said)


def test_many_small_packed_vectors_are_refused_for_their_total_size(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    h5py = pytest.importorskip("h5py")
    monkeypatch.setattr("plant.log.formats.packed.ALWAYS_ALLOWED", 1 << 20)
    with h5py.File(tmp_path / "bomb.h5", "w") as file:
        for place in range(60):
            file.create_dataset(f"c{place}", data=np.zeros(100_000), compression="gzip")
    with pytest.raises(LogError, match="unpacks to more than"):
        read_record(tmp_path / "bomb.h5")


def test_an_overlong_row_of_a_sheet_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("plant.log.formats.xlsx.LONGEST_ROW", 1 << 16)
    with ZipFile(tmp_path / "bomb.xlsx", "w", ZIP_DEFLATED) as file:
        file.writestr("xl/workbook.xml", "<workbook/>")
        file.writestr("xl/worksheets/sheet1.xml", f"<sheetData><row>{'<c><v>1</v></c>' * 100_000}</row></sheetData>")
    with pytest.raises(LogError, match="longer than any of a sheet"):
        read_record(tmp_path / "bomb.xlsx")


def test_the_unused_end_of_preallocated_arrays_is_left_out_with_a_note() -> None:
    ended = np.concatenate((np.ones(N), np.full(300, np.nan)))
    channels = {name: scale * ended for name, scale in (("motor_speed_rad_s", 9.0), ("velocity_m_s", 0.1))}
    checked = checked_log({"time_s": 1e-3 * np.arange(N + 300) * ended, **channels}, source="a.csv")
    assert checked.notes[0].code == LogCode.END_LEFT_OUT
    assert len(checked.channels["velocity_m_s"]) == N
    channels["velocity_m_s"][-1] = 0.1  # now the end contains a measured value
    with pytest.raises(LogError, match="time_s is missing in 300 of 700 samples"):
        checked_log({"time_s": 1e-3 * np.arange(N + 300) * ended, **channels}, source="a.csv")
