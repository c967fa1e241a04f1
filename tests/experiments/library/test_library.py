import json
from dataclasses import replace
from pathlib import Path

import control
import numpy as np
import pytest

from estimation.identification.design.input_design import Limits
from estimation.identification.fit.order import order_table
from experiments.eha.kind import EHA
from experiments.library.library import build_library, circuit_passes, library_text
from experiments.library.structures import MADE_FOR, clock_table
from experiments.library.tables import library_table, root_table
from experiments.nine_conditions.printed_transfer_functions import printed_model
from experiments.nine_conditions.settings import StudySettings
from experiments.nine_conditions.transfer_functions import identification_study
from experiments.published.library import FORMAT, VERSION, read_library
from experiments.running.random_streams import stream
from faults.conditions import CONDITIONS, parameters_for
from faults.diagnosis.rmse import score_transfer_functions
from faults.eha.inject import varied_actuator
from plant.eha.circuit_parameters import CircuitParameters
from plant.eha.drives import make_drive
from plant.eha.model import EhaParameters
from plant.eha.rig import Rig
from plant.eha.simulate import CIRCUIT, simulate
from plant.errors import HydrostateError
from plant.sensors.sensors import BENCH


def test_the_library_of_the_package_has_nine_stable_models_with_both_covariances() -> None:
    models = read_library()
    assert list(models) == list(CONDITIONS)
    for model in models.values():
        assert model.is_stable
        assert np.isfinite(model.covariance_white).all()
        assert np.isfinite(model.covariance_robust).all()
        assert model.denominator.size == 3
        assert 0.0 < model.dc_gain_std < 0.1 * model.dc_gain
        assert model.data_hash


def test_gains_fall_with_leakage_and_with_friction() -> None:
    gains = library_table(read_library()).set_index("condition")["dc_gain"]
    assert gains["normal"] > gains["minor_leakage"] > gains["major_leakage"]
    assert gains["minor_friction"] > gains["minor_leakage_minor_friction"] > gains["major_leakage_minor_friction"]
    assert (gains < 1.1 * 5.57e-7 / 1.52e-3).all()  # the pump's flow limits the piston's velocity


def test_models_of_the_library_jump_less_than_the_printed_ones() -> None:
    """Errata E15: eight of nine printed models do not roll off; ours jump if the piston sticks, by half as much."""
    table, moving = library_table(read_library()), library_table(read_library(which="around_mean"))
    assert (moving["jump_ratio"].abs() < 0.15).all()
    assert (table["jump_ratio"].abs() < 0.45).all()
    assert (table["published_jump_ratio"] > 0.7).sum() == 8


def test_the_printed_digits_leave_the_normal_gain_uncertain_by_a_factor_of_20() -> None:
    """Errata E14."""
    low, high = printed_model("normal")["dc_gain"]["interval"]
    assert low == pytest.approx(3.2e-5, rel=0.02)
    assert high == pytest.approx(7.78e-4, rel=0.01)
    assert printed_model("normal")["pole_half_width"][0][0] > 0.0


def test_a_written_library_is_read_back_exactly(tmp_path: Path) -> None:
    models = read_library()
    entries = {name: {"model": model.to_dict()} for name, model in models.items()}
    (tmp_path / "library.json").write_text(library_text({"format": FORMAT, "version": VERSION, "conditions": entries}))
    again = read_library(tmp_path / "library.json")
    assert all(again[name].to_dict() == model.to_dict() for name, model in models.items())


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        json.dumps({"format": "other"}),
        json.dumps({"format": FORMAT, "version": 9}),
        json.dumps({"format": FORMAT}),
    ],
)
def test_a_file_that_is_not_a_library_is_refused(text: str, tmp_path: Path) -> None:
    (tmp_path / "file.json").write_text(text)
    with pytest.raises(HydrostateError, match="library"):
        read_library(tmp_path / "file.json")


def test_velocities_of_both_passes_have_zero_mean_and_correlate_with_speed() -> None:
    speeds, velocities = circuit_passes(CircuitParameters(), "normal", np.random.default_rng(1), duration=8.0)
    assert len(speeds) == len(velocities) == 2
    assert all(abs(one.mean()) < 1e-9 for one in velocities)
    # a faster motor drives the piston faster, in either direction of the pass
    assert all(np.corrcoef(u, v)[0, 1] > 0.5 for u, v in zip(speeds, velocities, strict=True))


def test_a_clock_of_5_hz_has_the_largest_error_at_25_hz() -> None:
    table = clock_table(read_library(which="around_mean")["major_leakage"], Limits(125.66), 1)
    assert table["at_25_hz"].idxmax() == "200 ms"
    assert table.loc[MADE_FOR, "at_25_hz"] < 1.1 * table["at_25_hz"].min()


def test_poles_and_zeros_are_listed_with_the_published_ones_and_their_spread() -> None:
    roots = root_table(read_library())
    printed = roots[
        (roots["condition"] == "minor_friction") & (roots["source"] == "Table 6") & (roots["kind"] == "pole")
    ]
    np.testing.assert_allclose(printed["real"], 0.8735)
    assert (roots["real_spread"] > 0.0).all()
    assert set(roots["condition"]) == set(CONDITIONS)


def test_a_higher_order_never_fits_worse() -> None:
    condition = "major_leakage_major_friction"
    u, y = circuit_passes(CircuitParameters(), condition, stream(2024, "order", condition), duration=8.0)
    table = order_table(u, y, 1e-3)
    assert (np.diff(table["rmse"]) <= 1e-6 * table["rmse"].iloc[0]).all()


@pytest.mark.parametrize("drive", ["prbs", "steps"])
def test_the_library_classifies_at_least_85_percent_of_circuit_logs(drive: str) -> None:
    """Section 6's rule, least RMSE in velocity, on circuits spread about the nine, without seeds of the library."""
    library, right = read_library(), []
    for seed in range(3):
        for name, condition in CONDITIONS.items():
            rng = stream(777, drive, name, seed)
            p = varied_actuator(parameters_for(condition, EhaParameters()), rng)
            log = simulate(CIRCUIT, make_drive(drive, 20.0, 1e-3, p, rng), 1e-3, p, sensors=BENCH, rng=rng)
            right.append(score_transfer_functions(log, library).condition == name)
    assert np.mean(right) >= 0.85  # 108 of 108 and 101 of 108 were measured over twelve seeds


def test_the_study_and_diagnose_use_the_models_of_the_library() -> None:
    shown = {name: model.to_dict() for name, model in read_library().items()}
    of_study, _ = identification_study(EhaParameters(), replace(StudySettings(), identification_duration=1.0))
    options = {"no_pressure": False, "transfer_functions": True, "seed": 1}
    assert EHA.diagnose is not None
    _, (_, of_diagnose) = EHA.diagnose.prepare(Rig("paper", EhaParameters()), options)
    for found in (of_study, of_diagnose()):
        assert {name: model.to_dict() for name, model in found.items()} == shown


@pytest.mark.parametrize(
    ("asked", "of_paper", "of_another"), [(None, True, False), (False, False, False), (True, True, True)]
)
def test_transfer_functions_of_another_rig_are_prepared_only_on_request(
    asked: bool | None,
    of_paper: bool,
    of_another: bool,
) -> None:
    assert EHA.diagnose is not None
    paper = Rig("paper", EhaParameters())
    another = Rig("mine", replace(EhaParameters(), moving_mass=9.0))
    for rig, wanted in ((paper, of_paper), (another, of_another)):
        _, (_, models) = EHA.diagnose.prepare(rig, {**EHA.diagnose.options, "seed": 0, "transfer_functions": asked})
        assert (models is not None) == wanted


def test_a_model_of_the_library_is_a_transfer_function_of_python_control() -> None:
    for name, model in read_library().items():
        system = model.to_control()
        assert isinstance(system, control.TransferFunction)
        assert float(system.dcgain()) == pytest.approx(model.dc_gain, rel=1e-9), name
        assert system.dt == 1e-3


@pytest.mark.slow
def test_the_study_rebuilds_the_gains_of_the_library() -> None:
    stored = read_library()
    built = build_library(2024)["conditions"]
    for name, model in stored.items():
        gain = built[name]["dc_gain"]
        assert gain["value"] == pytest.approx(model.dc_gain, rel=1e-3)
