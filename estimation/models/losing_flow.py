"""The flow form with one more loss, whose shape is known from measured signals and whose size is not.

A leak that depends on position, on the shaft's angle or on pressure, and a pump that fills badly, take oil from the
loaded chamber as leakage does: each is one column beside the drives. See decision 288.
"""

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

from estimation.models.completed_flow import completed_flow_form
from estimation.models.flow import MASS_FLOW_FORM, fed_rates
from estimation.models.flow_parameters import FlowParameters
from estimation.models.greybox import GreyBoxModel
from plant.compiled.functions import Scalar
from plant.components.oil import ATMOSPHERE
from plant.eha.circuit import chamber_volumes
from plant.units import si

LOSS, LOSS_SIZE = "extra_loss", "loss_size"
"""Drive: flow from chamber 1 to chamber 2 per unit of the loss [m^3/s]; unknown: its size in these units."""


@dataclass(frozen=True, kw_only=True)
class LosingFlowParameters(FlowParameters):
    """The flow form's parameters, and the size of one more loss."""

    loss_size: float = si(0.0, "1", "units of one more loss from chamber to chamber", "fitted")


def _rates_with_loss(
    state: tuple[Scalar, Scalar, Scalar], drives: Any, p: SimpleNamespace, share: Scalar
) -> tuple[Scalar, Scalar, Scalar]:
    speeds, positions, (loss, next_loss), step = drives
    rise, fall, supply = fed_rates(state, (speeds, positions, step), p, share, by_mass=True)
    position, next_position = positions
    volume_1, volume_2 = chamber_volumes(position + share * (next_position - position), p)
    lost = p.loss_size * (loss + share * (next_loss - loss))
    stiffness_1, stiffness_2 = (p.bulk_modulus - (pressure - ATMOSPHERE) for pressure in state[:2])
    return rise - stiffness_1 * lost / volume_1, fall + stiffness_2 * lost / volume_2, supply


_COMPLETED = completed_flow_form(MASS_FLOW_FORM)

LOSING_FLOW_FORM: GreyBoxModel = replace(
    _COMPLETED,
    name="flow_losing",
    drives=(*_COMPLETED.drives, LOSS),
    unknowns=(*_COMPLETED.unknowns, LOSS_SIZE),
    rates=_rates_with_loss,
    parameters=LosingFlowParameters,
    linear=(*_COMPLETED.linear, (LOSS_SIZE, 1.0)),
)
"""Balanced by mass, with make-up valves that crack, an accumulator, and one more loss."""
