import os
from pathlib import Path

import pytest

from experiments.batch.study_file import StudyError, parse_study, read_study
from plant.eha.rig import read_rig
from plant.errors import RigError
from plant.small_file import small_file


@pytest.fixture
def pipe(tmp_path: Path) -> Path:
    os.mkfifo(tmp_path / "pipe.toml")
    return tmp_path / "pipe.toml"


def test_a_pipe_is_not_waited_for(pipe: Path) -> None:
    with pytest.raises(RigError, match="a regular file is needed"):
        read_rig(pipe)
    with pytest.raises(StudyError, match="a regular file is needed"):
        read_study(pipe)


def test_a_device_without_end_is_refused() -> None:
    with pytest.raises(RigError, match="a regular file is needed"):
        read_rig("/dev/zero")


def test_a_file_that_no_person_wrote_is_refused_by_its_size(tmp_path: Path) -> None:
    (tmp_path / "large.toml").write_bytes(b"#" * 101)
    with pytest.raises(OSError, match="it has more than"):
        small_file(tmp_path / "large.toml", 100)


def test_a_decimal_comma_is_named_in_rig_and_study_files(tmp_path: Path) -> None:
    (path := tmp_path / "comma.toml").write_text("[parameters]\nmoving_mass = 20,5  # kg\n")
    for read, error in ((read_rig, RigError), (read_study, StudyError)):
        with pytest.raises(error, match=r"line 2.*; moving_mass = 20,5 has a decimal comma, write a point"):
            read(path)


@pytest.mark.parametrize("name", ["../up", "a/b", ".", "..", "a\x1b[2J", "a\\b", "", "x" * 200])
def test_a_study_is_called_what_a_folder_may_be(name: str) -> None:
    content = {"name": name, "runs": [{"seeds": 1, "methods": [{"verb": "diagnose"}]}]}
    with pytest.raises(StudyError, match="name"):
        parse_study(content, "a.toml")
