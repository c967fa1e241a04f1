"""Identifiability of a piezo-stack actuator from a bench's sensors, before anything is measured."""

from estimation.piezo_stack.estimate import stack_bounds
from estimation.piezo_stack.finding import SMALLEST_FAULT
from estimation.piezo_stack.unknowns import DEFAULT_UNKNOWNS
from experiments.page.frames import Rows, as_table
from plant.piezo_stack.parameters import PiezoStackParameters
from plant.piezo_stack.run import SAMPLE_TIME, sine_drive

SENSOR_SETS = {
    "position": ("position_m",),
    "pressure": ("chamber_pressure_pa",),
    "stack displacement": ("stack_displacement_m",),
    "stack displacement, position": ("stack_displacement_m", "position_m"),
    "all four": ("stack_displacement_m", "stack_force_n", "position_m", "chamber_pressure_pa"),
}
"""Measured channels in addition to the drive, by their name on the card."""

FREQUENCIES = (100.0, 275.0)
"""Drive frequencies examined [Hz]."""

DURATION = 0.1
"""Duration of the experiment [s]."""


@as_table
def identifiability_card(healthy: PiezoStackParameters) -> Rows:
    """Return Cramér-Rao bounds of every quantity, all unknown together, by sensors and drive.

    Returns
    -------
    pandas.DataFrame
        Columns frequency_hz, sensors, and for each quantity its standard deviation in percent: of a minor fault for
        leaks and friction, of its own value for the others.
    """
    for frequency in FREQUENCIES:
        drive = sine_drive(frequency, 140.0, DURATION, SAMPLE_TIME)
        for name, channels in SENSOR_SETS.items():
            bounds = stack_bounds(healthy, drive, SAMPLE_TIME, channels=channels)
            percent = {
                unknown: 100.0 * bounds[unknown] / SMALLEST_FAULT.get(unknown, 1.0) for unknown in DEFAULT_UNKNOWNS
            }
            yield {"frequency_hz": frequency, "sensors": name, **percent}
