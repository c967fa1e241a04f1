"""`hydrostate library` shows the models, and why they have the output-error structure."""

import json
import re
from collections.abc import Mapping
from pathlib import Path

import pandas as pd
import pytest
from rich.console import Console
from typer.testing import CliRunner

from estimation.identification import LinearModel
from estimation.identification.design.input_design import Limits
from experiments.cli import app
from experiments.library.figures import LIBRARY_FIGURES
from experiments.library.sentences import structure_sentences
from experiments.library.structures import clock_table, order_and_bandwidth, structure_table
from experiments.library.study import LIBRARY
from experiments.library.tables import library_table, response_table, root_table
from experiments.page.figure_files import figure_files
from experiments.page.render import render_page
from experiments.published.library import read_library
from experiments.running.study import SeedSettings, run_study
from faults.conditions import CONDITIONS
from plant.eha.circuit_parameters import CircuitParameters

SHOWN = ("normal", "minor_friction")


@pytest.fixture(scope="module")
def tables() -> Mapping[str, pd.DataFrame]:
    """Return the results of the command, from short tests of two conditions."""
    rig, library = CircuitParameters(), read_library()
    around = read_library(which="around_mean")
    models = {name: around[name] for name in SHOWN}
    return {
        "library": library_table(library),
        "roots": root_table(library),
        "responses": response_table(library),
        "structures": structure_table(rig, models, 7, duration=24.0),
        "orders": order_and_bandwidth(rig, models, 7, duration=12.0),
        "clocks": clock_table(models["normal"], Limits(125.66), 7, duration=5.0).reset_index(),
    }


def test_the_library_of_the_package_is_shown_and_json_contains_its_models() -> None:
    ran = CliRunner().invoke(app, ["library", "--json"])
    assert ran.exit_code == 0, ran.output
    entries = json.loads(ran.stdout)
    assert [entry["condition"] for entry in entries] == list(CONDITIONS)
    assert LinearModel.from_dict(entries[0]).to_dict() == read_library()["normal"].to_dict()
    shown = CliRunner().invoke(app, ["library"]).output
    assert all(name in shown for name in CONDITIONS)


def test_a_file_that_is_not_a_library_is_refused(tmp_path: Path) -> None:
    (tmp_path / "other.json").write_text("{}")
    ran = CliRunner().invoke(app, ["library", str(tmp_path / "other.json")])
    assert ran.exit_code == 2
    assert "must say format 'hydrostate transfer-function library'" in ran.output
    both = CliRunner().invoke(app, ["library", str(tmp_path / "other.json"), "--out", str(tmp_path / "new")])
    assert both.exit_code == 2
    assert "shown or built" in both.output


def test_output_error_fits_best_in_free_run_and_worst_in_one_step_prediction(
    tables: Mapping[str, pd.DataFrame],
) -> None:
    for _, rows in tables["structures"].groupby("condition"):
        found = rows.set_index("structure")
        assert found.loc["output-error", "behind_percent"] < 0.5
        assert found["fit_percent"].idxmin() == "ARX"
        assert found["one_step_percent"].idxmin() == "output-error"


def test_other_structures_weigh_frequencies_above_25_hz_more_than_output_error(
    tables: Mapping[str, pd.DataFrame],
) -> None:
    weight = tables["structures"].pivot_table(index="condition", columns="structure", values="weight_above_percent")
    ours = weight.pop("output-error")
    assert ours.between(3.0, 10.0).all()  # the share above 25 Hz of the spectrum of a 50 ms clock
    assert (weight.min(axis=1) > 2.0 * ours).all()


def test_the_sentences_quote_the_table_of_structures(tables: Mapping[str, pd.DataFrame]) -> None:
    who, _, why = structure_sentences(tables["structures"])
    arx = tables["structures"].set_index(["structure", "condition"]).loc["ARX"]
    assert f"{arx['behind_percent'].min():.2g} to {arx['behind_percent'].max():.2g} points behind" in who
    assert f"ARX has {arx['weight_above_percent'].mean():.0f} %" in why


def test_the_page_contains_every_figure_and_loads_nothing(tables: Mapping[str, pd.DataFrame]) -> None:
    figures = figure_files(LIBRARY_FIGURES, tables)
    facts = {**tables, **LIBRARY.facts(tables, SeedSettings(7)), "settings": SeedSettings(7)}
    page = render_page(LIBRARY.template, facts, LIBRARY.columns, figures)
    assert page.count("data:image/svg+xml;base64,") == len(LIBRARY_FIGURES)
    assert not re.search(r"""(src|href)=["'](?!data:|#)""", page)
    for target in re.findall(r'href="#([^"]+)"', page):
        assert f'id="{target}"' in page
    assert all(image[:4] == b"\x89PNG" for path, image in figures.items() if path.endswith(".png"))
    # the page shows two models for each condition, with other gains, and has to say from which test each is
    assert "around 4 V, at which the piston does not reverse" in " ".join(page.split())
    assert "by condition, around a mean of 4 V." in " ".join(page.split())


@pytest.mark.slow
def test_the_study_writes_a_valid_library_and_its_report(tmp_path: Path) -> None:
    report = run_study(LIBRARY, SeedSettings(2024), tmp_path / "library", Console(stderr=True, quiet=True))
    models = read_library(report.with_name("library.json"))
    assert list(models) == list(CONDITIONS)
    structures = pd.read_csv(report.parent / "tables" / "structures.csv").set_index("structure")
    assert (structures.loc["output-error", "behind_percent"] < 0.5).all()
    assert structures.loc["ARX", "behind_percent"].max() > 10.0
