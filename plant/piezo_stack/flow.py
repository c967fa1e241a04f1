"""Results of a piezo-stack run: output flow as a test bench measures it, stages of the pump cycle, Reynolds number."""

import numpy as np
from numpy.typing import NDArray

from plant.arrays import Array
from plant.components.line import reynolds_number
from plant.errors import DriveError
from plant.piezo_stack.model import stack_pressures
from plant.piezo_stack.parameters import PiezoStackParameters
from plant.piezo_stack.run import FINE_TIME, sine_drive
from plant.piezo_stack.trajectory import run_stack

FLOW_TIME = 0.16
"""Duration of a run for measuring flow [s]; only its second half is evaluated."""

STAGES = ("compression", "discharge", "expansion", "intake")
"""The four stages of a pump cycle, in order (Figure 2; equation 15 decides)."""

OPEN_LIFT = 1e-5
"""Lift above which a reed counts as open [m]; on its seat it still moves by some micrometres."""


def mean_flow(position: Array, sample_time: float, frequency: float, cylinder_area: float) -> float:
    """Return the output flow by the bench's rule (errata P15): area times mean velocity, whole cycles, second half.

    Parameters
    ----------
    position : ndarray, shape (n,)
        Position of the cylinder's rod [m].
    sample_time : float
        Seconds between samples [s].
    frequency : float
        Drive frequency [Hz].
    cylinder_area : float
        Cylinder area A_cp [m^2].

    Returns
    -------
    float
        Flow [m^3/s].

    Raises
    ------
    DriveError
        If the second half holds no whole cycle.

    Examples
    --------
    >>> round(mean_flow(0.05 * 1e-4 * np.arange(1001), 1e-4, 100.0, 3e-4), 9)
    1.5e-05
    """
    last = len(position) - 1
    cycles = int(0.5 * last * sample_time * frequency + 1e-6)
    if cycles < 1:
        raise DriveError(
            f"half the run must hold a whole cycle of {frequency:g} Hz, got {0.5 * last * sample_time:g} s"
        )
    first = last - cycles / (frequency * sample_time)
    start = float(np.interp(first, np.arange(last + 1), position))
    return cylinder_area * (float(position[-1]) - start) * frequency / cycles


def output_flow(parameters: PiezoStackParameters, frequency: float, peak_to_peak: float) -> float:
    """Return the flow under a sine drive of length `FLOW_TIME`, as Figures 11 to 14 (errata P15) show it.

    Parameters
    ----------
    parameters : PiezoStackParameters
        The actuator, with its load and bias pressure.
    frequency : float
        Drive frequency [Hz].
    peak_to_peak : float
        Peak-to-peak drive voltage [V]; its bias is half of that.

    Returns
    -------
    float
        Flow [m^3/s].
    """
    states = run_stack(parameters, sine_drive(frequency, peak_to_peak, FLOW_TIME, FINE_TIME), FINE_TIME)
    return mean_flow(states[:, 12], FINE_TIME, frequency, parameters.cylinder_area)


def stages(states: Array, parameters: PiezoStackParameters) -> NDArray[np.int64]:
    """Return the stage of the pump cycle at each sample, as an index into `STAGES` (Figure 2; equation 15 decides).

    In discharge and intake, the reed that is open further passes oil forward. In between, the chamber is in compression
    or expansion.

    Parameters
    ----------
    states : ndarray, shape (n, 19)
        As named in `plant.piezo_stack.model.STATES`.

    Returns
    -------
    ndarray, shape (n,)
        0 to 3.
    """
    pressure = stack_pressures(tuple(states.T), parameters)
    rising = np.gradient(pressure.chamber) > 0.0
    outlet, inlet = states[:, 5], states[:, 7]
    discharging = (outlet > np.maximum(OPEN_LIFT, inlet)) & (pressure.chamber > pressure.delivery)
    taking_in = (inlet > np.maximum(OPEN_LIFT, outlet)) & (pressure.intake > pressure.chamber)
    return np.where(discharging, 1, np.where(taking_in, 3, np.where(rising, 0, 2)))


def line_reynolds_numbers(states: Array, parameters: PiezoStackParameters) -> Array:
    """Return the Reynolds number in the delivery line (equation 16, errata P9); laminar below 2300.

    Parameters
    ----------
    states : ndarray, shape (n, 19)
        As named in `plant.piezo_stack.model.STATES`.

    Returns
    -------
    ndarray, shape (n,)
        Reynolds number [dimensionless].
    """
    p = parameters
    return reynolds_number(states[:, 10], p.line_area, p.density, p.viscosity)
