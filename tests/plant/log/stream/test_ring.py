import struct
import threading
from pathlib import Path

import numpy as np
import pytest

from plant.errors import HydrostateError, LogError
from plant.log.stream.ring import MOST_ROWS, RingReader, RingWriter
from plant.log.stream.source import BatchCounts, is_stream, stream_lines

HEADER = "time_s,motor_speed_rad_s,position_m"


def rows(begin: int, end: int) -> np.ndarray:
    n = np.arange(begin, end)[:, None]
    return np.concatenate([1e-3 * n, np.sin(n), 1.0 / (1.0 + n)], axis=1)


def test_all_rows_of_a_writer_that_waits_for_the_reader_arrive_unchanged(tmp_path: Path) -> None:
    path, count, received = tmp_path / "ring", 3 * MOST_ROWS, BatchCounts()
    writer = RingWriter(path, HEADER, 100)

    def write() -> None:
        with writer:
            writer.write(rows(0, count), wait=True)

    thread = threading.Thread(target=write)
    thread.start()
    header, *lines = stream_lines(f"ring:{path}", received)
    thread.join(10.0)
    assert header == f"{HEADER}\n"
    assert np.array_equal(np.loadtxt(lines, delimiter=","), rows(0, count))
    assert (received.batches, received.lost, received.what) == (count, 0, "rows")


def test_overwritten_rows_are_counted_as_lost_and_the_others_are_read(tmp_path: Path) -> None:
    with RingWriter(tmp_path / "ring", HEADER, 10) as writer:
        reader = RingReader(tmp_path / "ring")
        writer.write(rows(0, 4))
        assert np.array_equal(reader.take(), rows(0, 4))
        writer.write(rows(4, 30))
        assert np.array_equal(reader.take(), rows(21, 30))
        assert reader.lost == 17
        assert (writer.room(), reader.take().shape, reader.ended) == (9, (0, 3), False)
    assert reader.ended


def test_a_reader_that_is_started_again_goes_on_at_the_next_row(tmp_path: Path) -> None:
    with RingWriter(tmp_path / "ring", HEADER, 10) as writer:
        writer.write(rows(0, 3))
        RingReader(tmp_path / "ring").take()
        writer.write(rows(3, 7))
        again = RingReader(tmp_path / "ring")
        assert np.array_equal(again.take(), rows(3, 7))
        assert again.lost == 0


def test_a_missing_value_is_an_empty_cell(tmp_path: Path) -> None:
    with RingWriter(tmp_path / "ring", HEADER, 10) as writer:
        writer.write(np.array([[0.5, np.nan, 2.0]]))
    assert list(stream_lines(f"ring:{tmp_path / 'ring'}", BatchCounts())) == [f"{HEADER}\n", "0.5,,2.0\n"]
    assert is_stream("ring:/dev/shm/bench")


def test_an_invalid_ring_file_address_or_size_is_refused(tmp_path: Path) -> None:
    with RingWriter(tmp_path / "ring", HEADER, 10):
        pass
    content = bytearray((tmp_path / "ring").read_bytes())
    struct.pack_into("<I", content, 12, 11)
    (tmp_path / "cut").write_bytes(content)
    (tmp_path / "text").write_text("time_s\n0.0\n" * 1000)
    for name, said in (("cut", "another size than the file"), ("text", "a ring is needed"), ("none", "cannot be read")):
        with pytest.raises(LogError, match=said):
            RingReader(tmp_path / name)
    with pytest.raises(HydrostateError, match=r"a stream must be .* or ring:PATH"):
        list(stream_lines("ring:", BatchCounts()))
    with pytest.raises(HydrostateError, match="two slots or more"):
        RingWriter(tmp_path / "small", HEADER, 1)
