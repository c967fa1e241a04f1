import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner, Result

import faults.eha.bank
from estimation.finding import OUTCOMES
from estimation.identification.model.linear_model import LinearModel
from estimation.notes import EstimateCode, RigCode
from experiments.cli import app
from faults.conditions import CONDITIONS
from faults.notes import AdviceCode, AgainstCode, ClassCode
from plant.eha.model import EhaParameters
from plant.eha.rig import rig_template
from plant.log.files import read_record
from plant.log.notes import LogCode
from plant.notes import Code

TRUTH = 2.07e8
PRESSURE = "differential_pressure_pa"
OUTCOME_WORDS = {outcome.value for outcome in OUTCOMES}


def invoke(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def results(*arguments: object) -> list[dict[str, Any]]:
    done = invoke(*arguments, "--json")
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout, parse_constant=_no_constant)


def _no_constant(name: str) -> None:
    raise AssertionError(f"JSON has no {name}")


asked = cache(results)  # each command runs once, however many tests use its result


def codes(result: dict[str, Any]) -> list[str]:
    return [note["code"] for note in result["notes"]]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("runs")


@pytest.fixture(scope="module")
def steps(folder: Path) -> dict[str, Path]:
    """Return one run in minor friction, in the three formats."""
    paths = {suffix: folder / f"steps{suffix}" for suffix in (".csv", ".parquet", ".mat")}
    for path in paths.values():
        made = invoke(
            *("simulate", "--plant", "lumped", "--condition", "minor_friction", "--drive", "steps", "--duration", 4),
            *("--sample-time", 2e-3, "--seed", 5, "--out", path),
        )
        assert made.exit_code == 0, made.output
    return paths


@pytest.fixture(scope="module")
def sine(folder: Path) -> Path:
    path = folder / "sine.parquet"
    arguments = ("simulate", "--drive", "sine", "--duration", 3, "--sample-time", 2e-4, "--sensors", "paper")
    made = invoke(*arguments, "-o", path)
    assert made.exit_code == 0, made.output
    assert f"{PRESSURE} is not logged by these sensors" in made.stderr
    return path


def test_a_simulated_run_contains_its_options_and_versions(steps: dict[str, Path]) -> None:
    made = {suffix: dict(read_record(path).metadata) for suffix, path in steps.items()}
    assert made[".csv"] == made[".parquet"] == made[".mat"]
    found = made[".mat"]
    assert (found["condition"], found["seed"], found["plant"], found["drive"]) == (
        "minor_friction",
        5,
        "lumped",
        "steps",
    )
    assert found["friction_severity"] == 1.0
    assert {"hydrostate", "numpy", "llvmlite", "python"} <= set(found["versions"])


def test_simulate_as_json_describes_the_written_log(folder: Path) -> None:
    path = folder / "chirp.parquet"
    arguments = ("simulate", "--drive", "chirp", "--duration", 2, "--sample-time", 1e-3, "--plant", "reduced")
    (found,) = results(*arguments, "--leakage-severity", 0.5, "--friction-severity", 0.25, "-o", path)
    assert (found["file"], found["outcome"], found["samples"], found["condition"]) == (str(path), "ok", 2000, None)
    assert (found["leakage_severity"], found["friction_severity"]) == (0.5, 0.25)
    assert found["channels"] == list(read_record(path))


def test_a_run_is_reproduced_by_its_seed(folder: Path) -> None:
    arguments = ("simulate", "--drive", "prbs", "--duration", 1, "--sample-time", 1e-3, "-o")
    runs: list[Any] = []
    for name, seed in (("a", 1), ("b", 1), ("c", 2)):
        assert invoke(*arguments, folder / f"{name}.mat", "--seed", seed).exit_code == 0
        record = read_record(folder / f"{name}.mat")
        assert record.metadata["plant"] == "circuit"  # the plant that diagnose explains in every condition
        runs.append(record["position_m"])
    assert np.array_equal(runs[0], runs[1])
    assert not np.array_equal(runs[0], runs[2])


# `tests/log_formats` covers all formats, each with one record
@pytest.mark.parametrize("formats", [".csv .mat", pytest.param(".csv .parquet .mat", marks=pytest.mark.slow)])
def test_estimate_gives_the_same_value_from_every_file_format(steps: dict[str, Path], formats: str) -> None:
    paths = [steps[suffix] for suffix in formats.split()]
    arguments = ("--condition", "minor_friction", "--start", 0, "--start-std", 1e8)
    found = results("estimate", *paths, *arguments)
    assert [one["file"] for one in found] == [str(path) for path in paths]
    for one in found:
        modulus = one["bulk_modulus_pa"]
        assert modulus["value"] == pytest.approx(TRUTH, rel=0.01)
        assert modulus["ci95"][0] < TRUTH < modulus["ci95"][1]
        assert modulus["ci95"][1] - modulus["ci95"][0] == pytest.approx(2 * 1.96 * modulus["std"], rel=1e-3)
        assert modulus["value"] == pytest.approx(found[0]["bulk_modulus_pa"]["value"], rel=1e-6)


@pytest.mark.parametrize(
    ("options", "method", "form", "channels"),
    [
        ((), "least-squares", "flow", {"position_m", PRESSURE}),
        (("--form", "pressure"), "ekf", "pressure", {"position_m", "velocity_m_s", PRESSURE}),
    ],
)
def test_estimate_has_the_documented_entries(
    steps: dict[str, Path], options: tuple[str, ...], method: str, form: str, channels: set[str]
) -> None:
    (one,) = asked("estimate", steps[".csv"], "--condition", "minor_friction", *options)
    assert set(one) >= {"file", "outcome", "bulk_modulus_pa", "nis", "method", "form", "gate", "bound_percent"}
    assert set(one) >= {"condition", "channels", "warnings", "message"}
    assert one["outcome"] in OUTCOME_WORDS
    assert set(one["bulk_modulus_pa"]) == {"value", "std", "ci95", "ci95_total"}
    assert set(one["gate"]) == {"passed", "reasons"}
    assert one["gate"] == {"passed": True, "reasons": []}
    assert set(one["nis"]) <= set(one["channels"]) == channels
    assert (one["method"], one["form"], one["condition"]) == (method, form, "minor_friction")
    assert 0.0 < one["bound_percent"] < 3.0


@pytest.mark.parametrize(("further", "tuned"), [((), True), (("--no-tune",), False), (("--no-pressure",), False)])
def test_the_pressure_form_is_tuned_by_default_if_pressure_is_logged(
    steps: dict[str, Path], further: tuple[str, ...], tuned: bool
) -> None:
    (one,) = asked("estimate", steps[".csv"], "--condition", "minor_friction", "--form", "pressure", *further)
    assert (one["noise"] is not None) == tuned


def test_both_engines_and_both_forms_can_be_chosen(folder: Path) -> None:
    path = folder / "reduced.parquet"
    made = invoke(
        "simulate", "--plant", "reduced", "--drive", "sine", "--duration", 0.5, "--sensors", "paper", "-o", path
    )
    assert made.exit_code == 0
    ours, oracle = (
        results("estimate", path, "--form", "acceleration", "--method", method, "--start", 4e8, "--start-std", 1e8)[0]
        for method in ("ekf", "filterpy-ekf")
    )
    assert ours["bulk_modulus_pa"]["value"] == pytest.approx(TRUTH, rel=0.03)
    assert oracle["bulk_modulus_pa"]["value"] == pytest.approx(ours["bulk_modulus_pa"]["value"], rel=1e-6)
    assert (oracle["method"], oracle["form"]) == ("filterpy-ekf", "acceleration")


def test_an_unobservable_bulk_modulus_has_no_value(sine: Path) -> None:
    (one,) = results("estimate", sine)
    assert one["outcome"] == "not_observable"
    assert one["bulk_modulus_pa"] == {"value": None, "std": None, "ci95": None, "ci95_total": None}
    assert one["bound_percent"] > 3.0
    shown = invoke("estimate", sine)
    assert shown.exit_code == 0
    assert "not observable" in shown.stdout


@pytest.mark.parametrize(
    ("verb", "code"),
    [
        pytest.param("estimate", EstimateCode.PRESSURE_ABSENT, marks=pytest.mark.slow),
        pytest.param("diagnose", ClassCode.PRESSURE_ABSENT_CLASS, marks=pytest.mark.slow),
    ],
)
def test_every_verb_notes_the_cost_of_missing_pressure(verb: str, code: Code, steps: dict[str, Path]) -> None:
    arguments = (verb, steps[".csv"], "--condition", "minor_friction")
    (one,) = results(*arguments, "--no-pressure")
    assert PRESSURE not in one["channels"]
    assert code in codes(one)
    assert f"note: {code.note()}" in " ".join(invoke(*arguments, "--no-pressure").stdout.split())
    assert str(code.note()) not in " ".join(invoke(*arguments).stdout.split())


def test_the_help_of_identify_says_that_missing_pressure_costs_nothing() -> None:
    assert "its absence costs nothing" in " ".join(invoke("identify", "--help").stdout.replace("│", " ").split())


@pytest.mark.parametrize(
    "formats",
    [
        pytest.param((".csv",), id="csv"),  # the test above covers all formats, with `estimate`
        pytest.param((".csv", ".parquet", ".mat"), marks=pytest.mark.slow, id="every format"),
    ],
)
def test_diagnose_names_the_condition_in_every_format(steps: dict[str, Path], formats: tuple[str, ...]) -> None:
    for one in results("diagnose", *(steps[suffix] for suffix in formats), "--condition", "normal"):
        told = "file outcome condition scores probabilities channels runner_up warnings notes advice"
        assert set(one) >= set(told.split())
        assert list(one["scores"]) == list(CONDITIONS)
        assert (one["condition"], one["outcome"], one["unknown"]) == ("minor_friction", "ok", False)
        assert sum(one["probabilities"].values()) == pytest.approx(1.0)
        ranked = sorted(one["probabilities"], key=one["probabilities"].__getitem__, reverse=True)
        assert [one["condition"], one["runner_up"]] == ranked[:2]
        assert one["condition"] == min(one["scores"], key=one["scores"].__getitem__)
        assert list(one["transfer_function_scores"]) == list(CONDITIONS)
        assert "normal was expected" in one["message"]
        low, high = one["severity"]["added_friction"]["ci95"]
        assert 0.0 < low < one["severity"]["added_friction"]["value"] < high
        assert one["severity"]["added_friction"]["unit"] == "N"
        assert one["gate"] == {"passed": True, "reasons": []}


def test_diagnose_marks_the_best_on_the_screen(steps: dict[str, Path]) -> None:
    shown = invoke("diagnose", steps[".csv"], "--scores").stdout
    (marked,) = [line for line in shown.splitlines() if "<- best" in line]
    assert marked.split()[0] == "minor_friction"


def test_a_log_without_motion_gets_no_condition(folder: Path) -> None:
    still = pd.DataFrame({"time_s": 1e-3 * np.arange(500), "motor_speed_rad_s": 0.0})
    still["velocity_m_s"] = np.random.default_rng(1).normal(0.0, 1e-3, 500)
    still.to_csv(folder / "still.csv", index=False)
    (one,) = results("diagnose", folder / "still.csv")
    assert (one["outcome"], one["condition"], one["runner_up"]) == ("not_observable", None, None)
    assert one["warnings"] == [str(LogCode.SPEED_CONSTANT.note())]
    assert {LogCode.SPEED_CONSTANT, ClassCode.MODELS_ALIKE} <= set(codes(one))
    assert one["message"] == str(ClassCode.MODELS_ALIKE.note())


def test_a_log_that_no_model_fits_is_unknown(steps: dict[str, Path], folder: Path) -> None:
    frame = read_record(steps[".csv"]).to_frame()
    frame["velocity_m_s"] *= 0.2
    frame[PRESSURE] *= 5.0
    frame.drop(columns="position_m").to_parquet(folder / "odd.parquet")
    (one,) = results("diagnose", folder / "odd.parquet")
    assert one["unknown"]
    assert AgainstCode.NONE_FITS in codes(one)
    assert len(one["reasons"]) >= 1
    assert AdviceCode.FIT_DOUBTED in codes(one)


@pytest.mark.slow
def test_transfer_functions_are_scored_on_request(
    steps: dict[str, Path], folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: list[float] = []

    def bank(rig: EhaParameters, rng: np.random.Generator, *, duration: float) -> dict[str, LinearModel]:
        assert duration > 0.0
        drawn.append(float(rng.random()))
        gains = rig.pump_displacement / rig.piston_area * np.linspace(1.0, 0.2, len(CONDITIONS))
        channels = ("motor_speed_rad_s", "velocity_m_s")
        made = (LinearModel(np.array([gain]), np.array([1.0]), 1e-3, *channels) for gain in gains)
        return dict(zip(CONDITIONS, made, strict=True))

    monkeypatch.setattr(faults.eha.bank, "identify_bank", bank)
    paths, rig = list(steps.values()), folder / "no paper.toml"  # its library is not the one that ships
    rig.write_text(rig_template().replace("piston_area = 0.00152", "piston_area = 0.00153"))
    first, second, _ = results("diagnose", *paths, "--transfer-functions", "--seed", 3, "--rig", rig)
    scores = first["transfer_function_scores"]
    assert list(scores) == list(CONDITIONS)
    assert first["transfer_function_condition"] == min(scores, key=scores.__getitem__)
    assert second["transfer_function_scores"] == pytest.approx(scores)
    assert drawn == [float(np.random.default_rng(3).random())]
    assert "best transfer function" in invoke("diagnose", paths[0], "--transfer-functions").stdout
    assert len(drawn) == 1  # nothing is identified for the paper's rig: its library ships


@pytest.mark.slow
def test_identified_transfer_functions_are_the_same_for_the_same_seed(steps: dict[str, Path]) -> None:
    first, again = (results("diagnose", steps[".mat"], "--transfer-functions", "--seed", 3)[0] for _ in range(2))
    assert first == again
    assert first["transfer_function_condition"] in CONDITIONS


def test_identify_gives_a_model_that_can_be_loaded_again(folder: Path) -> None:
    path = folder / "prbs.csv"
    assert invoke("simulate", "--drive", "prbs", "--duration", 10, "--sample-time", 1e-3, "-o", path).exit_code == 0
    (one,) = results("identify", path, "--out", folder / "model.json")
    assert set(one) >= {"file", "outcome", "numerator", "denominator", "sample_time_s", "input", "output"}
    assert set(one) >= {"fit_percent", "covariance", "dc_gain", "bandwidth_hz", "delay", "message"}
    assert (one["input"], one["output"], one["sample_time_s"]) == ("motor_speed_rad_s", "velocity_m_s", 1e-3)
    assert (len(one["numerator"]), len(one["denominator"]), np.shape(one["covariance"])) == (3, 3, (5, 5))
    assert one["fit_percent"] > 75.0  # measured: 76.4 %; sensor noise and the dead zone are not linear
    assert one["delay"] == {"samples": 0, "seconds": 0.0}
    (stored,) = json.loads((folder / "model.json").read_text())
    assert LinearModel.from_dict(stored).dc_gain == one["dc_gain"]["value"]


def test_identify_takes_order_numerator_delay_and_sample_time(steps: dict[str, Path]) -> None:
    arguments = ("--order", 1, "--numerator", 2, "--delay", 3, "--sample-time", 2e-3, "--filter-hz", 40)
    (one,) = results("identify", steps[".parquet"], *arguments)
    assert (len(one["numerator"]), len(one["denominator"]), one["sample_time_s"]) == (5, 2, 2e-3)
    assert one["delay"] == {"samples": 3, "seconds": pytest.approx(6e-3)}


@pytest.mark.slow
def test_another_actuator_is_estimated_and_diagnosed_with_its_rig_file(folder: Path) -> None:
    rig = folder / "rig.toml"
    text = rig_template().replace("piston_area = 0.00152", "piston_area = 0.00304")
    text = text.replace("pump_displacement = 5.57e-07", "pump_displacement = 9.0e-07").replace('"paper"', '"bench 2"')
    lines = ('motor_speed_rad_s = "RPM:rpm"', 'position_m = "POS_MM:mm"', f'{PRESSURE} = "DP_BAR:bar"')
    rig.write_text("\n".join([text, *lines, ""]))
    arguments = ("--condition", "major_leakage_minor_friction", "--sample-time", 1e-3)
    assert invoke("simulate", "--rig", rig, *arguments, "-o", folder / "ours.parquet").exit_code == 0
    record = read_record(folder / "ours.parquet")
    foreign = {"time_s": record.time, "RPM": record["motor_speed_rad_s"] * 30.0 / np.pi}
    foreign |= {"POS_MM": 1e3 * record["position_m"], "DP_BAR": 1e-5 * record[PRESSURE], "note": record.time}
    pd.DataFrame(foreign).to_csv(folder / "theirs.csv", index=False)

    (estimated,) = results("estimate", folder / "theirs.csv", "--rig", rig, *arguments[:2], "--start", 5e7)
    assert estimated["bulk_modulus_pa"]["value"] == pytest.approx(TRUTH, rel=0.03)
    assert (estimated["rig"], estimated["channels"]) == ("bench 2", ["position_m", PRESSURE])
    (diagnosed,) = results("diagnose", folder / "theirs.csv", "--rig", rig)
    assert diagnosed["condition"] == "major_leakage_minor_friction"
    (own,) = results("diagnose", folder / "ours.parquet", "--rig", rig)
    assert own["condition"] == "major_leakage_minor_friction"
    assert LogCode.COLUMNS_ABSENT.note(columns="RPM:rpm, POS_MM:mm, DP_BAR:bar").to_dict() in own["notes"]

    columns = "motor_speed_rad_s=RPM:rpm,position_m=POS_MM:mm"
    (asked,) = results("diagnose", folder / "theirs.csv", "--columns", columns, "--columns", f"{PRESSURE}=DP_BAR:bar")
    assert asked["channels"] == ["velocity_m_s", PRESSURE]
    assert asked["unknown"]
    assert RigCode.PUMP_WORN in codes(asked)


def test_the_flow_form_needs_no_condition_and_finds_the_leakage(steps: dict[str, Path]) -> None:
    (one,) = results("estimate", steps[".csv"])
    low, high = one["leakage_coefficient_m3_s_pa"]["ci95"]
    assert one["bulk_modulus_pa"]["value"] == pytest.approx(TRUTH, rel=0.005)
    assert one["leakage_coefficient_m3_s_pa"]["value"] == pytest.approx(4.784e-12, rel=0.03)
    assert low < one["leakage_coefficient_m3_s_pa"]["value"] < high
    assert one["flow_bias_m3_s"]["value"] == pytest.approx(2.413e-6, rel=0.05)
