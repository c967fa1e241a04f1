"""A user's own equations in Python: the fit prints, draws, simulates and can be passed on."""

# ruff: noqa: ARG005 - every slip is given the same log

import json
from typing import Any

import numpy as np
import pandas as pd
import pytest

import hydrostate as hs

TIME = 0.05 * np.arange(400)


def cooling(state: Any, inputs: Any, p: Any) -> Any:
    return p.rate * (inputs.room - state.warm) + p.heat


def oven(**changes: Any) -> hs.GreyBox:
    given: dict[str, Any] = {
        "states": {"warm": "degC"},
        "inputs": ["room"],
        "outputs": ["warm"],
        "parameters": {"rate": hs.Parameter(1.0, (0.01, 10.0), "1/s"), "heat": 1.5},
    }
    return hs.GreyBox(cooling, **{**given, **changes})


@pytest.fixture(scope="module")
def log() -> pd.DataFrame:
    table = pd.DataFrame({"room": 20.0 + 3.0 * np.sign(np.sin(TIME))}, index=TIME)
    table["warm"] = oven().simulate(table, {"rate": 0.5}, {"warm": 30.0})["warm"]
    table["warm"] += 0.05 * np.random.default_rng(4).standard_normal(len(TIME))
    return table


@pytest.fixture(scope="module")
def found(log: pd.DataFrame) -> Any:
    return oven().fit(log)


def test_a_fit_gives_quantities_noise_and_outcome(found: Any) -> None:
    assert found.believed
    assert found.quantities["rate"].covers(0.5)
    assert found.quantities["rate"].unit == "1/s"
    assert found.values["heat"] == 1.5
    assert found.noise["warm"] == pytest.approx(0.05, rel=0.15)
    assert found.fit_percent["warm"] > 90.0
    assert found.outcome == "ok"
    assert "believed" in str(found)
    assert "rate" in found._repr_html_()
    assert list(found.correlation.columns) == ["rate", "initial warm"]
    assert 1.0 <= found.condition < 100.0


def test_a_fit_can_be_converted_to_json_and_a_table(found: Any) -> None:
    entries = json.loads(json.dumps(found.to_dict()))
    assert entries["parameters"]["rate"]["unit"] == "1/s"
    assert entries["outcome"] == "ok"
    table = found.to_frame()
    assert table.loc["rate", "ci95_low"] < 0.5 < table.loc["rate", "ci95_high"]


def test_the_plot_of_a_fit_shows_the_measurement_and_the_residual(found: Any, log: pd.DataFrame) -> None:
    above, below = found.plot()
    np.testing.assert_allclose(above.lines[0].get_ydata(), log["warm"])
    left = np.asarray(above.lines[1].get_ydata()) - log["warm"].to_numpy()
    np.testing.assert_allclose(below.lines[0].get_ydata(), left, atol=1e-12)
    assert above.get_ylabel() == "warm [degC]"


def test_a_simulation_follows_a_record_or_a_table(found: Any, log: pd.DataFrame) -> None:
    record = hs.Record(0.05, {name: log[name].to_numpy() for name in log})
    run = found.simulate(record)
    np.testing.assert_allclose(run["warm"], log["warm"], atol=0.25)
    pd.testing.assert_frame_equal(run, found.simulate(log), check_names=False, atol=1e-12)
    np.testing.assert_allclose(found.simulate(log, {"warm": 0.0})["warm"].iloc[0], 0.0)


@pytest.mark.parametrize(
    ("slip", "said"),
    [
        (lambda log: oven().fit(3), "a Log, a Record or a pandas.DataFrame is needed, got int"),
        (lambda log: oven().fit(), "a log is needed to fit the equations to, got none"),
        (lambda log: oven().fit(log.reset_index(drop=True).iloc[[0, 1, 3, 7]]), "on a uniform clock"),
        (lambda log: oven().fit(log.assign(room="warm")), "a table of numbers by time"),
        (lambda log: oven(states="warm"), "states must be a mapping of names to units, or a list of names, got 'warm'"),
        (lambda log: oven(inputs=["room", "room"]), "inputs must have names of their own, got 'room' twice"),
        (lambda log: oven(parameters=["rate"]), "parameters must be a mapping of names"),
        (lambda log: oven().fit(log).beleived, "did you mean 'believed'"),
    ],
)
def test_wrong_arguments_are_refused_with_a_precise_message(log: pd.DataFrame, slip: Any, said: str) -> None:
    with pytest.raises(hs.HydrostateError, match=said):
        slip(log)
