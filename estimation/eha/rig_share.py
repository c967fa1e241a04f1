"""Sensitivity of a result to the rig file's entries, and the total interval that includes their uncertainty.

A response is the relative change of a quantity per relative change of a rig entry. The flow form's fit provides its
own; everything else uses the laws of dimension below, which are exact for common scales:

- any balance contains only volume over bulk modulus, so bulk modulus is proportional to the volume;
- with pressure, all flows may be scaled together: leakage grows, and so does compliance V/beta, so bulk modulus falls
  as the displacement grows; a pressure sensor that reads high makes bulk modulus too large and leakage too small;
- without pressure, mass, friction, pressures and bulk modulus may grow together while leakage falls: the mass fixes
  the scale.

Leakage is a small difference of two flows: an error of the pump's or the piston's counts by pumped flow over leakage.
How the ratio of the two flows affects bulk modulus depends on the drive; the laws assign it to the displacement.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any, NamedTuple

from estimation.finding import LARGE, NORMAL_95, Quantity
from estimation.fits.flow.told_volume import determines_volume
from estimation.fits.hypothesis_search.form_fit import FormFit
from estimation.notes import EstimateCode, RigCode
from plant.eha.doubts import PRESSURE_GAIN, Spread
from plant.eha.model import EhaParameters
from plant.eha.steady_state import steady_state
from plant.notes import Note

Responses = Mapping[str, float]
"""Relative change of a quantity per relative change of a rig entry, by entry [dimensionless]."""

GAIN: Mapping[str, float] = MappingProxyType({"bulk_modulus": -1.0, "leakage_coefficient": 1.0})
"""Responses to the gain of the pressure sensor."""

DELIVERY_ENTRY = "pump_displacement"
"""The entry of a rig file that a worn pump does not reach."""

SOFT_OIL_RATIO = 0.55
"""Share of the rig's bulk modulus below which the oil contains air [dimensionless]; above the inverse it is too
stiff."""

MOSTLY_RIG = 2.0
"""Ratio of the total interval to the one given the rig, above which a note names the entry [dimensionless]."""


def fitted_responses(fit: FormFit) -> Mapping[str, Responses]:
    """Return the responses of the flow form's results, from the fit's own linear response.

    Returns
    -------
    Mapping[str, Responses]
        By quantity. If the log determines the volume, bulk modulus depends on the gain of the pressure only: all flows
        may scale with the chambers, and their ratio is in the interval given the rig (`ratio_doubt`).
    """
    told = {
        name: {entry: slopes[name] / value for entry, slopes in fit.rig_slopes.items() if value}
        | {PRESSURE_GAIN: GAIN.get(name, 0.0)}
        for name, (value, _) in fit.parameters.items()
    }
    return told | (
        {"bulk_modulus": {PRESSURE_GAIN: GAIN["bulk_modulus"]}} if determines_volume(fit.explanation) else {}
    )


def scaled_responses(
    parameters: EhaParameters, found: Mapping[str, float], *, pressure: bool
) -> Mapping[str, Responses]:
    """Return responses by the laws of dimension.

    Parameters
    ----------
    found : Mapping[str, float]
        Estimated parameters [SI].
    pressure : bool
        Whether differential pressure was used.

    Returns
    -------
    Mapping[str, Responses]
        By quantity; only those for which there is a law.
    """
    p = replace(parameters, **{name: value for name, value in found.items() if hasattr(parameters, name)})
    velocity, settled = steady_state(p.rated_speed, p)
    pumped, swept = p.rated_flow, p.piston_area * velocity
    leaked, biased = (max(flow, 1e-3 * pumped) for flow in (p.leakage_coefficient * settled, p.flow_bias))
    scale: Responses = {"piston_area": 1.0, PRESSURE_GAIN: -1.0} if pressure else {"moving_mass": 1.0}
    held: Responses = {PRESSURE_GAIN: 1.0} if pressure else {"moving_mass": -1.0}
    own = 0.0 if pressure else 1.0
    oil: Responses = {PRESSURE_GAIN: -1.0} if pressure else {"moving_mass": 1.0, "piston_area": -1.0}
    return {
        "bulk_modulus": {"chamber_volume": 1.0, "pump_displacement": -1.0, **oil},
        "leakage_coefficient": {"pump_displacement": pumped / leaked, "piston_area": own - swept / leaked, **held},
        "flow_bias": {"pump_displacement": pumped / biased, "piston_area": -swept / biased},
        **dict.fromkeys(("friction_quadratic", "friction_linear", "friction_coulomb"), scale),
    }


def _entry_shifts(responses: Responses, spreads: Mapping[str, Spread]) -> dict[str, tuple[float, float]]:
    """Return the shift of a quantity, down and up, by each entry within the entry's 95 % [fraction of the quantity]."""
    found: dict[str, tuple[float, float]] = {}
    for entry, power in responses.items():
        down, up = spreads.get(entry, (0.0, 0.0))
        lower, upper = (down, up) if power > 0.0 else (up, down)
        found[entry] = abs(power) * -math.expm1(-NORMAL_95 * lower), abs(power) * math.expm1(NORMAL_95 * upper)
    return found


def with_total(
    one: Quantity, responses: Responses | None, spreads: Mapping[str, Spread], size: float | None = None
) -> Quantity:
    """Return a quantity with its total interval: noise and every entry of the rig, taken as independent.

    An entry's logarithm is normal, so its limits are ``value * exp(-1.96 s)`` and ``value * exp(1.96 s)``; distances of
    the limits from the value add in squares. If the interval is one of the logarithm, distances of logarithms do.

    Parameters
    ----------
    one : Quantity
        The quantity with the interval given the rig.
    responses : Responses or None
        Responses of the quantity [dimensionless]; None if unknown.
    spreads : Mapping[str, Spread]
        Uncertainty of each entry.
    size : float, optional
        Value to which the responses are relative, for a difference from a healthy actuator [in its unit]; by default
        the value itself, which then stays positive.

    Returns
    -------
    Quantity
        With ``ci95_total``; without it if there is no interval, or its responses are unknown.
    """
    if one.value is None or one.ci95 is None or responses is None:
        return one
    reaches = _entry_shifts(responses, spreads).values()
    down, up = (abs(one.value if size is None else size) * math.hypot(*ends) for ends in zip(*reaches, strict=True))
    low = one.value - math.hypot(one.value - one.ci95[0], down) if down else one.ci95[0]
    high = one.value + math.hypot(one.ci95[1] - one.value, up) if up else one.ci95[1]
    if one.value > 0.0 and one.ci95[0] > 0.0 and _is_logarithmic(one.value, one.ci95):
        low = one.value * math.exp(-math.hypot(math.log(one.value / one.ci95[0]), _log_ratio(one.value, -down)))
        high = one.value * math.exp(math.hypot(math.log(one.ci95[1] / one.value), _log_ratio(one.value, up)))
    elif size is None and one.value > 0.0:
        low = max(low, min(one.ci95[0], 0.0))
    return replace(one, ci95_total=(low, high))


def _is_logarithmic(value: float, ends: tuple[float, float]) -> bool:
    """Return whether an interval is wide, and symmetric in the logarithm of its value (`positive_interval_95`)."""
    return ends[0] < value * math.exp(-NORMAL_95 * LARGE) and math.isclose(ends[0] * ends[1], value**2, rel_tol=1e-9)


def _log_ratio(value: float, more: float) -> float:
    """Return the logarithm of a value plus a shift, over the value; at least a hundredth of the value must remain."""
    return math.log1p(max(more / value, -0.99))


def undetermined_wear(remarks: Sequence[Note]) -> float:
    """Return the uncertainty of pump delivery below displacement, if a log cannot separate wear from leakage.

    Returns
    -------
    float
        Standard deviation of the logarithm [dimensionless]; zero if the log determines it, or a worn pump was found.
    """
    said = _wear_note_data(remarks)
    return 0.005 * float(said["percent"]) if said else 0.0


class UndeterminedDelivery(NamedTuple):
    """Pump delivery from a log that cannot separate wear from leakage.

    Parameters
    ----------
    size, deviation : float
        Logarithm of the delivery over the displacement, and its standard deviation, with the prior of a pump
        [dimensionless].
    least : float
        The value below which leakage would be negative [dimensionless].
    """

    size: float
    deviation: float
    least: float = -math.inf


def undetermined_delivery(remarks: Sequence[Note]) -> UndeterminedDelivery | None:
    """Return the pump delivery from a log that cannot separate wear from leakage.

    Returns
    -------
    UndeterminedDelivery or None
        The delivery; None if the log determines it, or a worn pump was found.
    """
    said = _wear_note_data(remarks)
    if said is None:
        return None
    width, less = float(said["half_width"]), float(said["percent"])
    if "most" in said:
        return UndeterminedDelivery(0.01 * float(said["likeliest"]), 0.005 * width, -0.01 * float(said["most"]))
    return UndeterminedDelivery(0.01 * (width - less), 0.005 * width)


def _wear_note_data(remarks: Sequence[Note]) -> Mapping[str, Any] | None:
    """Return the figures of the note that wear is not excluded, None if there is none."""
    return next((note.data for note in remarks if note.code is RigCode.WEAR_NOT_EXCLUDED), None)


def with_wear(spreads: Mapping[str, Spread], remarks: Sequence[Note]) -> Mapping[str, Spread]:
    """Return the uncertainties of rig entries, with displacement's lower one widened by undetermined pump wear."""
    down, up = spreads.get(DELIVERY_ENTRY, (0.0, 0.0))
    worn = undetermined_wear(remarks)
    return {**spreads, DELIVERY_ENTRY: Spread(worn, up)} if worn > down else spreads


def rig_notes(name: str, one: Quantity, responses: Responses, spreads: Mapping[str, Spread]) -> tuple[Note, ...]:
    """Return a note if a quantity is known only as well as the rig.

    Parameters
    ----------
    name : str
        Its name.
    one : Quantity
        The quantity with both intervals.
    responses : Responses
        Its responses [dimensionless].
    spreads : Mapping[str, Spread]
        Uncertainty of each entry.

    Returns
    -------
    tuple of Note
        One at most, with the entry that makes most of the total.
    """
    if one.value is None or one.ci95 is None or one.ci95_total is None:
        return ()
    given, total = (high - low for low, high in (one.ci95, one.ci95_total))
    if not total > MOSTLY_RIG * given:
        return ()
    squares = {entry: (one.value * (down + up)) ** 2 for entry, (down, up) in _entry_shifts(responses, spreads).items()}
    entry = max(squares, key=lambda name: squares[name])
    share = 100.0 * squares[entry] / (sum(squares.values()) + given**2)
    return (EstimateCode.KNOWN_AS_THE_RIG.note(quantity=name, entry=entry, percent=share),)


def another_oil_notes(value: float | None, rig: EhaParameters) -> tuple[Note, ...]:
    """Return a note if a believed bulk modulus is not that of the rig's oil.

    Parameters
    ----------
    value : float or None
        Bulk modulus [Pa].
    rig : EhaParameters
        The actuator, as its file has it.

    Returns
    -------
    tuple of Note
        One at most: the possible causes, and the chamber volume that would explain it.
    """
    ratio = 1.0 if value is None else value / rig.bulk_modulus
    if SOFT_OIL_RATIO <= ratio <= 1.0 / SOFT_OIL_RATIO:
        return ()
    code = EstimateCode.SOFTER_THAN_RIG if ratio < 1.0 else EstimateCode.STIFFER_THAN_RIG
    return (code.note(ratio=ratio, written=rig.chamber_volume, volume=rig.chamber_volume / ratio),)
