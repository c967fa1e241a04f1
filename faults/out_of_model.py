"""Is the log one that the nine conditions can explain? Else the verdict is "unknown", with what speaks against.

A log is looked at from five sides: do its sensors work, do position and velocity agree, does any circuit follow it,
does the circuit that does lie in or between the conditions' regions, and would a sensor's bias or another pump explain
it better. The limits leave room for rigs that no circuit describes to the last digit.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimation.sensor_check import sensor_objections, without_saturated
from faults.circuit_runs import COORDINATES, Blocks, blocks_of, coordinates_of, parameter_rows, predicted
from faults.class_fit import WEAK, Actuator
from faults.class_regions import ClassFits, region_scores
from faults.conditions import severity
from plant.record import Record

Array = NDArray[np.float64]

UNEXPLAINED = (0.12, 0.08)
"""Share of velocity and of pressure, root mean square, that the best circuit may leave [dimensionless]."""

FARTHEST_OUT = 7.0
"""Least log-likelihood of the nearest condition's region, below its centre's [dimensionless]."""

SOFT = 0.55
"""Share of the rig's bulk modulus below which the oil holds air [dimensionless]; it is too stiff above the inverse."""

STANDARD_ERRORS = 2.0
"""Standard errors from zero at which a bias is believed [dimensionless]; they hold the model's error already."""

LEAST_BIAS = {"pump": 0.08, "differential_pressure_pa": 0.05, "motor_speed_rad_s": 0.03}
"""Biases that matter: of the pump's flow a radian, of pressure and of motor speed over their root mean square."""

GRID = 9
"""Severities of leakage, and of friction, between none and major that are tried."""

FREE_PUMP = 0.3
"""Standard deviation of the pump's displacement where a fit may change it [dimensionless]."""

AGREEMENT = 0.05
"""Share by which velocity and the slope of position may differ, root mean square [dimensionless]."""

BREAK = 3.0
"""Standard deviations of its noise by which velocity may differ from the slope of position in any case."""


def reasons_against(record: Record, blocks: Blocks, fits: ClassFits, region: float, actuator: Actuator) -> list[str]:
    """Return what speaks against a log being in any of the nine conditions.

    Parameters
    ----------
    record : Record
        The log.
    blocks : Blocks
        The same in blocks.
    fits : ClassFits
        The circuits fitted to it.
    region : float
        Log-likelihood of the nearest condition's region, relative to its centre [dimensionless].
    actuator : Actuator
        The healthy actuator.

    Returns
    -------
    list[str]
        Sentences for a reader; none for a log that fits.
    """
    found = [*sensor_objections(record, actuator.circuit), *_clipped(record, actuator), *_disagreement(record, blocks)]
    found += _unexplained(blocks, fits)
    found += _biases(blocks, fits, actuator)
    return found + _outside(fits, region, actuator)


def _clipped(record: Record, actuator: Actuator) -> list[str]:
    return list(without_saturated(record, actuator.circuit)[1])


def _disagreement(record: Record, blocks: Blocks) -> list[str]:
    """Compare a velocity sensor with the encoder, over the blocks."""
    if "velocity_m_s" not in record or "position_m" not in record:
        return []
    other = blocks_of(record.replace(position_m=None))
    apart = (other.velocity - blocks.velocity)[blocks.first :]
    there = np.isfinite(apart)
    size = float(np.sqrt(np.nanmean(blocks.velocity**2)))
    allowed = max(AGREEMENT * size, BREAK * float(np.hypot(blocks.noise[0], other.noise[0])))
    differs = float(np.sqrt(np.mean(apart[there] ** 2))) if np.any(there) else 0.0
    if differs <= allowed:
        return []
    return [f"velocity_m_s and the slope of position_m differ by {differs:.2g} m/s: one of the two sensors is wrong"]


def _unexplained(blocks: Blocks, fits: ClassFits) -> list[str]:
    sizes = np.sqrt(np.nanmean(blocks.outputs[blocks.first :] ** 2, axis=0))
    shares = fits.best.scales / np.maximum(sizes, np.finfo(float).tiny)
    heard = fits.best.scales > 2.0 * blocks.noise
    names = ("velocity", "differential pressure")
    return [
        f"the best circuit leaves {100.0 * share:.0f} % of the {name} unexplained"
        for name, share, limit, loud in zip(names, shares, UNEXPLAINED, heard, strict=False)
        if share > limit and loud
    ]


def _biases(blocks: Blocks, fits: ClassFits, actuator: Actuator) -> list[str]:
    """Add a bias of each sensor and the pump's displacement to the fit, in one linear step."""
    fit, first = fits.best, blocks.first
    rows = parameter_rows(fit.coordinates[None], actuator.circuit, actuator.rated)
    size = float(np.sqrt(np.mean(blocks.speed**2)))
    if size == 0.0:
        return []
    nudge = 0.01 * size
    faster = predicted(replace(blocks, speed=blocks.speed + nudge), rows)[0]
    columns = [*fit.slopes, (faster - fit.fitted) / nudge]
    names = ["motor_speed_rad_s"]
    if blocks.pressure is not None:
        columns.append(np.column_stack([np.zeros(len(blocks.velocity)), np.ones(len(blocks.velocity))]))
        names.append("differential_pressure_pa")
    seen = np.isfinite(blocks.outputs[first:])
    weighted = np.where(seen, np.array(columns)[:, first:] / fit.scales, 0.0).reshape(len(columns), -1)
    left = np.where(seen, (blocks.outputs - fit.fitted)[first:] / fit.scales, 0.0).ravel()
    trust = float(np.trace(fits.information) / np.trace(fit.information))
    pull = np.zeros((len(columns), len(columns)))
    prior = WEAK.copy()
    pump = COORDINATES.index("pump")
    prior[pump, pump] = FREE_PUMP**2
    pull[: len(WEAK), : len(WEAK)] = np.linalg.inv(prior)
    covariance = np.linalg.pinv(trust * weighted @ weighted.T + pull)
    found = covariance @ (trust * weighted @ left)
    errors = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    sizes = {"pump": 1.0, "motor_speed_rad_s": size}
    if blocks.pressure is not None:
        sizes["differential_pressure_pa"] = float(np.sqrt(np.nanmean(blocks.pressure**2)))
    words = {
        "pump": "the pump's flow against the piston's is {0:+.0f} % off the rig file: motor speed or position reads "
        "wrong, or it is another actuator",
        "motor_speed_rad_s": "motor speed reads {1:+.3g} rad/s off",
        "differential_pressure_pa": "differential pressure reads {1:+.3g} Pa off",
    }
    said: list[str] = []
    for name, place in [("pump", pump), *((name, len(WEAK) + i) for i, name in enumerate(names))]:
        value, error = float(found[place]), float(errors[place])
        if abs(value) > max(STANDARD_ERRORS * error, LEAST_BIAS[name] * sizes[name]):
            said.append(words[name].format(100.0 * value, -value if name == "motor_speed_rad_s" else value))
    return said


def _outside(fits: ClassFits, region: float, actuator: Actuator) -> list[str]:
    stiffness = float(np.exp(fits.best.coordinates[COORDINATES.index("bulk_modulus")]))
    share = stiffness / actuator.circuit.bulk_modulus
    known = fits.covariance[5, 5] ** 0.5
    if share < SOFT * np.exp(-2.0 * known) or share > np.exp(2.0 * known) / SOFT:
        kind = "air in it, or a soft hose" if share < 1.0 else "another oil, or a wrong rig file"
        return [f"the oil's bulk modulus is {share:.2f} of the rig's: {kind}"]
    if region >= -FARTHEST_OUT:
        return []
    leakage, friction, between = _nearest_severity(fits, actuator)
    if between < -FARTHEST_OUT:
        return ["the actuator that fits is in none of the nine conditions, nor between them"]
    return [
        f"between the nine conditions: leakage {leakage:.2f} and friction {friction:.2f} where 1 is minor and 2 major; "
        "a fault of another size, or a sensor with a wrong gain"
    ]


def _nearest_severity(fits: ClassFits, actuator: Actuator) -> tuple[float, float, float]:
    """Return severities of leakage and friction whose region holds the circuit best, and how well."""
    levels = np.linspace(0.0, 2.0, GRID)
    each = [(float(leakage), float(friction)) for leakage in levels for friction in levels]
    points = [coordinates_of(severity(*pair, actuator.circuit), actuator.rated) for pair in each]
    scores = region_scores(fits.best, fits.information, replace(actuator, conditions=np.array(points)))
    best = int(np.argmax(scores))
    return (*each[best], float(scores[best]))
