"""A pattern finds the same files as `glob`, and circular links do not loop for ever."""

import os
from glob import glob
from pathlib import Path

import pytest

from experiments.batch.log_files import matching_files


@pytest.fixture
def logs(tmp_path: Path) -> Path:
    """Return a folder with logs at three depths, one of them hidden."""
    for name in ("a.csv", "run/b.csv", "run/[1]/c.csv", ".hidden/d.csv", "run/b.txt"):
        (tmp_path / "logs" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "logs" / name).write_text("x")
    return tmp_path / "logs"


@pytest.mark.parametrize("pattern", ["**/*.csv", "*.csv", "**", "*/**/*.csv", "**/run/**/c.*", "run/b.csv", "none/**"])
def test_a_pattern_finds_the_same_files_as_glob(logs: Path, pattern: str) -> None:
    wanted = [path for path in glob(f"{logs}/{pattern}", recursive=True) if Path(path).is_file()]  # noqa: PTH207
    assert matching_files(f"{logs}/{pattern}") == sorted(wanted)


def test_circular_links_are_followed_to_each_folder_only_once(logs: Path, tmp_path: Path) -> None:
    (logs / "loop").symlink_to(".")
    (logs / "run/up").symlink_to("..")
    (logs / "run/out").symlink_to(tmp_path)
    (logs / "itself").symlink_to("itself")
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere/e.csv").write_text("x")
    (logs / "linked").symlink_to(tmp_path / "elsewhere")
    (logs / "f.csv").symlink_to("a.csv")
    os.mkfifo(logs / "pipe.csv")
    found = [Path(path).relative_to(logs).as_posix() for path in matching_files(f"{logs}/**/*.csv")]
    assert found == ["a.csv", "f.csv", "linked/e.csv", "run/[1]/c.csv", "run/b.csv"]


def test_a_folder_that_is_a_link_is_searched(logs: Path, tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to(logs)
    assert len(matching_files(f"{tmp_path}/link/**/*.csv")) == 3
