"""JSON as pandas and loggers write it: split tables, objects of columns or rows, and objects within rows."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from plant.errors import LogError
from plant.log.formats.json_text import open_json

LOG = pd.DataFrame({"time_s": [0.0, 0.1, 0.2], "position_m": [1.0, np.nan, 3.0]})


def read(path: Path, text: str) -> dict[str, list[float]]:
    path.write_text(text)
    table = open_json(path)
    return {table.headings[place].name: values.tolist() for place, values in table.numbers().items()}


@pytest.mark.parametrize("orient", ["columns", "split", "index", "records", "table", "values"])
def test_every_form_of_pandas_is_read(tmp_path: Path, orient: str) -> None:
    found = read(tmp_path / "log.json", LOG.to_json(orient=orient))  # pyright: ignore[reportArgumentType]
    names = ["column 1", "column 2"] if orient == "values" else list(LOG)
    for name, values in zip(names, LOG.to_numpy().T, strict=True):
        np.testing.assert_array_equal(found[name], values)


def test_objects_within_rows_give_columns_of_their_own(tmp_path: Path) -> None:
    rows = [{"t": 0.1 * k, "motor": {"speed": k, "drive": {"volts": -k}}} for k in range(3)]
    found = read(tmp_path / "log.jsonl", "\n".join(map(json.dumps, rows)))
    assert found["motor.speed"] == [0.0, 1.0, 2.0]
    assert found["motor.drive.volts"] == [0.0, -1.0, -2.0]


@pytest.mark.parametrize(
    "text", ['{"a": {"x": 1}, "b": {"y": 2}}', '{"columns": ["a"], "data": [[1, 2]]}', '{"a": {}}']
)
def test_objects_that_are_no_table_are_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(LogError, match="JSON is read as one object a row"):
        read(tmp_path / "log.json", text)
