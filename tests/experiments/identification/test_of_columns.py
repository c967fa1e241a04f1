"""The command line for models between any columns: fitted, validated, saved and simulated again."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner, Result

import hydrostate as hs
from benchmarks.identification.bent_inputs import PLANTED_NONLINEARITIES, draw_log
from estimation.identification.model.linear_model import LinearModel
from estimation.identification.model.recursion import filtered
from experiments.cli import app
from experiments.identification.entries import gains_shown
from tests.estimation.identification.free_run.test_error_model import signals


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Return three logs of a plant with two inputs and two outputs, in units that are not known."""
    folder = tmp_path_factory.mktemp("any")
    paths: list[Path] = []
    for seed in (1, 2, 3):
        rng = np.random.default_rng(seed)
        valve, load = (np.repeat(rng.normal(size=61), 5)[:300] for _ in range(2))
        flow = 2.0 + filtered([0.0, 0.4], [1.0, -0.8], valve) - filtered([0.0, 0.1], [1.0, -0.8], load)
        heat = 50.0 + filtered([0.0, 0.0, 1.0], [1.0, -0.5], load)
        noise = rng.normal(size=(2, 300))
        columns = {"Valve [%]": valve, "load": load, "flow": flow + 0.02 * noise[0], "heat": heat + 0.02 * noise[1]}
        paths.append(folder / f"run{seed}.csv")
        pd.DataFrame({"t_ms": 20.0 * np.arange(300), **columns}).to_csv(paths[-1], index=False)
    return paths


def run(*arguments: object) -> Result:
    return CliRunner().invoke(app, ["identify", *map(str, arguments)])


def test_several_logs_give_one_model_per_output_that_is_validated_and_simulated(
    logs: list[Path], tmp_path: Path
) -> None:
    saved, table = tmp_path / "model.json", tmp_path / "sim.csv"
    channels = ("--input", "Valve [%],load", "--output", "flow", "--output", "heat", "--order", 1, "--delay", 1)
    ran = run(*logs[:2], *channels, "--validate", logs[2], "--out", saved, "--json", "--simulated", table)
    assert ran.exit_code == 0, ran.output
    flow, heat = json.loads(ran.stdout)
    assert (flow["output"], heat["output"], flow["outcome"]) == ("flow", "heat", "ok")
    assert flow["dc_gain"]["value"] == pytest.approx([2.0, -0.5], rel=0.05)
    assert flow["sample_time_s"] == pytest.approx(0.02)
    assert flow["offset"] == pytest.approx(2.0, abs=0.05)
    assert flow["test"]["fit_percent"] > 90.0
    assert set(pd.read_csv(tmp_path / "sim-flow.csv")) >= {"time_s", "flow", "flow_simulated"}

    again = run(logs[2], "--simulate", saved, "--json")
    (one,) = json.loads(again.stdout)
    assert [part["output"] for part in one["outputs"]] == ["flow", "heat"]
    assert one["outputs"][0]["fit_percent"] == pytest.approx(flow["test"]["fit_percent"], abs=1e-6)


def test_one_input_gives_a_transfer_function_with_its_uncertainty(logs: list[Path], tmp_path: Path) -> None:
    arguments = ("--input", "load", "--output", "heat", "--order", 1, "--delay", 2, "--figure", tmp_path / "fit.png")
    ran = run(logs[0], *arguments, "--json")
    (one,) = json.loads(ran.stdout)
    model = LinearModel.from_dict(one)
    assert model.dc_gain == pytest.approx(2.0, abs=4.0 * one["dc_gain"]["std"])
    assert one["poles"][0]["real"] == pytest.approx(0.5, abs=0.02)
    assert (one["structure"], one["order"], one["delay"]["samples"]) == ("output-error", 1, 2)
    assert (tmp_path / "fit.png").read_bytes()[:4] == b"\x89PNG"
    assert "running free" in one["message"]
    assert "heat" in run(logs[0], "--input", "load", "--output", "heat", "--order", 1, "--delay", 2).stdout


def test_a_validation_log_of_another_plant_is_named_beside_what_held_back_blocks_promise(
    logs: list[Path], tmp_path: Path
) -> None:
    other = pd.read_csv(logs[1])
    other["heat"] = filtered([0.0, 0.0, 0.4], [1.0, -0.8], other["load"])
    other.to_csv(path := tmp_path / "other.csv", index=False)
    asked = ("--input", "load", "--output", "heat", "--order", 1, "--delay", 2, "--json")
    (one,), (same,) = (json.loads(run(logs[0], *asked, "--validate", log).stdout) for log in (path, logs[1]))
    (told,) = one["warnings"]
    assert f"leaves {1.0 - one['test']['fit_percent'] / 100.0:.0%} of the deviation of 'heat' in --validate" in told
    assert (one["test"]["clearly_worse"], same["test"]["clearly_worse"], same["warnings"]) == (True, False, [])


def test_a_test_log_that_is_too_short_is_named(logs: list[Path], tmp_path: Path) -> None:
    short = tmp_path / "short.csv"
    pd.read_csv(logs[1]).head(12).to_csv(short, index=False)
    form = ("--input", "Valve [%],load", "--output", "flow", "--order", 1, "--delay", 1)
    ran = run(logs[0], *form, "--validate", short)
    assert "short.csv: output 'flow' needs 20 samples or more, got 12" in " ".join(ran.output.split())
    pd.read_csv(logs[1]).head(25).to_csv(short, index=False)
    late = ("--input", "load", "--output", "heat", "--order", 1, "--delay", 30)
    said = run(logs[0], *late, "--validate", short).output
    why = "has at most 25 samples in one piece, and the model of 'heat' has a dead time of 30"
    assert f"--validate {short} {why}" in said


def test_a_closed_loop_is_identified_from_its_reference(logs: list[Path]) -> None:
    form = ("--input", "flow", "--output", "heat", "--order", 1, "--delay", 1)
    ran = run(logs[0], *form, "--reference", "Valve [%],load", "--json")
    (one,) = json.loads(ran.stdout)
    told = [(note["code"], note["data"]["reference"]) for note in one["notes"] if "reference" in note["data"]]
    assert told == [("two_stages", "Valve [%], load")]
    refused = run(logs[0], *form, "--reference", "heat")
    assert refused.exit_code == 2
    assert "neither input nor output" in refused.output


def test_a_state_space_model_has_all_outputs(logs: list[Path], tmp_path: Path) -> None:
    saved = tmp_path / "model.json"
    channels = ("--input", "Valve [%],load", "--output", "flow,heat", "--structure", "state-space", "--order", 3)
    ran = run(*logs[:2], *channels, "--delay", 1, "--validate", logs[2], "--out", saved, "--json")
    assert ran.exit_code == 0, ran.output
    flow, heat = json.loads(ran.stdout)
    assert (flow["structure"], flow["order"], flow["outcome"]) == ("state-space", 3, "ok")
    assert flow["n_values"] == heat["n_values"] == 3 * (2 + 2) + 2
    assert flow["dc_gain"]["value"] == pytest.approx([2.0, -0.5], abs=4.0 * max(flow["dc_gain"]["std"]))
    assert flow["offset"] == pytest.approx(2.0, abs=0.05)
    assert sorted(pole["real"] for pole in flow["poles"])[1:] == pytest.approx([0.5, 0.8], abs=0.05)
    assert flow["test"]["fit_percent"] > 90.0
    (one,) = json.loads(run(logs[2], "--simulate", saved, "--json").stdout)
    assert one["outputs"][1]["fit_percent"] == pytest.approx(heat["test"]["fit_percent"], abs=1e-6)
    assert "state-space, order 3" in run(logs[0], *channels, "--delay", 1).stdout

    form = {"structure": "state-space", "order": 3, "delay": 1}
    model = hs.read(logs[0]).identify(hs.read(logs[1]), input=["Valve [%]", "load"], output=["flow", "heat"], **form)
    system = model.to_control()
    assert (system.nstates, system.noutputs, system.ninputs) == (3, 2, 2)
    assert system.dcgain()[0] == pytest.approx(flow["dc_gain"]["value"])
    assert hs.load_model(saved).simulate(hs.read(logs[2])).shape == (300, 2)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--input", "load"), "--input and --output go together"),
        (("--input", "lod", "--output", "heat"), "did you mean 'load'?"),
        (("--input", "load", "--output", "load"), "must be different channels"),
        (("--input", "load,load", "--output", "heat"), "--input must name each column once, got load, load"),
        (("--input", "load", "--output", "heat,heat"), "--output must name each column once, got heat, heat"),
        (("--input", "load", "--output", "heat", "--structure", "oe"), "--structure must be one of"),
        (("--input", "load", "--output", "heat", "--resample", 0), "--resample must be positive"),
        ((), "--input COLUMN --output COLUMN relates any others"),
        (("--simulate", "none.json"), "none.json: the model cannot be read"),
    ],
)
def test_wrong_options_are_refused_with_a_precise_message(
    arguments: tuple[object, ...], said: str, logs: list[Path]
) -> None:
    ran = run(logs[0], *arguments)
    assert ran.exit_code == 2
    assert said in " ".join(ran.output.split())


def test_option_resample_gives_a_model_of_longer_sample_time(logs: list[Path]) -> None:
    form = ("--input", "load", "--output", "heat", "--order", 1, "--delay", 1)
    ran = run(logs[0], *form, "--resample", 0.06, "--json")
    (one,) = json.loads(ran.stdout)
    assert one["sample_time_s"] == pytest.approx(0.06)


def test_a_frequency_response_is_drawn_and_printed_with_its_levels(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    lines = np.arange(1, 400, 2)[np.arange(200) % 4 != 1]
    spectrum = np.zeros(513, dtype=complex)
    spectrum[lines] = np.exp(2j * np.pi * rng.random(len(lines)))
    one = np.fft.irfft(spectrum)
    u = np.tile(one / one.std(), 4)
    y = u + 0.1 * u**3 + 0.01 * rng.normal(size=len(u))
    for name, table in (
        ("multisine", pd.DataFrame({"u": u, "y": y})),
        (
            "local-polynomial",
            pd.DataFrame({"u": (v := rng.normal(size=600)), "y": 2.0 * v + 0.1 * rng.normal(size=600)}),
        ),
    ):
        table.index = pd.Index(0.01 * np.arange(len(table)), name="time_s")
        table.to_csv(tmp_path / "log.csv")
        picture = tmp_path / f"{name}.png"
        arguments = ("--input", "u", "--output", "y", "--order", 1, "--delay", 0, "--response", picture, "--json")
        ran = run(tmp_path / "log.csv", *arguments)
        assert ran.exit_code == 0, ran.output
        (found,) = json.loads(ran.stdout)
        told = found["frequency_response"]
        assert told["method"] == name
        assert picture.read_bytes()[:4] == b"\x89PNG"
        gain = np.hypot(told["real"], told["imag"])
        assert np.median(gain) == pytest.approx(2.0 if told["periods"] is None else 1.3, rel=0.05)
        if name == "multisine":
            assert (told["period_samples"], told["periods"]) == (1024, 3)
            assert told["odd_power"] > 100.0 * abs(told["even_power"])
            low, high = told["odd_power_interval"]
            assert low < told["odd_power"] < high
            assert told["odd_period_for_1_db"] > 1024
            assert told["noise_power"] == pytest.approx(1e-4 / 1024 / 3, rel=0.2)


@pytest.fixture(scope="module")
def saved(logs: list[Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the file with models of both outputs."""
    path = tmp_path_factory.mktemp("model") / "model.json"
    channels = ("--input", "Valve [%],load", "--output", "flow,heat", "--order", 1, "--delay", 1)
    ran = run(logs[0], *channels, "--out", path, "--json")
    assert ran.exit_code == 0, ran.output
    return path


def test_a_saved_model_is_simulated_on_each_log_and_each_run_is_written_to_its_own_file(
    logs: list[Path], saved: Path, tmp_path: Path
) -> None:
    shown = run(*logs[1:], "--simulate", saved, "--simulated", tmp_path / "run.csv")
    assert shown.exit_code == 0, shown.output
    assert [shown.stdout.count(name) for name in ("flow", "heat")] == [2, 2]
    written = sorted(path.name for path in tmp_path.iterdir())
    assert written == [f"run-{log}-{output}.csv" for log in ("run2", "run3") for output in ("flow", "heat")]
    table = pd.read_csv(tmp_path / "run-run2-flow.csv")
    assert list(table) == ["time_s", "Valve [%]", "load", "flow", "flow_simulated"]
    assert table["time_s"].to_numpy() == pytest.approx(0.02 * np.arange(300))
    assert np.std(table["flow_simulated"] - table["flow"]) < 0.05 * np.std(table["flow"])
    (tmp_path / "alone").mkdir()
    run(logs[1], "--simulate", saved, "--output", "heat", "--simulated", tmp_path / "alone" / "run.csv")
    assert [path.name for path in (tmp_path / "alone").iterdir()] == ["run.csv"]


def test_a_saved_model_simulates_one_of_its_outputs_or_columns_of_other_names(
    logs: list[Path], saved: Path, tmp_path: Path
) -> None:
    (one,) = json.loads(run(logs[1], "--simulate", saved, "--output", "heat", "--json").stdout)
    assert [part["output"] for part in one["outputs"]] == ["heat"]
    table = pd.read_csv(logs[1]).rename(columns={"Valve [%]": "a", "load": "b", "flow": "c", "heat": "d"})
    table.to_csv(tmp_path / "renamed.csv", index=False)
    names = ("--input", "a,b", "--output", "c,d")
    (other,) = json.loads(run(tmp_path / "renamed.csv", "--simulate", saved, *names, "--json").stdout)
    assert [part["output"] for part in other["outputs"]] == ["c", "d"]
    assert other["outputs"][1]["fit_percent"] == pytest.approx(one["outputs"][0]["fit_percent"], abs=1e-9)
    for wrong in (("--input", "a", "--output", "c,d"), ("--input", "a,b", "--output", "c")):
        refused = run(tmp_path / "renamed.csv", "--simulate", saved, *wrong)
        assert refused.exit_code == 2
        assert "the model goes from 2 inputs to 2 outputs, got columns for" in " ".join(refused.output.split())


def test_a_saved_model_matches_columns_by_name_in_any_order(logs: list[Path], saved: Path) -> None:
    """Before, with the outputs in reverse order, each model was compared with the column of the other output."""
    (one,) = json.loads(run(logs[1], "--simulate", saved, "--json").stdout)
    turned = ("--input", "load,Valve [%]", "--output", "heat,flow")
    (other,) = json.loads(run(logs[1], "--simulate", saved, *turned, "--json").stdout)
    assert [part["output"] for part in other["outputs"]] == ["heat", "flow"]
    assert other["outputs"] == one["outputs"][::-1]


def test_a_frequency_response_of_two_inputs_is_refused(logs: list[Path], tmp_path: Path) -> None:
    channels = ("--input", "Valve [%],load", "--output", "heat", "--order", 1, "--delay", 1)
    ran = run(logs[0], *channels, "--response", tmp_path / "response.png")
    assert ran.exit_code == 2
    assert "--response takes one input, got Valve [%], load" in " ".join(ran.output.split())
    assert not (tmp_path / "response.png").exists()


def test_a_backlash_is_reported_with_the_interval_of_its_half_width(tmp_path: Path) -> None:
    data = draw_log(PLANTED_NONLINEARITIES[2], 1)
    table = pd.DataFrame({"u": data.u[0][:, 0], "y": data.y[0]}, index=0.01 * np.arange(data.y[0].size))
    table.to_csv(tmp_path / "play.csv", index_label="time_s")
    arguments = ("--input", "u", "--output", "y", "--structure", "hammerstein", "--order", 2, "--delay", 1)
    (one,) = json.loads(run(tmp_path / "play.csv", *arguments, "--json").stdout)
    width = one["nonlinearity"]["half_width"]
    assert (one["structure"], one["nonlinearity"]["kind"]) == ("hammerstein", "backlash")
    assert width["ci95"][0] < width["value"] < width["ci95"][1]
    assert abs(width["value"] - 0.3) < 4.0 * width["std"]
    assert "backlash at u, half width 0.3" in run(tmp_path / "play.csv", *arguments).stdout
    model = hs.read(tmp_path / "play.csv").identify(input="u", output="y", structure="hammerstein", order=2, delay=1)
    assert model.nonlinearity["half_width"] == width


def test_an_error_model_is_reported_saved_and_simulated(tmp_path: Path) -> None:
    u, y = (column[:500] for column in signals(3))
    table = pd.DataFrame({"u": u[:, 0], "y": y}, index=0.01 * np.arange(y.size))
    table.to_csv(tmp_path / "product.csv", index_label="time_s")
    saved, arguments = tmp_path / "model.json", ("--structure", "auto", "--order", 2, "--delay", 0)
    said = run(tmp_path / "product.csv", "--input", "u", "--output", "y", *arguments, "--out", saved).stdout
    assert "error model" in said
    assert "can be predicted by a polynomial of its free run and the inputs" in " ".join(said.split())
    (one,) = json.loads(saved.read_text())
    assert set(one["error_model"]) == {"degree", "lags_samples", "n_values"}
    assert "with an error model" in one["message"]
    (again,) = json.loads(run(tmp_path / "product.csv", "--simulate", saved, "--json").stdout)
    assert again["outputs"][0]["fit_percent"] == pytest.approx(one["fit_percent"], abs=1e-6)


def test_an_output_measured_without_its_sign_is_modelled_as_an_absolute_value(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    u = np.repeat(rng.uniform(-1.5, 1.5, 60), 5)
    y = np.abs(filtered([0.0, 0.2], [1.0, -1.6, 0.8], u)) + 0.01 * rng.normal(size=300)
    table = pd.DataFrame({"u": u, "speed": y}, index=0.02 * np.arange(300))
    table.to_csv(tmp_path / "drive.csv", index_label="time_s")
    arguments = ("--input", "u", "--output", "speed", "--order", 2, "--delay", 1)
    said = run(tmp_path / "drive.csv", *arguments, "--structure", "auto").stdout
    assert "speed: absolute value at speed, lag 0" in said
    assert "measured without its sign" in " ".join(run(tmp_path / "drive.csv", *arguments).output.split())


def test_a_test_log_whose_input_leaves_the_fitted_range_is_named(tmp_path: Path) -> None:
    for name, scale in (("fit", 1.0), ("alike", 1.0), ("wider", 3.0)):
        rng = np.random.default_rng(1)
        u, y = scale * np.repeat(rng.uniform(-1.0, 1.0, 75), 4), np.zeros(300)
        for t in range(1, 300):
            y[t] = 0.8 * y[t - 1] + 0.3 * u[t - 1] - 0.2 * y[t - 1] * abs(y[t - 1])
        table = pd.DataFrame({"u": u, "y": y + 0.01 * rng.normal(size=300)}, index=0.01 * np.arange(300))
        table.to_csv(tmp_path / f"{name}.csv", index_label="time_s")
    channels = ("--input", "u", "--output", "y", "--order", 1, "--delay", 1)
    for structure, test, named in (("narx", "wider", True), ("narx", "alike", False), ("output-error", "wider", False)):
        arguments = (*channels, "--structure", structure, "--validate", tmp_path / f"{test}.csv", "--json")
        ran = run(tmp_path / "fit.csv", *arguments)
        assert ran.exit_code == 0, ran.output
        (one,) = json.loads(ran.stdout)
        codes = [note["code"] for note in one["notes"]]
        assert ("input_beyond_range" in codes) is named
        if named:
            (note,) = [note for note in one["notes"] if note["code"] == "input_beyond_range"]
            assert note["data"]["greatest"] == pytest.approx(3.0 * note["data"]["high"], rel=0.01)


@pytest.mark.parametrize(
    ("gain", "shown"),
    [
        (None, "-"),
        ({"value": 2.5, "std": 0.1}, "2.5 ± 0.1"),
        ({"value": 7e10, "std": 3e22}, "undetermined"),
        ({"value": [1.0, 2.0]}, "1 2"),
        ({"value": [1.0, 2.0], "std": [0.1, 3.0]}, "1 ± 0.1 undetermined"),
    ],
)
def test_a_gain_smaller_than_its_deviation_is_shown_as_undetermined(gain: dict[str, object] | None, shown: str) -> None:
    assert gains_shown({"dc_gain": gain, "notes": []}) == shown


def test_the_gain_of_an_integrating_model_is_shown_as_undetermined() -> None:
    assert gains_shown({"dc_gain": {"value": 9.7e6, "std": 1e6}, "notes": [{"code": "integrates"}]}) == "undetermined"


def test_a_log_without_time_is_simulated_on_the_model_s_sample_time(logs: list[Path], tmp_path: Path) -> None:
    saved, timeless = tmp_path / "model.json", tmp_path / "timeless.csv"
    form = ("--input", "Valve [%],load", "--output", "flow", "--order", 1, "--delay", 1)
    run(*logs[:2], *form, "--out", saved)
    pd.read_csv(logs[2]).drop(columns="t_ms").to_csv(timeless, index=False)
    (timed,), (one,) = (json.loads(run(log, "--simulate", saved, "--json").stdout) for log in (logs[2], timeless))
    assert one["fit_percent"] == pytest.approx(timed["fit_percent"], abs=1e-6)
    assert [("no time column" in said, "0.02 s" in said) for said in one["warnings"]] == [(True, True)]
