import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from estimation.eha.online import StreamFilterOptions, begin_filter
from experiments.cli import app
from plant.eha.drives import sine
from plant.eha.model import EhaParameters
from plant.eha.simulate import LUMPED, simulate
from plant.log.files import write_record
from plant.log.record import Record
from plant.sensors.sensors import BENCH

T = 1e-3
P = EhaParameters()


def bench() -> Record:
    rng = np.random.default_rng(3)
    return simulate(LUMPED, sine(4.0, T, P.rated_speed, 5.0), T, P, sensors=BENCH, rng=rng)


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("filter") / "run.csv"
    write_record(bench(), path)
    return path


def run(*arguments: object, given: str | None = None) -> tuple[int, list[dict[str, Any]], str]:
    result = CliRunner().invoke(app, ["filter", *map(str, arguments)], input=given)
    return result.exit_code, [json.loads(line) for line in result.stdout.splitlines()], result.stderr


def test_a_filtered_stream_gives_bulk_modulus_with_its_standard_deviation(log: Path) -> None:
    code, told, said = run("-", given=log.read_text())
    assert "leakage and friction are taken from the rig 'paper'" in said
    assert (code, "warning" in said) == (0, False)  # not `said == ""`: the first run may announce that it compiles
    assert [one["event"] for one in told] == ["start", *["estimate"] * 4, "end"]
    last = told[-2]
    assert last["values"]["bulk_modulus_pa"] == pytest.approx(P.bulk_modulus, rel=0.01)
    assert 0.0 < last["std"]["bulk_modulus_pa"] < 0.01 * P.bulk_modulus
    assert (last["gate"], last["samples"], told[-1]["outcome"]) == ([], 4000, "ok")


def test_a_filter_estimates_groups_of_parameters_by_their_short_names(log: Path) -> None:
    _, told, said = run(log, "--states", "leakage,friction")
    assert {"leakage_coefficient", "flow_bias", "friction_linear", "friction_coulomb"} <= told[-2]["values"].keys()
    assert "taken from the rig" not in said


def test_a_restart_between_two_rows_does_not_change_the_result(log: Path, tmp_path: Path) -> None:
    state, (header, *rows) = tmp_path / "filter.npz", log.read_text().splitlines(keepends=True)
    run("-", "--state", state, given=header + "".join(rows[:2345]))
    told = run("-", "--state", state, given=header + "".join(rows[2346:]))[1]
    # row 2345 never came: it is a missing sample, for a restarted filter as for one that ran on
    lost = run("-", given=header + "".join(rows[:2345] + rows[2346:]))[1]
    assert told[0]["message"] == "continued"
    assert (told[-2]["values"], told[-2]["std"]) == (lost[-2]["values"], lost[-2]["std"])
    state.unlink()
    whole = run("-", given=log.read_text())[1]
    run("-", "--state", state, given=header + "".join(rows[:2345]))
    told = run("-", "--state", state, given=header + "".join(rows[2345:]))[1]
    assert (told[-2]["values"], told[-2]["std"]) == (whole[-2]["values"], whole[-2]["std"])


def test_after_a_long_gap_the_filter_begins_again_with_a_warning(log: Path, tmp_path: Path) -> None:
    state, (header, *rows) = tmp_path / "filter.npz", log.read_text().splitlines(keepends=True)
    code, told, said = run("-", given=header + "".join(rows[:1000] + rows[2500:]))
    assert code == 0
    assert [one["message"] for one in told if one["event"] == "start"] == ["begun", "begun"]
    assert "rows are missing before" in said
    assert told[-1]["samples"] == 1500
    run("-", "--state", state, given=header + "".join(rows[:1000]))
    _, told, said = run("-", "--state", state, given=header + "".join(rows[2500:]))
    assert told[0]["message"] == "begun"
    assert "the stream does not continue at" in said


def test_option_like_takes_the_sensor_noise_from_another_log(log: Path) -> None:
    record = bench()
    asked = StreamFilterOptions(P, "pressure", "ekf")
    loud = record.replace(position_m=record["position_m"] + 1e-4 * np.random.default_rng(0).normal(size=len(record)))
    own, other = begin_filter(asked, record).problem, begin_filter(asked, record, loud).problem
    assert other.variances[0] > 100.0 * own.variances[0]
    spoilt = log.with_name("spoilt.csv")
    lines = log.read_text().splitlines(keepends=True)
    spoilt.write_text("".join([*lines[:900], "overload\n", *lines[900:]]))
    code, told, said = run(log, "--like", spoilt, "--every", "10")
    assert (code, len(told)) == (0, 3)
    assert f"{spoilt}: warning: lines that are not rows of data were left out (lines: 1" in said


def test_a_state_of_another_filter_actuator_or_rate_is_refused(log: Path, tmp_path: Path) -> None:
    state, rig = tmp_path / "filter.npz", tmp_path / "rig.toml"
    assert run(log, "--state", state)[0] == 0
    CliRunner().invoke(app, ["rig", "init", str(rig)])
    rig.write_text(rig.read_text().replace("moving_mass = 7.376", "moving_mass = 9.0"))
    assert "is of pressure ekf, asked for is flow ekf" in run(log, "--state", state, "--form", "flow")[2]
    assert "of an actuator with other parameters" in run(log, "--state", state, "--rig", rig)[2]
    slow = tmp_path / "slow.csv"
    write_record(Record(2 * T, {name: bench()[name] for name in bench()}), slow)
    assert "was saved at 1000 Hz, but the stream has 500 Hz" in run(slow, "--state", state)[2]
    state.write_text("no state")
    assert "a state of hydrostate filter is needed" in run(log, "--state", state)[2]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--form", "motion"), "form must be one of"),
        (("--method", "imm"), "a method that filters a stream must be one of"),
        (("--every", "0"), "--every"),
        (("--like", "nowhere.csv"), "nowhere.csv"),
    ],
)
def test_invalid_options_are_refused(log: Path, arguments: tuple[str, ...], said: str) -> None:
    code, _, error = run(log, *arguments)
    assert code == 2
    assert said in error
    assert "Traceback" not in error


def test_a_stream_without_a_needed_channel_and_a_missing_file_are_refused(tmp_path: Path) -> None:
    code, told, error = run("-", "--form", "flow", given="time_s,motor_speed_rad_s\n0.0,1\n0.1,1\n0.2,1\n")
    assert code == 2
    assert told[-1]["outcome"] == "failed"
    assert "standard input" in error
    assert "it cannot be read" in run(tmp_path / "nowhere.csv")[2]


@pytest.mark.parametrize("name", ["run.parquet", "run.csv.gz"])
def test_a_log_that_is_no_text_is_refused_with_the_command_that_filters_it(tmp_path: Path, name: str) -> None:
    write_record(bench(), tmp_path / name)
    code, told, said = run(tmp_path / name)
    assert (code, told[-1]["outcome"]) == (2, "failed")
    assert "estimate LOG --method ekf" in said
