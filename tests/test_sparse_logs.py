"""A log that lacks up to half of its samples can be identified, as on the command line; other verbs refuse it."""

import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

import hydrostate as hs
from estimation.identification.model.recursion import filtered
from experiments.cli import app
from plant.errors import LogWarning

MOTION = {"input": "motor_speed_rad_s", "output": "velocity_m_s"}
LEFT_OUT = r"time_s leaves out \d+ of \d+ samples, wanted at most 5 %; the longest gap is before row \d+"


@pytest.fixture(scope="module")
def run() -> pd.DataFrame:
    log = hs.simulate("normal", duration=2.0, sample_time=1e-3, seed=3)
    return log.to_frame()[["motor_speed_rad_s", "velocity_m_s", "differential_pressure_pa"]].reset_index()


@pytest.fixture
def holed(run: pd.DataFrame, tmp_path: Path) -> Path:
    """Return the file of a log whose logger stopped for a tenth of the time."""
    path = tmp_path / "holed.csv"
    run.drop(index=range(700, 900)).to_csv(path, index=False)
    return path


def sparse(path: Path) -> hs.Log:
    with pytest.warns(LogWarning) as said:
        log = hs.read(path)
    assert any("motor_speed_rad_s is missing in 200 of 2000" in str(one.message) for one in said)
    return log


def by_command(path: Path, tmp_path: Path, *arguments: str) -> list[float]:
    names = ["--input", MOTION["input"], "--output", arguments[0] if arguments else MOTION["output"]]
    form = ["--order", "2", "--delay", "1", "--out", str(tmp_path / "m.json")]
    done = CliRunner().invoke(app, ["identify", str(path), *names, *form])
    assert done.exit_code == 0, done.stderr
    (found,) = json.loads((tmp_path / "m.json").read_text())
    return [*np.ravel(found["numerator"]), *found["denominator"]]


def test_python_and_the_command_identify_the_same_model_from_a_log_with_a_gap(holed: Path, tmp_path: Path) -> None:
    with pytest.warns(LogWarning):
        model = sparse(holed).identify(**MOTION, order=2, delay=1)
    assert [*np.ravel(model.numerator), *model.denominator] == pytest.approx(by_command(holed, tmp_path), rel=1e-9)


@pytest.mark.parametrize(
    "verb",
    [
        lambda log: log.estimate(),
        lambda log: log.diagnose(),
        lambda log: log.identify(),
        lambda log: hs.features(log),
        lambda log: log.between(0.0, 0.5).estimate(),
    ],
)
def test_all_verbs_but_identification_refuse_a_log_with_a_long_gap(
    holed: Path, verb: Callable[[hs.Log], object]
) -> None:
    log = sparse(holed)
    with pytest.raises(hs.LogError, match=f"^{re.escape(str(holed))}: {LEFT_OUT}$"):
        verb(log)


def test_a_log_with_over_half_of_its_samples_missing_is_refused_by_read(run: pd.DataFrame, tmp_path: Path) -> None:
    run.drop(index=range(400, 1500)).to_csv(tmp_path / "most.csv", index=False)
    with pytest.raises(hs.LogError, match=LEFT_OUT):
        hs.read(tmp_path / "most.csv")


def test_a_channel_too_sparse_for_estimates_is_used_in_identification_with_a_warning(
    run: pd.DataFrame, tmp_path: Path
) -> None:
    gone = run.copy()
    gone.loc[500:900, "differential_pressure_pa"] = np.nan
    gone.to_csv(tmp_path / "gone.csv", index=False)
    with pytest.warns(LogWarning, match=r"pressure_pa is missing in 401 of 2000 .*; the channel is not used"):
        log = hs.read(tmp_path / "gone.csv")
    assert "differential_pressure_pa" not in log.channels
    with pytest.warns(LogWarning, match=r"pressure_pa is missing in 401 of 2000 .*; those samples are not used"):
        model = log.identify(input="motor_speed_rad_s", output="differential_pressure_pa", order=2, delay=1)
    wanted = by_command(tmp_path / "gone.csv", tmp_path, "differential_pressure_pa")
    assert [*np.ravel(model.numerator), *model.denominator] == pytest.approx(wanted, rel=1e-9)
    assert "differential_pressure_pa" in log.between(0.0, 1.0).related


def test_a_model_is_identified_from_a_column_with_missing_samples() -> None:
    rng = np.random.default_rng(1)
    u = np.repeat(rng.normal(size=80), 5)
    y = 3.0 + filtered([0.0, 0.5], [1.0, -0.5], u) + 0.01 * rng.normal(size=400)
    y[rng.random(400) < 0.3] = np.nan
    table = pd.DataFrame({"t": 0.1 * np.arange(400), "coil": u, "gap": y})
    with pytest.warns(LogWarning, match="gap is missing"):
        log = hs.read(table)
    with pytest.warns(LogWarning, match="those samples are not used"):
        model = log.identify(input="coil", output="gap", order=1, delay=1)
    assert model.denominator == pytest.approx([1.0, -0.5], abs=0.02)
    assert model.simulate(log).shape == (400,)


def test_a_pressure_that_begins_late_does_not_shorten_the_record_for_identification(
    run: pd.DataFrame, tmp_path: Path
) -> None:
    late = run.copy()
    late.loc[:699, "differential_pressure_pa"] = np.nan
    late.to_csv(path := tmp_path / "late.csv", index=False)
    with pytest.warns(LogWarning, match=r"is logged only from 0\.7 s to"):
        log = hs.read(path)
    assert (len(log.record), len(log.related)) == (len(run) - 700, len(run))
    assert log.record.start_time == pytest.approx(0.7)
    part = log.between(1.0, 1.2)
    assert part.related.start_time == part.record.start_time == pytest.approx(1.0)
    assert (part.related["velocity_m_s"] == part.record["velocity_m_s"]).all()
