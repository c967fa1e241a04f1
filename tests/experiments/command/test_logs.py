import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

import plant.log.files
from estimation.finding import OUTCOMES
from estimation.notes import SensorCode
from experiments.cli import app
from experiments.command.logs import Batch, read_log
from plant.errors import LogWarning, MissingColumnError
from plant.log.files import read_record, write_record
from plant.log.formats.detect import open_tables
from plant.log.notes import LogCode
from plant.log.record import Record
from plant.log.table import Table

WORDS = {outcome.value for outcome in OUTCOMES}
VERBS = ("estimate", "identify", "diagnose")


def invoke(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("good") / "good.csv"
    made = invoke("simulate", "--drive", "prbs", "--duration", 4, "--sample-time", 1e-3, "-o", path)
    assert made.exit_code == 0, made.output
    return path


def hostile(folder: Path, good: Path) -> dict[str, Path]:
    """Write one file of each kind that must be refused; return them by a part of the message."""
    lines = good.read_text().splitlines()
    others = ",0" * (lines[0].count(",") - 1)
    files = {
        "a header line is needed": b"",
        "at least 10 samples": (lines[0] + "\n").encode(),
        "column motor_speed_rad_s is missing": b"time_s,position_m\n" + b"".join(b"%d,1\n" % i for i in range(20)),
        "unit 'parsnip' is unknown": "\n".join(
            [lines[0].replace("position_m", "position_parsnip"), *lines[1:]]
        ).encode(),
        "must hold numbers, got 'oops'": "\n".join(
            [*lines[:30], *(f"{row / 1e3:.3f},oops{others}" for row in range(29, 129)), *lines[130:]]
        ).encode(),
        "must be finite": "\n".join([*lines[:30], "0.029,inf" + others, *lines[31:]]).encode(),
        "got binary data": bytes(range(256)),
    }
    paths: dict[str, Path] = {}
    for number, (sentence, content) in enumerate(files.items()):
        paths[sentence] = folder / f"hostile{number}.csv"
        paths[sentence].write_bytes(content)
    paths["there is no such file"] = folder / "none.csv"
    paths["a file is needed, got a folder; `hydrostate fleet FOLDER` reads all logs of one"] = folder
    return paths


@pytest.mark.parametrize("verb", VERBS)
def test_hostile_logs_are_named_and_the_good_ones_among_them_processed(verb: str, good: Path, tmp_path: Path) -> None:
    bad = list(hostile(tmp_path, good).values())
    done = invoke(verb, good, *bad, good, "--json")
    results = json.loads(done.stdout)
    assert done.exit_code == 1
    assert [one["file"] for one in results] == [str(path) for path in (good, *bad, good)]
    assert [one["outcome"] for one in results] == ["ok", *["failed"] * len(bad), "ok"]
    assert {one["outcome"] for one in results} <= WORDS
    assert results[0] == results[-1]
    assert all(set(one) == set(results[0]) for one in results[1:-1]) or verb == "identify"
    for path, one in zip(bad, results[1:-1], strict=True):
        assert f"{path}: {one['message']}" in done.stderr.splitlines()
    assert "Traceback" not in done.output


def test_each_hostile_log_gets_its_own_message(good: Path, tmp_path: Path) -> None:
    files = hostile(tmp_path, good)
    results = json.loads(invoke("diagnose", *files.values(), "--json").stdout)
    assert [sentence for sentence, one in zip(files, results, strict=True) if sentence not in one["message"]] == []


@pytest.mark.parametrize("verb", VERBS)
def test_the_exit_code_is_2_if_no_log_can_be_read(verb: str, tmp_path: Path) -> None:
    done = invoke(verb, tmp_path / "a.csv", tmp_path / "b.csv", "--out", tmp_path / "out", "--json")
    assert done.exit_code == 2
    assert [one["outcome"] for one in json.loads(done.stdout)] == ["failed", "failed"]
    assert json.loads((tmp_path / "out" / "results.json").read_text()) == json.loads(done.stdout)


def test_an_internal_error_on_one_log_leaves_the_others_processed(good: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(path: Path, beside: str | None) -> tuple[Table, ...]:
        if path.name == "broken.csv":
            raise RuntimeError("the mill is broken")
        return open_tables(path, beside)

    monkeypatch.setattr(plant.log.files, "open_tables", broken)
    done = invoke("diagnose", good.with_name("broken.csv"), good, "--json")
    assert done.exit_code == 1
    assert [one["outcome"] for one in json.loads(done.stdout)] == ["failed", "ok"]
    assert "broken.csv: an internal error (RuntimeError: the mill is broken), please report it" in done.stderr


def test_an_interruption_keeps_the_results_so_far(good: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(path: Path, beside: str | None) -> tuple[Table, ...]:
        if path.name == "second.csv":
            raise KeyboardInterrupt
        return open_tables(path, beside)

    monkeypatch.setattr(plant.log.files, "open_tables", interrupted)
    done = invoke("diagnose", good, good.with_name("second.csv"), good, "--json", "--out", tmp_path)
    assert done.exit_code == 130
    assert "interrupted after 1 of 3 logs" in done.stderr.splitlines()
    assert [one["file"] for one in json.loads(done.stdout)] == [str(good)]
    assert len(json.loads((tmp_path / "results.json").read_text())) == 1


def test_an_interruption_before_the_first_log_leaves_earlier_results_as_they_are(
    good: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object, **__: object) -> Record:
        raise KeyboardInterrupt

    (tmp_path / "found.json").write_text("earlier")
    monkeypatch.setattr(plant.log.files, "open_tables", interrupted)
    done = CliRunner().invoke(app, ["estimate", str(good), "--out", str(tmp_path / "found.json")])
    assert (done.exit_code, "written" in done.stderr) == (130, False)
    assert (tmp_path / "found.json").read_text() == "earlier"


def test_a_warning_is_printed_with_the_log_and_kept_in_the_result(good: Path, tmp_path: Path) -> None:
    record = read_record(good)
    gappy = record["velocity_m_s"].copy()
    gappy[100:150] = np.nan
    write_record(record.replace(velocity_m_s=gappy), tmp_path / "gappy.csv")
    done = invoke("diagnose", good, tmp_path / "gappy.csv", "--json")
    plain, warned = json.loads(done.stdout)
    masked = LogCode.SAMPLES_MASKED.note(channel="velocity_m_s", count=50, total=4000, percent=1.25)
    assert warned["warnings"][0] == str(masked)
    assert [one["code"] for one in plain["notes"]].count("samples_masked") == 0
    assert str(masked) not in plain["warnings"]
    assert masked.to_dict() in warned["notes"]
    assert masked.to_dict() not in plain["notes"]
    assert f"{tmp_path / 'gappy.csv'}: warning: {masked}" in done.stderr.splitlines()


def test_clipped_slow_or_outlying_pressure_is_noted_and_bulk_modulus_still_found(good: Path, tmp_path: Path) -> None:
    record = read_record(good)
    pressure = record["differential_pressure_pa"]
    limit = 0.7 * np.max(np.abs(pressure))
    channel = "differential_pressure_pa"
    logs = {
        SensorCode.SENSOR_CLIPPED: np.clip(pressure, -limit, limit),
        LogCode.CHANNEL_SLOWER: np.where(np.arange(len(record)) % 4 == 1, pressure, np.nan),
        SensorCode.OUTLIERS_LEFT_OUT: np.where(np.isin(np.arange(len(record)), (9, 99)), 1e8, pressure),
    }
    wanted = {
        LogCode.CHANNEL_SLOWER: {"channel": channel, "rows": 4},
        SensorCode.OUTLIERS_LEFT_OUT: {"channel": channel, "count": 2, "total": 4000},
    }
    for name, values in zip("abc", logs.values(), strict=True):
        write_record(record.replace(differential_pressure_pa=values), tmp_path / f"{name}.csv")
    done = invoke("estimate", *(tmp_path / f"{name}.csv" for name in "abc"), "--json")
    for code, one in zip(logs, json.loads(done.stdout), strict=True):
        low, high = one["bulk_modulus_pa"]["ci95"]
        assert abs(one["bulk_modulus_pa"]["value"] - 2.07e8) < 0.75 * (high - low)  # three standard deviations
        assert one["gate"]["passed"]
        (note,) = (note for note in one["notes"] if note["code"] == code)
        assert note["data"]["channel"] == channel
        assert note["data"] == wanted.get(code, note["data"])
        assert note["text"] in one["warnings"]


@pytest.mark.parametrize(
    ("outcomes", "total", "code"),
    [
        (("ok", "ok"), 2, 0),
        (("ok", "not_observable"), 2, 0),
        (("not_observable",), 1, 0),
        (("ok", "failed"), 2, 1),
        (("diverged", "ok"), 2, 1),
        (("diverged", "failed"), 2, 1),
        (("failed", "failed"), 2, 2),
        (("ok",), 2, 130),
        ((), 2, 130),
    ],
)
def test_exit_code_follows_from_the_outcomes(outcomes: tuple[str, ...], total: int, code: int) -> None:
    assert Batch(tuple({"outcome": outcome} for outcome in outcomes), total).exit_code == code


def test_results_written_beside_the_screen_are_the_same_as_with_json(good: Path, tmp_path: Path) -> None:
    shown = invoke("diagnose", good, "--out", tmp_path / "new")
    printed = json.loads(invoke("diagnose", good, "--json").stdout)
    assert shown.exit_code == 0
    assert json.loads((tmp_path / "new" / "results.json").read_text()) == printed
    assert sorted(path.name for path in (tmp_path / "new").iterdir()) == ["results.csv", "results.json"]


def test_a_full_disk_loses_the_results_file_and_not_the_printed_results(
    good: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: Path) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    done = invoke("diagnose", good, "--json", "--out", tmp_path)
    assert done.exit_code == 1
    assert json.loads(done.stdout)[0]["outcome"] == "ok"
    assert "No space left on device" in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_columns_of_the_rig_file_missing_from_a_log_give_a_warning(good: Path) -> None:
    columns = {"position_m": "POS_MM:mm", "differential_pressure_pa": "DP_BAR:bar"}
    with pytest.warns(LogWarning) as caught:
        record = read_log(good, columns, {})
    assert [one.message.note for one in caught] == [LogCode.COLUMNS_ABSENT.note(columns="POS_MM:mm, DP_BAR:bar")]
    assert "differential_pressure_pa" in record


def test_a_missing_column_of_the_option_columns_is_an_error(good: Path) -> None:
    done = invoke("estimate", good, "--columns", "position_m=POS_MM:mm", "--json")
    assert done.exit_code == 2
    assert "column 'POS_MM' is needed for position_m" in json.loads(done.stdout)[0]["message"]


def test_columns_of_the_command_line_take_precedence_over_the_rig_file(good: Path) -> None:
    with pytest.raises(MissingColumnError) as caught:
        read_log(good, {"position_m": "position_m"}, {"position_m": "OTHER"})
    assert (caught.value.channel, caught.value.column, caught.value.source) == ("position_m", "OTHER", str(good))
