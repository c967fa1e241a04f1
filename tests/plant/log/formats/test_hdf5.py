"""An HDF5 file may name numbers in any other file, or in itself: these are not read."""

from pathlib import Path

import numpy as np
import pytest

from plant.errors import LogError, LogWarning
from plant.log.files import read_record
from plant.log.formats.hdf5 import open_hdf5

h5py = pytest.importorskip("h5py")


def test_numbers_that_an_hdf5_file_takes_from_other_files_or_from_itself_are_not_read(tmp_path: Path) -> None:
    secret = tmp_path / "secret.bin"
    secret.write_bytes(np.arange(50.0).tobytes())
    path = tmp_path / "log.h5"
    with h5py.File(path, "w") as file:
        itself = h5py.VirtualLayout((50,), "f8")
        itself[:] = h5py.VirtualSource(".", "speed", (50,))  # reading it would end the process
        file.create_virtual_dataset("speed", itself)
        file.create_dataset("position", (50,), "f8", external=[(str(secret), 0, 400)])
        text = h5py.VirtualLayout((50,), "u2")
        text[:] = h5py.VirtualSource(".", "metadata_json", (50,))
        file.create_virtual_dataset("metadata_json", text).attrs["MATLAB_class"] = np.bytes_("char")
    with pytest.raises(LogError, match="stored in other files"):
        open_hdf5(path)
    with h5py.File(path, "a") as file:
        file["time"] = np.arange(50.0)
    (table,) = open_hdf5(path)
    assert [one.name for one in table.headings] == ["time"]


def test_a_frame_that_pandas_keeps_has_the_names_that_stand_beside_its_values(tmp_path: Path) -> None:
    path = tmp_path / "log.h5"
    with h5py.File(path, "w") as file:
        file["df/axis1"] = np.arange(50.0)
        file["df/block0_items"] = np.array([b"position_m", b"velocity_m_s"])
        file["df/block0_values"] = np.zeros((50, 2))
        file["df/block1_items"] = np.array([b"one", b"two", b"three"])  # not as many as there are columns
        file["df/block1_values"] = np.zeros((50, 2))
        file["df/block2_items"] = h5py.ExternalLink("secret.h5", "x")
        file["df/block2_values"] = np.zeros((50, 2))
    (table,) = open_hdf5(path)
    assert [one.name for one in table.headings] == [
        *("axis1", "position_m", "velocity_m_s"),
        *("block1_values 1", "block1_values 2", "block2_values 1", "block2_values 2"),
    ]


def test_fields_that_hold_several_numbers_are_columns(tmp_path: Path) -> None:
    path = tmp_path / "log.h5"
    with h5py.File(path, "w") as file:
        rows = np.zeros(50, [("index", "i8"), ("values", "f8", (2,))])
        rows["values"][:, 1] = 7.0
        file["table"] = rows
    (table,) = open_hdf5(path)
    assert [one.name for one in table.headings] == ["index", "values 1", "values 2"]
    assert set(table.numbers()[2]) == {7.0}


@pytest.mark.parametrize("name", ["scale", "Gain", "slope", "lsb"])
def test_a_scale_of_counts_is_told_and_not_applied(name: str, tmp_path: Path) -> None:
    rows = np.arange(20)
    with h5py.File(tmp_path / "log.h5", "w") as file:
        file["time_s"], file["motor_speed_rad_s"] = 1e-3 * rows, rows.astype(float)
        file["position_mm"] = rows
        file["position_mm"].attrs.update({name: 0.5, "offset": 2})
        file["velocity_mm_s"] = rows.astype(float)
        file["velocity_mm_s"].attrs[name] = 0.5  # numbers that are no counts
    with pytest.warns(LogWarning, match="scale factor 0.5 and the offset 2 for column 'position_mm'") as said:
        record = read_record(tmp_path / "log.h5")
    np.testing.assert_array_equal(record["position_m"], 1e-3 * rows)
    assert not any("velocity_mm_s'" in str(one.message) for one in said)
