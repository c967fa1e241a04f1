"""A state is read back as it was kept; a damaged file or one of another kind is refused."""

from pathlib import Path

import numpy as np
import pytest

from plant.errors import HydrostateError
from plant.kept import read_kept, write_kept


def test_a_state_is_read_back_and_refused_as_another_kind(tmp_path: Path) -> None:
    path = tmp_path / "watch.state"
    write_kept(path, "watch 1", {"mean": np.arange(3.0)})
    found = read_kept(path, "watch 1")
    assert list(found) == ["mean"]
    np.testing.assert_array_equal(found["mean"], np.arange(3.0))
    with pytest.raises(
        HydrostateError, match=r"watch\.state: a state of watch is needed, the file is one of 'watch 1'.*delete it"
    ):
        read_kept(path, "watch 2")


def test_a_missing_file_or_one_without_a_state_is_refused_in_one_sentence(tmp_path: Path) -> None:
    path = tmp_path / "watch.state"
    for content in (None, b"", b"PK\x03\x04 and no more", b"text"):
        if content is not None:
            path.write_bytes(content)
        said = r"watch\.state: a state of watch is needed[:,] (No such|the file holds none)"
        with pytest.raises(HydrostateError, match=said):
            read_kept(path, "watch 1")
