"""Named methods: model, filter and noise of each.

`published-ekf` is the EHA paper's: equations 7.1 to 7.4 with the noise of equations 7.6 and 7.7. `chamber-ekf` is the
bank of modelled-chamber filters (`estimation.eha.by_flow_filter`).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from estimation.models.eha_forms import ACCELERATION_FORM
from estimation.models.published_noise import PRINTED_NOISE, PRINTED_R


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
