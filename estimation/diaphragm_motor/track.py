"""Leakage and load of the diaphragm motor over time, without a sensor of pressure or flow.

A healthy pump is its own flow meter: at a given drive the middle electrode's amplitude gives the flow Q and the
pressure p that it delivers. The part of Q that the piston does not sweep is leakage, G = (Q - A_c v - C p') / p; the
part of A_c p that friction does not take is load. A Kalman filter tracks both, in blocks of 20 cycles, and holds
leakage while the pressure changes.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil, pi, sqrt, tanh

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

from estimation.diaphragm_motor.signature import (
    FEWEST_CYCLES,
    GAIN_TOLERANCE,
    POSITION,
    SETTLING_TIME,
    Drive,
    fitted_tones,
    whole_cycles,
)
from estimation.finding import NORMAL_95
from plant.arrays import Floats
from plant.diaphragm_motor.flow import operate
from plant.diaphragm_motor.parameters import DiaphragmMotorParameters
from plant.diaphragm_motor.run import ELECTRODES
from plant.errors import LogError
from plant.log.record import Record

MIDDLE = ELECTRODES[3]
"""The electrode by whose amplitude the maps are read: it peaks with the flow (section 7.1)."""

MAP_LOADS = tuple(float(load) for load in np.linspace(-10.0, 34.0, 12))
"""Loads from which the maps are made [N]."""

FLOW_TOLERANCE = 0.005
"""Relative standard deviation of the flow from the maps, judged [dimensionless]."""

LEAK_ALARM = 5e-13
"""Leakage above which the piston is said to leak, with 97.5 % certainty and for `PERSISTENCE` blocks [m^3/(s Pa)]."""

PERSISTENCE = 3
"""Number of blocks of 20 cycles for which a leak must show."""


@dataclass(frozen=True)
class HealthyMaps:
    """Maps of a healthy pump at one drive: flow and pressure as functions of the middle electrode's amplitude.

    Parameters
    ----------
    flow, pressure : Polynomial
        Mean flow into the cylinder [m^3/s] and pressure across its piston [Pa], as functions of the amplitude [V].
    """

    flow: Polynomial
    pressure: Polynomial


@dataclass(frozen=True)
class MotorTrack:
    """Leakage and load over time, one entry for each block of 20 cycles.

    Parameters
    ----------
    time : ndarray, shape (blocks,)
        End of each block [s].
    leakage, leakage_std : ndarray, shape (blocks,)
        Leakage across the piston and its standard deviation [m^3/(s Pa)].
    load, load_std : ndarray, shape (blocks,)
        Force against extension and its standard deviation [N].
    held : ndarray of bool, shape (blocks,)
        Whether leakage was held because the pressure had just changed.
    """

    time: Floats
    leakage: Floats
    leakage_std: Floats
    load: Floats
    load_std: Floats
    held: NDArray[np.bool_]

    @property
    def alarm_time(self) -> float | None:
        """Time at which leakage has been certain for `PERSISTENCE` blocks [s]; None if it never was."""
        certain = (self.leakage - NORMAL_95 * self.leakage_std > LEAK_ALARM) & ~self.held
        for end in range(PERSISTENCE, len(certain) + 1):
            if certain[end - PERSISTENCE : end].all():
                return float(self.time[end - 1])
        return None


def healthy_maps(p: DiaphragmMotorParameters, drive: Drive) -> HealthyMaps:
    """Return flow and pressure as functions of the middle electrode's amplitude, over loads (section 7.2).

    Parameters
    ----------
    p : DiaphragmMotorParameters
        The motor, with a tight piston.

    Returns
    -------
    HealthyMaps
        Polynomials of degree 5.

    Raises
    ------
    LogError
        If the drive is too weak to move the rod against the loads.
    """
    points = [operate(replace(p, load_force=load), drive.frequency, drive.peak_to_peak) for load in MAP_LOADS]
    points = [point for point in points if point.velocity > _LEAST_SPEED]
    if len(points) <= _DEGREE:
        raise LogError(
            f"a drive that moves the rod is needed, got {drive.peak_to_peak:.4g} V peak to peak at "
            f"{drive.frequency:.4g} Hz"
        )
    amplitude = np.array([abs(point.tones[3]) for point in points])
    flow, pressure = (
        Polynomial.fit(amplitude, [getattr(point, name) for point in points], _DEGREE)
        for name in ("outlet_flow", "pressure")
    )
    return HealthyMaps(flow, pressure)


@dataclass(frozen=True)
class Block:
    """Measurements over a block of 20 cycles.

    Parameters
    ----------
    end, length : float
        End and length [s].
    amplitude, velocity : float
        Amplitude of the middle electrode [V], velocity of the rod [m/s].
    deviations : ndarray, shape (2,)
        Standard deviations of amplitude and velocity.
    """

    end: float
    length: float
    amplitude: float
    velocity: float
    deviations: Floats


def motor_blocks(record: Record, drive: Drive) -> list[Block]:
    """Return the settled log in blocks of 20 cycles.

    Parameters
    ----------
    record : Record
        Middle electrode and position.

    Raises
    ------
    LogError
        If the log holds none.
    """
    between = record.sample_time
    first = ceil(SETTLING_TIME / between)
    whole_cycles(len(record) - first, between, drive.frequency)
    count = round(FEWEST_CYCLES / (drive.frequency * between))
    angle = 2.0 * pi * drive.frequency * between * np.arange(count)
    length = count * between
    blocks: list[Block] = []
    spreads: list[Floats] = []
    for start in range(first, len(record) - count + 1, count):
        both = np.column_stack([record[MIDDLE][start : start + count], record[POSITION][start : start + count]])
        found, noise = fitted_tones(both, angle, trend=1)
        velocity = 2.0 * float(found[1, 1]) / length
        spreads.append(np.array([sqrt(2.0 / count) * noise[0], sqrt(12.0 / count) / length * noise[1]]))
        amplitude = float(np.hypot(found[2, 0], found[3, 0]))
        blocks.append(Block((start + count) * between, length, amplitude, velocity, spreads[-1]))
    usual = np.median(spreads, axis=0)  # the median ignores blocks that contain a step, which is not noise
    return [replace(block, deviations=usual) for block in blocks]


def track_leakage(
    blocks: Sequence[Block], p: DiaphragmMotorParameters, maps: HealthyMaps, trust: float = 1.0
) -> MotorTrack:
    """Filter leakage and load, one block at a time; leakage is held while the pressure changes.

    Parameters
    ----------
    maps : HealthyMaps
        Flow and pressure of its pump.
    trust : float
        Factor on the tolerances of the electrode's gain and of the flow [dimensionless].
    """
    state, known = np.array([p.crossport_leakage, 0.0]), np.diag([_FIRST_LEAKAGE**2, _FIRST_LOAD**2])
    rows: list[tuple[float, ...]] = []
    before, waiting = float(maps.pressure(blocks[0].amplitude)), 0
    for block in blocks:
        pressure = float(maps.pressure(block.amplitude))
        slope = abs(float(maps.pressure.deriv()(block.amplitude)))
        jumped = abs(pressure - before) > max(_STILL, _SURE * slope * float(block.deviations[0]))
        waiting = _BLOCKS_HELD if jumped else max(0, waiting - 1)
        seen, noise = _balances(block, (pressure - before) / block.length, p, maps)
        known = known + np.diag([_LEAKAGE_WALK**2, (_FIRST_LOAD if jumped else _LOAD_WALK) ** 2])
        design = np.array([[pressure, 0.0], [0.0, 1.0]])
        chosen = [1] if waiting else [0, 1]
        state, known = _updated_belief(state, known, seen[chosen], design[chosen], noise[np.ix_(chosen, chosen)])
        spread = np.sqrt(np.diag(known) + (trust * _tolerance_errors(block, state, p, maps)) ** 2)
        rows.append((block.end, state[0], spread[0], state[1], spread[1], float(waiting > 0)))
        before = pressure
    time, leakage, leakage_std, load, load_std, held = np.array(rows).T
    return MotorTrack(time, leakage, leakage_std, load, load_std, held > 0.0)


def _balances(block: Block, rate: float, p: DiaphragmMotorParameters, maps: HealthyMaps) -> tuple[Floats, Floats]:
    """Return the lost flow and the remaining force, with their covariance from the sensors' noise."""
    compliance = p.line_compliance + p.cylinder_volume / p.cylinder_bulk_modulus
    amplitude, velocity = block.amplitude, block.velocity
    rubbed = tanh(velocity / p.friction_speed)
    lost = float(maps.flow(amplitude)) - p.piston_area * velocity - compliance * rate
    resisted = p.viscous_friction * velocity + p.coulomb_friction * rubbed
    force = p.piston_area * float(maps.pressure(amplitude)) - resisted
    stiff = p.viscous_friction + p.coulomb_friction / p.friction_speed * (1.0 - rubbed**2)
    slopes = np.array(
        [
            [float(maps.flow.deriv()(amplitude)), -p.piston_area],
            [p.piston_area * float(maps.pressure.deriv()(amplitude)), -stiff],
        ]
    )
    return np.array([lost, force]), slopes @ np.diag(block.deviations**2) @ slopes.T


def _updated_belief(state: Floats, known: Floats, seen: Floats, design: Floats, noise: Floats) -> tuple[Floats, Floats]:
    """Return the Kalman filter's belief after a measurement, by Joseph's form."""
    gain = known @ design.T @ np.linalg.inv(design @ known @ design.T + noise)
    left = np.eye(len(state)) - gain @ design
    return state + gain @ (seen - design @ state), left @ known @ left.T + gain @ noise @ gain.T


def _tolerance_errors(block: Block, state: Floats, p: DiaphragmMotorParameters, maps: HealthyMaps) -> Floats:
    """Return the errors of leakage and load due to the tolerances of an electrode's gain and of a map."""
    off = GAIN_TOLERANCE * block.amplitude
    pressure, flow = float(maps.pressure(block.amplitude)), float(maps.flow(block.amplitude))
    slope_p, slope_q = (float(one.deriv()(block.amplitude)) for one in (maps.pressure, maps.flow))
    lost = np.hypot(off * (slope_q - state[0] * slope_p), FLOW_TOLERANCE * flow)
    return np.array([float(lost) / max(abs(pressure), _LEAST_PRESSURE), p.piston_area * abs(slope_p) * off])


_LEAST_SPEED = 1e-4
"""Velocity of the rod above which an operating point is used for the maps [m/s]; judged."""

_LEAST_PRESSURE = 1e3
"""Least pressure by which lost flow is divided to give leakage [Pa]; judged."""

_DEGREE = 5
"""Degree of the polynomials for flow and pressure in the electrode's amplitude; judged."""

_FIRST_LEAKAGE, _FIRST_LOAD = 2e-11, 50.0
"""Prior standard deviations of leakage [m^3/(s Pa)] and load [N], the latter also after a jump of load; judged."""

_LEAKAGE_WALK, _LOAD_WALK = 5e-14, 0.05
"""Standard deviations of the change of both within a block without a jump [m^3/(s Pa), N]; judged."""

_STILL, _SURE = 300.0, 6.0
"""Change of pressure between blocks up to which there is no jump [Pa], and the same in deviations of its noise;
judged."""

_BLOCKS_HELD = 3
"""Blocks for which leakage is held after a jump [count]; judged."""
