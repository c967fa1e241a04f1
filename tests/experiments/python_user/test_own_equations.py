"""A user's own equations in Python: the fit prints, draws, simulates and can be passed on."""

# ruff: noqa: ARG005 - every slip is given the same log

import json
import pickle
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd
import pytest

import hydrostate as hs
from plant.errors import LogWarning

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


@pytest.mark.parametrize(
    "timed",
    [
        lambda table: table.reset_index(drop=True).assign(time_s=TIME),
        lambda table: table.reset_index(drop=True).assign(time_ms=1e3 * TIME),
        lambda table: table.reset_index(drop=True).assign(time=pd.Timestamp("2026-01-01") + pd.to_timedelta(TIME, "s")),
        lambda table: table.set_axis(pd.Index((1e3 * TIME).round().astype(int), name="time_ms")),
        lambda table: table.set_axis(pd.date_range("2026-01-01", periods=len(TIME), freq="50ms")),
        lambda table: table.set_axis(pd.date_range("2026-01-01", periods=len(TIME), freq="50ms", tz="Europe/Berlin")),
        lambda table: table.set_axis(pd.to_timedelta(TIME, "s")),
    ],
)
def test_the_time_of_a_table_is_that_of_the_same_table_as_a_log(
    timed: Callable[[pd.DataFrame], pd.DataFrame], log: pd.DataFrame, found: Any
) -> None:
    table = timed(log)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        again = oven().fit(table)
    assert again.values["rate"] == pytest.approx(found.values["rate"], rel=1e-9)
    assert again.simulate(table).index.equals(table.index)
    features = hs.features([table], parts=1, bands=2)
    assert list(features) == list(hs.features([log], parts=1, bands=2))


def test_rows_that_are_only_counted_are_a_second_apart_and_a_warning_says_so(log: pd.DataFrame, found: Any) -> None:
    with pytest.warns(LogWarning, match="no time column: a sample time of 1 s was assumed"):
        slow = oven(parameters={"rate": hs.Parameter(1.0, (1e-3, 10.0)), "heat": hs.Parameter(1.5, (1e-3, 10.0))}).fit(
            log.reset_index(drop=True)
        )
    assert slow.values["rate"] == pytest.approx(0.05 * found.values["rate"], rel=0.05)
    with pytest.raises(hs.HydrostateError, match="its index holds neither times nor row numbers"):
        oven().fit(log.set_axis([f"row {k}" for k in range(len(log))]))


def test_an_input_may_be_called_t() -> None:
    table = pd.DataFrame({"t": TIME}, index=TIME)
    drifting = hs.GreyBox(
        lambda state, inputs, p: p.rate * inputs.t,
        states=["x"],
        inputs=["t"],
        outputs=["x"],
        parameters={"rate": hs.Parameter(2.0)},
    )
    assert drifting.simulate(table)["x"].iloc[-1] == pytest.approx(TIME[-1] ** 2)


def test_equations_and_their_fit_can_be_passed_to_other_processes(log: pd.DataFrame, found: Any) -> None:
    model, fit = pickle.loads(pickle.dumps((oven(), found)))  # noqa: S301 - our own
    assert model.fit(log).to_dict() == found.to_dict() == fit.to_dict()
    pd.testing.assert_frame_equal(fit.simulate(log), found.simulate(log))


def test_numbers_of_numpy_are_starts_and_known_values() -> None:
    assert type(hs.Parameter(np.float32(0.5)).start) is float  # type: ignore[arg-type]
    assert oven(parameters={"rate": hs.Parameter(1.0), "heat": np.int64(2)}).equations.known == {"heat": 2.0}
