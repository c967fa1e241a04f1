"""Noise of the EHA paper's filter: Q of equation 7.6 and R of equation 7.7, as printed and as densities."""

from collections.abc import Mapping
from types import MappingProxyType

from estimation.models.eha_forms import ACCELERATION_FORM

PUBLISHED_TIME = 1e-4
"""Sample time of section 7, for which equation 7.6 is printed [s]."""

PRINTED_Q = (1e-12, 1e-8, 1e-6, 1e-12)
"""Equation 7.6: variance added per step to position [m^2], velocity [m^2/s^2], acceleration [m^2/s^4] and bulk modulus
[Pa^2]; far too small on bulk modulus (errata E10)."""

PRINTED_R: Mapping[str, float] = MappingProxyType({"position_m": 1e-12, "velocity_m_s": 1e-4})
"""Equation 7.7: measurement variances [m^2, m^2/s^2] (errata E11)."""

PRINTED_NOISE: Mapping[str, float] = MappingProxyType(
    {state.name: q / PUBLISHED_TIME for state, q in zip(ACCELERATION_FORM.states, PRINTED_Q, strict=True)}
)
"""Equation 7.6 as densities, by state [SI squared a second]."""
