from pathlib import Path

import pytest

from plant.errors import NoMemoryError
from plant.log.formats.detect import open_tables


def test_a_column_that_memory_does_not_hold_is_not_taken_for_a_column_of_text(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "run.csv"
    path.write_text("time_s,text,speed_rad_s\n" + "0.1,a,2.5\n" * 20)
    (table,) = open_tables(path)
    assert sorted(table.numbers()) == [0, 2]

    def full(*_: object, **__: object) -> None:
        raise MemoryError("malloc of size 8 failed")

    monkeypatch.setattr("plant.log.formats.csv._read_fast", full)
    with pytest.raises(NoMemoryError, match=r"run\.csv: reading it as csv needs more memory than there is"):
        table.numbers()
