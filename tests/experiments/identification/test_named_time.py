"""The time of a log between any columns may be called anything, on the command line and in Python."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner, Result

import hydrostate as hs
from experiments.cli import app
from plant.errors import HydrostateError

FORM = ("--input", "load", "--output", "flow", "--order", 1, "--delay", 1)


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Return a log whose time is called so, and the same log whose time is called otherwise."""
    folder = tmp_path_factory.mktemp("times")
    rng = np.random.default_rng(7)
    load, flow = np.repeat(rng.normal(size=60), 5), np.zeros(300)
    for k in range(1, 300):
        flow[k] = 0.8 * flow[k - 1] + 0.4 * load[k - 1]
    frame = pd.DataFrame({"t_ms": 20.0 * np.arange(300), "load": load, "flow": flow + 0.02 * rng.normal(size=300)})
    frame.to_csv(folder / "timed.csv", index=False)
    frame.rename(columns={"t_ms": "Kanal 1"}).to_csv(folder / "renamed.csv", index=False)
    return folder / "timed.csv", folder / "renamed.csv"


def run(*arguments: object) -> Result:
    return CliRunner().invoke(app, ["identify", *map(str, arguments)])


def test_a_model_of_a_log_with_another_name_for_the_time_is_the_same(logs: tuple[Path, Path], tmp_path: Path) -> None:
    saved = tmp_path / "model.json"
    named = ("--columns", "time_s=Kanal 1:ms", "--json")
    (timed,) = json.loads(run(logs[0], *FORM, "--json").stdout)
    (one,) = json.loads(run(logs[1], *FORM, *named, "--validate", logs[1], "--out", saved).stdout)
    assert one["sample_time_s"] == timed["sample_time_s"] == pytest.approx(0.02)
    assert one["denominator"] == timed["denominator"]
    (again,) = json.loads(run(logs[1], "--simulate", saved, *named).stdout)
    assert again["fit_percent"] == pytest.approx(one["test"]["fit_percent"], abs=1e-9)


def test_a_named_time_and_a_sample_time_contradict_each_other(logs: tuple[Path, Path]) -> None:
    refused = run(logs[1], *FORM, "--columns", "time_s=Kanal 1:ms", "--json", "--sample-time", 0.02)
    assert "a column of time or a sample time is wanted, got both: 'Kanal 1:ms' and 0.02 s" in refused.stdout


def test_other_channels_are_not_named_between_columns(logs: tuple[Path, Path]) -> None:
    refused = run(logs[0], *FORM, "--structure", "narx", "--columns", "position_m=flow:mm")
    assert refused.exit_code == 2
    assert "only the time may be named, --columns time_s=NAME:UNIT" in " ".join(refused.output.split())


def test_python_reads_a_log_of_anything_whose_time_is_named(logs: tuple[Path, Path]) -> None:
    log = hs.read(logs[1], columns={"time_s": "Kanal 1:ms"})
    assert log.record.sample_time == pytest.approx(0.02)
    assert list(log.record) == ["load", "flow"]
    with pytest.raises(HydrostateError, match="'Kanal 2'"):
        hs.read(logs[1], columns={"time_s": "Kanal 2:ms"})
