"""The wide flow form behind a pressure filter of second order, as an amplifier's or a logger's mostly is."""

from dataclasses import replace
from functools import partial
from types import SimpleNamespace
from typing import Any

from estimation.models.wide_flow import WIDE_FLOW_FORM, wide_rates
from estimation.models.wrong_pressure import pressure_error
from plant.compiled.functions import Scalar

FILTER_TIME = "filter_time"
"""Inverse of the natural frequency of that filter."""


def _rates(
    state: tuple[Scalar, ...],
    drives: Any,
    p: SimpleNamespace,
    share: Scalar,
    *,
    turbulent: bool = False,
    quick: bool = False,
) -> tuple[Scalar, ...]:
    """Return the rates of the circuit and of ``T^2 y'' + lag y' + y = dp + offset``, y being what is read."""
    p1, p2, behind, supply, climbs = state
    circuit = p1, p2, behind, supply
    rise, fall, _, fed = wide_rates(circuit, drives, p, share, turbulent=turbulent, quick=quick)
    begun, next_begun = drives[2]
    left = behind + pressure_error((p1, p2), begun + share * (next_begun - begun), p) - p.pressure_lag * climbs
    return rise, fall, rise - fall - climbs, fed, left / (p.filter_time * p.filter_time)


def _at_rest(p: SimpleNamespace) -> tuple[Scalar, ...]:
    return *WIDE_FLOW_FORM.initial(p), 0.0


def _observed_pressure(state: tuple[Scalar, ...]) -> tuple[Scalar]:
    p1, p2, behind, _, _ = state
    return (p1 - p2 - behind,)


FILTERED_FLOW_FORM = replace(
    WIDE_FLOW_FORM,
    name="filtered_flow",
    initial=_at_rest,
    rates=_rates,
    observe=_observed_pressure,
    jump=(*WIDE_FLOW_FORM.jump, 0.0),
)
FILTERED_TURBULENT_FLOW_FORM = replace(
    FILTERED_FLOW_FORM, name="filtered_flow_turbulent", rates=partial(_rates, turbulent=True)
)
FILTERED_QUICK_FLOW_FORM = replace(FILTERED_FLOW_FORM, name="filtered_flow_quick", rates=partial(_rates, quick=True))
FILTERED_TURBULENT_QUICK_FLOW_FORM = replace(
    FILTERED_FLOW_FORM, name="filtered_flow_turbulent_quick", rates=partial(_rates, turbulent=True, quick=True)
)
