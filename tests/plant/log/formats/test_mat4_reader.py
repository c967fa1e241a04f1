"""MAT files of version 4 are read as scipy reads them; damaged ones are refused."""

import io
import struct

import numpy as np
import pytest
from scipy.io import loadmat, savemat

from plant.log.formats.mat4_reader import is_version_4, read_variables_of_version_4
from plant.log.formats.mat_reader import DamagedMatError

VALUES = {
    "x": np.arange(6.0).reshape(3, 2),
    "narrow": np.arange(4, dtype=np.float32)[:, None],
    "count": np.array([[1, -2, 70000]], dtype=np.int32),
    "small": np.array([[1, -2]], dtype=np.int16),
    "turn": np.array([[1.0 + 2.0j], [3.0 - 4.0j]]),
    "gain": np.array([[2.5]]),
}


def stored(values: dict[str, object]) -> bytes:
    file = io.BytesIO()
    savemat(file, values, format="4")
    return file.getvalue()


def test_numbers_are_those_that_scipy_reads() -> None:
    content = stored(VALUES)
    assert is_version_4(content)
    found, wanted = read_variables_of_version_4(content), loadmat(io.BytesIO(content))
    for name in VALUES:
        np.testing.assert_array_equal(found[name], wanted[name].squeeze())


def test_text_is_a_string_or_one_for_each_row_and_a_sparse_matrix_is_not_read() -> None:
    from scipy.sparse import csc_array

    found = read_variables_of_version_4(
        stored({"a": "bench 2", "b": np.array(["ab", "c "]), "s": csc_array(np.eye(3))})
    )
    assert found == {"a": "bench 2", "b": ["ab", "c"], "s": None}


def test_numbers_of_the_other_byte_order_are_read() -> None:
    content = struct.pack(">5i", 1000, 2, 1, 0, 2) + b"x\0" + np.array([1.5, -2.0], ">f8").tobytes()
    np.testing.assert_array_equal(read_variables_of_version_4(content)["x"], [1.5, -2.0])


def test_other_files_are_not_taken_for_version_4() -> None:
    file = io.BytesIO()
    savemat(file, VALUES)
    for content in (file.getvalue(), b"", b"time_s,position_m\n0,1\n2,3\n", bytes(200)):
        assert not is_version_4(content)


@pytest.mark.parametrize("kept", [10, 30, 60])
def test_a_file_that_ends_too_early_is_refused(kept: int) -> None:
    with pytest.raises(DamagedMatError, match="the file ends within"):
        read_variables_of_version_4(stored(VALUES)[:kept])


@pytest.mark.parametrize(("place", "value"), [(0, 7), (0, 90), (1, -1), (2, -1), (4, 0), (4, 2**30)])
def test_a_header_that_contradicts_itself_is_refused(place: int, value: int) -> None:
    content = bytearray(stored({"x": np.ones((2, 1))}))
    struct.pack_into("<i", content, 4 * place, value)
    with pytest.raises(DamagedMatError, match="no variable of version 4 begins at byte 0"):
        read_variables_of_version_4(bytes(content))


def test_sizes_beyond_the_file_take_no_memory() -> None:
    content = bytearray(stored({"x": np.ones((2, 1))}))
    struct.pack_into("<2i", content, 4, 2**31 - 1, 2**31 - 1)
    with pytest.raises(DamagedMatError, match="the file ends within the variable 'x'"):
        read_variables_of_version_4(bytes(content))
