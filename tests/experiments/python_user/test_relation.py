"""Models between any channels in Python, of one output and of several, fitted and loaded."""

import warnings
from pathlib import Path
from typing import Any

import control
import numpy as np
import pytest

from estimation.identification.free_run.fallback import Fallback
from estimation.identification.free_run.polynomial_dynamics import PolynomialDynamics
from estimation.identification.free_run.saved import load_models
from estimation.identification.model.recursion import filtered
from experiments.python_user.log import ANY, Log
from experiments.python_user.relation import Relation, identified
from hydrostate import read
from plant.eha.rig import Rig
from plant.errors import HydrostateError, LogWarning, NoSuchNameError
from plant.log.record import Record

T = 0.02
GAINS = {"flow": (2.0, -0.5), "heat": (0.0, 2.0)}
"""Steady-state gain from valve and load, by output."""


def record(seed: int) -> Record:
    rng = np.random.default_rng(seed)
    valve, load = (np.repeat(rng.normal(size=81), 5)[:400] for _ in range(2))
    flow = 2.0 + filtered([0.0, 0.4], [1.0, -0.8], valve) - filtered([0.0, 0.1], [1.0, -0.8], load)
    heat = 50.0 + filtered([0.0, 1.0], [1.0, -0.5], load)
    noise = 0.02 * rng.normal(size=(2, 400))
    return Record(T, {"valve": valve, "load": load, "flow": flow + noise[0], "heat": heat + noise[1]})


def opened(one: Record) -> Log:
    return Log(one, Rig(), ANY)


@pytest.fixture(scope="module")
def both() -> Relation:
    return identified([record(1)], ["valve", "load"], ["flow", "heat"], {"order": 1, "delay": 1})


@pytest.fixture(scope="module")
def shared() -> Relation:
    form = {"structure": "state-space", "order": 2, "delay": 1}
    return identified([record(1)], ["valve", "load"], ["flow", "heat"], form)


def test_models_of_two_outputs_become_one_transfer_matrix_of_python_control(both: Relation) -> None:
    system = both.to_control()
    assert isinstance(system, control.TransferFunction)
    assert (system.noutputs, system.ninputs, system.dt) == (2, 2, T)
    np.testing.assert_allclose(system.dcgain(), list(GAINS.values()), atol=0.05)


def test_a_shared_state_space_model_becomes_one_state_space_of_python_control(shared: Relation) -> None:
    system = shared.to_control()
    assert isinstance(system, control.StateSpace)
    assert list(system.output_labels) == ["flow", "heat"]
    np.testing.assert_allclose(system.dcgain(), list(GAINS.values()), atol=0.05)
    np.testing.assert_allclose(sorted(system.poles().real)[-2:], [0.5, 0.8], atol=0.05)


def test_report_writes_one_page_for_each_output(both: Relation, tmp_path: Path) -> None:
    places = both.report(tmp_path / "loop", title="bench 7, Monday")
    assert [one.name for one in places] == ["loop-flow.html", "loop-heat.html"]
    for place, output in zip(places, GAINS, strict=True):
        page = place.read_text("utf-8")
        assert page.startswith("<!DOCTYPE html>")
        assert "bench 7, Monday" in page
        assert output in page
    with pytest.raises(HydrostateError, match=r"must end in \.html"):
        both.report(tmp_path / "loop.png")
    with pytest.raises(HydrostateError, match="loaded have no log"):
        Relation(both.models).report(tmp_path / "loop")


def test_entries_are_attributes_of_a_single_model_and_not_of_two(both: Relation) -> None:
    one = identified([record(1)], "load", "heat", {"order": 1, "delay": 1})
    assert one.output == "heat"
    assert one.fit_percent > 95.0  # an attribute from the entries
    assert one.sample_time == pytest.approx(T)  # an attribute from the model
    with pytest.raises(NoSuchNameError, match="simulat"):
        _ = one.simulat
    with pytest.raises(NoSuchNameError):
        _ = both.fit_percent
    with pytest.raises(AttributeError):
        _ = both._nothing


def test_a_simulation_starts_from_the_measured_output_of_a_log_but_not_with_inputs_alone(both: Relation) -> None:
    log = record(2)
    alone = both.simulate(np.column_stack([log["valve"], log["load"]]))
    begun = both.simulate(opened(log))
    assert alone.shape == begun.shape == (400, 2)
    # the initial state has decayed: the slowest pole is 0.8
    np.testing.assert_allclose(alone[100:], begun[100:], atol=1e-6)
    np.testing.assert_allclose(begun[:, 0], log["flow"], atol=0.3)
    assert abs(begun[0, 0] - log["flow"][0]) < abs(alone[0, 0] - log["flow"][0])


def test_validation_on_another_log_has_one_row_per_output(both: Relation) -> None:
    told = both.validate(opened(record(2)))
    assert list(told.index) == ["flow", "heat"]
    assert (told["fit_percent"] > 95.0).all()
    assert told["rmse"].to_numpy() == pytest.approx(0.02, rel=0.2)  # the noise is all that is left


def test_validation_on_a_log_of_another_plant_warns(both: Relation, tmp_path: Path) -> None:
    other = record(2)
    slow = Record(T, {**other.channels, "flow": 2.0 + filtered([0.0, 0.1], [1.0, -0.95], other["valve"])})
    with pytest.warns(LogWarning, match="of the deviation of 'flow' in the log, but") as said:
        both.validate(opened(slow))
    assert len(said) == 1
    both.save(tmp_path / "model.json")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        Relation(load_models(tmp_path / "model.json")).validate(opened(slow))  # the file holds no expected error


def test_repeated_rows_are_left_out_of_simulation_and_validation_with_a_warning(both: Relation) -> None:
    once = record(2)
    rows = np.r_[0:220, 200:400]
    twice = Record(T, {name: once[name][rows] for name in once})
    with pytest.warns(LogWarning, match="20 rows"):
        again = both.simulate(opened(twice))
    np.testing.assert_allclose(again, both.simulate(once))
    with pytest.warns(LogWarning, match="20 rows"):
        told = both.validate(twice)
    np.testing.assert_allclose(told["rmse"], both.validate(once)["rmse"])


def test_saved_models_are_loaded_without_the_results_of_the_fit(both: Relation, tmp_path: Path) -> None:
    both.save(tmp_path / "model.json")
    loaded = Relation(load_models(tmp_path / "model.json"))
    assert loaded.to_dict() == both.to_dict()
    assert list(both.to_frame().columns)[:3] == ["structure", "n_values", "fit_percent"]
    assert list(loaded.to_frame().columns) == ["structure", "n_values"]
    assert "From valve, load" in str(loaded)
    assert "output-error" in loaded._repr_html_()
    assert loaded.plot() == []  # a loaded model has no log to draw


def test_every_output_is_drawn_with_its_residual(both: Relation) -> None:
    axes = both.plot()
    labels = [axis.get_ylabel() for axis in axes]
    assert labels == ["flow [its unit]"] * 2 + ["heat [its unit]"] * 2
    left_over = axes[3].lines[0].get_ydata()
    assert np.std(np.asarray(left_over)) == pytest.approx(0.02, rel=0.2)


def test_a_model_of_longer_sample_time_is_simulated_at_its_own_sample_time() -> None:
    slow = identified([record(1)], "load", "heat", {"order": 1, "delay": 1, "sample_time": 2 * T})
    assert slow.sample_time == pytest.approx(2 * T)
    assert slow.simulate(opened(record(2))).shape == (200,)


def test_columns_of_a_table_are_matched_by_name(both: Relation) -> None:
    log = record(2)
    table = opened(log).to_frame()
    begun = both.simulate(opened(log))
    np.testing.assert_allclose(both.simulate(table[["heat", "load", "flow", "valve"]]), begun)
    np.testing.assert_allclose(both.simulate(log), begun)
    np.testing.assert_allclose(both.validate(table)["rmse"], both.validate(opened(log))["rmse"])
    alone = both.simulate(np.column_stack([log["valve"], log["load"]]))
    np.testing.assert_allclose(both.simulate(table[["load", "valve"]]), alone)
    with pytest.warns(LogWarning, match=r"sample time of 0\.02 s"):  # rows without a time have the model's sample time
        np.testing.assert_allclose(both.simulate({"load": log["load"], "valve": log["valve"]}), alone)
    with pytest.raises(HydrostateError, match="channel 'valve' is needed"):
        both.simulate(table[["load"]])


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ("run.csv", r"hydrostate\.read opens a file"),
        ([["a", "b"]], "must be numbers"),
        ([[0.0, 1.0], [0.0, np.nan]], "finite at every sample, row 1 is not"),
    ],
)
def test_inputs_that_are_not_finite_numbers_are_refused(given: object, said: str, both: Relation) -> None:
    with pytest.raises(HydrostateError, match=said):
        both.simulate(given)


def test_validation_on_an_array_is_refused(both: Relation) -> None:
    with pytest.raises(HydrostateError, match="got ndarray"):
        both.validate(np.zeros(30))


def test_a_channel_name_that_is_not_a_string_is_refused() -> None:
    with pytest.raises(HydrostateError, match="input must be the name of a channel or a list of names, got 3"):
        opened(record(1)).identify(input=3, output="heat")


def test_completion_offers_the_attributes_of_a_single_model(both: Relation) -> None:
    one = identified([record(1)], "load", "heat", {"order": 1, "delay": 1})
    assert {"fit_percent", "sample_time", "simulate"} <= {*dir(one)}
    assert "fit_percent" not in dir(both)


def bent(seed: int, size: float) -> Record:
    u = size * np.repeat(np.random.default_rng(seed).normal(size=100), 5)
    y = filtered([0.0, 0.4], [1.0, -0.8], u + 0.3 * u**2)
    return Record(T, {"valve": u, "heat": y + 0.01 * np.random.default_rng(seed).normal(size=y.size)})


def test_inputs_beyond_the_fitted_range_of_a_polynomial_model_give_a_warning() -> None:
    found = identified([bent(1, 1.0)], "valve", "heat", {"structure": "narx", "order": 1, "delay": 1})
    found.simulate(bent(1, 1.0))  # pytest turns a warning into an error
    far = bent(2, 4.0)
    for ask in (found.simulate, found.validate, lambda log: found.simulate(log["valve"])):
        with pytest.warns(LogWarning) as said:
            ask(far)
        assert str(said[0].message).startswith("input 'valve' ranges from")
        assert len(said) == (2 if ask == found.validate else 1)  # validation also tells of the larger error


def test_a_linear_model_that_replaces_a_polynomial_one_gives_a_warning(monkeypatch: pytest.MonkeyPatch) -> None:
    found = identified([bent(1, 1.0)], "valve", "heat", {"structure": "auto", "order": 1, "delay": 1})
    dynamics = found.models[0].dynamics
    assert isinstance(dynamics, PolynomialDynamics)
    assert dynamics.fallback is not None
    found.simulate(bent(1, 1.0))
    told = list[int]()

    def judged(*given: Any) -> Any:
        told.append(1)
        return given[3], (3.0, 0.1)

    monkeypatch.setattr(Fallback, "judged", judged)
    for given in (bent(1, 1.0), bent(1, 1.0)["valve"]):
        with pytest.warns(LogWarning, match="linear") as said:
            found.simulate(given)
        assert {one.message.note.code for one in said} == {"linear_stands_in"}
    with pytest.warns(LogWarning, match="linear"):
        found.validate(bent(1, 1.0))
    assert len(told) == 3  # the fits that leave out a block run once, for both the result and the warning


def test_repeated_rows_are_left_out_of_identification_with_a_warning() -> None:
    once = bent(1, 1.0)
    rows = np.concatenate([np.arange(300), np.arange(280, len(once))])
    sent = Record(T, {name: once[name][rows] for name in once})
    options = {"order": 1, "delay": 1}
    with pytest.warns(LogWarning, match="20 rows a second time"):
        found = identified([sent], "valve", "heat", options)
    assert found.models[0].to_dict() == identified([once], "valve", "heat", options).models[0].to_dict()


def test_a_slip_in_structure_or_sample_time_is_called_by_its_name() -> None:
    noise = np.random.default_rng(1).standard_normal((2, 200))
    log = read({"time_s": 0.1 * np.arange(200), "u": noise[0], "y": noise[1]})
    with pytest.raises(HydrostateError, match=r"structure must be one of .*, state-space, got 'state space', did you"):
        log.identify(input="u", output="y", structure="state space")
    with pytest.raises(HydrostateError, match="sample_time must be a number of seconds above 0, got 0"):
        log.identify(input="u", output="y", sample_time=0)
