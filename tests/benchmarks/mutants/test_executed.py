"""The record of a run names the tests that a fault in a given line can make fail."""

import os
from pathlib import Path

import pytest
from coverage import CoverageData

from benchmarks.mutants.executed import Executed

SOURCE = """
LIMIT = 3


def held(x):
    if x > LIMIT:
        return LIMIT
    return x


def doubled(x, by=2):
    return by * x
"""

RAN = {
    "tests/plant/test_a.py::test_high|run": [6, 7],
    "tests/plant/test_b.py::test_low|run": [6, 8],
    "tests/plant/test_b.py::test_doubled|setup": [12],
    "": [2, 5, 11],
}
"""What a run would record: the lines of the file that each test executes."""


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A project with one source file and two test files, and a record of a run of its tests."""
    (tmp_path / "plant").mkdir()
    (tmp_path / "plant" / "a.py").write_text(SOURCE)
    for name in ("test_a.py", "test_b.py"):
        (tmp_path / "tests" / "plant" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "tests" / "plant" / name).touch()
    data = CoverageData(basename=str(tmp_path / "data"))
    for test, lines in RAN.items():
        data.set_context(test)
        data.add_lines({"plant/a.py": lines})
    data.write()
    return tmp_path


def first(project: Path, line: int, count: int) -> set[str]:
    """Return the names of the tests that are tried first."""
    named = Executed(project, project / "data").tests("plant/a.py", line)[:count]
    return {test.partition("::")[2] for test in named}


def test_a_fault_goes_first_to_the_tests_that_execute_its_line(project: Path) -> None:
    assert first(project, 7, 1) == {"test_high"}
    assert first(project, 8, 1) == {"test_low"}
    assert first(project, 6, 2) == {"test_high", "test_low"}


def test_a_fault_in_a_constant_goes_first_to_the_tests_of_the_functions_that_read_it(project: Path) -> None:
    assert first(project, 2, 2) == {"test_high", "test_low"}


def test_a_fault_in_a_default_value_goes_first_to_the_tests_of_its_function(project: Path) -> None:
    assert first(project, 11, 1) == {"test_doubled"}


def test_no_test_of_the_folder_is_left_out(project: Path) -> None:
    for line in (2, 6, 7, 8, 11, 12):
        assert first(project, line, 9) == {"test_high", "test_low", "test_doubled"}


def test_tests_in_the_files_own_test_file_come_first(project: Path) -> None:
    named = Executed(project, project / "data").tests("plant/a.py", 6)
    assert named[0] == "tests/plant/test_a.py::test_high"


def test_a_file_edited_after_the_recorded_run_has_no_tests_by_line(project: Path) -> None:
    later = (project / "data").stat().st_mtime + 10
    os.utime(project / "plant" / "a.py", (later, later))
    assert Executed(project, project / "data").of_file("plant/a.py") == {}
