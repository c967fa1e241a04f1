"""Section 4's first tests on the circuit plant: the first measurements that a user of the rig would make."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import pandas as pd

from experiments.circuit.doubted_breaks import break_frequency_limits
from experiments.circuit.dynamic_experiments import (
    AMPLITUDE_INPUTS,
    MEAN_INPUTS,
    frequency_responses,
    low_frequency_gains,
)
from experiments.circuit.passes import in_condition
from experiments.circuit.steady_experiments import steady_runs
from experiments.page.frames import Rows, as_table
from experiments.published import SCALARS
from experiments.running.random_streams import stream
from plant.eha.circuit_parameters import CircuitParameters
from plant.eha.simulate import CIRCUIT, simulate
from plant.eha.steady_state import steady_state
from plant.errors import HydrostateError
from plant.sensors.sensors import BENCH

LEVELS_V = (0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0)
"""Input levels of the steady-state gain [V]."""

BREAK_MEANS_V = (2.0, 4.0, 7.0)
"""Input means at which the break frequency is determined [V]."""

UNCERTAIN_BREAK_ROWS = "break frequency within the parameters' uncertainty"
"""Name of the two rows from `break_frequency_limits`."""

ROOMY_STROKE = 2.0
"""Stroke long enough for the piston to settle at 8 V [m]; `experiments.circuit.steady_experiments` has that for 4 V."""

_COUNTS = 5.0
_MOTION_THRESHOLD = 5.0
_VOLT_RESOLUTION = 0.005
_STEP_SAMPLE_TIME = 1e-4


@as_table
def first_tests(rig: CircuitParameters, seed: int, levels_v: Iterable[float] = LEVELS_V) -> Rows:
    """Return section 4's first tests: dead time, steady gain, break frequency, linearity, dead zone.

    Dead time ends when the encoder departs from its extrapolated line by five counts. It is measured for a step of 4 V
    from rest, where the breakaway pressure of the seals must first build up, and for a step from 2 V to 4 V in motion.
    The break frequency is where the empirical gain is 3 dB below that at its lowest frequency; its range for parameters
    within their uncertainty comes from the linearised equations. Linearity is the ratio of the largest low-frequency
    gain to the smallest.

    Parameters
    ----------
    levels_v : iterable of float
        Input levels of the steady-state gain [V], positive.

    Returns
    -------
    pandas.DataFrame
        Columns test, at, value, unit, expected, published: expected is the value that Tables 2 to 4 imply (errata E8
        for the dead zone), published is the value in the paper; either is NaN if there is none.
    """
    rng = stream(seed, "circuit first tests")
    for low in (0.0, 2.0):
        yield _row("dead time", f"{low:g} V to 4 V", dead_time(rig, low, 4.0, rng), "s")
    for volts in levels_v:
        speed = volts * rig.motor_speed_per_volt
        (run,) = steady_runs([replace(rig, stroke=ROOMY_STROKE)], speed, BENCH, rng)
        settled = run["velocity_m_s"][-1000:]
        implied = steady_state(speed, rig)[0] / speed
        yield _row("steady-state gain", f"{volts:g} V", float(np.mean(settled)) / speed, "m/rad", implied)
    means = frequency_responses(rig, seed, MEAN_INPUTS)
    for mean in BREAK_MEANS_V:
        found = break_frequency(means[means["mean_v"] == mean])
        yield _row("break frequency", f"mean {mean:g} V", found, "Hz", published=SCALARS["bandwidth"].si_value)
    highest, least = break_frequency_limits(rig, BREAK_MEANS_V[0], BREAK_MEANS_V[-1])
    yield _row(UNCERTAIN_BREAK_ROWS, "mean 7 V, highest", highest, "Hz", published=SCALARS["bandwidth"].si_value)
    yield _row(UNCERTAIN_BREAK_ROWS, "mean 2 V over mean 7 V, least", least, "1")
    gains = low_frequency_gains(means, "mean_v")
    yield _row("gain spread", "means from 2 V", _spread(gains[gains.index >= 2.0]), "1")
    gains = low_frequency_gains(frequency_responses(rig, seed, AMPLITUDE_INPUTS), "amplitude_v")
    yield _row("gain spread", "amplitudes from 2 V", _spread(gains[gains.index >= 2.0]), "1")
    yield _row("gain spread", "amplitudes from 0.5 V", _spread(gains), "1")
    for name in ("normal", "minor_leakage", "major_leakage"):
        p = in_condition(rig, name)
        held = p.flow_bias + p.leakage_coefficient * p.friction_coulomb / p.piston_area
        implied = held / (p.pump_displacement * p.motor_speed_per_volt)
        yield _row("dead zone", name, dead_zone(p, rng), "V", implied)


def break_frequency(response: pd.DataFrame) -> float:
    """Return the frequency at which the gain is 3 dB below that at the lowest frequency [Hz].

    Returns
    -------
    float
        Linearly interpolated frequency [Hz]; NaN if the gain stays above.

    Examples
    --------
    >>> response = pd.DataFrame({"frequency_hz": [1.0, 2.0, 3.0], "gain": [1.0, 1.0, 2.0**0.5 - 1.0]})
    >>> round(break_frequency(response), 6)
    2.5
    """
    frequency, gain = response["frequency_hz"].to_numpy(), response["gain"].to_numpy()
    limit = gain[0] / np.sqrt(2.0)
    below = np.flatnonzero(gain < limit)
    if len(below) == 0:
        return float("nan")
    pair = [below[0], below[0] - 1]
    return float(np.interp(limit, gain[pair], frequency[pair]))


def dead_zone(p: CircuitParameters, rng: np.random.Generator, highest_v: float = 4.0) -> float:
    """Return the smallest voltage that moves the piston from rest, by bisection.

    The piston counts as moved if the encoder shows several times the breakaway deflection of the seals after the
    voltage has been held as long as in `experiments.circuit.steady_experiments.steady_runs`.

    Parameters
    ----------
    highest_v : float
        A voltage that moves the piston [V].

    Returns
    -------
    float
        Voltage [V].

    Raises
    ------
    HydrostateError
        If the highest voltage does not move it.
    """

    def moves(volts: float) -> bool:
        (run,) = steady_runs([p], volts * p.motor_speed_per_volt, BENCH, rng)
        return bool(np.max(run["position_m"]) > _MOTION_THRESHOLD * p.presliding_displacement)

    if not moves(highest_v):
        raise HydrostateError(f"highest_v must move the piston, got {highest_v:g} V, which does not")
    low, high = 0.0, highest_v
    while high - low > _VOLT_RESOLUTION:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if moves(middle) else (middle, high)
    return high


def dead_time(p: CircuitParameters, from_v: float, to_v: float, rng: np.random.Generator) -> float:
    """Return the time after a step at which the encoder departs from its extrapolated line by five counts.

    Parameters
    ----------
    from_v, to_v : float
        Voltage before and after [V]; at 0 V the piston is at rest.

    Returns
    -------
    float
        Time [s].

    Raises
    ------
    HydrostateError
        If it never leaves its line.
    """
    before, after, T = round(1.0 / _STEP_SAMPLE_TIME), round(0.2 / _STEP_SAMPLE_TIME), _STEP_SAMPLE_TIME
    drive = np.repeat(np.array([from_v, to_v]) * p.motor_speed_per_volt, [before, after])
    position = simulate(CIRCUIT, drive, T, p, sensors=BENCH, rng=rng)["position_m"]
    time = T * (np.arange(len(drive)) - before)
    line = slice(before - round(0.1 / T), before)
    slope, level = np.polyfit(time[line], position[line], 1)
    off = np.abs(position - level - slope * time)[before:] > _COUNTS * BENCH.position_quantum
    if not off.any():
        raise HydrostateError(f"a step must move the piston, got {from_v:g} V to {to_v:g} V, which does not")
    return float(time[before + int(np.argmax(off))])


def _spread(gains: pd.Series) -> float:
    return float(gains.max() / gains.min())


def _row(
    test: str, at: str, value: float, unit: str, expected: float = float("nan"), published: float = float("nan")
) -> dict[str, object]:
    return {"test": test, "at": at, "value": value, "unit": unit, "expected": expected, "published": published}
