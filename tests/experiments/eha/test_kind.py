"""Settings of the gear-pump actuator's verbs: its transfer functions and its figure."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import faults.eha.bank
from estimation.eha.estimate import estimate_log
from experiments.cli import app
from experiments.eha.kind import EHA
from experiments.published.library import read_library
from plant.eha.drives import make_drive, sine
from plant.eha.model import EhaParameters
from plant.eha.rig import Rig
from plant.eha.simulate import CIRCUIT, LUMPED, simulate
from plant.log.record import Record
from plant.sensors.sensors import BENCH

OPTIONS = {"transfer_functions": None, "no_pressure": False, "seed": 7}
OTHER = Rig("other", EhaParameters(moving_mass=9.0))


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[tuple[EhaParameters, float]]:
    """Return the rigs for which banks are identified, with the first random number of each."""
    asked: list[tuple[EhaParameters, float]] = []

    def identified(parameters: EhaParameters, rng: np.random.Generator, **_: Any) -> dict[str, Any]:
        asked.append((parameters, float(rng.random())))
        return {}

    monkeypatch.setattr(faults.eha.bank, "identify_bank", identified)
    return asked


def linear_of(rig: Rig, **options: Any) -> Any:
    assert EHA.diagnose is not None
    _, (_, linear) = EHA.diagnose.prepare(rig, {**OPTIONS, **options})
    return linear


def test_the_paper_s_rig_uses_the_stored_library_without_simulation(asked: list[Any]) -> None:
    for wanted in (None, True):
        found = linear_of(Rig(), transfer_functions=wanted)()
        assert found.keys() == read_library().keys()
        for name, model in read_library().items():
            np.testing.assert_array_equal(found[name].numerator, model.numerator)
    assert linear_of(Rig(), transfer_functions=False) is None
    assert asked == []


def test_transfer_functions_of_another_rig_are_identified_once_and_only_on_request(
    asked: list[Any], capsys: pytest.CaptureFixture[str]
) -> None:
    assert linear_of(OTHER) is None
    linear = linear_of(OTHER, transfer_functions=True)
    assert asked == []  # nothing is identified before it is needed
    linear()
    linear()
    assert asked == [(OTHER.parameters, float(np.random.default_rng(7).random()))]
    assert capsys.readouterr().err.count("identifying nine transfer functions") == 1


def log() -> Record:
    p, rng = EhaParameters(), np.random.default_rng(1)
    return simulate(LUMPED, sine(2.0, 1e-3, p.rated_speed, 5.0), 1e-3, p, sensors=BENCH, rng=rng)


def test_the_library_ignores_a_velocity_channel_that_is_found_wrong() -> None:
    p, rng = EhaParameters(), np.random.default_rng(8)
    record = simulate(CIRCUIT, make_drive("steps", 2.0, 1e-3, p, rng), 1e-3, p, sensors=BENCH, rng=rng)
    velocity, verb = record["velocity_m_s"], EHA.diagnose
    assert verb is not None
    wrong, absent = (
        verb.run(record.replace(velocity_m_s=one), Rig(), (False, read_library)).evidence.transfer_functions
        for one in (0.5 * velocity, None)
    )
    assert wrong.by_condition == absent.by_condition


def test_a_fitted_log_has_no_innovations_figure_and_the_option_for_one_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert EHA.estimate is not None
    assert EHA.estimate.figure is not None
    EHA.estimate.figure(estimate_log(log(), Rig()), "run.csv", tmp_path / "run.png")
    assert "no figure: run.csv was not filtered; ask for one with --method ekf" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_the_remark_on_assumed_leakage_is_omitted_if_a_condition_is_given_or_leakage_estimated() -> None:
    assert EHA.estimate is not None
    remarks = EHA.estimate.remarks
    told = {"condition": None, "form": "pressure", "rig": "mine"}
    (said,) = remarks([told])
    assert "leakage and friction were taken to be those of the rig 'mine'" in said
    for change in ({"condition": "normal"}, {"form": "flow"}, {"form": "motion"}, {"form": None}):
        assert list(remarks([{**told, **change}])) == []


def test_a_sample_time_over_100_ms_is_refused(tmp_path: Path) -> None:
    """Otherwise the transfer functions would be run with ten million of their steps per sample."""
    path, speed = tmp_path / "run.csv", 90.0 * np.sin(np.arange(40.0) / 9.0)
    rows = np.column_stack([1e4 * np.arange(40.0), speed, 1e-5 * np.cumsum(speed)])
    np.savetxt(path, rows, delimiter=",", header="time_s,motor_speed_rad_s,position_m", comments="")
    for verb in ("estimate", "diagnose"):
        done = CliRunner().invoke(app, [verb, str(path)])
        assert (done.exit_code, done.output.count("must be at most 0.1 s")) == (2, 1)
