"""An HDF5 file may name numbers in any other file, or in itself: these are not read."""

from pathlib import Path

import numpy as np
import pytest

from plant.errors import LogError
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
