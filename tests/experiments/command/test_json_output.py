import json
from pathlib import Path

import numpy as np
import pytest

from estimation.eha.bulk_modulus import Outcome
from experiments.command.json_output import csv_text, json_text, plain, prepare_output, write_results, write_whole
from plant.errors import HydrostateError


def test_nan_and_infinity_are_written_as_null() -> None:
    text = json_text([{"value": float("nan"), "ci95": (-np.inf, np.float64(1.5)), "rows": np.array([[np.nan, 2.0]])}])
    assert json.loads(text) == [{"value": None, "ci95": [None, 1.5], "rows": [[None, 2.0]]}]


def test_enumerations_paths_and_numpy_scalars_become_plain_values() -> None:
    values = {"outcome": Outcome.OK, "file": Path("a.csv"), "count": np.int64(3), "passed": np.bool_(True)}
    found = plain(values)
    assert found == {"outcome": "ok", "file": "a.csv", "count": 3, "passed": True}
    assert type(found["outcome"]) is str


def test_the_json_text_is_ascii_and_keeps_file_names() -> None:
    text = json_text([{"file": "Prüfstand \udc80.csv"}])
    assert text.isascii()
    assert json.loads(text)[0]["file"] == "Prüfstand \udc80.csv"


def test_table_has_a_column_for_every_entry_of_any_log() -> None:
    text = csv_text([{"file": "a", "gate": {"passed": True}}, {"file": "b", "scores": {"normal": 1.0}}])
    assert text.splitlines() == ["file,gate.passed,scores.normal", "a,True,", "b,,1.0"]


def test_results_replace_older_ones_without_leaving_other_files(tmp_path: Path) -> None:
    out = tmp_path / "new" / "folder"
    prepare_output(out)
    write_results([{"file": "old"}], out)
    write_results([{"file": "new"}], out)
    assert json.loads((out / "results.json").read_text()) == [{"file": "new"}]
    assert sorted(path.name for path in out.iterdir()) == ["results.csv", "results.json"]


def test_results_to_a_name_ending_in_json_are_one_file(tmp_path: Path) -> None:
    out = tmp_path / "model.json"
    prepare_output(out)
    assert write_results([{"file": "a"}], out) == [out]
    assert [path.name for path in tmp_path.iterdir()] == ["model.json"]


def test_results_that_cannot_be_written_leave_the_old_ones(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_results([{"file": "old"}], tmp_path)

    def full(*_: Path) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    with pytest.raises(HydrostateError, match=r"results\.json: cannot be written: No space left"):
        write_results([{"file": "new"}], tmp_path)
    assert json.loads((tmp_path / "results.json").read_text()) == [{"file": "old"}]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["results.csv", "results.json"]


def test_a_file_in_place_of_the_results_folder_is_refused_and_kept(tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("mine")
    with pytest.raises(HydrostateError, match=r"--out .*taken: the folder cannot be made"):
        prepare_output(tmp_path / "taken")
    assert (tmp_path / "taken").read_text() == "mine"


@pytest.mark.parametrize(
    ("log", "out"), [("run.json", "run.json"), ("run.csv", "run.csv.json"), ("results.csv", "."), ("a/run.json", "b")]
)
def test_results_never_overwrite_a_log_or_its_side_file(log: str, out: str, tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "b").symlink_to("a")
    for name in (log, "run.csv.json"):
        (tmp_path / name).write_text("a log")
    (tmp_path / "a" / "results.json").hardlink_to(tmp_path / log)
    with pytest.raises(HydrostateError, match="is read and would be overwritten; give another name"):
        prepare_output(tmp_path / out, [tmp_path / log])
    prepare_output(tmp_path / out, [tmp_path / "other.csv"])


def test_a_folder_in_place_of_the_file_and_missing_write_permission_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "model.json").mkdir()
    with pytest.raises(HydrostateError, match=r"model\.json: a file is needed, got a folder"):
        prepare_output(tmp_path / "model.json")
    monkeypatch.setattr("os.access", lambda *_: False)
    with pytest.raises(HydrostateError, match="there is no permission to write there"):
        prepare_output(tmp_path / "out")


def test_a_page_with_a_file_name_that_is_not_utf_8_is_written(tmp_path: Path) -> None:
    write_whole(tmp_path / "page.html", "<p>l\udcf6g.csv ü</p>")
    assert (tmp_path / "page.html").read_text(encoding="utf-8") == "<p>l?g.csv ü</p>"
