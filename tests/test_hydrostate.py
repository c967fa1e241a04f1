"""The module that a Python user imports: it shows what a log contains, and answers a mistake with the remedy."""

# ruff: noqa: ARG005 - every mistake is given the same two things

import ast
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import control
import numpy as np
import pandas as pd
import pytest
from matplotlib.axes import Axes

import hydrostate as hs
from estimation.identification.model.recursion import filtered
from plant.errors import LogWarning

ROOT = Path(__file__).resolve().parents[1]
HEAVY = ("numpy", "scipy", "pandas", "matplotlib", "typer")


@pytest.fixture(scope="module")
def log() -> hs.Log:
    return hs.simulate("minor_leakage", duration=4.0, sample_time=1e-3, seed=7)


@pytest.fixture(scope="module")
def verdict(log: hs.Log) -> hs.Answer:
    return log.diagnose()


@pytest.fixture
def file(log: hs.Log, tmp_path: Path) -> Path:
    path = tmp_path / "run.csv"
    log.to_frame().rename(columns={"position_m": "POS"}).to_csv(path)
    return path


def test_a_log_that_is_read_is_the_log_that_was_written(log: hs.Log, file: Path) -> None:
    again = hs.read(file, columns={"position_m": "POS"})
    assert set(again.channels) == set(log.channels)
    assert again["position_m"][-1] == pytest.approx(log["position_m"][-1], abs=1e-12)
    assert len(again.between(1.0, 2.0)) == 1001


def test_a_table_gives_the_same_log_as_its_file(log: hs.Log, file: Path) -> None:
    table = log.to_frame()
    again = hs.read(table.rename(columns={"position_m": "POS"}), columns={"position_m": "POS"})
    for channel in log.channels:
        np.testing.assert_array_equal(again[channel], hs.read(file, columns={"position_m": "POS"})[channel])
    assert again.sample_time == pytest.approx(log.sample_time)
    with pytest.raises(hs.HydrostateError, match=r"^the table: .*to read a log without time, give sample_time$"):
        hs.read(table.reset_index(drop=True), plant="eha")
    assert hs.read(table.reset_index(drop=True), sample_time=1e-3).diagnose().condition == "minor_leakage"


def test_a_report_contains_the_notes_on_reading_the_log(log: hs.Log, tmp_path: Path) -> None:
    whole = log.between(0.0, 1.0).to_frame().drop(columns=["pressure_a_pa", "pressure_b_pa"])
    table = whole.rename(columns={"differential_pressure_pa": "dp"})
    with pytest.warns(LogWarning, match="column 'dp' was not used, but it may be differential_pressure_pa"):
        read = hs.read(table)
    for part in (read, read.between(0.0, 0.9)):
        part.estimate(form="pressure").report(tmp_path / "page.html")
        assert "&#39;dp&#39; was not used" in (tmp_path / "page.html").read_text("utf-8")


def test_estimate_and_diagnosis_give_the_same_bulk_modulus(log: hs.Log, verdict: hs.Answer) -> None:
    found = log.estimate()
    assert found.believed
    assert found.bulk_modulus == verdict.bulk_modulus
    assert found.bulk_modulus.covers(log.rig.parameters.bulk_modulus)
    assert verdict.condition == "minor_leakage"
    assert verdict.probabilities["minor_leakage"] > 0.9
    assert [note.to_dict() for note in verdict.all_notes] == verdict.to_dict()["notes"] != []


def test_an_answer_converts_to_frame_dictionary_text_html_and_plot(verdict: hs.Answer) -> None:
    table = verdict.to_frame()
    assert isinstance(table, pd.DataFrame)
    assert table.loc["bulk_modulus", "unit"] == "Pa"
    assert verdict.to_dict()["bulk_modulus_pa"]["value"] == verdict.bulk_modulus.value
    assert len(str(verdict).splitlines()) < 24
    assert "minor leakage" in str(verdict)
    assert "<table" in verdict._repr_html_()
    assert all(isinstance(axis, Axes) and axis.get_xlabel() for axis in verdict.plot())


def test_a_notebook_shows_the_channels_of_a_log_and_answers_contain_its_file_name(log: hs.Log, tmp_path: Path) -> None:
    assert "<th>position_m</th>" in log._repr_html_()
    log.to_frame().to_csv(tmp_path / "press 7.csv")
    read = hs.read(tmp_path / "press 7.csv")
    assert "press 7.csv" in str(read.estimate())
    assert "press 7.csv" in str(read.between(0.0, 1.5).estimate())


def test_a_model_converts_to_a_transfer_function_of_python_control(log: hs.Log) -> None:
    model = log.identify()
    assert isinstance(model.to_control(), control.TransferFunction)
    assert model.to_frame().loc["dc_gain", "value"] == model.dc_gain
    assert "fit" in str(model)
    assert [axis.get_ylabel() for axis in model.plot()] == ["gain [dB]", "phase [degrees]"]


MISTAKES: dict[str, tuple[Callable[[hs.Log, Path], object], str]] = {
    "no such file": (lambda log, file: hs.read("none.csv"), "none.csv: there is no such file"),
    "no path": (
        lambda log, file: hs.read(3),
        "the path of a log, a pandas.DataFrame or arrays by name are needed, got 3",
    ),  # type: ignore[arg-type]
    "no such column": (
        lambda log, file: hs.read(file, columns={"position_m": "X"}),
        "name one of them as position_m=NAME",
    ),
    "columns as text": (lambda log, file: hs.read(file, columns="POS"), "columns must be a mapping"),  # type: ignore[arg-type]
    "rig as a mapping": (lambda log, file: hs.read(file, rig={}), "rig must be a Rig of eha"),  # type: ignore[arg-type]
    "rig of another kind": (
        lambda log, file: hs.read(file, rig=log.rig, plant="piezo-stack"),
        "must be a Rig of piezo",
    ),
    "no such rig file": (lambda log, file: hs.read(file, rig="paper"), "hydrostate rig init FILE"),
    "text for a number": (lambda log, file: log.estimate(start_std="1e8"), "start_std must be a number, got '1e8'"),
    "text for a guess": (lambda log, file: log.estimate(start="5e7"), "start must be a number [Pa], got '5e7'"),
    "a page under another name": (lambda log, file: log.estimate().report("a.pdf"), "must end in .html, got 'a.pdf'"),
    "names of two levels": (
        lambda log, file: hs.read(pd.concat({"bench": pd.DataFrame({"time_s": [0.0, 1e-3]})}, axis=1)),
        "must have one name, got names of 2 levels",
    ),
    "a command stays as it is typed": (
        lambda log, file: hs.read(file, columns={"position_m": "X"}),
        "`hydrostate inspect FILE --write rig.toml` guesses which column is which and in what unit; then add rig='",
    ),
    "misspelt option": (lambda log, file: log.estimate(methd="ekf"), "did you mean 'method'"),
    "misspelt condition": (lambda log, file: hs.simulate("minor_leak"), "condition must be one of normal"),
    "misspelt plant": (lambda log, file: hs.simulate(plant="pump"), "plant must be one of eha, reduced, lumped"),
    "plant of none": (lambda log, file: hs.read(file, plant="pump"), "plant must be one of eha, reduced, lumped"),
    "a truth for a time": (
        lambda log, file: hs.read(file, sample_time=True),
        "sample_time must be a number of seconds",
    ),
    "text for a time": (lambda log, file: hs.read(file, sample_time="1 ms"), "sample_time must be a number of seconds"),  # type: ignore[arg-type]
    "text for a count": (lambda log, file: log.identify(n_denominator="3"), "n_denominator must be a number, got '3'"),
    "no whole order": (
        lambda log, file: log.identify(input="motor_speed_rad_s", output="velocity_m_s", order="two"),
        "order must be a whole number, got 'two'",
    ),
    "a part that is not there": (
        lambda log, file: log.between(50.0, 60.0),
        "50 s to 60 s has 0 of the log's, which is",
    ),
    "a part too short": (lambda log, file: log.between(1.0, 1.005), "a part of at least 10 samples is needed"),
    "a folder for a page": (lambda log, file: log.estimate().report("."), "cannot be written: Is a directory"),
    "no such folder": (
        lambda log, file: log.identify(input="motor_speed_rad_s", output="velocity_m_s", order=1).save("none/a.json"),
        "none/a.json: the model cannot be written: No such file or directory",
    ),
    "misspelt verb": (lambda log, file: log.estimat(), "did you mean 'estimate'"),
    "verb of a log": (lambda log, file: hs.estimate, "a log has it: hydrostate.read(path).estimate()"),
    "samples by number": (lambda log, file: log[0:10], "got a slice; between(begin, end) takes a part [s]"),
    "misspelt name": (lambda log, file: hs.reed, "did you mean 'read'"),
    "no such channel": (lambda log, file: log["pressure"], "channel 'pressure' is needed; the record has"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_natural_mistake_is_answered_with_its_remedy(mistake: str, log: hs.Log, file: Path) -> None:
    make, said = MISTAKES[mistake]
    with pytest.raises(hs.HydrostateError) as caught:
        make(log, file)
    assert said in str(caught.value)


def run(code: str, *folders: Path) -> subprocess.CompletedProcess[str]:
    path = ", ".join(repr(str(folder)) for folder in (*folders, ROOT))
    command = [sys.executable, "-c", f"import sys; sys.path[:0] = [{path}]\n{code}"]
    return subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603 - our own interpreter


def test_importing_hydrostate_imports_no_heavy_dependency() -> None:
    done = run(f"import hydrostate; print([one for one in {HEAVY} if one in sys.modules])")
    assert done.stdout.strip() == "[]", done.stderr


def test_the_module_runs_as_the_command() -> None:
    command = [sys.executable, str(ROOT / "hydrostate.py"), "conditions", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603 - our own interpreter
    assert done.returncode == 0, done.stderr
    assert "minor_leakage" in done.stdout


def test_a_foreign_package_with_the_name_of_ours_is_refused_with_its_path(tmp_path: Path) -> None:
    (tmp_path / "faults").mkdir()
    (tmp_path / "faults" / "__init__.py").write_text("")
    done = run("import hydrostate", tmp_path)
    assert done.returncode == 1
    assert f"needs its own package 'faults' in {ROOT}, but Python finds {tmp_path / 'faults'}" in done.stderr


@pytest.mark.parametrize("package", ["plant", "estimation", "faults", "experiments", "hydrostate"])
def test_every_package_exports_at_most_25_names_each_with_an_example(package: str) -> None:
    face = __import__(package)
    assert len(face.__all__) <= 25
    for name in face.__all__:
        assert getattr(face, name) is not None
        assert package == "hydrostate" or f"\n{name} " in (face.__doc__ or ""), f"{package}.{name} has no example"


def test_importing_the_packages_imports_no_heavy_dependency() -> None:
    done = run(f"import plant, estimation, faults, experiments; print([one for one in {HEAVY} if one in sys.modules])")
    assert done.stdout.strip() == "[]", done.stderr


def test_a_log_with_unknown_channels_is_read_identified_and_simulated(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    u = np.repeat(rng.normal(size=60), 5)
    y = 3.0 + filtered([0.0, 0.5], [1.0, -0.5], u) + 0.01 * rng.normal(size=300)
    pd.DataFrame({"t": 0.1 * np.arange(300), "coil (V)": u, "gap": y}).to_csv(tmp_path / "a.csv", index=False)
    log = hs.read(tmp_path / "a.csv")
    assert log.channels == ("coil (V)", "gap")
    model = log.identify(input="coil (V)", output="gap", order=1, delay=1)
    assert model.fit_percent > 95.0
    assert "output-error" in str(model)
    assert model.simulate(log).shape == (300,)
    model.save(tmp_path / "model.json")
    assert hs.load_model(tmp_path / "model.json").validate(log).loc["gap", "fit_percent"] > 95.0
    assert float(model.to_control().dcgain()) == pytest.approx(1.0, abs=0.05)
    with pytest.raises(hs.HydrostateError, match=r"estimate needs motor_speed_rad_s and position_m or velocity_m_s, "):
        log.estimate()
    with pytest.raises(hs.HydrostateError, match="channels among coil"):
        log.identify(input="coil (V)")


def test_the_columns_suggested_for_a_log_with_other_names_make_it_readable(tmp_path: Path) -> None:
    """An earlier message named neither the missing channels nor the columns that may hold them."""
    table = hs.simulate(duration=1.0, sample_time=1e-3, seed=3).to_frame().reset_index()
    table = table[["time_s", "motor_speed_rad_s", "position_m", "differential_pressure_pa"]]
    table.columns = ["Zeit [s]", "Drehzahl [rad/s]", "Weg [m]", "Druckdifferenz [Pa]"]
    table.to_csv(tmp_path / "a.csv", index=False)
    with pytest.raises(hs.HydrostateError, match="estimate needs motor_speed_rad_s and position_m") as said:
        hs.read(tmp_path / "a.csv").estimate()
    columns = ast.literal_eval(str(said.value).partition("columns=")[2].partition(")")[0])
    assert columns["motor_speed_rad_s"] == "Drehzahl [rad/s]:rad/s"
    assert "differential_pressure_pa" in hs.read(tmp_path / "a.csv", columns=columns).channels


def test_a_model_is_validated_separately_on_both_sides_of_a_gap_of_its_input(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    u = np.repeat(rng.normal(size=80), 5)
    y = 3.0 + filtered([0.0, 0.1], [1.0, -0.9], u) + 0.01 * rng.normal(size=400)
    for name, gone in (("whole", []), ("holed", range(150, 165))):
        seen = u.copy()
        seen[list(gone)] = np.nan
        pd.DataFrame({"t": 0.1 * np.arange(400), "coil": seen, "gap": y}).to_csv(tmp_path / f"{name}.csv", index=False)
    model = hs.read(tmp_path / "whole.csv").identify(input="coil", output="gap", order=1, delay=1)
    with pytest.warns(LogWarning, match="coil is missing in 15"):
        holed = hs.read(tmp_path / "holed.csv")
    with pytest.warns(LogWarning, match="experiments: 2"):
        tested = model.validate(holed)
    assert tested.loc["gap", "fit_percent"] == pytest.approx(model.fit_percent, abs=1.0)
