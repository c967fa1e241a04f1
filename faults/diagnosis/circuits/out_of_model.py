"""Can the nine conditions explain a log? Otherwise the verdict is "unknown", with the reasons.

There are three tests: does any circuit follow the log, is that circuit in or between the conditions' regions, and would
a sensor's bias or another pump explain the log better. The limits allow for rigs that no circuit describes exactly.
"""

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from estimation.eha.rig_share import SOFT_OIL_RATIO
from estimation.fits.greybox.block_averages import samples_a_block
from faults.conditions import CONDITIONS, severity
from faults.diagnosis.circuits.actuator import Actuator
from faults.diagnosis.circuits.beside import beside_note
from faults.diagnosis.circuits.blocks import Blocks
from faults.diagnosis.circuits.circuit_runs import COORDINATES, coordinates_of, parameter_rows, predicted_outputs
from faults.diagnosis.circuits.class_fit import (
    LASTING,
    SEAL_SPREAD,
    STEP,
    WEAK_PRIOR,
    PointFit,
    fit_freely,
    normalised_rows,
)
from faults.diagnosis.circuits.class_regions import ClassFits
from faults.diagnosis.circuits.load_or_offset import load_for_offset
from faults.diagnosis.circuits.not_shown import FRICTION_LAW, undetermined_coordinates
from faults.diagnosis.circuits.region_scores import region_scores
from faults.diagnosis.circuits.yielding import UNEXPLAINED, follows_velocity, yielding_velocity
from faults.notes import AgainstCode
from plant.notes import Note

AVERAGING_TIME = 0.1
"""Time over which velocity is averaged again if pressure is logged [s]: a piston that hardly moves breaks loose some
blocks sooner or later than the circuit's, and moves as far."""

UNEXPLAINED_AVERAGED = 0.06
"""Share of velocity that means over `AVERAGING_TIME` may leave unexplained [dimensionless]: half of the limit for
blocks."""

SEAL_YIELD = math.exp(SEAL_SPREAD)
"""How far seals may yield, over the rig's presliding displacement [dimensionless]: one standard deviation more, 54
um."""

FARTHEST_OUT = 7.0
"""Least log-likelihood of the nearest condition's region, relative to its centre [dimensionless]."""

FARTHEST_BESIDE = 10.4
"""The same for the best circuit of all severities, if pressure is logged [dimensionless]: two severities reach 7.0 by
chance in one case of 1100, and five other coordinates reach this as seldom. Without pressure it is the only sign of
some faults."""

STANDARD_ERRORS = 2.0
"""Standard errors from zero at which a bias is believed [dimensionless]; they include the model's error."""

LEAST_BIAS = {"pump": 0.08, "differential_pressure_pa": 0.05, "motor_speed_rad_s": 0.03}
"""Biases that matter: of the pump's flow per radian, of pressure and of motor speed over their root mean square."""

GRID = 9
"""Severities of leakage, and of friction, between none and major that are tried."""

FREE_PUMP = 0.3
"""Standard deviation of the pump's displacement where a fit may change it [dimensionless]."""

SMALLEST_PUMP = 0.3
"""Share of the rig's displacement below which no pump is tried [dimensionless]."""

PUMP_GAIN, PUMP_GAIN_WITHOUT = 20.0, 3.0
"""Log-posterior that another pump must gain, with pressure and without, in `LASTING` blocks that count as one
[dimensionless]. In logs of other physics a pump 10 % off gained up to 15 without being there. On nine steps, one that
is 15 % off gains 44 to 154, and 9 to 18 under major leakage and friction. With pressure the flow balance tests for a
worn pump too; without, nothing else does."""

BIAS_GAIN = 4.0
"""The same for an offset of motor speed without pressure [dimensionless]: as for any other fault. For a creeping piston
one linear step promises false offsets; plain training log 9749 gains 2.7, unlike chambers and loads on the rod 13 to
57."""


def reasons_against(blocks: Blocks, fits: ClassFits, region: float, actuator: Actuator) -> list[Note]:
    """Return the reasons against all nine conditions.

    Parameters
    ----------
    region : float
        Log-likelihood of the nearest condition's region, relative to its centre [dimensionless].

    Returns
    -------
    list[Note]
        Empty for a log that fits.
    """
    left = [] if sticks_and_slips(blocks, fits.best, actuator) else unexplained_notes(blocks, fits, actuator)
    return [*left, *_bias_notes(blocks, fits, actuator), *_outside_notes(blocks, fits, region, actuator)]


def unexplained_notes(blocks: Blocks, fits: ClassFits, actuator: Actuator) -> list[Note]:
    """Return a note for each output of which the best circuit leaves too much.

    Returns
    -------
    list[Note]
        Empty if a circuit follows the log.
    """
    scales, sizes = fits.best.scales, blocks.rms
    shares = np.divide(scales, sizes, out=np.full(len(scales), np.inf), where=sizes > 0.0)  # a dead sensor reads 0
    least = np.array([yielding_velocity(blocks, actuator), 0.0])[: len(shares)]
    heard = fits.best.scales > np.maximum(2.0 * blocks.noise, least)
    if blocks.pressure is not None:
        heard[0] &= _averaged_residual(blocks, fits.best) > UNEXPLAINED_AVERAGED * blocks.rms[0]
    names = ("velocity", "differential pressure")
    return [
        AgainstCode.UNEXPLAINED.note(percent=100.0 * share, channel=name)
        for name, share, limit, loud in zip(names, shares, UNEXPLAINED, heard, strict=False)
        if share > limit and loud
    ]


def sticks_and_slips(blocks: Blocks, fit: PointFit, actuator: Actuator) -> bool:
    """Return whether a circuit misses only the times at which the piston breaks loose, and not how far it moves.

    Minor friction falls with speed, so that a slowly pushed piston sticks and slips: some twenty jumps a second of a
    tenth of a millimetre each. The start of a jump depends on seals that no circuit describes exactly, and the next
    jump follows from it. How far the piston moves follows from pressure and flow. So if the circuit follows pressure,
    and motion over `AVERAGING_TIME` within what seals may yield, jumps at other times are no objection.

    Parameters
    ----------
    fit : PointFit
        The best circuit.

    Returns
    -------
    bool
        Always False without pressure, since nothing then shows that the piston sticks.
    """
    if blocks.pressure is None or fit.scales[1] > max(UNEXPLAINED[1] * blocks.rms[1], 2.0 * blocks.noise[1]):
        return False
    return AVERAGING_TIME * _averaged_residual(blocks, fit) <= SEAL_YIELD * actuator.circuit.presliding_displacement


def _averaged_residual(blocks: Blocks, fit: PointFit) -> float:
    """Return the residual of a circuit in mean velocity over `AVERAGING_TIME`, root mean square [m/s]."""
    left = (blocks.velocity - fit.fitted[:, 0])[blocks.first :]
    together = samples_a_block(blocks.block * blocks.sample_time, AVERAGING_TIME)
    parts = left[: len(left) // together * together].reshape(-1, together)
    there = np.isfinite(parts)
    means = np.where(there, parts, 0.0).sum(axis=1) / np.maximum(there.sum(axis=1), 1)
    known = np.any(there, axis=1)
    return float(np.sqrt(np.mean(means[known] ** 2))) if np.any(known) else float("inf")


def _bias_notes(blocks: Blocks, fits: ClassFits, actuator: Actuator) -> list[Note]:
    """Return a note for each biased sensor, and for a pump other than the rig's.

    Both are found by one linear step from the best circuit. Another pump changes the other coordinates, so it is put
    into the circuit and the step is repeated; it counts if the circuit then explains the log better. So does an offset
    of motor speed without pressure, unless a load on the rod explains the log as well.
    """
    size = float(np.sqrt(np.mean(blocks.speed**2)))
    if size == 0.0:
        return []
    trust = float(np.trace(fits.information) / np.trace(fits.best.information))
    sizes = {"pump": 1.0, "motor_speed_rad_s": size}
    if blocks.pressure is not None:
        sizes["differential_pressure_pa"] = float(np.sqrt(np.nanmean(blocks.pressure**2)))
    found = _linear_biases(blocks, fits.best, trust, actuator, sizes)
    matters = {name: abs(value) > _least_bias(name, error, sizes) for name, (value, error) in found.items()}
    pump = found["pump"][0]
    if blocks.pressure is None and pump < 0.0:  # `other_faults` looks for a worn pump
        matters["pump"] = False
    nearest, load = list(CONDITIONS)[int(np.argmax(fits.scores))], None
    if matters["pump"]:
        healthy = actuator.circuit
        other = replace(healthy, pump_displacement=healthy.pump_displacement * max(1.0 + pump, SMALLEST_PUMP))
        tried = replace(actuator, circuit=other)
        without, again = (fit_freely(blocks, one, nearest) for one in (actuator, tried))
        least = PUMP_GAIN_WITHOUT if blocks.pressure is None else PUMP_GAIN
        matters["pump"] = without.cost - again.cost > least * LASTING
        pump = (1.0 + pump) * (1.0 + _linear_biases(blocks, again, trust, tried, sizes)["pump"][0]) - 1.0
    if blocks.pressure is None and matters["motor_speed_rad_s"]:
        offset = found["motor_speed_rad_s"][0]
        without, again = (
            fit_freely(replace(blocks, speed=blocks.speed + one), actuator, nearest) for one in (0.0, offset)
        )
        gain = (without.cost - again.cost) / LASTING
        if gain > BIAS_GAIN:
            load = load_for_offset(blocks, actuator, nearest, without, offset, gain)
        # if an offset explains the log, a circuit with it follows the log
        matters["motor_speed_rad_s"] = load is not None or (
            gain > BIAS_GAIN and follows_velocity(blocks, again, actuator)
        )
    said = {name: _bias_note(name, pump if name == "pump" else found[name][0]) for name in found if matters[name]}
    return list((said if load is None else said | {"motor_speed_rad_s": load}).values())


def _least_bias(name: str, error: float, sizes: Mapping[str, float]) -> float:
    return max(STANDARD_ERRORS * error, LEAST_BIAS[name] * sizes[name])


def _linear_biases(
    blocks: Blocks, fit: PointFit, trust: float, actuator: Actuator, sizes: Mapping[str, float]
) -> Mapping[str, tuple[float, float]]:
    """Return the pump's relative delivery and each sensor's bias, with errors, by one linear step from a fit."""
    rows = parameter_rows(fit.coordinates[None], actuator.circuit, actuator.rated)
    nudge = 0.01 * sizes["motor_speed_rad_s"]
    faster = predicted_outputs(replace(blocks, speed=blocks.speed + nudge), rows)[0]
    pumping = replace(actuator.circuit, pump_displacement=actuator.circuit.pump_displacement * math.exp(STEP))
    larger = predicted_outputs(blocks, parameter_rows(fit.coordinates[None], pumping, actuator.rated))[0]
    columns = [*fit.slopes, (larger - fit.fitted) / STEP, (faster - fit.fitted) / nudge]
    if blocks.pressure is not None:
        columns.append(np.column_stack([np.zeros(len(blocks.velocity)), np.ones(len(blocks.velocity))]))
    weighted, left = normalised_rows(blocks, fit, np.array(columns))
    pull, pump = np.zeros((len(columns), len(columns))), len(WEAK_PRIOR)
    pull[:pump, :pump] = np.linalg.inv(WEAK_PRIOR)
    pull[pump, pump] = 1.0 / FREE_PUMP**2
    covariance = np.linalg.pinv(trust * weighted @ weighted.T + pull)
    found = covariance @ (trust * weighted @ left)
    errors = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    return {name: (float(found[at]), float(errors[at])) for at, name in enumerate(sizes, start=pump)}


def _bias_note(name: str, value: float) -> Note:
    if name == "pump":
        return AgainstCode.PUMP_OFF.note(percent=100.0 * value)
    if name == "motor_speed_rad_s":
        return AgainstCode.SPEED_BIAS.note(bias_rad_s=-value)
    return AgainstCode.PRESSURE_BIAS.note(bias_pa=value)


def _outside_notes(blocks: Blocks, fits: ClassFits, region: float, actuator: Actuator) -> list[Note]:
    stiffness = float(np.exp(fits.best.coordinates[COORDINATES.index("bulk_modulus")]))
    share = stiffness / actuator.circuit.bulk_modulus
    known = fits.covariance[5, 5] ** 0.5
    # without pressure, a piston that yields on its seals shows only the ratio of bulk modulus to friction
    over_friction = blocks.pressure is None and undetermined_coordinates(fits) >= FRICTION_LAW
    if not over_friction and (
        share < SOFT_OIL_RATIO * np.exp(-2.0 * known) or share > np.exp(2.0 * known) / SOFT_OIL_RATIO
    ):
        return [(AgainstCode.OIL_SOFT if share < 1.0 else AgainstCode.OIL_STIFF).note(share=share)]
    if region >= -FARTHEST_OUT:
        return []
    leakage, friction, between = _nearest_severity(fits, actuator)
    if between >= -FARTHEST_OUT:
        return [AgainstCode.BETWEEN_CONDITIONS.note(leakage=leakage, friction=friction)]
    farthest = FARTHEST_OUT if blocks.pressure is None else FARTHEST_BESIDE
    return [beside_note(fits, actuator)] if between < -farthest else []


def _nearest_severity(fits: ClassFits, actuator: Actuator) -> tuple[float, float, float]:
    """Return the severities of leakage and friction whose region fits the circuit best, and how well."""
    levels = np.linspace(0.0, 2.0, GRID)
    each = [(float(leakage), float(friction)) for leakage in levels for friction in levels]
    points = [coordinates_of(severity(*pair, actuator.circuit), actuator.rated) for pair in each]
    scores = region_scores(fits.best, fits.discounted_information, replace(actuator, conditions=np.array(points)))
    best = int(np.argmax(scores))
    return (*each[best], float(scores[best]))
