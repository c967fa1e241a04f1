"""How bad is it? A fitted circuit in the units of a shop, each number with a 95 % interval."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
from numpy.typing import NDArray

from faults.circuit_runs import COORDINATES, parameter_rows
from faults.class_fit import WEAK, Actuator
from faults.class_regions import ClassFits
from plant.circuit_parameters import CircuitParameters
from plant.components.cylinder import quadratic_friction
from plant.components.oil import ATMOSPHERE
from plant.steady_state import steady_state

Array = NDArray[np.float64]

DRAWS = 200
"""Circuits drawn from what a fit believes, for the intervals."""

OF_KIND = 0.2
"""How far bulk modulus differs between sound actuators of one kind [dimensionless]: what is less may be air."""

BLIND = 0.9
"""A log that narrows a coefficient to no less than this share of the prior says nothing of it [dimensionless]."""

VAGUE = 3.0
"""Ratio of relative widths from which a combination is known and its parts are not [dimensionless]."""


@dataclass(frozen=True)
class Severity:
    """One number of a verdict.

    Parameters
    ----------
    value : float
        The estimate [in its unit].
    unit : str
        The unit.
    ci95 : tuple of float
        Ends of its 95 % interval [in its unit].
    """

    value: float
    unit: str
    ci95: tuple[float, float]

    def covers(self, truth: float) -> bool:
        """Return whether the interval holds a value.

        Parameters
        ----------
        truth : float
            The value [in its unit].

        Returns
        -------
        bool
            Whether it does.
        """
        return self.ci95[0] <= truth <= self.ci95[1]


UNITS: Mapping[str, str] = {
    "leakage_flow": "L/min",
    "velocity_lost": "%",
    "added_friction": "N",
    "pressure_rise": "%",
    "bulk_modulus": "Pa",
    "entrained_air": "%",
}
"""The severities: leakage flow and bias at rated pressure (the relief setting); velocity lost and pressure rise in the
steady state at rated speed, relative to the healthy actuator; friction at its rated velocity over the healthy; bulk
modulus; the air at atmospheric pressure that would make the oil so soft."""


def severities_at(point: Array, actuator: Actuator) -> Mapping[str, float]:
    """Return the severities of a circuit.

    Parameters
    ----------
    point : ndarray, shape (7,)
        Its coordinates.
    actuator : Actuator
        The healthy actuator.

    Returns
    -------
    Mapping[str, float]
        In the units of `UNITS`.
    """
    healthy = actuator.circuit
    (row,) = parameter_rows(point[None], healthy, actuator.rated)
    p = SimpleNamespace(**dict(zip(CircuitParameters.__dataclass_fields__, row.tolist(), strict=True)))
    velocity, pressure = steady_state(healthy.rated_speed, p)
    sound_velocity, sound_pressure = steady_state(healthy.rated_speed, healthy)
    rubbing, sound = (
        float(quadratic_friction(actuator.rated, 1.0, q.friction_quadratic, q.friction_linear, q.friction_coulomb))
        for q in (p, healthy)
    )
    softness = 1.0 / p.bulk_modulus - 1.0 / healthy.bulk_modulus
    return {
        "leakage_flow": 6e4 * (p.leakage_coefficient * healthy.relief_pressure + p.flow_bias),
        "velocity_lost": 100.0 * (1.0 - velocity / sound_velocity),
        "added_friction": rubbing - sound,
        "pressure_rise": 100.0 * (pressure / sound_pressure - 1.0) if sound_pressure > 0.0 else 0.0,
        "bulk_modulus": p.bulk_modulus,
        "entrained_air": 100.0 * max(0.0, softness * healthy.accumulator_pressure**2 / ATMOSPHERE),
    }


def severities(
    fits: ClassFits, actuator: Actuator, widths: Mapping[str, float] | None = None
) -> Mapping[str, Severity]:
    """Return the severities of a fitted circuit with their intervals.

    Parameters
    ----------
    fits : ClassFits
        The fit.
    actuator : Actuator
        The healthy actuator.
    widths : Mapping[str, float], optional
        By what each interval is stretched [dimensionless]; 1 if not given.

    Returns
    -------
    Mapping[str, Severity]
        By the names of `UNITS`.
    """
    rng = np.random.default_rng(0)
    centre = fits.best.coordinates
    drawn = rng.multivariate_normal(centre, fits.spread, DRAWS, method="cholesky")
    with np.errstate(all="ignore"):  # friction that falls faster than leakage holds has no steady state
        table, best = [severities_at(point, actuator) for point in drawn], severities_at(centre, actuator)
    found: dict[str, Severity] = {}
    for name, value in best.items():
        if not np.isfinite(value):
            found[name] = Severity(value, UNITS[name], (float("nan"), float("nan")))
            continue
        low, high = (float(end) for end in np.nanpercentile([row[name] for row in table], (2.5, 97.5)))
        stretch = 1.0 if widths is None else widths.get(name, 1.0)
        ends = value - stretch * (value - low), value + stretch * (high - value)
        found[name] = Severity(value, UNITS[name], ends)
    air = found["entrained_air"]
    unlike = actuator.circuit.bulk_modulus * (1.0 - OF_KIND)
    lowest = air.ci95[0] if found["bulk_modulus"].ci95[1] < unlike else 0.0
    return found | {"entrained_air": Severity(air.value, air.unit, (max(0.0, lowest), air.ci95[1]))}


def what_is_not_told(fits: ClassFits, found: Mapping[str, Severity], *, pressure: bool) -> list[str]:
    """Return a sentence for each thing that the log does not determine.

    Parameters
    ----------
    fits : ClassFits
        The fit.
    found : Mapping[str, Severity]
        Its severities [each in its unit].
    pressure : bool
        Whether differential pressure is logged.

    Returns
    -------
    list[str]
        Sentences for a reader; none for a log that tells all.
    """
    known, believed = np.sqrt(np.diag(fits.covariance)), np.sqrt(np.diag(WEAK))
    blind = {name for name, k, b in zip(COORDINATES, known, believed, strict=True) if k > BLIND * b}
    said: list[str] = []
    if "friction_rated" in blind and "friction_rest" in blind:
        said.append("friction is not visible: the piston hardly moves, so any friction beyond what holds it fits alike")
    if "bulk_modulus" in blind:
        said.append("bulk modulus is not visible under this drive")
    flow, speed = found["leakage_flow"], found["velocity_lost"]
    low, high = speed.ci95
    lost = f": the velocity lost, {speed.value:z.1f} % ({low:z.1f} to {high:z.1f}), is what the log determines"
    lost = lost if np.isfinite(speed.value) else ""
    if not pressure:
        said.append(
            "without pressure leakage and friction share one scale, beyond which they are not told apart but by how "
            f"alike actuators of one kind are{lost}"
        )
    elif _width(flow) > VAGUE * (high - low) / 100.0 and _width(flow) > 0.3:
        said.append(f"leakage coefficient and flow bias are not told apart{lost}")
    return said


def _width(severity: Severity) -> float:
    return (severity.ci95[1] - severity.ci95[0]) / abs(severity.value) if severity.value else float("inf")
