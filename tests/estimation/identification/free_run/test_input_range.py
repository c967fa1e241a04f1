"""A polynomial model reports inputs outside the range of its training data."""

from dataclasses import replace

import numpy as np
import pytest

from estimation.identification.free_run.data import Channels, channels_from
from estimation.identification.free_run.identify import identify_channels
from estimation.identification.free_run.input_range import input_range_notes
from estimation.identification.free_run.model import FreeRunModel
from estimation.identification.free_run.polynomial_dynamics import PolynomialDynamics
from tests.estimation.identification.free_run.test_polynomial_fit import duffing, log


@pytest.fixture(scope="module")
def model() -> FreeRunModel:
    return identify_channels(log(), structure="narx", order=2, delay=1).model


def driven(factor: float) -> Channels:
    u, y = duffing(400, 1)
    return channels_from([factor * u[:, None]], [y], 0.01, ["force"], "deflection")


def test_inputs_within_the_fitted_range_are_not_noted(model: FreeRunModel) -> None:
    assert input_range_notes(model, driven(1.0)) == []
    assert input_range_notes(model, driven(0.5)) == []


def test_an_input_beyond_the_fitted_range_is_noted_with_its_extremes_and_share(model: FreeRunModel) -> None:
    u = driven(2.0).u[0][:, 0]
    (note,) = input_range_notes(model, driven(2.0))
    assert note.code == "input_beyond_range"
    assert note.data["channel"] == "force"
    assert (note.data["least"], note.data["greatest"]) == (u.min(), u.max())
    low, high = 0.5 * u.min(), 0.5 * u.max()
    assert (note.data["low"], note.data["high"]) == (pytest.approx(low), pytest.approx(high))
    far = 0.1 * (high - low)
    assert note.data["share"] == pytest.approx(np.mean((u < low - far) | (u > high + far)))


def test_the_fitted_range_shifts_with_the_mean_of_the_fitted_input(model: FreeRunModel) -> None:
    away = replace(model, scaling=replace(model.scaling, u_mean=model.scaling.u_mean + 3.0))

    def shifted(factor: float) -> Channels:
        one = driven(factor)
        return replace(one, u=(one.u[0] + 3.0,))

    assert input_range_notes(away, shifted(1.0)) == []
    (here,), (there,) = input_range_notes(model, driven(2.0)), input_range_notes(away, shifted(2.0))
    assert there.data["share"] == here.data["share"]
    for end in ("least", "greatest", "low", "high"):
        assert there.data[end] == pytest.approx(here.data[end] + 3.0)


def test_a_linear_model_and_one_without_inputs_in_its_products_have_no_input_range(model: FreeRunModel) -> None:
    assert isinstance(model.dynamics, PolynomialDynamics)
    variables = replace(model.dynamics.variables, source=np.zeros_like(model.dynamics.variables.source))
    own = replace(model, dynamics=replace(model.dynamics, variables=variables))
    assert input_range_notes(own, driven(9.0)) == []
    linear = identify_channels(log(), structure="output-error", order=2, delay=1).model
    assert input_range_notes(linear, driven(9.0)) == []
    assert np.isfinite([linear.level, linear.offset]).all()
    assert np.isnan([model.level, model.offset]).all()
    rest = linear.simulate(np.zeros(2000))
    assert rest[-1] == pytest.approx(linear.offset, abs=1e-9)
