"""A verb imports only what its answer needs: imports take most of the time of a short run."""

import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.simulate import LUMPED, simulate
from plant.log.files import write_record
from plant.sensors.sensors import BENCH
from tests.thinned import thinned

DEAR = {
    "control",
    "distributed",
    "fastapi",
    "filterpy",
    "jinja2",
    "matplotlib",
    "numpy.ma",
    "pandas",
    "pebble",
    "pint",
    "pydantic",
    "rich",
    "scipy",
    "starlette",
    "statsmodels",
    "uvicorn",
}
"""Modules that no verb needs for its JSON."""

OTHERS = {"experiments.verbs.serve", "experiments.verbs.watch"}
"""Modules of other verbs, which a verb for a single log does not import."""

TELLING = """
import sys
from experiments.cli import app_for
try:
    app_for(sys.argv[1:])()
except SystemExit as ended:
    print(*sys.modules, file=sys.stderr)
    sys.exit(ended.code)
"""


def python(text: str, *arguments: str) -> "subprocess.CompletedProcess[str]":
    command = [sys.executable, "-c", text, *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False, env=dict(os.environ))  # noqa: S603


def loaded_by(arguments: Sequence[str]) -> set[str]:
    done = python(TELLING, *arguments)
    assert done.returncode == 0, done.stderr
    return set(done.stderr.split())


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    healthy, rng = EhaParameters(), np.random.default_rng(3)
    drive = make_drive("prbs", 1.0, 1e-3, healthy, rng)
    record = simulate(LUMPED, drive, 1e-3, healthy, sensors=BENCH, rng=rng)
    folder = tmp_path_factory.mktemp("logs")
    paths = {suffix: folder / f"run.{suffix}" for suffix in ("csv", "parquet", "mat")}
    for path in paths.values():
        write_record(record, path)
    paths["txt"] = folder / "bench.txt"
    names = ("Time [ms]", "Motor speed [rpm]", "Position [mm]", "Differential pressure [bar]")
    scaled = (1e3 * record.time, 9.549296585513721 * record["motor_speed_rad_s"], 1e3 * record["position_m"])
    table = np.column_stack([*scaled, 1e-5 * record["differential_pressure_pa"]])
    np.savetxt(paths["txt"], table, delimiter=",", header=",".join(names), comments="")
    return paths


@pytest.mark.parametrize(
    ("verb", "suffix"),
    thinned(
        [
            *(("estimate", suffix) for suffix in ("csv", "parquet", "mat", "txt")),
            *(("diagnose", "csv"), ("identify", "csv"), ("inspect", "txt")),
        ],
        [("inspect", "txt"), ("diagnose", "csv"), ("identify", "csv")],
    ),
)
def test_a_verb_on_a_log_imports_no_slow_module(logs: dict[str, Path], verb: str, suffix: str) -> None:
    dear = DEAR | (set() if verb == "inspect" else OTHERS)
    assert not dear & loaded_by([verb, str(logs[suffix]), "--json"])


def test_help_imports_neither_numpy_nor_pyarrow() -> None:
    assert not (DEAR - {"rich"} | {"numpy", "pyarrow"}) & loaded_by(["estimate", "--help"])


@pytest.mark.parametrize(("arguments", "code"), [(["conditions", "--json"], 0), (["estimate"], 2)])
def test_the_immediate_exit_keeps_the_exit_code_and_runs_the_atexit_functions(arguments: list[str], code: int) -> None:
    text = "import atexit, experiments.cli\natexit.register(print, 'called')\nexperiments.cli.main()"
    done = python(text, *arguments)
    assert done.returncode == code
    assert done.stdout.endswith("called\n")
