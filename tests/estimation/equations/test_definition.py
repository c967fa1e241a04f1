"""Errors in a user's equations are reported by name, before there is any log."""

# ruff: noqa: ARG005 - every function is given the same three things

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from estimation.equations.definition import Equations, Parameter
from estimation.equations.kernel import traceable
from estimation.equations.trace import Named
from plant.errors import HydrostateError

NAMES: dict[str, Any] = {
    "states": {"angle": "rad", "speed": "rad/s"},
    "inputs": {"torque": "N m"},
    "outputs": {"angle": "rad"},
    "parameters": {"weight": Parameter(1.0, (0.1, 10.0))},
}


def _choosing(state: Any, inputs: Any, p: Any) -> Any:  # noqa: ARG001 -- as a user writes it
    return (state.speed, 1.0) if state.angle > 0.0 else (state.speed, -1.0)


@pytest.mark.parametrize(
    ("derivative", "said"),
    [
        (lambda s, i, p: s.speed, "must return 2 values, one for each of angle, speed, got 1"),
        (lambda s, i, p: (s.speed, math.sin(s.angle)), "no function of math"),
        (lambda s, i, p: (s.speed, np.arcsin(s.angle)), "np.arcsin cannot be traced; a model may call abs, sign"),
        (lambda s, i, p: (s.speed, np.interp(s.angle, [0, 1], [0, 1])), "np.interp cannot be traced"),
        (lambda s, i, p: (s.speed, s.angle**0.5), "whole powers only"),
        (lambda s, i, p: (s.speed, s.angle**p.weight), "got a symbol: write exp"),
        (_choosing, "not with if"),
        (lambda s, i, p: (s.speed, s.angle > 0.0), "got a comparison for speed: use np.where"),
        (lambda s, i, p: (s.speed, p.wieght), "parameter 'wieght' is read, .* did you mean 'weight'"),
        (lambda s, i, p: (s.speed, i.torqe), "reads input 'torqe', which is none of torque"),
        (lambda s, i, p: (s.velocity, 0.0), "reads state 'velocity', which is none of angle, speed"),
        (lambda s, i: (s.speed, 0.0), "takes 2 positional arguments"),
        (lambda s, i, p: (s.speed, "fast"), "must return numbers, got 'fast' for speed"),
        (lambda s, i, p: (s.speed, 1 / 0), "fails: ZeroDivisionError"),
    ],
)
def test_a_function_that_cannot_be_traced_is_refused(derivative: Callable[..., Any], said: str) -> None:
    with pytest.raises(HydrostateError, match=said):
        traceable(Equations(derivative, **NAMES))


def test_the_number_of_values_from_observe_is_checked() -> None:
    with pytest.raises(HydrostateError, match=r"observe .* must return 1 values, one for each of angle, got 2"):
        traceable(Equations(lambda s, i, p: (s.speed, 0.0), **NAMES, observe=lambda s, i, p: (s.angle, s.speed)))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"outputs": {"angel": "rad"}}, "output 'angel' must be a state"),
        ({"outputs": {}}, "outputs must name one at least"),
        ({"parameters": {}}, "parameters must name one at least"),
        ({"parameters": {"weight": 1.0}}, "parameter 'weight' must be a Parameter"),
        ({"parameters": {"the weight": Parameter(1.0)}}, "a parameter must be named by letters"),
        ({"known": {"weight": 1.0}}, "parameter 'weight' must be unknown or known, got both"),
        ({"known": {"mass": math.nan}}, "parameter 'mass' must be a finite number, got nan"),
        ({"initial": {"angel": 0.0}}, "initial names 'angel', which is none of angle, speed"),
        ({"held": ("force",)}, "held names 'force', which is none of torque"),
        ({"states": {"lambda": "1"}}, "a state must be named by letters"),
    ],
)
def test_names_that_do_not_fit_together_are_refused(changes: dict[str, Any], said: str) -> None:
    with pytest.raises(HydrostateError, match=said):
        Equations(lambda s, i, p: (s.speed, 0.0), **{**NAMES, **changes})


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ((5.0, (0.0, 1.0)), "a start between its bounds 0 and 1 is needed, got 5"),
        ((math.nan,), "a start must be a finite number, got nan"),
        (("1",), "a start must be a finite number, got '1'"),
        ((1.0, (2.0, 1.0)), "bounds must be a least and a larger value, got 2 and 1"),
        ((1.0, (2.0,)), "bounds must be two numbers"),
    ],
)
def test_a_parameter_that_makes_no_sense_is_refused(given: Any, said: str) -> None:
    with pytest.raises(HydrostateError, match=said):
        Parameter(*given)


def test_a_parameter_with_a_positive_bound_is_searched_by_its_logarithm() -> None:
    assert Parameter(1.0, (0.1, 10.0)).logarithmic
    assert not Parameter(1.0, (0.0, 10.0)).logarithmic
    assert Parameter(0.0, (-1.0, 1.0)).size == pytest.approx(0.2)


def test_an_unknown_attribute_is_reported_with_the_message_of_python() -> None:
    with pytest.raises(HydrostateError, match=r"derivative .* fails: module 'numpy' has no attribute 'sine'"):
        traceable(Equations(lambda s, i, p: (s.speed, np.sine(s.angle)), **NAMES))


def test_equations_need_a_function() -> None:
    with pytest.raises(HydrostateError, match="derivative must be a function of state, inputs and parameters, got 3"):
        Equations(3, **NAMES)  # type: ignore[arg-type]


def test_special_attributes_of_python_are_not_taken_for_parameters() -> None:
    named = Named({"weight": 1.0})
    assert not hasattr(named, "__array__")
    with pytest.raises(HydrostateError, match="did you mean 'weight'"):
        named.wait  # noqa: B018  it is read
