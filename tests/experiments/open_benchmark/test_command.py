"""`hydrostate benchmark`."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from experiments.cli import app
from experiments.open_benchmark.kinds import KINDS

RUN = CliRunner()


@pytest.mark.usefixtures("_short")
def test_make_writes_one_folder_for_each_kind(tmp_path: Path) -> None:
    asked = ["benchmark", "make", "--kind", "plain", "--kind", "single_rod", "--count", "2", "--out", str(tmp_path)]
    done = RUN.invoke(app, [*asked, "--json"])
    assert done.exit_code == 0, done.output
    assert [entry["logs"] for entry in json.loads(done.stdout)] == [2, 2]
    assert sorted(path.name for path in (tmp_path / "single_rod").iterdir()) == [
        *("rig.toml", "run000.csv", "run001.csv", "truth.csv")
    ]


@pytest.mark.parametrize("wrong", [["--kind", "plane"], ["--split", "tests"], ["--count", "0"]])
def test_make_refuses_unknown_kinds_and_splits_and_a_count_of_zero(wrong: list[str], tmp_path: Path) -> None:
    done = RUN.invoke(app, ["benchmark", "make", "--out", str(tmp_path), *wrong])
    assert done.exit_code == 2
    assert not any(tmp_path.iterdir())


def test_the_command_kinds_lists_every_kind() -> None:
    done = RUN.invoke(app, ["benchmark", "kinds", "--json"])
    assert [entry["kind"] for entry in json.loads(done.stdout)] == list(KINDS)
    assert len(RUN.invoke(app, ["benchmark", "kinds"]).stdout.splitlines()) == len(KINDS)
