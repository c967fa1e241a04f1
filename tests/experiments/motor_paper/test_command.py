"""`hydrostate motor-paper` and its page."""

import json
import re
from pathlib import Path

import pandas as pd
import pytest
from typer.testing import CliRunner

from experiments.cli import app
from experiments.motor_paper.study import MOTOR_PAPER_FIGURES

RUN = CliRunner()


@pytest.mark.slow
def test_the_study_writes_its_report_with_every_figure_and_erratum(tmp_path: Path) -> None:
    done = RUN.invoke(app, ["motor-paper", "--out", str(tmp_path / "paper"), "--json"])
    assert done.exit_code == 0, done.output
    assert json.loads(done.stdout)[0]["outcome"] == "ok"
    page = (tmp_path / "paper" / "report.html").read_text(encoding="utf-8")
    assert page.count("<figure") == len(MOTOR_PAPER_FIGURES)
    assert "the regression is circular" in page
    assert re.findall(r'<a href="#(M\d+)"', page)
    assert not set(re.findall(r'href="#(M\d+)"', page)) - set(re.findall(r'<dt id="(M\d+)"', page))
    regression = pd.read_csv(tmp_path / "paper" / "tables" / "regression.csv")
    assert regression["relative_difference"].max() < 1e-6


def test_a_file_in_place_of_the_result_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("mine", encoding="utf-8")
    done = RUN.invoke(app, ["motor-paper", "--out", str(tmp_path / "taken")])
    assert done.exit_code == 2
    assert "--out must be a folder, got the file" in " ".join(done.stderr.split())
