"""A comparison of two studies, on the terminal and for a program."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from experiments.cli import app

STUDY = """
name = "{name}"
[[runs]]
plants = ["reduced"]
drives = ["sine"]
conditions = ["normal"]
seeds = 6
starts_pa = [{start}]
duration_s = 0.05
methods = [{{ verb = "filter", form = "acceleration", method = "ekf" }}]
"""


@pytest.fixture(scope="module")
def stores(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("compared")
    for name, start in (("near", 2e8), ("far", 0.0)):
        (folder / f"{name}.toml").write_text(STUDY.format(name=name, start=start), encoding="utf-8")
        words = ["batch", str(folder / f"{name}.toml"), "--out", str(folder / name), "--workers", "1"]
        assert CliRunner().invoke(app, words).exit_code == 0
    return folder / "near", folder / "far"


def test_json_contains_the_rows_of_the_screen(stores: tuple[Path, Path]) -> None:
    words = ["compare", *map(str, stores)]
    shown = CliRunner().invoke(app, words)
    (told,) = json.loads(CliRunner().invoke(app, [*words, "--json"]).stdout)
    assert shown.exit_code == 0, shown.output
    assert (told["first"], told["second"]) == tuple(map(str, stores))
    (error,) = [row for row in told["rows"] if row["condition"] == "all" and row["measure"] == "error of bulk modulus"]
    assert error["series"] == 6
    assert error["difference"] == pytest.approx(error["second"] - error["first"])
    assert "near [%]" in shown.stdout
    assert f"{error['difference']:+.3g}" in shown.stdout
    same = CliRunner().invoke(app, ["compare", str(stores[0]), str(stores[0])])
    assert "A [%]" in same.stdout  # two studies with the same name are called A and B


@pytest.mark.slow
def test_two_logs_are_compared_on_the_terminal_on_a_page_and_for_a_program(tmp_path: Path) -> None:
    logs = [str(tmp_path / f"{name}.csv") for name in ("before", "after")]
    for log, leakage in zip(logs, ("0", "1"), strict=True):
        how = ["--drive", "steps", "--duration", "2", "--sample-time", "2e-3", "--leakage-severity", leakage]
        assert CliRunner().invoke(app, ["simulate", *how, "--out", log]).exit_code == 0
    shown = CliRunner().invoke(app, ["compare", *logs, "--report", str(tmp_path / "page.html")])
    assert shown.exit_code == 0, shown.output
    title = next(line for line in shown.stdout.splitlines() if line.startswith("In the second log, "))
    assert "leakage" in title.partition(" higher")[0]
    assert title in (tmp_path / "page.html").read_text(encoding="utf-8")
    (told,) = json.loads(CliRunner().invoke(app, ["compare", *logs, "--json"]).stdout)
    leak = next(row for row in told["differences"] if row["quantity"] == "leakage_flow")
    assert leak["changed"]
    assert leak["interval"][0] > 2.0
    same = CliRunner().invoke(app, ["compare", logs[0], logs[0]])
    assert (same.exit_code, "twice" in same.output) == (2, True)


def test_a_page_with_another_ending_than_html_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("")
    both = [str(tmp_path / "a.csv"), str(tmp_path / "b.csv")]
    done = CliRunner().invoke(app, ["compare", *both, "--report", str(tmp_path / "x.pdf")])
    assert done.exit_code == 2
    assert "--report (--out) must end in .html, got 'x.pdf'; a browser prints the page as PDF" in " ".join(
        done.output.split()
    )


def test_a_missing_log_is_refused_by_its_name(tmp_path: Path) -> None:
    (tmp_path / "before.csv").touch()
    done = CliRunner().invoke(app, ["compare", str(tmp_path / "before.csv"), str(tmp_path / "after.csv")])
    assert done.exit_code == 2
    assert "after.csv: there is no such file" in " ".join(done.stderr.split())


def test_logs_without_time_are_compared_with_a_given_sample_time(tmp_path: Path) -> None:
    logs = [tmp_path / f"{name}.csv" for name in ("before", "after")]
    for log in logs:
        how = ["--duration", "0.5", "--sample-time", "2e-3", "--out", str(log)]
        assert CliRunner().invoke(app, ["simulate", *how]).exit_code == 0
        rows = log.read_text("utf-8").splitlines()
        log.write_text("\n".join(row.partition(",")[2] for row in rows), encoding="utf-8")
    words = ["compare", *map(str, logs), "--json"]
    refused = CliRunner().invoke(app, words)
    assert (refused.exit_code, "give --sample-time" in " ".join(refused.stderr.split())) == (2, True), refused.stderr
    (told,) = json.loads(CliRunner().invoke(app, [*words, "--sample-time", "2e-3"]).stdout)
    assert (told["outcome"], bool(told["differences"])) == ("ok", True)
    wrong = CliRunner().invoke(app, [*words, "--sample-time", "0"])
    assert (wrong.exit_code, "--sample-time must be positive and finite" in wrong.stderr) == (2, True), wrong.stderr
