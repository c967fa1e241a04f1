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


def test_a_pipe_is_refused_without_waiting(pipe: Path) -> None:
    with pytest.raises(RigError, match="a regular file is needed"):
        read_rig(pipe)
    with pytest.raises(StudyError, match="a regular file is needed"):
        read_study(pipe)


def test_a_device_file_is_refused() -> None:
    with pytest.raises(RigError, match="a regular file is needed"):
        read_rig("/dev/zero")


def test_a_file_above_the_size_limit_is_refused(tmp_path: Path) -> None:
    (tmp_path / "large.toml").write_bytes(b"#" * 101)
    with pytest.raises(OSError, match="it has more than"):
        small_file(tmp_path / "large.toml", 100)


def test_a_decimal_comma_is_named_in_rig_and_study_files(tmp_path: Path) -> None:
    (path := tmp_path / "comma.toml").write_text("[parameters]\nmoving_mass = 20,5  # kg\n")
    for read, error in ((read_rig, RigError), (read_study, StudyError)):
        with pytest.raises(error, match=r"line 2.*; moving_mass = 20,5 has a decimal comma, write a point"):
            read(path)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("flow_bias = \u22121e-6", "has a minus sign that is none of TOML, write a hyphen (-)"),
        ("stroke = \u201c200 mm\u201d", 'has quotes that are none of TOML, write "'),
        ("bulk_modulus = 1,400,000,000", "has commas, write nothing between thousands"),
        ("bulk_modulus = 1.4 GPa", "has a unit, write the number and its unit in quotes"),
        ("bulk_modulus = 1.4e9 Pa", "has a unit, write the number and its unit in quotes"),
        ("bulk modulus = 1.4e9", "has a space in its name, write an underscore (_)"),
        ("bulk_modulus: 1.4e9", "has a colon, write an equals sign (=)"),
    ],
)
def test_a_common_mistake_in_a_line_is_named(tmp_path: Path, line: str, said: str) -> None:
    (path := tmp_path / "rig.toml").write_text(f"[parameters]\n{line}\n", encoding="utf-8")
    with pytest.raises(RigError) as error:
        read_rig(path)
    assert str(error.value).endswith(f"; {line} {said}")


@pytest.mark.parametrize("name", ["../up", "a/b", ".", "..", "a\x1b[2J", "a\\b", "", "x" * 200])
def test_a_study_name_that_is_no_valid_folder_name_is_refused(name: str) -> None:
    content = {"name": name, "runs": [{"seeds": 1, "methods": [{"verb": "diagnose"}]}]}
    with pytest.raises(StudyError, match="name"):
        parse_study(content, "a.toml")
