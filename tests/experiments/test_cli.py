import csv
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner, Result

import faults.conditions
from experiments.cli import VERBS_LOADED_ALONE, app, app_for
from experiments.nine_conditions.settings import quick_settings
from experiments.running.study import Study
from faults.conditions import CONDITIONS
from plant.eha.model import EhaParameters
from plant.eha.rig import read_rig

PUBLISHED = Path(__file__).resolve().parents[2] / "experiments" / "published"
COMMANDS = ("study", "simulate", "estimate", "identify", "diagnose", "identifiability", "conditions")


def invoke(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def process(*arguments: object, **environment: str) -> "subprocess.CompletedProcess[str]":
    command = [sys.executable, "-m", "experiments.cli", *map(str, arguments)]
    variables = {**os.environ, **environment}
    return subprocess.run(command, capture_output=True, text=True, check=False, env=variables)  # noqa: S603 - our own command


@pytest.mark.parametrize("command", [(name,) for name in COMMANDS] + [("rig", "init")])
def test_help_of_every_command_gives_an_example(command: tuple[str, ...]) -> None:
    shown = invoke(*command, "--help")
    assert shown.exit_code == 0
    assert f"Example: hydrostate {' '.join(command)}" in " ".join(shown.stdout.split())


@pytest.mark.parametrize(
    "words", [[verb, *more] for verb in VERBS_LOADED_ALONE for more in (["--help"], [], ["--no-such", "x.csv"])]
)
def test_a_verb_loaded_alone_gives_the_same_output_as_in_the_whole_app(words: list[str]) -> None:
    alone, among = CliRunner().invoke(app_for(words), words), CliRunner().invoke(app, words)
    assert (alone.exit_code, alone.output) == (among.exit_code, among.output)


def test_help_in_80_columns_cuts_neither_names_nor_descriptions(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    shown = invoke("diagnose", "--help").stdout
    assert "stack_displacement_m" in shown, "a name is cut"
    assert "diaphragm-motor: known force against" in shown
    assert "<" not in shown
    assert "<" not in invoke("--help").stdout


@pytest.mark.parametrize("words", [["diagnose"], ["rig", "init"], ["rig"], []])
def test_the_verb_help_prints_the_same_as_the_option_help(words: list[str]) -> None:
    asked, meant = invoke("help", *words), invoke(*words, "--help")
    assert (asked.exit_code, asked.output) == (0, meant.output)


@pytest.mark.parametrize("verb", ["diagnose", "estimate", "inspect"])
def test_the_options_report_and_html_are_equivalent(verb: str) -> None:
    refused = [invoke(verb, "x.csv", name, "page.txt").output for name in ("--report", "--html")]
    assert refused[0] == refused[1]
    assert "must end in .html" in refused[0]


def test_a_log_on_standard_input_is_referred_to_watch() -> None:
    assert "hydrostate watch -" in invoke("diagnose", "-").output


@pytest.mark.parametrize(
    ("command", "units"),
    [
        ("simulate", ["[s]", "[dimensionless]"]),
        ("estimate", ["[Pa]", "SI"]),
        ("identify", ["[s]", "[Hz]", "[rad/s]", "[m/s]"]),
        ("diagnose", ["[m/s]", "[dimensionless]"]),
    ],
)
def test_help_contains_units(command: str, units: list[str]) -> None:
    shown = invoke(command, "--help").stdout
    assert [unit for unit in units if unit not in shown] == []


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_the_common_options(command: str) -> None:
    shown = invoke(command, "--help").stdout
    assert all(option in shown for option in ("--json", "--out", "--seed"))


def test_help_explains_exit_codes_and_outcomes() -> None:
    shown = " ".join(invoke("--help").stdout.split())
    for meaning in (
        "0 all done",
        "1 some logs failed",
        "2 nothing was done",
        "not_observable",
        "HYDROSTATE_DEBUG",
    ):
        assert meaning in shown


def test_help_and_version_import_no_heavy_package() -> None:
    code = (
        "import sys\nfrom experiments.cli import app\n"
        "for option in ('--help', '--version'):\n"
        "    try:\n        app([option])\n    except SystemExit as end:\n        assert end.code == 0\n"
        "print(sorted({'numpy', 'scipy', 'matplotlib', 'pandas', 'pint'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)  # noqa: S603
    assert done.stdout.splitlines()[-2:] == ["hydrostate 0.1.0", "[]"]


def test_fitting_a_log_imports_no_filters_and_no_reader_of_another_format(tmp_path: Path) -> None:
    """Before, filters and tuning took a fifteenth of all imports, only for the names of their options."""
    (tmp_path / "log.csv").write_text("time_s,motor_speed_rad_s\n0,1\n")
    code = (
        "import sys\nimport faults.diagnosis.diagnose\nfrom experiments.cli import app\n"
        f"try:\n    app(['estimate', {str(tmp_path / 'log.csv')!r}])\nexcept SystemExit as end:\n    assert end.code\n"
        "unused = {'estimation.filters.methods', 'estimation.tuning.tuning', 'plant.log.formats.mat_reader'}\n"
        "print(sorted(unused & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)  # noqa: S603
    assert done.stdout.splitlines()[-1] == "[]"


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["bogus"], "hydrostate: No such command 'bogus'. Commands: inspect, diagnose, "),
        (["export", "filter"], "hydrostate export: No such command 'filter'. Commands: c, fmu, model."),
        (["estimate"], "hydrostate estimate: Missing argument 'LOG'. `hydrostate estimate --help` shows an example."),
        (["estimate", "a.csv", "--sample-time", "0"], "--sample-time must be positive and finite, got 0 s"),
        (
            ["estimate", "a.csv", "--sart", "1"],
            "hydrostate estimate: No such option: --sart (Possible options: --plant, --start",
        ),
        (
            ["estimate", "a.csv", "--form", "force"],
            "--form must be one of auto, flow, motion, acceleration, pressure, got 'force'",
        ),
        (["estimate", "a.csv", "--method", "ukf9"], "filterpy-ekf, got 'ukf9'"),
        (["estimate", "a.csv", "--states", "mass"], "--states must be one of leakage, friction, air"),
        (["estimate", "a.csv", "--sensors", "position,force"], "--sensors must be one of position, velocity, dp"),
        (["estimate", "a.csv", "--robust", "very"], "--robust must be one of none, huber, student-t, got 'very'"),
        (["estimate", "a.csv", "--smooth", "--method", "ukf"], "--smooth smooths the ekf, got --method ukf"),
        (["estimate", "a.csv", "--condition", "bad"], "condition must be one of normal, minor_leakage"),
        (["diagnose", "a.csv", "--condition", "bad"], "condition must be one of normal, minor_leakage"),
        (["estimate", "a.csv", "--start", "-1"], "--start must be positive and finite, got -1 Pa"),
        (["estimate", "a.csv", "--start", "nan"], "--start must be positive and finite, got nan Pa"),
        (["estimate", "a.csv", "--start-std", "0"], "--start-std must be positive and finite, got 0 Pa"),
        (
            ["estimate", "a.csv", "--rig", "none.toml"],
            "none.toml: cannot be read as a rig file: No such file or directory; `hydrostate rig init`",
        ),
        (["estimate", "a.csv", "--columns", "position_m"], "columns must be given as CHANNEL=NAME:UNIT"),
        (
            ["estimate", "a.csv", "--columns", "position_m=X:furlongs/h"],
            "position_m='X:furlongs/h': unit 'furlongs/h' does not",
        ),
        (["diagnose", "a.csv", "--columns", "depth=X"], "channel 'depth' is unknown"),
        (["identify", "a.csv", "--filter-hz", "0"], "--filter-hz must be positive and finite, got 0 Hz"),
        (["watch", "a.csv", "--state", "s"], "--state goes with a stream"),
        (["identify", "a.csv", "--order", "0"], "--order must be a whole number from 1 to 20, or auto, got '0'"),
        (["simulate"], "hydrostate simulate: Missing option '--out' / '-o'."),
        (["simulate", "-o", "a.xls"], "--out must end in .csv"),
        (
            ["simulate", "-o", "a.csv", "--plant", "toy"],
            "--plant must be one of eha, reduced, lumped, circuit, piezo-stack, diaphragm-motor, got 'toy'",
        ),
        (["simulate", "-o", "a.csv", "--drive", "walk"], "--drive must be one of sine"),
        (["simulate", "-o", "a.csv", "--drive", "stepz"], "got 'stepz', did you mean 'steps'?"),
        (["simulate", "-o", "a.csv", "--duration", "inf"], "--duration must be positive and finite, got inf s"),
        (["simulate", "-o", "a.csv", "--leakage-severity", "9"], "leakage severity must be between 0 and 5, got 9.0"),
        (
            ["simulate", "-o", "a.csv", "--leakage-severity", "1", "--condition", "normal"],
            "give either --condition or severities, not both",
        ),
        (["estimate", "a.csv", "--method", "ekf", "--figure", "a.pdf"], "--figure must end in .png, got 'a.pdf'"),
        (["identify", "a.csv", "--response", "a.svg"], "--response must end in .png, got 'a.svg'"),
        (["identify", "a.csv", "--validate", "b.csv"], "--validate goes with --input and --output that name columns"),
        (["identify", "a.csv", "--simulated", "s.csv"], "--simulated goes with --input and --output"),
        (["identify", "a.csv", "--rig", "r.toml", "--simulate", "m.json"], "--simulate goes with --input and --output"),
        (["identify", "a.csv", "--input", "u", "--output", "y", "--filter-hz", "9"], "--filter-hz does not go with"),
        (["identify", "a.csv", "--simulate", "m.json", "--validate", "b.csv"], "--validate goes with a fit"),
        (["identify", "a.csv", "--columns", "position_m=b", "--output", "u,y"], "--output takes one channel with"),
        (["identify", "a.csv", "--figure", "none/a.png"], "--figure none/a.png: there is no such folder"),
        (["diagnose", "a.csv", "--report", "none/a.html"], "--report none/a.html: there is no such folder"),
        (["inspect", "a.csv", "--report", "none/a.html"], "--report none/a.html: there is no such folder"),
        (["diagnose", "a.csv", "--out", "a.csv"], "--out must be a folder, or a file that ends in .json, got 'a.csv'"),
        (["diagnose", "."], ".: a file is needed, got a folder; `hydrostate fleet FOLDER` reads all logs of one"),
        (["watch", "-", "--state", "none/a.npz"], "--state none/a.npz: there is no such folder"),
        (["filter", "-", "--state", "none/a.npz"], "--state none/a.npz: there is no such folder"),
        (["fleet", ".", "--names", "a.csv"], "a.csv: must be a CSV table in UTF-8 that can be read: No such file"),
        (
            ["fleet", ".", "--maintenance", "a.csv"],
            "a.csv: must be a CSV table in UTF-8 that can be read: No such file",
        ),
        (["library", "a.json"], "library a.json cannot be read: No such file or directory"),
        (["diagnose", "a.csv", "--report", "."], "--report must be a file, got the folder '.'"),
        (
            ["diagnose", "a.csv", "--report", "a.pdf"],
            "--report must end in .html, got 'a.pdf'; a browser prints the page",
        ),
        (["diagnose", "a.csv", "--rig", "."], ".: cannot be read as a rig file: it is a folder"),
        (["--rig", "a.toml", "diagnose"], "No such option: --rig (a command's options stand after its name)"),
        (["simulate", "-o", "a.csv", "--duration", "10s"], "'--duration': a number is needed, got '10s'"),
        (["simulate", "-o", "a.csv", "--seed", "x"], "'--seed': a whole number is needed, got 'x'"),
        (["study", "-o", "a.csv"], "--out must be a folder, got 'a.csv'"),
        (["export", "model", "a.json", "-o", "a.csv"], "--out must be a folder, got 'a.csv'"),
        (["export", "fmu", "-o", "a.csv"], "--out must end in .fmu, got 'a.csv'"),
        (["fleet", "none"], "none: must be a folder with logs or a store, but there is no such folder"),
        (["conditions", "--seed", "-1"], "Invalid value for '--seed'"),
    ],
)
def test_wrong_arguments_are_refused_in_one_line(
    arguments: list[str], sentence: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    refused = invoke(*arguments)
    assert refused.exit_code == 2
    assert sentence in refused.stderr
    assert len(refused.stderr.splitlines()) == 1
    assert refused.stdout == ""
    assert list(tmp_path.iterdir()) == []


def test_an_internal_error_prints_one_line_and_a_traceback_only_on_request(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> None:
        raise RuntimeError("the\nmill is broken")

    monkeypatch.setattr(faults.conditions, "parameters_for", broken)
    monkeypatch.delenv("HYDROSTATE_DEBUG", raising=False)
    quiet = invoke("conditions")
    assert quiet.exit_code == 1
    assert quiet.stderr.splitlines() == [
        "hydrostate: an internal error (RuntimeError: the mill is broken), please report it; "
        "HYDROSTATE_DEBUG=1 prints the traceback"
    ]
    monkeypatch.setenv("HYDROSTATE_DEBUG", "1")
    assert "Traceback (most recent call last)" in invoke("conditions").stderr


def test_an_interruption_is_exit_code_130_without_a_traceback(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(faults.conditions, "parameters_for", interrupted)
    stopped = invoke("conditions")
    assert (stopped.exit_code, stopped.stdout) == (130, "")
    assert "Traceback" not in stopped.stderr


def test_the_nine_conditions_have_the_names_of_table_1() -> None:
    with (PUBLISHED / "eha_table1_conditions.csv").open() as file:
        names = [row["condition"] for row in csv.DictReader(file)]
    found = json.loads(invoke("conditions", "--json").stdout)
    assert [one["condition"] for one in found] == names
    assert found[4]["parameters"]["friction_quadratic"] == 4.462e6


def test_conditions_are_shown_with_units() -> None:
    shown = invoke("conditions").stdout
    assert all(name in shown for name in CONDITIONS)
    assert "L_t [m^3/(s Pa)]" in shown


def test_rig_init_writes_a_file_once(tmp_path: Path) -> None:
    path = tmp_path / "rig.toml"
    assert invoke("rig", "init", path).exit_code == 0
    assert read_rig(path).parameters == EhaParameters()
    path.write_text("# mine")
    again = invoke("rig", "init", path)
    assert again.exit_code == 2
    assert again.stderr.splitlines() == [
        f"hydrostate: {path}: the file exists already and is not overwritten; give another name"
    ]
    assert path.read_text() == "# mine"
    assert "PATH must end in .toml, got" in invoke("rig", "init", tmp_path / "rig.csv").stderr


def test_help_lists_the_groups_of_commands_in_order() -> None:
    said = invoke("--help").stdout
    headings = ["What a log says", "│ diagnose", "Many logs", "│ fleet", "Before a test", "│ rig ", "The papers"]
    places = [said.index(one) for one in headings]
    assert places == sorted(places)


@pytest.mark.parametrize("as_json", [False, True])
def test_study_prints_the_path_of_the_report_last(
    as_json: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[tuple[str, object, Path]] = []

    def run(study: Study[Any], settings: object, out: Path, console: object) -> Path:
        del console
        asked.append((study.name, settings, out))
        return out / "report.html"

    monkeypatch.setattr("experiments.running.study.run_study", run)
    done = invoke("study", "--quick", "--out", tmp_path, "--seed", 7, *(["--json"] if as_json else []))
    assert done.exit_code == 0
    assert asked == [("nine conditions", quick_settings(7), tmp_path)]
    if as_json:
        (found,) = json.loads(done.stdout)
        assert (found["outcome"], found["report"]) == ("ok", str(tmp_path / "report.html"))
        assert found["manifest"] == str(tmp_path / "manifest.json")
        assert found["seconds"] >= 0.0
    else:
        assert done.stdout.splitlines()[-1] == str(tmp_path / "report.html")


def test_the_command_runs_as_a_process_with_its_exit_codes(tmp_path: Path) -> None:
    (tmp_path / "empty.csv").write_text("")
    fine, refused = process("conditions", "--json"), process("estimate", tmp_path / "empty.csv", "--json")
    assert (fine.returncode, len(json.loads(fine.stdout)), fine.stderr) == (0, 9, "")
    assert refused.returncode == 2
    assert [one["outcome"] for one in json.loads(refused.stdout)] == ["failed"]
    assert "empty.csv: a header line is needed, but the file is empty" in refused.stderr
    assert "Traceback" not in refused.stderr


def test_closed_standard_streams_are_not_an_error() -> None:
    command = f"exec {sys.executable} -m experiments.cli conditions --json >&- 2>&- <&-"
    assert subprocess.run(["/bin/sh", "-c", command], check=False).returncode == 0  # noqa: S603


def test_a_closed_output_pipe_is_not_an_error() -> None:
    reading, writing = os.pipe()
    os.close(reading)
    command = [sys.executable, "-m", "experiments.cli", "conditions", "--json"]
    done = subprocess.run(command, stdout=writing, stderr=subprocess.PIPE, text=True, check=False)  # noqa: S603
    os.close(writing)
    assert (done.returncode, done.stderr) == (0, "")


def test_compiling_is_announced_once(tmp_path: Path) -> None:
    words = ("--plant", "reduced", "--duration", 0.1, "--sample-time", 1e-3)
    arguments = ("simulate", *words, "-o", tmp_path / "run.parquet")
    first, second = (process(*arguments, HYDROSTATE_CACHE=str(tmp_path / "cache")) for _ in range(2))
    assert (first.returncode, second.returncode) == (0, 0)
    assert [line[:17] for line in first.stderr.splitlines()] == ["compiling kernels"]
    assert second.stderr == ""
    assert first.stdout == second.stdout
