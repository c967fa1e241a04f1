from functools import partial
from pathlib import Path

import numpy as np
import pytest

from plant.errors import NoMemoryError
from plant.log import table as tables
from plant.log.formats.detect import open_tables
from plant.log.table import table_of


def test_running_out_of_memory_is_refused_and_not_taken_for_a_text_column(
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


def test_a_table_with_too_many_values_is_refused_after_its_first_column(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tables, "MOST_VALUES", 1000)
    monkeypatch.setattr(tables, "ALWAYS_HELD", 3)
    read: list[int] = []

    def values(place: int) -> np.ndarray:
        read.append(place)
        return np.zeros(300)

    wide = table_of("wide.h5", {f"c{place}": partial(values, place) for place in range(4)})
    with pytest.raises(NoMemoryError, match="all 4 columns of 300 rows are more than is looked at at once"):
        wide.numbers()
    assert read == [0]
