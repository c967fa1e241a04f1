"""Figure 5 again: whether parameters within their uncertainty could give the published 25 Hz at every mean."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import product

from estimation.finding import NORMAL_95
from plant.eha.around_mean import break_frequency_about
from plant.eha.doubts import DEFAULT_UNCERTAINTIES
from plant.eha.model import EhaParameters

WIDTHS: Mapping[str, float] = {
    "friction_quadratic": 0.1,
    "friction_linear": 0.1,
    "leakage_coefficient": 0.1,
    "bulk_modulus": 0.2,
}
"""Variation between actuators of values without uncertainty in a rig file: half-widths of
`faults.eha.inject.varied_actuator`."""

GEOMETRY = ("pump_displacement", "piston_area", "chamber_volume", "moving_mass")
"""Entries with uncertainty in a rig file, set to the ends of their 95 % interval."""


def _corner_actuators(rig: EhaParameters) -> Iterator[EhaParameters]:
    """Yield actuators with every uncertain value at one end of its range."""
    ends = {name: (1.0 - width, 1.0 + width) for name, width in WIDTHS.items()}
    for name in GEOMETRY:
        doubt = DEFAULT_UNCERTAINTIES[name].usual
        ends[name] = (1.0 - NORMAL_95 * doubt.down, 1.0 + NORMAL_95 * doubt.up)
    for factors in product(*ends.values()):
        yield replace(rig, **{name: factor * getattr(rig, name) for name, factor in zip(ends, factors, strict=True)})


def break_frequency_limits(rig: EhaParameters, low_v: float, high_v: float) -> tuple[float, float]:
    """Return the limits of the break frequencies that the parameters' uncertainty can reach.

    Parameters
    ----------
    low_v, high_v : float
        Two input means [V].

    Returns
    -------
    highest : float
        Largest break frequency at the high mean [Hz].
    least_ratio : float
        Smallest ratio of the break frequency at the low mean to that at the high one, for the same actuator.
    """
    low, high = low_v * rig.motor_speed_per_volt, high_v * rig.motor_speed_per_volt
    pairs = [(break_frequency_about(low, p), break_frequency_about(high, p)) for p in _corner_actuators(rig)]
    return max(at_high for _, at_high in pairs), min(at_low / at_high for at_low, at_high in pairs)
