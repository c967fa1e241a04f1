"""A MAT file of version 7.3 keeps parts of structs and cells apart: they are read as in the older versions."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from plant.errors import LogError
from plant.log.formats import mat73_values
from plant.log.formats.hdf5 import open_hdf5
from plant.log.table import Table

h5py = pytest.importorskip("h5py")

TIME = 1e-3 * np.arange(50.0)


class Made:
    """A file that is written as MATLAB does."""

    def __init__(self, file: Any) -> None:
        self.file, self.count = file, 0
        file.create_group("#refs#")

    def put(self, where: Any, name: str, value: Any) -> Any:
        """Write text, numbers or a list of values, whose parts stand in another group; return what was written."""
        if isinstance(value, str):
            made = where.create_dataset(name, data=np.array([[ord(one)] for one in value], "u2"))
            made.attrs["MATLAB_class"] = np.bytes_("char")
        elif isinstance(value, list):
            made = where.create_dataset(name, data=np.array([[self.part(one)] for one in value], h5py.ref_dtype))
        else:
            made = where.create_dataset(name, data=np.atleast_2d(value))
            made.attrs["MATLAB_class"] = np.bytes_("double")
        return made

    def part(self, value: Any) -> Any:
        self.count += 1
        return self.put(self.file["#refs#"], f"p{self.count}", value).ref

    def struct(self, name: str, **fields: Any) -> None:
        group = self.file.create_group(name)
        for field, value in fields.items():
            self.put(group, field, value)


def tables(path: Path, write: Callable[[Made], None]) -> tuple[Table, ...]:
    with h5py.File(path, "w") as file:
        write(Made(file))
    return open_hdf5(path)


def columns(table: Table) -> dict[str, tuple[str | None, np.ndarray]]:
    return {table.headings[k].bare: (table.headings[k].unit, np.ravel(one)) for k, one in table.numbers().items()}


def test_a_recording_of_dspace_has_the_names_units_and_times_of_its_signals(tmp_path: Path) -> None:
    def write(made: Made) -> None:
        made.struct("rec/X", Data=TIME, Name="Time")
        made.struct("rec/Y", Name=["Speed", "Way"], Unit=["rpm", "mm"], Data=[9.0 * TIME, TIME - 1.0])

    (table,) = tables(tmp_path / "rec.mat", write)
    found = columns(table)
    assert [(name, unit) for name, (unit, _) in found.items()] == [("time", "s"), ("Speed", "rpm"), ("Way", "mm")]
    np.testing.assert_array_equal(found["time"][1], TIME)
    np.testing.assert_array_equal(found["Way"][1], TIME - 1.0)


def test_structure_with_time_of_simulink_has_the_labels_of_its_signals(tmp_path: Path) -> None:
    def write(made: Made) -> None:
        made.struct("out", time=TIME)
        made.struct("out/signals", values=[TIME, np.vstack([TIME, 2.0 * TIME])], label=["position_m", ""])

    (table,) = tables(tmp_path / "out.mat", write)
    assert list(columns(table)) == ["time", "position_m", "signal 2 1", "signal 2 2"]


def test_cells_beside_a_struct_do_not_hide_it_and_objects_are_left_out(tmp_path: Path) -> None:
    def write(made: Made) -> None:
        made.struct("log", time_s=TIME, position_m=-TIME)
        made.put(made.file, "names", ["a", "b"]).attrs["MATLAB_class"] = np.bytes_("cell")
        made.file["logsout"] = np.full(6, 3e9)
        made.file["logsout"].attrs["MATLAB_object_decode"] = 3

    (table,) = tables(tmp_path / "log.mat", write)
    assert (table.label, set(columns(table))) == ("log", {"time_s", "position_m"})


def test_an_object_alone_is_refused_with_what_to_do(tmp_path: Path) -> None:
    def write(made: Made) -> None:
        made.put(made.file, "logsout", np.full(6, 3e9)).attrs["MATLAB_object_decode"] = 3

    with pytest.raises(LogError, match="can only be read by MATLAB: save its columns as"):
        tables(tmp_path / "log.mat", write)


def test_a_file_that_refers_to_itself_or_to_another_file_is_read_without_that(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "secret.h5", "w") as file:
        file["other"] = TIME

    def write(made: Made) -> None:
        made.struct("log", time_s=TIME, position_m=TIME)
        made.file["log/away"] = h5py.ExternalLink("secret.h5", "other")
        made.file["log/soft"] = h5py.SoftLink("/log/time_s")
        loop = made.file["log"].create_dataset("loop", (1, 1), h5py.ref_dtype)
        loop.attrs["MATLAB_class"] = np.bytes_("cell")
        loop[0, 0] = made.file["log"].ref

    (table,) = tables(tmp_path / "log.mat", write)
    assert {one for one in columns(table) if "." not in one} == {"time_s", "position_m"}


def test_more_parts_or_numbers_than_a_log_has_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def write(made: Made) -> None:
        made.struct("rec", Name=["a"] * 30, Data=[TIME] * 30)

    monkeypatch.setattr(mat73_values, "MOST_PARTS", 20)
    with pytest.raises(LogError, match="structs and cells of more than 20 parts are not read"):
        tables(tmp_path / "log.mat", write)
    monkeypatch.undo()
    monkeypatch.setattr("plant.log.formats.hdf5.most_unpacked", lambda _: 1000)
    with pytest.raises(LogError, match="unpacks to more than"):
        tables(tmp_path / "again.mat", write)
