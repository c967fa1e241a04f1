"""Velocity control of the diaphragm motor: PID on the drive's voltage, by encoder or by the middle electrode alone.

The controller acts once in several cycles, at a zero crossing of the sine. The sign of the wanted velocity sets the 4/3
valve. Self-sensing computes velocity from the amplitude of A4 and the voltage through the healthy motor's maps, as
section 4 of the diaphragm-motor paper intends; it does not see leakage past the piston.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import ceil, pi
from typing import Literal

import numpy as np

from estimation.diaphragm_motor.maps import MIDDLE, MotorMaps
from plant.arrays import Array
from plant.diaphragm_motor.flow import tone
from plant.diaphragm_motor.model import POSITION, at_rest, deflections
from plant.diaphragm_motor.run import BENCH_SENSORS, HIGHEST_VOLTAGE, LONGEST_STEP, MotorSensors, Schedule, run_motor

CYCLES = 4
"""Cycles of the drive between actions of the controller."""

SENSED_CYCLES = 2
"""Last cycles of a period from which an electrode's amplitude is taken, after the motor has responded."""


@dataclass(frozen=True, kw_only=True)
class VelocityController:
    """Gains of a PID on the drive's peak-to-peak voltage.

    Parameters
    ----------
    proportional : float
        Proportional gain [V s/m].
    integral : float
        Integral gain [V/m].
    derivative : float
        Derivative gain, on the measured velocity, not on the error [V s^2/m].
    most : float
        Largest voltage peak to peak [V]; the integral is held while the voltage is at a limit and the integral would
        exceed it.
    """

    proportional: float = 8e3
    integral: float = 6e5
    derivative: float = 0.0
    most: float = 2.0 * HIGHEST_VOLTAGE

    def act(self, error: float, change: float, held: float, period: float) -> tuple[float, float]:
        """Return the next voltage and the integral's part of it.

        Parameters
        ----------
        error : float
            Wanted minus measured speed [m/s].
        change : float
            Change of the measured speed over the last period [m/s].
        held : float
            The integral's part so far [V].
        period : float
            Time between actions [s].

        Returns
        -------
        tuple of float
            Voltage peak to peak [V], integral part [V].

        Examples
        --------
        >>> VelocityController().act(1e-3, 0.0, 295.0, 0.01)
        (300.0, 295.0)
        """
        summed = held + self.integral * period * error
        wanted = self.proportional * error + summed - self.derivative * change / period
        given = min(max(wanted, 0.0), self.most)
        windup = (wanted > given and error > 0.0) or (wanted < given and error < 0.0)
        return given, held if windup else summed


@dataclass(frozen=True, eq=False)
class ControlledRun:
    """A run under control, one row for each period.

    Parameters
    ----------
    time : ndarray, shape (n,)
        End of each period [s].
    wanted, measured, velocity : ndarray, shape (n,)
        Reference, the controller's measurement, and the piston's true mean velocity [m/s].
    swing : ndarray, shape (n,)
        Voltage peak to peak [V].
    position : ndarray, shape (n,)
        Piston at the end of each period [m].
    """

    time: Array
    wanted: Array
    measured: Array
    velocity: Array
    swing: Array
    position: Array

    def settling(self, since: float, until: float, band: float = 0.05) -> float:
        """Return the settling time of the true velocity into a band about the wanted one, between two times.

        Parameters
        ----------
        since, until : float
            The two times [s].
        band : float
            Share of the wanted velocity [dimensionless].

        Returns
        -------
        float
            Time [s]; infinity if it never settles, or there is no sample between the two times.
        """
        here = (self.time > since) & (self.time <= until)
        off = np.abs(self.velocity[here] - self.wanted[here]) > band * np.abs(self.wanted[here])
        time = self.time[here]
        if not len(off) or off[-1]:
            return np.inf
        return float(time[np.flatnonzero(off)[-1] + 1] - since) if off.any() else 0.0


def controlled_run(
    schedule: Schedule,
    wanted: Callable[[float], float],
    duration: float,
    frequency: float,
    maps: MotorMaps,
    rng: np.random.Generator,
    *,
    controller: VelocityController | None = None,
    sensing: Literal["encoder", "self"] = "encoder",
    sensors: MotorSensors = BENCH_SENSORS,
) -> ControlledRun:
    """Run the fast plant under velocity control, from rest (sections 4 and 5.1, errata M19).

    Parameters
    ----------
    schedule : sequence of tuple of float and DiaphragmMotorParameters
        Start time [s] and motor of each part of the run; the controller sets the spool.
    wanted : callable
        Velocity [m/s] as a function of time [s].
    duration : float
        Length of the run [s].
    frequency : float
        Frequency of the drive [Hz].
    maps : MotorMaps
        Maps of the healthy motor at this frequency, for self-sensing.
    controller : VelocityController, optional
        Gains; by default those of the class.

    Raises
    ------
    HydrostateError
        If the frequency lies off the maps, or the state stops being finite.
    """
    control = controller or VelocityController()
    a_cycle = ceil(1.0 / (frequency * LONGEST_STEP) - 1e-9)
    between = 1.0 / (frequency * a_cycle)
    period, count = CYCLES / frequency, round(duration * frequency / CYCLES)
    sine = 0.5 * np.sin(2.0 * pi * np.arange(CYCLES * a_cycle + 1) / a_cycle)
    before, seen, held = 0.0, 0.0, 0.0
    state = at_rest(schedule[0][1])
    rows = np.empty((count, 5))
    for k in range(count):
        begin = k * period
        goal = wanted(begin)
        way = 1.0 if goal >= 0.0 else -1.0
        motor = replace([p for time, p in schedule if time <= begin + 1e-9][-1], spool=way)
        swing, held = control.act(abs(goal) - seen, seen - before, held, period)
        states = run_motor(motor, swing * sine, between, start=state)
        state = states[-1].copy()
        if sensing == "encoder":
            measured = way * _encoder_speed(states[1:, POSITION], a_cycle, period, sensors, rng)
        else:
            bent = deflections(states[1:], swing * sine[1:], motor)[-SENSED_CYCLES * a_cycle :, MIDDLE]
            read = motor.sensing_gain * motor.sensor_gain[MIDDLE] * bent
            noisy = read + sensors.electrode_v * rng.standard_normal(len(read))
            flow, pressure = maps.sensed(frequency, swing, float(abs(tone(noisy, between, frequency))))
            measured = (flow - maps.motor.crossport_leakage * pressure) / maps.motor.piston_area
        rows[k] = begin + period, goal, way * measured, state[POSITION] - states[0, POSITION], swing
        rows[k, 3] /= period
        before, seen = seen, measured
    position = np.cumsum(rows[:, 3]) * period
    time, aim, saw, velocity, swings = rows.T
    return ControlledRun(time, aim, saw, velocity, swings, position)


def _encoder_speed(
    position: Array, a_cycle: int, period: float, sensors: MotorSensors, rng: np.random.Generator
) -> float:
    """Return the mean velocity of a period: mean position of its last cycle minus that of its first, free of ripple."""
    noisy = position + sensors.position_m * rng.standard_normal(len(position))
    moved = float(noisy[-a_cycle:].mean() - noisy[:a_cycle].mean())
    return moved / (period * (CYCLES - 1) / CYCLES)
