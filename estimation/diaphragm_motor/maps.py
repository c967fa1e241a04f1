"""The diaphragm motor averaged over cycles: maps of flow and sensing, and the cylinder's slow motion with them.

The fast plant is run on a grid of frequency, voltage and load; between the points the maps are linear. A filter or a
controller then steps by tenths of a millisecond instead of microseconds, and an electrode's amplitude gives flow and
pressure through the maps: the aim of equation 19 of the diaphragm-motor paper (errata M19 explains why it fails).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import tanh
from typing import Any

import numpy as np
from numpy.typing import NDArray

from plant.arrays import Array, Tones
from plant.diaphragm_motor.flow import operate
from plant.diaphragm_motor.model import SIDE_A, at_rest
from plant.diaphragm_motor.parameters import DiaphragmMotorParameters
from plant.errors import HydrostateError

SWINGS = tuple(np.arange(0.0, 301.0, 50.0))
"""Voltages of a map, peak to peak [V]."""

PRESSURES = tuple(np.arange(0.0, 1.21e5, 1e4))
"""Pressure differences over the piston in a map [Pa]; healthy pumps stall at 1.05e5 Pa on 200 V at 480 Hz."""

AVERAGE_STEP = 2e-4
"""Step of the averaged motion, and time between its samples [s]."""

MIDDLE = 3
"""Index of the middle electrode, A4."""


@dataclass(frozen=True, eq=False)
class MotorMaps:
    """Averages of settled runs on a grid.

    Parameters
    ----------
    frequencies : ndarray, shape (f,)
        Drive frequencies [Hz], rising.
    swings : ndarray, shape (v,)
        Voltages peak to peak [V], rising.
    pressures : ndarray, shape (k,)
        Pressure differences over the piston [Pa], rising.
    flow : ndarray, shape (f, v, k)
        Mean flow delivered by the pump [m^3/s].
    tones : ndarray of complex, shape (f, v, k, 7)
        Electrodes' voltages at the drive's frequency [V].
    """

    motor: DiaphragmMotorParameters
    frequencies: Array
    swings: Array
    pressures: Array
    flow: Array
    tones: Tones

    def row(self, values: NDArray[Any], frequency: float, swing: float) -> NDArray[Any]:
        """Return a map's values over pressure at a frequency and a voltage.

        Parameters
        ----------
        values : ndarray, shape (f, v, k, ...)
            `flow`, or `tones` [any unit].
        frequency : float
            Frequency of the drive [Hz]; if a map has only one frequency, it must be this one.
        swing : float
            Voltage peak to peak [V].

        Returns
        -------
        ndarray, shape (k, ...)
            By linear interpolation.

        Raises
        ------
        HydrostateError
            If frequency or voltage lie off the map.
        """
        i, a = _grid_cell("frequency", self.frequencies, frequency, "Hz")
        j, b = _grid_cell("voltage", self.swings, swing, "V")
        k = min(i + 1, len(self.frequencies) - 1)
        low = (1.0 - b) * values[i, j] + b * values[i, j + 1]
        return low if a == 0.0 else (1.0 - a) * low + a * ((1.0 - b) * values[k, j] + b * values[k, j + 1])

    def sensed(self, frequency: float, swing: float, amplitude: float) -> tuple[float, float]:
        """Return flow and pressure from the middle electrode's amplitude, which falls as pressure rises.

        Parameters
        ----------
        frequency : float
            Frequency of the drive [Hz].
        swing : float
            Voltage peak to peak [V].
        amplitude : float
            Amplitude of A4 at the drive's frequency [V].

        Returns
        -------
        tuple of float
            Flow [m^3/s] and pressure difference [Pa]; limited to the ends of the map.
        """
        seen = np.abs(self.row(self.tones[..., MIDDLE], frequency, swing))[::-1]
        rising = np.maximum.accumulate(seen)
        pressure = float(np.interp(amplitude, rising, self.pressures[::-1]))
        flow = float(np.interp(pressure, self.pressures, self.row(self.flow, frequency, swing)))
        return flow, pressure


def _grid_cell(name: str, axis: Array, value: float, unit: str) -> tuple[int, float]:
    """Return the cell of an axis that contains a value, and its position within the cell."""
    if not axis[0] - 1e-9 <= value <= axis[-1] + 1e-9:
        raise HydrostateError(f"the map's {name} goes from {axis[0]:g} to {axis[-1]:g} {unit}, got {value:g} {unit}")
    if len(axis) == 1:
        return 0, 0.0
    cell = min(max(int(np.searchsorted(axis, value, side="right")) - 1, 0), len(axis) - 2)
    return cell, float(np.clip((value - axis[cell]) / (axis[cell + 1] - axis[cell]), 0.0, 1.0))


def motor_maps(
    p: DiaphragmMotorParameters,
    frequencies: Sequence[float],
    swings: Sequence[float] = SWINGS,
    pressures: Sequence[float] = PRESSURES,
) -> MotorMaps:
    """Run the fast plant on a grid of frequency, voltage and load, and average (sections 4 and 7, errata M19).

    Parameters
    ----------
    p : DiaphragmMotorParameters
        The motor; its Coulomb friction and load are not used, since the map is against pressure.
    frequencies : sequence of float
        Frequencies of the drive [Hz], rising.
    swings : sequence of float
        Voltages peak to peak [V], rising.
    pressures : sequence of float
        Pressure differences over the piston [Pa], rising.

    Raises
    ------
    DriveError
        If the diaphragms do not take a drive.
    """
    axes = [np.asarray(axis, dtype=np.float64) for axis in (frequencies, swings, pressures)]
    shape = tuple(len(axis) for axis in axes)
    flow, tones = np.empty(shape), np.empty((*shape, 7), dtype=np.complex128)
    loaded = [replace(p, coulomb_friction=0.0, load_force=p.piston_area * pressure) for pressure in axes[2]]
    for i, frequency in enumerate(axes[0]):
        for j, swing in enumerate(axes[1]):
            points = [
                operate(motor, float(frequency), float(swing), start=_rest_state_under_load(motor, float(pressure)))
                for motor, pressure in zip(loaded, axes[2], strict=True)
            ]
            reached = np.array([point.pressure for point in points])
            delivered = [point.outlet_flow for point in points]
            flow[i, j] = np.interp(axes[2], reached, delivered)
            seen = np.array([point.tones for point in points])
            for electrode in range(7):
                tones[i, j, :, electrode] = np.interp(axes[2], reached, seen[:, electrode])
    return MotorMaps(p, axes[0], axes[1], axes[2], flow, tones)


def _rest_state_under_load(p: DiaphragmMotorParameters, pressure: float) -> Array:
    """Return the state at rest under a load that the fed side already carries."""
    state = at_rest(p)
    state[SIDE_A] = pressure
    return state


def average_run(
    maps: MotorMaps, p: DiaphragmMotorParameters, frequency: float, swing: Array
) -> tuple[Array, Array, Array]:
    """Return pressure, velocity and position of the averaged motor from rest, along a voltage (equations 2 and 18).

    ``C p_A' = Q(V, f, p_A) - A_c v - G dp`` and ``M v' = A_c dp - F - c v - F_c tanh(v/v_s)``, by a semi-implicit step.
    The other side returns to tank at once: ``p_B = (A_c v / K)^2``, which damps the liquid's and the piston's swing.

    Parameters
    ----------
    maps : MotorMaps
        Maps of the healthy motor, or any other.
    frequency : float
        Frequency of the drive [Hz].
    swing : ndarray, shape (n,)
        Voltage peak to peak at samples `AVERAGE_STEP` apart [V].

    Returns
    -------
    tuple of ndarray, shape (n,)
        Pressure difference [Pa], velocity [m/s], position [m].

    Raises
    ------
    HydrostateError
        If frequency or voltage lie off the maps.
    """
    area, mass, h = p.piston_area, p.moving_mass, AVERAGE_STEP
    compliance = p.line_compliance + p.cylinder_volume / p.cylinder_bulk_modulus
    returned = (area / p.land_conductance) ** 2
    difference, velocity, position = np.zeros(len(swing)), np.zeros(len(swing)), np.zeros(len(swing))
    fed, last = 0.0, np.nan
    row = axis = maps.pressures
    for k in range(len(swing) - 1):
        if swing[k] != last:
            last = float(swing[k])
            row = maps.row(maps.flow, frequency, last)
            axis = maps.pressures + np.sign(row) * (row / p.land_conductance) ** 2
        v, dp = float(velocity[k]), float(difference[k])
        rubbed = tanh(v / p.friction_speed)
        push = area * dp - p.load_force - p.viscous_friction * v - p.coulomb_friction * rubbed
        steep = p.viscous_friction + p.coulomb_friction / p.friction_speed * (1.0 - rubbed**2)
        steep += 2.0 * area * returned * abs(v)
        after = v + h * push / (mass + h * steep)
        fed += h / compliance * (float(np.interp(fed, axis, row)) - area * after - p.crossport_leakage * dp)
        velocity[k + 1] = after
        difference[k + 1] = fed - returned * after * abs(after)
        position[k + 1] = position[k] + h * after
    return difference, velocity, position
