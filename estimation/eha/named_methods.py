"""Named methods: model, filter and noise of each.

`published-ekf` is the EHA paper's: equations 7.1 to 7.4 with the noise of equations 7.6 and 7.7. `chamber-ekf` is the
bank of modelled-chamber filters (`estimation.eha.by_flow_filter`).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from estimation.models.eha_forms import ACCELERATION_FORM

PUBLISHED_TIME = 1e-4
"""Sample time of section 7, for which equation 7.6 is printed [s]."""

PRINTED_Q = (1e-12, 1e-8, 1e-6, 1e-12)
"""Equation 7.6: variance added per step to position [m^2], velocity [m^2/s^2], acceleration [m^2/s^4] and bulk modulus
[Pa^2]."""

PRINTED_R: Mapping[str, float] = MappingProxyType({"position_m": 1e-12, "velocity_m_s": 1e-4})
"""Equation 7.7: measurement variances [m^2, m^2/s^2]."""

PRINTED_NOISE: Mapping[str, float] = MappingProxyType(
    {state.name: q / PUBLISHED_TIME for state, q in zip(ACCELERATION_FORM.states, PRINTED_Q, strict=True)}
)
"""Equation 7.6 as densities [SI squared a second]."""


@dataclass(frozen=True)
class NamedMethod:
    """A method with a name of its own.

    Parameters
    ----------
    form : str
        The process model.
    method : str
        A filter of `estimation.filters.methods.METHODS`.
    noise : Mapping[str, float]
        Process-noise densities by state, in place of the form's [SI squared a second].
    variances : Mapping[str, float]
        Measurement variances of the channels that are used, in place of the log's [SI squared]; if empty, all channels
        that the form predicts.
    """

    form: str
    method: str
    noise: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    variances: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))


NAMED: Mapping[str, NamedMethod] = MappingProxyType(
    {
        "published-ekf": NamedMethod(ACCELERATION_FORM.name, "ekf", PRINTED_NOISE, PRINTED_R),
        "chamber-ekf": NamedMethod("flow", "ekf"),
    }
)
"""The methods with a name of their own."""
