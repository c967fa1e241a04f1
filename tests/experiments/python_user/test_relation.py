"""Models between any channels as a Python user holds them: of one output and of several, fitted and loaded."""

from pathlib import Path

import control
import numpy as np
import pytest

from estimation.identification.free_run.saved import load_models
from estimation.identification.model.recursion import filtered
from experiments.python_user.log import ANY, Log
from experiments.python_user.relation import Relation, identified
from plant.eha.rig import Rig
from plant.errors import NoSuchNameError
from plant.log.record import Record

T = 0.02
GAINS = {"flow": (2.0, -0.5), "heat": (0.0, 2.0)}
"""Steady gain from valve and load, by output."""


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


def test_two_outputs_are_one_object_of_python_control_with_a_row_each(both: Relation) -> None:
    system = both.to_control()
    assert isinstance(system, control.TransferFunction)
    assert (system.noutputs, system.ninputs, system.dt) == (2, 2, T)
    np.testing.assert_allclose(system.dcgain(), list(GAINS.values()), atol=0.05)


def test_a_state_space_is_shared_as_long_as_all_its_outputs_are_there(shared: Relation) -> None:
    system = shared.to_control()
    assert isinstance(system, control.StateSpace)
    assert list(system.output_labels) == ["flow", "heat"]
    np.testing.assert_allclose(system.dcgain(), list(GAINS.values()), atol=0.05)
    np.testing.assert_allclose(sorted(system.poles().real)[-2:], [0.5, 0.8], atol=0.05)


def test_one_model_has_what_it_was_fitted_with_as_attributes_and_two_have_not(both: Relation) -> None:
    one = identified([record(1)], "load", "heat", {"order": 1, "delay": 1})
    assert one.output == "heat"
    assert one.fit_percent > 95.0  # of the entries
    assert one.sample_time == pytest.approx(T)  # of the model
    with pytest.raises(NoSuchNameError, match="simulat"):
        _ = one.simulat
    with pytest.raises(NoSuchNameError):
        _ = both.fit_percent
    with pytest.raises(AttributeError):
        _ = both._nothing


def test_inputs_alone_are_simulated_too_and_a_log_begins_from_its_measured_output(both: Relation) -> None:
    log = record(2)
    alone = both.simulate(np.column_stack([log["valve"], log["load"]]))
    begun = both.simulate(opened(log))
    assert alone.shape == begun.shape == (400, 2)
    np.testing.assert_allclose(alone[100:], begun[100:], atol=1e-6)  # the slowest pole is 0.8
    np.testing.assert_allclose(begun[:, 0], log["flow"], atol=0.3)
    assert abs(begun[0, 0] - log["flow"][0]) < abs(alone[0, 0] - log["flow"][0])


def test_another_log_is_followed_output_by_output(both: Relation) -> None:
    told = both.validate(opened(record(2)))
    assert list(told.index) == ["flow", "heat"]
    assert (told["fit_percent"] > 95.0).all()
    assert told["rmse"].to_numpy() == pytest.approx(0.02, rel=0.2)  # the noise is all that is left


def test_saved_models_are_loaded_without_what_was_fitted(both: Relation, tmp_path: Path) -> None:
    both.save(tmp_path / "model.json")
    loaded = Relation(load_models(tmp_path / "model.json"))
    assert loaded.to_dict() == both.to_dict()
    assert list(both.to_frame().columns)[:3] == ["structure", "n_values", "fit_percent"]
    assert list(loaded.to_frame().columns) == ["structure", "n_values"]
    assert "From valve, load" in str(loaded)
    assert "output-error" in loaded._repr_html_()
    assert loaded.plot() == []  # it has no log to draw


def test_every_output_has_two_drawings(both: Relation) -> None:
    axes = both.plot()
    labels = [axis.get_ylabel() for axis in axes]
    assert labels == ["flow [its unit]"] * 2 + ["heat [its unit]"] * 2
    left_over = axes[3].lines[0].get_ydata()
    assert np.std(np.asarray(left_over)) == pytest.approx(0.02, rel=0.2)


def test_a_slower_model_is_simulated_on_its_own_clock() -> None:
    slow = identified([record(1)], "load", "heat", {"order": 1, "delay": 1, "sample_time": 2 * T})
    assert slow.sample_time == pytest.approx(2 * T)
    assert slow.simulate(opened(record(2))).shape == (200,)
