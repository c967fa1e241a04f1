"""Transfer functions, their deviations and their exact sampling, kept in `numbers.json`."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest

from estimation.identification.model.bandwidth import bandwidth, bandwidth_std
from estimation.identification.model.export import _padded, to_ss
from estimation.identification.model.held_input import held_input_model
from estimation.identification.model.lags import lagged
from estimation.identification.model.linear_model import LinearModel
from estimation.identification.model.recursion import filtered
from estimation.identification.model.table import model_table
from estimation.identification.model.uncertainty import _deviations, cancellations, complex_std, root_gradients
from plant.arrays import Array
from tests.kernels import loops_in_python
from tests.numbers import Numbers, refused, some

NUMBERS = Numbers(__file__)
RNG = np.random.default_rng(31)
U: Array = RNG.standard_normal(60)


def spread(p: int, size: float) -> Array:
    root = size * np.random.default_rng(p).standard_normal((p, p))
    return root @ root.T


MODELS: dict[str, LinearModel] = {
    "second order": LinearModel(
        [0.0, 0.3, -0.1],
        [1.0, -1.5, 0.7],
        0.01,
        "u",
        "y",
        delay=1,
        covariance=spread(4, 0.01),
        initial_state=[0.2, -0.1],
        offset=0.5,
        noise_numerator=[1.0, 0.3],
        noise_denominator=[1.0, -0.8],
        n_samples=60,
    ),
    "first order": LinearModel([0.4], [1.0, -0.6], 0.02, "u", "y", covariance=spread(2, 0.02)),
    "late": LinearModel([0.0, 0.0, 0.0, 0.4, 0.1], [1.0, -0.6], 0.02, "u", "y", delay=3, covariance=spread(3, 0.02)),
    "a gain": LinearModel([2.0], [1.0], 0.02, "u", "y", covariance=spread(1, 0.02)),
    "unstable": LinearModel([1.0, 0.2], [1.0, -1.3, 0.1], 0.01, "u", "y"),
    "on the circle": LinearModel([1.0], [1.0, -1.0], 0.01, "u", "y"),
    "high pass": LinearModel([1.0, -0.99], [1.0, -0.5], 0.01, "u", "y", covariance=spread(3, 0.02)),
    "slow": LinearModel([0.0, 1e-6], [1.0, -0.999999], 0.01, "u", "y", delay=1, covariance=spread(2, 1e-9)),
    "continuous": LinearModel(
        [2.0, 30.0],
        [1.0, 4.0, 25.0],
        0.05,
        "u",
        "y",
        continuous=True,
        dead_time=0.12,
        covariance=spread(4, 0.3),
        offset=0.2,
    ),
    "unstable in time": LinearModel([2.0], [1.0, -0.5], 0.05, "u", "y", continuous=True),
    "integrator in time": LinearModel([2.0], [1.0, 0.0], 0.05, "u", "y", continuous=True),
}


@NUMBERS.case()
def transfer_functions() -> dict[str, Any]:
    told: dict[str, Any] = {}
    for name, model in MODELS.items():
        told[name] = {
            "roots": [model.poles, model.zeros, model.is_stable],
            "sizes": [model.initial_state.size, model.free_numerator.size],
            "simulated": some(model.simulate(U), 7),
        }
        time, step = model.step(0.3)
        told[name] |= {"step": [time.size, time[-1], some(step, 4)]}
        if name in ("on the circle", "integrator in time"):
            continue
        told[name]["gain"] = model.dc_gain
        told[name]["bandwidth [Hz]"] = [bandwidth(model), bandwidth_std(model)]
        if np.isfinite(model.covariance).all():
            band = model.frequency_response([0.1, 1.0, 3.0, 9.0], ci=0.9)
            told[name]["deviations"] = [model.pole_std, model.zero_std, model.dc_gain_std, model.coefficient_std]
            told[name]["response"] = [band.response, band.gain_std, band.phase_std, band.gain_low, band.gain_high]
            told[name]["slopes"] = model.response_gradient([0.3, 2.0])[1]
        if model.continuous:
            told[name]["sampled"] = [model.discretised(0.03).numerator, model.discretised().denominator]
    one = MODELS["second order"]
    measured = np.where(np.arange(60) % 7 == 3, np.nan, one.simulate(U) + 0.1 * U[::-1])
    told["predicted"] = some(one.predict(U, measured), 9)
    told["from its state"] = some(one.simulate(U, initial=one.initial_state), 4)
    told["a short step"] = [one.step(0.0)[0].size, one.step(0.01)[0].size, one.step(0.016)[0].size]
    told["table"] = {
        key: value for key, value in model_table({"a": one}).iloc[0].to_dict().items() if not isinstance(value, str)
    }
    told["observer form"] = [np.asarray(part) for part in _matrices(one)]
    told["observer form of a gain"] = [np.asarray(part).tolist() for part in _matrices(MODELS["a gain"])]
    told["padded"] = [*_padded(MODELS["late"]), *_padded(MODELS["first order"])]
    return told


def _matrices(model: LinearModel) -> list[Any]:
    found: Any = to_ss(model)
    return [found.A, found.B, found.C, found.D]


@NUMBERS.case()
def corners_of_bandwidth() -> dict[str, Any]:
    told: dict[str, Any] = {}
    for name, pole in (("quick", 0.1), ("within the grid's first step", 0.9999999), ("slow", 0.99999)):
        model = LinearModel([1.0 - pole], [1.0, -pole], 0.01, "u", "y", covariance=spread(2, 1e-9))
        told[name] = [bandwidth(model), bandwidth_std(model)]
    resonant = LinearModel([1.0], [1.0, 0.2, 1.0], 0.01, "u", "y", continuous=True, covariance=spread(3, 1e-3))
    told["resonant"] = [bandwidth(resonant), bandwidth_std(resonant)]
    told["without covariance"] = bandwidth_std(replace(resonant, covariance=np.full((3, 3), np.nan)))
    return told


@NUMBERS.case()
def poles_that_zeros_cancel() -> dict[str, Any]:
    told: dict[str, Any] = {}
    small = np.diag([1e-4, 1e-4, 1e-4, 1e-4])
    numerator, denominator = np.poly([0.8]), np.poly([0.82, 0.3])
    rows = {
        "near": (numerator, denominator, small[:4, :4], 1.0),
        "told apart": (numerator, denominator, 1e-3 * small[:4, :4], 1.0),
        "barely told apart": (numerator, denominator, 0.036 * small[:4, :4], 1.0),
        "not told apart": (numerator, denominator, 0.5 * small[:4, :4], 1.0),
        "far": (np.poly([0.7]), denominator, 100.0 * small[:4, :4], 1.0),
        "half as far as rest": (np.poly([0.735]), denominator, 100.0 * small[:4, :4], 1.0),
        "seen from another rest": (numerator, denominator, small[:4, :4], 0.8),
        "not known": (numerator, denominator, np.full((4, 4), np.nan), 1.0),
        "a pair": (
            np.poly([0.6 + 0.3j, 0.6 - 0.3j]).real,
            np.poly([0.61 + 0.3j, 0.61 - 0.3j]).real,
            np.eye(5) * 1e-4,
            1.0,
        ),
        "the same": (numerator, np.poly([0.8, 0.3]), small[:4, :4], 1.0),
        "two": (np.poly([0.8, 0.5]), np.poly([0.82, 0.52]), np.eye(5) * 1e-4, 1.0),
    }
    for name, given in rows.items():
        told[name] = [[one.pole, one.zero, one.deviations] for one in cancellations(*given)]
    apart = np.array([3.0, 4.0])
    told["deviations"] = [
        _deviations(apart, np.diag([4.0, 1.0])),
        _deviations(np.zeros(2), np.eye(2)),
        _deviations(apart, np.full((2, 2), np.inf)),
        _deviations(apart, np.zeros((2, 2))),
    ]
    told["gradients"] = root_gradients(np.array([1.0, -1.1, 0.3]), np.array([0.5 + 0j, 0.6]))
    told["complex deviations"] = complex_std(np.array([[1.0 + 2.0j, 0.5]]), np.array([[1.0, -0.2], [-0.2, 2.0]]))
    return told


@NUMBERS.case()
def held_inputs() -> dict[str, Any]:
    told: dict[str, Any] = {}
    for name, b, a, late in (
        ("first order", [2.0], [1.0, 3.0], 0.0),
        ("second order", [1.0, 5.0], [1.0, 4.0, 25.0], 0.0),
        ("within a sample", [1.0, 5.0], [1.0, 4.0, 25.0], 0.03),
        ("whole samples", [5.0], [1.0, 4.0, 25.0], 0.2),
        ("beyond whole samples", [5.0], [1.0, 4.0, 25.0], 0.23),
        ("through", [2.0, 1.0], [1.0, 4.0], 0.0),
        ("through, late", [2.0, 1.0], [1.0, 4.0], 0.04),
        ("through, whole samples", [2.0, 1.0], [1.0, 4.0], 0.1),
        ("a hair below a sample", [5.0], [1.0, 4.0], 0.1 - 1e-12),
    ):
        told[name] = [*held_input_model(np.array(b), np.array(a[1:]), late, 0.1)]
    return told


@NUMBERS.case()
def series_that_are_filtered() -> dict[str, Any]:
    with loops_in_python():
        told: dict[str, Any] = {
            "third order": some(filtered([0.5, 0.2, -0.1], [1.0, -1.2, 0.5, -0.1], U), 7),
            "longer numerator": some(filtered([0.5, 0.2, -0.1, 0.3], [1.0, -0.5], U), 7),
            "from a state": some(filtered([0.5], [1.0, -1.2, 0.5], U, [0.3, -0.2]), 7),
            "a gain": some(filtered([0.5], [1.0], U), 4),
        }
    return told | {"lags": lagged(np.arange(1.0, 5.0), 1, 2), "no lags": list(lagged(U, 1, 0).shape)}


@NUMBERS.case()
def what_models_refuse() -> dict[str, Any]:
    make = partial(LinearModel, input_name="u", output_name="y")
    calls: dict[str, Callable[[], Any]] = {
        "no time": partial(make, [1.0], [1.0], 0.0),
        "endless time": partial(make, [1.0], [1.0], np.inf),
        "a table": partial(make, [[1.0]], [1.0], 0.1),
        "a table below": partial(make, [1.0], [[1.0]], 0.1),
        "not finite": partial(make, [np.nan], [1.0], 0.1),
        "not finite below": partial(make, [1.0], [1.0, np.inf], 0.1),
        "nothing below": partial(make, [1.0], [], 0.1),
        "not monic": partial(make, [1.0], [2.0, 1.0], 0.1),
        "a delay below nothing": partial(make, [1.0], [1.0], 0.1, delay=-1),
        "a delay of all": partial(make, [0.0], [1.0], 0.1, delay=1),
        "no zeros for it": partial(make, [1.0, 2.0], [1.0], 0.1, delay=1),
        "another state": partial(make, [1.0], [1.0, 0.5], 0.1, initial_state=[1.0, 2.0]),
        "another covariance": partial(make, [1.0], [1.0, 0.5], 0.1, covariance=np.eye(3)),
        "C not monic": partial(make, [1.0], [1.0, 0.5], 0.1, noise_numerator=[2.0]),
        "C a table": partial(make, [1.0], [1.0, 0.5], 0.1, noise_numerator=[[1.0]]),
        "C of nothing": partial(make, [1.0], [1.0, 0.5], 0.1, noise_numerator=[]),
        "sampled twice": partial(make([1.0], [1.0], 0.1).discretised, 0.1),
    }
    return {name: refused(call) for name, call in calls.items()}


@pytest.mark.parametrize("case", NUMBERS.cases)
def test_kept_numbers_are_unchanged(case: str) -> None:
    NUMBERS.check(case)
