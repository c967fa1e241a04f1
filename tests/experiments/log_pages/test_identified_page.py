"""The page of an identified model: its verdict, its permitted uses, and its downloads."""

import base64
import json
import re
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from estimation.identification.free_run.saved import load_models
from estimation.identification.model.linear_model import LinearModel
from experiments.cli import app
from experiments.identification.entries import linear_entries
from experiments.log_pages.identified_charts import MeasuredCurve, bode_charts, measured_curve, step_charts
from experiments.log_pages.identified_files import control_text, matlab_text
from experiments.log_pages.identified_page import identified_page
from experiments.log_pages.identified_view import IdentifiedView, view_of_channels
from experiments.log_pages.identified_words import (
    answer_of,
    determined_band,
    is_usable,
    p_value_text,
    title_of,
    uses_of,
)
from plant.log.files import write_record
from plant.log.record import Record

TRUTH = LinearModel(
    np.array([0.0, 2e-5, 1e-5]), np.array([1.0, -1.5, 0.6]), 1e-3, "motor_speed_rad_s", "velocity_m_s", delay=1
)


def seen(model: LinearModel = TRUTH, held: float | None = 95.0, **changes: Any) -> IdentifiedView:
    """Return the view of a model on a log of the true plant."""
    rng = np.random.default_rng(1)
    u = 100.0 * np.repeat(rng.choice([-1.0, 1.0], 300), 10)
    y = TRUTH.simulate(u)
    y = y + 0.02 * y.std() * rng.standard_normal(y.size)
    fitted = replace(model, structure="output-error", fit_percent=96.0, rmse=0.02, covariance=1e-16 * np.eye(4))
    tests = {"whiteness_p": 0.4, "cross_correlation_p": 0.3}
    gain = {"value": fitted.dc_gain, "std": 1e-6, "ci95": (2.9e-4, 3.1e-4)}
    told = {"file": "/private/place/run.csv", "held_back_percent": held, "validation": tests, "notes": []}
    entries = {**linear_entries(fitted), "input": model.input_name, "output": model.output_name, **told}
    return view_of_channels({**entries, "dc_gain": gain, **changes}, fitted, u, y)


@pytest.mark.parametrize(
    ("view", "usable", "title"),
    [
        (lambda: seen(), True, "Model of velocity (linear, order 2): fit 95.0 % on data held back from the fit."),
        (lambda: seen(held=None), True, "Model of velocity (linear, order 2): fit 96.0 % on the data of the fit; "),
        (lambda: seen(held=-3.0), False, "Do not use this model of velocity: on held-back data it is no better"),
        (lambda: seen(outcome="mismatch"), False, "Do not use this model of velocity: the log does not show"),
        (
            lambda: seen(outcome="mismatch", notes=[{"code": "swapped"}]),
            False,
            "Do not use this model of velocity: its input seems to answer its output.",
        ),
        (
            lambda: seen(replace(TRUTH, denominator=[1.0, -2.1, 1.2])),
            False,
            "Do not use this model of velocity: it is un",
        ),
    ],
)
def test_the_title_says_whether_the_model_is_usable(
    view: Callable[[], IdentifiedView], usable: bool, title: str
) -> None:
    one = view()
    assert is_usable(one) == usable
    assert title_of(one).startswith(title)
    good, bad = uses_of(one, measured_curve(one))
    assert bool(good) == usable
    assert any(said.startswith("Diagnosis") for said in bad)


def test_a_model_of_a_wandering_output_is_usable_for_changes_despite_a_poor_free_run() -> None:
    view = seen(held=-30.0, fit_percent=-5.0, notes=[{"code": "random_walk"}])
    assert is_usable(view)
    assert title_of(view).endswith("(linear, order 2), fitted to changes: the output also wanders by itself.")
    good, bad = uses_of(view, None)
    assert good[0].startswith("Simulation of changes of velocity by motor speed")
    assert "The level of velocity: it also moves by itself." in bad
    assert "no better than the mean" not in answer_of(view)


def test_controller_design_is_recommended_for_a_right_model_and_not_for_a_wrong_one() -> None:
    for model, allowed in ((TRUTH, True), (replace(TRUTH, numerator=1.6 * TRUTH.numerator), False)):
        view = seen(model)
        good, bad = uses_of(view, measured_curve(view))
        assert any(said.startswith("Controller design") for said in good) == allowed
        assert any(said.startswith("Controller design") for said in bad) != allowed


@pytest.mark.parametrize("kind", ["cut-off", "stops"])
def test_a_model_with_limits_is_not_compared_with_the_measured_response(kind: str) -> None:
    view = seen(replace(TRUTH, numerator=1.6 * TRUTH.numerator), nonlinearity={"kind": kind})
    good, bad = uses_of(view, measured_curve(view))
    assert not any("differs from the measured response" in said for said in [*good, *bad])
    assert any(said.startswith("Controller design without a check") for said in bad)
    assert "(linear with limits, order 2)" in title_of(view)
    assert "The output also has limits" in control_text(view)


def test_a_model_with_an_error_model_is_named_so_and_its_control_file_leaves_that_out() -> None:
    view = seen(error_model={"degree": 2, "lags_samples": [0, 4, 16], "n_values": 28})
    assert "(linear, order 2, with an error model)" in title_of(view)
    assert "The model also has an error model, which a transfer function leaves out" in control_text(view)
    assert "error model" not in title_of(seen()) + control_text(seen())


@pytest.mark.parametrize("worse", [False, True])
def test_the_fit_on_validation_logs_stands_in_the_title_and_a_poor_one_restricts_the_use(worse: bool) -> None:
    view = seen(test={"files": ["a.csv", "b.csv"], "fit_percent": 51.52, "clearly_worse": worse})
    assert title_of(view).endswith("fit 95.0 % on data held back from the fit, 51.5 % on a.csv, b.csv.")
    said = [one for one in uses_of(view, None)[1] if one.startswith("Logs like a.csv, b.csv")]
    assert len(said) == worse
    assert "on a.csv" not in title_of(seen(test={"files": ["a.csv"], "fit_percent": float("nan")}))


def test_failed_residual_tests_and_an_uncertain_gain_restrict_the_use_of_the_model() -> None:
    tests = {"whiteness_p": 1e-9, "cross_correlation_p": 1e-9}
    view = seen(validation=tests, dc_gain={"value": 1e-4, "std": 1e-4, "ci95": (-1e-4, 3e-4)})
    _, bad = uses_of(view, None)
    assert any(said.startswith("Steady gain") for said in bad)
    follows = f"the residual still follows the input ({p_value_text(0.0)})"
    assert any(said.startswith(f"Conclusions about order and poles of the plant: {follows}") for said in bad)


def test_the_known_band_of_a_response_excludes_lines_of_noise() -> None:
    rng = np.random.default_rng(2)
    frequency = np.linspace(0.1, 100.0, 1000)
    noise = rng.standard_normal(1000) + 1j * rng.standard_normal(1000)
    response = np.where(frequency < 20.0, 10.0 + 0.0j, noise)
    measured = MeasuredCurve(frequency, response, np.full(1000, 2.0))
    assert (np.abs(noise) > 2.0).sum() > 50
    low, high = determined_band(measured) or (0.0, 0.0)
    assert (low, high) == (pytest.approx(0.1), pytest.approx(20.0, rel=0.1))
    assert determined_band(MeasuredCurve(frequency, noise, np.full(1000, 2.0))) is None


def taken(page: str) -> dict[str, str]:
    """Return the files that a page offers for download, by name."""
    found = re.findall(r'download="([^"]+)" href="data:[^,]+,([^"]+)"', page)
    return {name: base64.b64decode(content).decode() for name, content in found}


def test_the_model_can_be_downloaded_completely_and_without_the_folder_of_the_log(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    page = identified_page(seen())
    assert "/private/place" not in page
    files = taken(page)
    (entry,) = json.loads(files["run-model.json"])
    assert LinearModel.from_dict(entry).denominator.tolist() == TRUTH.denominator.tolist()
    assert "/private/place" not in files["run-model.json"]
    made: dict[str, Any] = {}
    fake = SimpleNamespace(TransferFunction=lambda *given, **names: (*given, names))
    monkeypatch.setitem(sys.modules, "control", fake)
    exec(files["run-model.py"], made)  # noqa: S102 -- our own text
    numerators, denominators, clock, names = made["model"]
    assert numerators == [[TRUTH.numerator.tolist()]]
    assert (denominators, clock) == ([[TRUTH.denominator.tolist()]], 1e-3)
    assert names == {"inputs": ["motor_speed_rad_s"], "outputs": ["velocity_m_s"]}
    script = files["model_of_run.m"].splitlines()
    assert script[0] == "% Identified by Hydrostate from 'run.csv'."
    length = max(TRUTH.numerator.size, TRUTH.denominator.size)
    rows = [np.pad(one, (0, length - one.size)).tolist() for one in (TRUTH.numerator, TRUTH.denominator)]
    assert script[-4:] == [
        f"model = tf({{{rows[0]!r}}}, {{{rows[1]!r}}}, ...",
        "    0.001, 'Variable', 'z^-1');",
        "model.InputName = {'motor_speed_rad_s'};",
        "model.OutputName = 'velocity_m_s';",
    ]


def test_a_continuous_time_model_is_downloaded_as_such_and_its_step_response_has_a_band() -> None:
    model = LinearModel(np.array([30.0]), np.array([1.0, 100.0]), 1e-3, "u", "y", continuous=True, dead_time=0.002)
    view = seen(replace(TRUTH))
    fitted = replace(model, structure="continuous", fit_percent=90.0, rmse=0.1, covariance=np.diag([0.01, 0.1]))
    entries = {**view.result, **linear_entries(fitted), "input": "u", "output": "y"}
    one = view_of_channels(entries, fitted, view.u[:, 0], view.y)
    text = control_text(one)
    assert "dead time of 0.002 s" in text
    assert "[[[30.0]]]" in text
    script = matlab_text(replace(one, result={**entries, "output": "it's\ny"}))
    assert "tf({[30.0]}, {[1.0, 100.0]}, ...\n    'Variable', 's', 'InputDelay', 0.002);" in script
    assert "model.OutputName = 'it''s\\x0ay';" in script
    (panel,) = step_charts(one, "run").panels
    assert [curve.name for curve in panel.curves] == ["u +100", "95 % from", "95 % to"]
    assert panel.curves[0].values[-1] == pytest.approx(30.0, rel=0.02)


@pytest.fixture(scope="module")
def columns(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a log of two inputs and three outputs, one of them nonlinear."""
    rng = np.random.default_rng(5)
    a, b = (np.repeat(rng.uniform(-1.0, 1.0, 100), 6) for _ in range(2))
    y = LinearModel(np.array([0.0, 0.4]), np.array([1.0, -0.7]), 1.0, "a", "y", delay=1).simulate(a + 0.5 * b)
    z = LinearModel(np.array([0.0, 0.3]), np.array([1.0, -0.5]), 1.0, "a", "z", delay=1).simulate(a - b)
    noise = 0.01 * rng.standard_normal((2, a.size))
    path = tmp_path_factory.mktemp("columns") / "run.csv"
    write_record(Record(0.1, {"a": a, "b": b, "y": y + noise[0], "z": z + noise[1], "w": y + y**2 + noise[0]}), path)
    return path


@pytest.mark.parametrize(
    ("arguments", "names", "words"),
    [
        (
            ("--input", "a,b", "--output", "y"),
            ["page.html"],
            ("steady gain from b", "in the unit of y (rms)"),
        ),
        (
            ("--input", "a,b", "--output", "y,z", "--structure", "state-space"),
            ["page-y.html", "page-z.html"],
            ("state space",),
        ),
        (
            ("--input", "a", "--output", "w", "--structure", "narx"),
            ["page.html"],
            ("polynomial", "The model is not linear"),
        ),
    ],
)
def test_each_output_of_models_between_any_columns_has_a_page(
    columns: Path, tmp_path: Path, arguments: tuple[str, ...], names: list[str], words: tuple[str, ...]
) -> None:
    form = ("--order", "1", "--delay", "1", "--html", str(tmp_path / "page.html"))
    ran = CliRunner().invoke(app, ["identify", str(columns), *arguments, *form])
    assert ran.exit_code == 0, ran.output
    assert sorted(one.name for one in tmp_path.iterdir()) == names
    page = (tmp_path / names[0]).read_text("utf-8")
    assert all(one in page for one in words)
    (tmp_path / "model.json").write_text(taken(page)["run-model.json"], encoding="utf-8")
    (model,) = load_models(tmp_path / "model.json")
    assert model.output in arguments[3]


def test_a_response_below_its_noise_draws_no_dots() -> None:
    view = seen()
    charts = bode_charts(view, None, "run")
    assert charts is not None
    assert charts.log
    assert [curve.name for curve in charts.panels[0].curves] == ["model", "95 % from", "95 % to"]
    nothing = MeasuredCurve(np.array([1.0, 2.0]), np.array([0.1 + 0j, 0.1 + 0j]), np.array([1.0, 1.0]))
    drawn = bode_charts(view, nothing, "run")
    assert drawn is not None
    assert np.isnan(drawn.panels[0].curves[-1].values).all()
